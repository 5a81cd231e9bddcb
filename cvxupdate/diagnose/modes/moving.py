"""Where an effect that moves stands in each state: from node to node, and between them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.modes.states import Kind, Shared, State, fitted_states
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError

BETWEEN = 801  # places that are tried between the nodes beside one
ONWARD = 12  # from a place to a better one beside it, at most
OPPOSITE = -0.99  # cosine of the directions to the two nodes beside one on a line


def walked(states: Sequence[State], kind: Kind, found: Shared) -> Shared:
    """With the place of each state moved to a better one beside it, as long as there is one: a scan
    has its own nuisance parameters in each state, the fit has one for all."""
    order = {e.key: k for k, e in enumerate(kind.effects)}
    for _ in range(ONWARD):
        places = [order[e.key] for e in found.effects]
        size = float(found.fit.p[-1]) * found.units[0]
        best = [
            min(
                (k, *(b for b in beside(kind, k) if b is not None)),
                key=lambda b, s=s: cost_at(s, kind, b, size, found.fit.p[:-1]),  # type: ignore[misc]
            )
            for s, k in zip(states, places, strict=True)
        ]
        if best == places:
            return found
        again = fitted_states(states, kind, best, [size] * len(states), False)
        if again is None or again.fit.cost >= found.fit.cost:
            return found
        found = again
    return found


def cost_at(state: State, kind: Kind, place: int, size: float, nuisance: Real) -> float:
    """Weighted squares of `residual_at`; infinite where the effect cannot stand."""
    left = residual_at(state, kind, place, size, nuisance)
    return float("inf") if left is None else float(left @ left)


def residual_at(state: State, kind: Kind, place: int, size: float, nuisance: Real) -> Real | None:
    """Weighted differences of a state from the model with an effect of a size (in the unit of its
    figure) at a place; None where it cannot stand."""
    p = size / float(kind.units[place])
    setting = state.with_effect(kind.effects[place], p)
    if setting is None:
        return None
    try:
        values, weights, _ = setting.evaluate(np.append(nuisance, p)).differences
    except CvxupdateError:
        return None
    return np.asarray(weights * values)


def beside(kind: Kind, place: int) -> tuple[int | None, int | None]:
    """The places next to one on both sides of a line; None where there is none."""
    x = kind.xyz - kind.xyz[place]
    far = np.linalg.norm(x, axis=1)
    apart = np.flatnonzero(far > 0.0)
    if not len(apart):
        return None, None
    one = int(apart[np.argmin(far[apart])])
    cosine = x[apart] @ x[one] / (far[apart] * far[one])
    other = apart[cosine < OPPOSITE]
    return one, int(other[np.argmin(far[other])]) if len(other) else None


def between(
    state: State, kind: Kind, place: int, size: float, nuisance: Real
) -> tuple[Real, float] | None:
    """Where between the nodes of a line (x, y, z in m), and its deviation along it: differences at
    a place and at both beside it make parabolas, and where the sum of their squares is least it
    is; None where there is no such place."""
    one, other = beside(kind, place)
    if one is None or other is None:
        return None
    left = [residual_at(state, kind, k, size, nuisance) for k in (one, place, other)]
    r = [v for v in left if v is not None]
    if len({len(v) for v in r}) != 1 or len(r) < 3:
        return None
    at = kind.xyz[place]
    far = [float(np.linalg.norm(kind.xyz[k] - at)) for k in (one, other)]
    bend, slope, here = np.polyfit([-far[0], 0.0, far[1]], r, 2)
    x = np.linspace(-far[0], far[1], BETWEEN)[:, None]
    best = float(x[np.argmin(np.sum((bend * x**2 + slope * x + here) ** 2, axis=1)), 0])
    grows = float(np.linalg.norm(2.0 * bend * best + slope))
    along = (kind.xyz[other] - at) / far[1]
    return np.asarray(at + best * along), 1.0 / max(grows, np.finfo(float).tiny)
