"""The other places of an effect that tables of modes hardly tell from its own."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.modes.first_order import columns_of, linearised
from cvxupdate.diagnose.screen.projection import Projection, norms
from cvxupdate.diagnose.settings import NEIGHBOURING
from cvxupdate.physics.effect import Effect


def places_alike(base: Fit, effect: Effect, candidates: Sequence[Effect]) -> list[Effect]:
    """Of ``candidates`` those of the type of ``effect`` at other places of its kind and extent
    whose derivatives of what was measured, free of those of the nuisance parameters (``base``), are
    in proportion to its own there: the squared cosine is at least `NEIGHBOURING`. Most alike
    first."""
    mine = [e for e in candidates if e.key == effect.key]
    others = [e for e in candidates if e.key != effect.key and _of_one_kind(e, effect)]
    if not (mine and others):
        return []
    columns = columns_of(base, [mine[0], *others])
    if columns[0] is None or columns[0].shape[1] != 1:
        return []
    left = Projection.of(linearised(base))
    some = [(e, J) for e, J in zip(others, columns[1:], strict=True) if J is not None]
    J = left.freed(np.hstack([columns[0], *(x for _, x in some)]))
    lengths = np.maximum(norms(J), 1e-300)
    cosines = (J[:, 0] @ J) / (lengths[0] * lengths)
    near = [
        (float(c), e)
        for c, (e, _) in zip(cosines[1:], some, strict=True)
        if c > 0.0 and c**2 >= NEIGHBOURING
    ]
    return [e for _, e in sorted(near, key=lambda pair: -pair[0])]


def _of_one_kind(one: Effect, other: Effect) -> bool:
    a, b = one.place, other.place
    same = (one.physics, one.count, a.dof, len(a.nodes), len(a.elements), a.groups)
    return same == (other.physics, other.count, b.dof, len(b.nodes), len(b.elements), b.groups)
