"""Laws and places that are hardly told apart: what a force does to the structure is nearly the
same."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.motion.point import MotionPoint
from cvxupdate.diagnose.settings import NEIGHBOURING, NEIGHBOURS
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
    model = point.setting.model
    n = point.carried
    soft = 1.0 / np.maximum(point.modes.frequencies[:n], 1e-3 * point.modes.frequencies[n - 1])

    def bent(action: NonlinearForce) -> np.ndarray:
        values = soft * (direction(model, action.rows) @ point.modes.shapes[:, :n])
        return np.asarray(values / max(float(np.linalg.norm(values)), 1e-300))

    here, near = bent(own), []
    for e in candidates:
        other = e.action
        if e.physics != effect.physics or not isinstance(other, NonlinearForce):
            continue
        if (other.law, other.sides) != (own.law, own.sides) or set(other.rows) == set(own.rows):
            continue
        cosine = float(here @ bent(other))
        one_sided = own.law == "clearance" and own.sides == "one"
        if one_sided and (cosine < 0.0 or other.side != own.side):
            continue  # a stop on the other side is another stop
        if cosine**2 >= NEIGHBOURING:
            near.append((cosine**2, e))
    ranked = sorted(near, key=lambda pair: -pair[0])
    return [*(other_forms(effect) if forms else ()), *(e for _, e in ranked[:NEIGHBOURS])]
