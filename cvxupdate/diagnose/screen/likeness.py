"""Which effects say the same of what was measured, to first order."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.diagnose.settings import AS_ONE
from cvxupdate.diagnose.types import Evidence, Real
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.physics.grounding_spring import GroundingSpring
from cvxupdate.physics.place import Place


def moving_as_one(evidence: Evidence, base: Fit, found: Fit, effect: Effect) -> list[Effect]:
    """The same effect at other places whose derivatives of the responses, beside the nuisance
    parameters alone (``base``), are as good as in proportion to its own: parts of what moves as one
    in the band (the top of a table, a girder along itself). A hidden oscillator is a spring to what
    it stands on at each frequency: places are alike for it where springs to ground are, for at its
    own frequency it does the same wherever it stands; where it was ``found``, for a column stands
    still on a clamp and moves as one on a fixture."""
    tuned = isinstance(effect.action, HiddenOscillator)
    if not (tuned or effect.change) or len(effect.place.nodes) != 1:
        return []
    candidates = {e.key: e for e in evidence.candidates(evidence.model, (effect.physics,))}
    springs = _springs(evidence, found) if tuned else {}
    at = found if tuned else base

    def columns(effects: Sequence[Effect]) -> list[Real | None]:
        return evidence.columns(at, [springs.get(e.place, e) for e in effects])

    def nuisance() -> Linearised:
        whole, n = evidence.linearised(at), slice(len(base.setting.model.parameters))
        if not tuned:
            return whole
        return Linearised(whole.A[:, n], whole.r, whole.p[n], whole.scales[n])

    return proportional(effect, [*candidates.values()], columns, nuisance, AS_ONE)


def _springs(evidence: Evidence, found: Fit) -> dict[Place, Effect]:
    """Springs to ground on a fitted model by their places, whether they are sought or not."""
    springs = GroundingSpring().candidates(evidence.context(found.setting.model))
    return {e.place: e for e in springs}


def proportional(
    effect: Effect,
    candidates: Sequence[Effect],
    columns: Callable[[Sequence[Effect]], list[Real | None]],
    nuisance: Callable[[], Linearised],
    least: float,
) -> list[Effect]:
    """Of ``candidates`` those of the type of ``effect`` at other places of its kind and extent
    whose ``columns``, free of what ``nuisance`` parameters do, are in proportion to its own there:
    the squared cosine is at ``least`` so much. Most alike first."""
    mine = [e for e in candidates if e.key == effect.key]
    others = [e for e in candidates if e.key != effect.key and of_one_kind(e, effect)]
    if not (mine and others):
        return []
    first, *rest = columns([mine[0], *others])
    if first is None or first.shape[1] != 1:
        return []
    some = [(e, J) for e, J in zip(others, rest, strict=True) if J is not None]
    J = np.hstack([first, *(x for _, x in some)])
    return in_proportion(Projection.of(nuisance()), J, [e for e, _ in some], least)


def in_proportion(
    left: Projection, J: Real, others: Sequence[Effect], least: float
) -> list[Effect]:
    """Of ``others`` those whose columns (of ``J``, from its second on) are in proportion to the
    first, free of nuisance parameters, most alike first."""
    J = left.freed(J)
    lengths = np.maximum(norms(J), 1e-300)
    cosines = (J[:, 0] @ J) / (lengths[0] * lengths)
    near = [
        (float(c), e) for c, e in zip(cosines[1:], others, strict=True) if c > 0.0 and c**2 >= least
    ]
    return [e for _, e in sorted(near, key=lambda pair: -pair[0])]


def of_one_kind(one: Effect, other: Effect) -> bool:
    """Whether two effects are the same at places of one kind and extent."""
    a, b = one.place, other.place
    same = (one.physics, one.count, a.dof, len(a.nodes), len(a.elements), a.groups)
    return same == (other.physics, other.count, b.dof, len(b.nodes), len(b.elements), b.groups)
