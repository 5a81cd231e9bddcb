"""Which effects say the same of what was measured, to first order."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.diagnose.settings import AS_ONE
from cvxupdate.diagnose.types import Evidence, Real
from cvxupdate.physics.effect import Effect


def moving_as_one(evidence: Evidence, base: Fit, effect: Effect) -> list[Effect]:
    """The same effect at other places whose derivatives of the responses, beside the nuisance
    parameters alone (``base``), are as good as in proportion to its own: parts of what moves as one
    in the band (the top of a table, a girder along itself)."""
    if effect.change is None or len(effect.place.nodes) != 1:
        return []
    candidates = evidence.candidates(evidence.model, (effect.physics,))
    columns = partial(evidence.columns, base)
    return proportional(effect, candidates, columns, lambda: evidence.linearised(base), AS_ONE)


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
