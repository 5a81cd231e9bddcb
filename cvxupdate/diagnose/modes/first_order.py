"""How much of the projected residual every effect at every place could explain, to first order:
derivatives of eigenvalues and shapes (Fox and Kapoor 1968)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.errors import ModelError
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.effect import Effect
from cvxupdate.residual.block_columns import BlockColumns

BASIS = 120  # modes that span the derivative of a shape
TOGETHER = 256  # columns scored at a time


def linearised(fit: Fit) -> Linearised:
    """The nuisance parameters, and effects already placed, at a fit."""
    A, _ = fit.point.system().weighted()
    values, weights, _ = fit.point.differences
    return Linearised(A, -weights * values, fit.point.p, fit.setting.scales)


def block_columns(fit: Fit) -> BlockColumns:
    """Derivatives of the rows of a fit along changes of single blocks."""
    model, K, M = fit.setting.model, fit.point.matrices.K, fit.point.matrices.M
    rigid = rigid_body_modes(model, K, M)
    return BlockColumns.of(fit.point, natural_modes(K, M, min(model.size, BASIS), rigid))


def columns_of(fit: Fit, effects: Sequence[Effect]) -> list[Real | None]:
    """Weighted columns (rows, n) of each effect; None where it has none."""
    columns = block_columns(fit)
    _, weights, _ = fit.point.differences
    single: dict[tuple[str, int], Real] = {}
    out: list[Real | None] = []
    for e in effects:
        change = e.change
        if change is None or not change.tangent or not all(change.tangent):
            out.append(None)
            continue
        keys = [(e.physics, m) for m in change.members] if change.additive else []
        if len(keys) > 1 and all(k in single for k in keys):
            J = np.sum([single[k] for k in keys], axis=0)
        else:
            J = np.stack([columns.of_blocks(blocks) for blocks in change.tangent], axis=1)
            J = weights[:, None] * J
        if len(keys) == 1:
            single[keys[0]] = J
        out.append(J)
    return out


def first_order(fit: Fit, effects: Sequence[Effect]) -> list[Score]:
    """Scores in the order of ``effects``; nothing where shapes of a repeated eigenvalue have no
    derivative."""
    out = [Score(e, 0.0, np.zeros(e.count)) for e in effects]
    try:
        left = Projection.of(linearised(fit))
    except ModelError:
        return out
    columns = columns_of(fit, effects)
    alone = [k for k, J in enumerate(columns) if J is not None and J.shape[1] == 1]
    for first in range(0, len(alone), TOGETHER):
        some = alone[first : first + TOGETHER]
        J = np.hstack([x for k in some if (x := columns[k]) is not None])
        Jp = left.freed(J)
        scores = left.one([effects[k] for k in some], Jp.T @ left.residual, norms(Jp), norms(J))
        for k, score in zip(some, scores, strict=True):
            out[k] = score
    for k, several in enumerate(columns):
        if several is not None and several.shape[1] > 1:
            out[k] = left.several(effects[k], several, left.freed(several))
    return out
