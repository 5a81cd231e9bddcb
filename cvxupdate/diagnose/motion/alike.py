"""Laws and places that are hardly told apart: what a force does to the structure is nearly the
same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.motion.point import MotionPoint
from cvxupdate.diagnose.settings import NEIGHBOURING, TELLING
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.hysteresis import other_forms
from cvxupdate.physics.internal_force import NonlinearForce, direction

# laws that act like a linear effect at one level: what they take out of the motion, or give back
ACTING_LIKE = {
    "viscous_damper": ("dry_friction", "hysteresis", "quadratic_damping"),
    "grounding_spring": ("clearance", "cubic_stiffness", "hysteresis"),
}


def kin(effect: Effect, depends: bool) -> tuple[str, ...]:
    """Types that may stand for an effect: of a law its own; where the recordings ``depends`` on
    their level, of a dashpot or a spring the laws that act like it."""
    if isinstance(effect.action, NonlinearForce):
        return (effect.physics,)
    return ACTING_LIKE.get(effect.physics, ()) if depends else ()


def alike(
    point: MotionPoint, effect: Effect, candidates: Sequence[Effect], forms: bool = True
) -> list[Effect]:
    """With ``forms`` other forms of the law of ``effect`` where it stands. Then, nearest first, of
    ``candidates`` those with its law elsewhere, where a force bends the modes that are marched as
    it does there: the squared cosine of the two static deflections, in the scalar product of the
    strain energy, is at least `NEIGHBOURING`. Of an effect that is no law the ``candidates`` that
    stand where it does."""
    own, place = effect.action, effect.place
    if not isinstance(own, NonlinearForce):
        spot = (set(place.nodes), place.dof)
        return [e for e in candidates if (set(e.place.nodes), e.place.dof) == spot]
    found = _elsewhere(point, effect.physics, own, candidates)
    near = [e for cosine, e in found if cosine**2 >= NEIGHBOURING]
    return [*(other_forms(effect) if forms else ()), *near]


def as_one(point: MotionPoint, effect: Effect, candidates: Sequence[Effect]) -> list[Effect]:
    """Of ``candidates`` those with the law of ``effect`` elsewhere that no recording in this band
    could tell from it: a force there bends the modes that are marched as it does here, to within
    `TELLING`. None of an effect that is no law."""
    own, least = effect.action, 1.0 - TELLING**2
    if not isinstance(own, NonlinearForce):
        return []
    found = _elsewhere(point, effect.physics, own, candidates)
    return [e for cosine, e in found if cosine**2 >= least]


def _elsewhere(
    point: MotionPoint, physics: str, own: NonlinearForce, candidates: Sequence[Effect]
) -> list[tuple[float, Effect]]:
    """Candidates of a type with its ``own`` law at other places, with the cosine of the two static
    deflections, most alike first."""
    model, n = point.setting.model, point.carried
    soft = 1.0 / np.maximum(point.modes.frequencies[:n], 1e-3 * point.modes.frequencies[n - 1])

    def bent(action: NonlinearForce) -> np.ndarray:
        values = soft * (direction(model, action.rows) @ point.modes.shapes[:, :n])
        return np.asarray(values / max(float(np.linalg.norm(values)), 1e-300))

    here, found = bent(own), []
    for e in candidates:
        other = e.action
        if e.physics != physics or not isinstance(other, NonlinearForce):
            continue
        forms = [(a.law, a.names, a.sides) for a in (own, other)]
        if forms[0] != forms[1] or set(other.rows) == set(own.rows):
            continue
        cosine = float(here @ bent(other))
        one_sided = own.law == "clearance" and own.sides == "one"
        if one_sided and (cosine < 0.0 or other.side != own.side):
            continue  # a stop on the other side is another stop
        found.append((cosine, e))
    return sorted(found, key=lambda pair: -(pair[0] ** 2))
