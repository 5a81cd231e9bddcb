"""The minima that many starts reached, and whether two of them are really different."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cvxupdate.fe.parameters import Parameter
from cvxupdate.system import Array
from cvxupdate.update.starts import StartEnd

HIGHER = 0.01
"""Two ends are one minimum where a way between them is nowhere higher than both by more than this
fraction: nobody calls a model better for less (a step in that direction is judged by the same
figure in the published comparison of problems/real/smu-modal-data)."""
SLIGHT = 1e-6
"""The same where the objective is nearly zero, as with exact recordings: it counts squares of
deviations, and a likelihood changes by a millionth."""
ON_THE_WAY = (0.25, 0.5, 0.75)
TOLD = 3  # parameters named as those in which two minima differ most
ON_BOUND = 1e-4  # of the distance between the bounds

Objective = Callable[[Array], float]
Descent = Callable[[Array], Array]


@dataclass(frozen=True)
class Basin:
    """A minimum: its lowest ``objective``, the ``starts`` that ended there, where ``p``, and
    ``ridge``, the highest objective found on the straight way to the lowest minimum (None: it is
    that one)."""

    objective: float
    starts: tuple[int, ...]
    p: tuple[float, ...]
    ridge: float | None = None


def basins(
    ends: Iterable[StartEnd], objective: Objective, descent: Descent | None = None
) -> tuple[Basin, ...]:
    """The different minima among ``ends``, lowest first; ``objective`` is asked on the way between
    two ends, inf where the model is no structure.

    A ridge on the straight way may only say that the valley is bent. ``descent`` gives where the
    loop goes from a point: with it the way over that of the middle is tried as well.
    """
    found: list[list[StartEnd]] = []
    for end in sorted(ends, key=lambda e: e.objective):
        if not np.isfinite(end.objective):
            continue
        own = next((b for b in found if _one_valley(b[0], end, objective, descent)), None)
        if own is None:
            found.append([end])
        else:
            own.append(end)
    return tuple(
        Basin(
            b[0].objective,
            tuple(sorted(e.number for e in b)),
            b[0].p,
            _highest(np.array(found[0][0].p), np.array(b[0].p), objective) if k else None,
        )
        for k, b in enumerate(found)
    )


def _one_valley(a: StartEnd, b: StartEnd, objective: Objective, descent: Descent | None) -> bool:
    """Whether no ridge stands between two ends of which ``a`` is the lower, and ``b`` is no shelf
    far above it."""
    if b.objective > (1.0 + HIGHER) * a.objective + SLIGHT:
        return False
    limit = (1.0 + HIGHER) * b.objective + SLIGHT
    x, y = np.array(a.p), np.array(b.p)
    if _highest(x, y, objective) <= limit:
        return True
    if descent is None:
        return False
    middle = descent((x + y) / 2.0)
    if not objective(middle) <= limit:
        return False
    return all(_highest(end, middle, objective) <= limit for end in (x, y))


def _highest(x: Array, y: Array, objective: Objective) -> float:
    return max(objective(x + t * (y - x)) for t in ON_THE_WAY)


def starts_report(
    ends: Sequence[StartEnd],
    minima: Sequence[Basin],
    parameters: Sequence[Parameter],
    fit_at: Callable[[Array], Mapping[str, float]],
) -> dict[str, Any]:
    """Plain data: how many starts, what became of each, the minima found: ``share`` of the starts
    that ended in each (within 1 % of its objective), ``ridge`` between it and the lowest,
    ``on_bounds`` parameters on a bound, ``fit`` as ``fit_at`` a point says, and what ``differs``
    most from the lowest (name, there, here; of the width of its bounds)."""
    seconds = [e.seconds for e in ends]
    return {
        "count": len(ends),
        "seconds_median": float(np.median(seconds)) if seconds else None,
        "ends": [{k: v for k, v in asdict(e).items() if k != "p"} for e in ends],
        "minima": [
            {
                "objective": b.objective,
                "share": len(b.starts) / len(ends),
                "starts": list(b.starts),
                "ridge": b.ridge,
                "p": list(b.p),
                "on_bounds": _on_bounds(b, parameters),
                "fit": dict(fit_at(np.array(b.p))),
                "differs": _differs(minima[0], b, parameters) if k else [],
            }
            for k, b in enumerate(minima)
        ],
    }


def _on_bounds(b: Basin, parameters: Sequence[Parameter]) -> int:
    lower, upper = _limits(parameters)
    p, slack = np.array(b.p), ON_BOUND * (upper - lower)
    return int(np.sum((p <= lower + slack) | (p >= upper - slack)))


def _differs(
    lowest: Basin, b: Basin, parameters: Sequence[Parameter]
) -> list[dict[str, float | str]]:
    lower, upper = _limits(parameters)
    there, here = np.array(lowest.p), np.array(b.p)
    apart = np.abs(here - there) / (upper - lower)
    return [
        {"name": parameters[j].name, "lowest": float(there[j]), "here": float(here[j])}
        for j in np.argsort(-apart)[:TOLD].tolist()
        if apart[j] > HIGHER
    ]


def _limits(parameters: Sequence[Parameter]) -> tuple[Array, Array]:
    """Starts are drawn between bounds, so every parameter has both."""
    return np.array([q.lower for q in parameters]), np.array([q.upper for q in parameters])


def starts_notes(report: Mapping[str, Any]) -> tuple[str, ...]:
    """What the many starts say, in a sentence; nothing where there were none."""
    if not report:
        return ()
    minima = report["minima"]
    if not minima:
        return ("None of the starts led to a model that is a structure.",)
    best = minima[0]
    others = f"; the next lowest is {minima[1]['objective']:.5g}" if len(minima) > 1 else ""
    return (
        f"{len(best['starts'])} of {report['count']} starts ended in the lowest minimum found "
        f"(objective {best['objective']:.5g}), of {len(minima)} different ones{others}. A start "
        f"took {report['seconds_median']:.2g} s of processor time (median).",
    )
