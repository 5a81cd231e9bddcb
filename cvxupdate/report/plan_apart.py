"""What would tell the explanations of a diagnosis apart, on the page of `plan` and in its files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import count, number
from cvxupdate.report.structure import drawable
from cvxupdate.report.structure_places import place_map

if TYPE_CHECKING:
    from cvxupdate.commands.planned import Planned
    from cvxupdate.diagnose.apart import Apart, Measurement

TOLD, HINTED = 3.0, 1.0
"""Deviations from which on a difference is seen in one measurement, and below which it is not."""
LISTED = 10
BOUNDARIES = ("mass", "spring", "support", "free")
"""Kinds of measurements that change the boundary."""
EVEN = 0.1
"""Explanations expected to be listed: as many more are as good."""


def apart_data(found: Apart | None) -> dict[str, Any] | None:
    """As plain data."""
    if found is None:
        return None
    return {
        "explanations": [vars(e) for e in found.explanations],
        "measurements": [{**vars(m), "least": m.least} for m in found.measurements],
        "lines": found.lines,
        "pairs": found.pairs,
        "same": found.same,
        "together": None
        if found.together is None
        else {
            "measurements": [vars(m) for m in found.together.measurements],
            "separations": found.together.separations,
            "least": found.together.least,
            "before": found.together.before,
            "after": found.together.after,
            "left": found.together.left,
        },
    }


def apart_says(found: Apart) -> str:
    """What to measure next, in a sentence."""
    alike = count(len(found.explanations), "explanation")
    if not found.measurements:
        return f"No further measurement was compared for the {alike}."
    if found.same and len(found.same) == len(found.pairs):
        return (
            f"Nothing that was tried tells the {alike} apart: to further responses and other "
            "boundaries they are one and the same."
        )
    best, s = found.measurements[0], found.together
    if s is not None and best.left is not None and s.left < best.left - EVEN:
        return together_says(found)
    pairs = len(best.separations)
    told = sum(s >= TOLD for s in best.separations)
    if told == pairs:
        what = f"the {alike}" if pairs == 1 else f"all {alike}"
        return f"Measure {best.says}: it tells {what} apart by {_by(best)} standard deviations."
    if told:
        return (
            f"Measure {best.says}: it tells {told} of {pairs} pairs of explanations apart; the "
            "others need what comes after it, or are alike wherever one measures."
        )
    if max(best.separations) < HINTED:
        return (
            f"Nothing that was tried tells the {alike} apart: to further responses, modes and "
            "known masses they are one and the same."
        )
    return (
        f"The best that was tried, {best.says}, is worth {_by(best)} standard deviations: a hint, "
        "no proof. Measure with less noise, or over a wider --band."
    )


def together_says(found: Apart) -> str:
    """What a set of responses tells, in a sentence; empty where there is none."""
    s = found.together
    if s is None:
        return ""
    told = sum(x >= TOLD for x in s.separations)
    drives = list(dict.fromkeys(m.drive for m in s.measurements))
    places = "; ".join(
        f"{', '.join(m.sensor for m in s.measurements if m.drive == d)} to a force at {d}"
        for d in drives
    )
    pairs = count(len(s.separations), "pair")
    what = (
        f"{'the' if told == 1 else 'all'} {pairs}"
        if told == len(s.separations)
        else (f"{told} of {pairs}")
    )
    return (
        f"Measure together the responses at {places}: they tell {what} of explanations, the worst "
        f"by {number(s.least, 2)} standard deviations. Beside the true one {_others(s.before)} "
        f"expected to be listed as things are, {_others(s.after)} with these (effects that the "
        "diagnosis does not list and that do nearly as well are counted)."
    )


def boundary_says(found: Apart) -> str:
    """What the best change of the boundary tells, beside the set; empty where none was tried."""
    changed = [m for m in found.measurements if m.kind in BOUNDARIES]
    if not changed or changed[0].left is None:
        return ""
    best, left, s = changed[0], changed[0].left, found.together
    told = f"{_by(best)} standard deviations, {_others(left)} expected to be listed"
    if s is not None and left <= s.left + EVEN:
        return (
            f"Or change the boundary: {best.says} tell as much ({told} of these explanations). "
            "They need a problem file of their own, whose model has the same change."
        )
    return (
        f"The best change of the boundary tells less: {best.says} ({told} of these explanations)."
    )


def _others(expected: float) -> str:
    shown = number(expected, 2) if expected >= 0.1 else "less than 0.1"
    return f"{shown} {'other is' if shown == '1' else 'others are'}"


def _by(m: Measurement) -> str:
    least = number(m.least, 2)
    return least if len(m.separations) == 1 else f"at least {least}"


def apart_rows(found: Apart) -> list[dict[str, str]]:
    """The best measurements of each kind's own and of all, for a table."""
    best = list(found.measurements[:LISTED])
    for kind in dict.fromkeys(m.kind for m in found.measurements):
        first = next(m for m in found.measurements if m.kind == kind)
        best += [] if first in best else [first]
    return [
        {
            "says": m.says,
            "least": number(m.least, 2),
            "most": number(max(m.separations), 2),
            "told": f"{sum(s >= TOLD for s in m.separations)} of {len(m.separations)}",
        }
        for m in best
    ]


def apart_csv(found: Apart) -> list[list[str]]:
    """Rows of plan.csv: what to measure next, in order."""
    return [
        [
            "next",
            str(k),
            m.sensor or (f"n{m.node}" if m.node is not None else ""),
            m.drive,
            m.says,
            f"{m.least:.3g}",
        ]
        for k, m in enumerate(found.measurements[:LISTED], start=1)
    ] + [
        ["together", str(k), m.sensor, m.drive, m.says, f"{found.together.least:.3g}"]
        for k, m in enumerate(found.together.measurements if found.together else (), start=1)
        if found.together is not None
    ]


def apart_map(name: str, found: Planned) -> str | None:
    """On the structure: how far each place tells the explanations apart."""
    geometry, apart = found.geometry, found.apart
    if geometry is None or apart is None or not drawable(geometry):
        return None
    worth: dict[int, tuple[float, str]] = {}
    for m in apart.measurements:
        node = m.node if m.node is not None else int(m.sensor[1:].partition(".")[0] or 0)
        label = m.sensor if m.node is None else f"n{node}"
        if node and m.worth > worth.get(node, (-1.0, ""))[0]:
            worth[node] = (m.worth, label)
    title = "How far a measurement at each place tells the explanations apart"
    return place_map(name, title, geometry, worth)
