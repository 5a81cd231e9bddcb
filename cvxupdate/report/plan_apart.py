"""What would tell the explanations of a diagnosis apart, on the page of `plan` and in its files."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import NOTHING, count, number
from cvxupdate.report.structure import drawable
from cvxupdate.report.structure_places import place_map

if TYPE_CHECKING:
    from cvxupdate.commands.planned import Planned
    from cvxupdate.diagnose.apart import Apart, LawCheck, Measurement

TOLD, HINTED = 3.0, 1.0
"""Deviations from which on a difference is seen in one measurement, and below which it is not."""
LISTED = 10


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
        "laws": [{**vars(x), "chosen": x.factors[x.chosen]} for x in found.laws],
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
    best = found.measurements[0]
    if found.proposed != (best,):
        return together_first(found)
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


def together_first(found: Apart) -> str:
    """The set that is proposed, in a headline; empty where there is none."""
    s = found.together
    if s is None:
        return ""
    return (
        f"Measure {count(len(s.measurements), 'response')} together: of the other "
        f"{count(len(found.explanations) - 1, 'explanation')}, {_expected(s.left)} expected to be "
        "listed still beside the true one."
    )


def together_says(found: Apart) -> str:
    """Which responses, and what they tell; empty where there is no set."""
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
    what = f"{told} of {pairs}"
    if told == len(s.separations):
        what = "the pair" if told == 1 else f"all {pairs}"
    return (
        f"Together, the responses at {places} tell {what} of explanations, the worst by "
        f"{number(s.least, 2)} standard deviations. With effects counted that the diagnosis does "
        f"not list and that do nearly as well, {_expected(s.after)} expected beside the true one; "
        f"as things are, {number(s.before, 2)}."
    )


def boundary_says(found: Apart) -> str:
    """What the best change of the boundary tells, beside the set; empty where none was tried."""
    changed = [m for m in found.measurements if m.is_boundary]
    if not changed or changed[0].left is None:
        return ""
    best, left = changed[0], changed[0].left
    told = f"{_by(best)} standard deviations; {_expected(left)} expected to be listed still"
    if found.together is not None and found.as_good(best):
        return (
            f"Or change the boundary: {best.says} tell as much ({told}). They need a problem file "
            "of their own, whose model has the same change."
        )
    return f"The best change of the boundary tells less: {best.says} ({told})."


def laws_says(found: Apart) -> str:
    """What a second level tells of linear effects; empty where none may be a law's equivalent."""
    told = [x for x in found.laws if x.separations[x.chosen] >= TOLD]
    if not found.laws:
        return ""
    if not told:
        return (
            "Whether one of them is what a law looks like at one level (a cubic spring, friction), "
            "another level does not tell either: too little of it would change."
        )
    best = max(told, key=lambda x: x.separations[x.chosen])
    more = "" if len(told) == 1 else f"; {count(len(told), 'pair')} by 3 or more"
    return (
        "What another level does tell is whether one of them is what a law looks like at one "
        f"level: with {_times(best)} {best.effect[0].lower()}{best.effect[1:]} and {best.law} "
        f"there differ by {number(best.separations[best.chosen], 2)} standard deviations{more}."
    )


def _times(x: LawCheck) -> str:
    return f"{x.factors[x.chosen]:g} times the force"


def law_rows(found: Apart) -> list[dict[str, str]]:
    """Of every linear effect and law that looks like it, for a table."""
    return [
        {
            "effect": x.effect,
            "law": x.law,
            "power": f"{x.power:g}",
            "factor": f"{x.factors[x.chosen]:g}",
            "told": number(x.separations[x.chosen], 2),
        }
        for x in found.laws
    ]


def _expected(others: float) -> str:
    shown = number(others, 2) if others >= 0.1 else "less than 0.1"
    return f"{shown} {'is' if shown in ('1', '1.0', 'less than 0.1') else 'are'}"


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
            "left": NOTHING if m.left is None else number(m.left, 2),
            "told": f"{sum(s >= TOLD for s in m.separations)} of {len(m.separations)}",
        }
        for m in best
    ]


def apart_csv(found: Apart) -> list[list[str]]:
    """Rows of plan.csv: what to measure next, in order."""
    return (
        [
            [
                "next",
                str(k),
                m.sensor or (f"n{m.node}" if m.node is not None else ""),
                m.drive,
                m.says,
                f"{m.least:.3g}",
            ]
            for k, m in enumerate(found.measurements[:LISTED], start=1)
        ]
        + [
            ["together", str(k), m.sensor, m.drive, m.says, f"{found.together.least:.3g}"]
            for k, m in enumerate(found.together.measurements if found.together else (), start=1)
            if found.together is not None
        ]
        + [
            [
                "level",
                str(k),
                "",
                "",
                f"the same responses with {_times(x)}: {x.effect}, or {x.law}",
                f"{x.separations[x.chosen]:.3g}",
            ]
            for k, x in enumerate(found.laws, start=1)
        ]
    )


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
