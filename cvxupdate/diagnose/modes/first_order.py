"""How much of the projected residual every effect at every place could explain, to first order:
derivatives of eigenvalues and shapes (Fox and Kapoor 1968)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.diagnose.types import Real, Score
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.effect import Effect
from cvxupdate.residual.modal import ModalPoint

BASIS = 120  # modes that span the derivative of a shape
TOGETHER = 256  # columns scored at a time


def linearised(fit: Fit) -> Linearised:
    """The nuisance parameters, and effects already placed, at a fit."""
    A, _ = fit.point.system().weighted()
    values, weights, _ = fit.point.differences
    return Linearised(A, -weights * values, fit.point.p, fit.setting.scales)


def columns_of(fit: Fit, effects: Sequence[Effect]) -> list[Real | None]:
    """Weighted columns (rows, n) of each effect; None where it has none."""
    point, model = fit.point, fit.setting.model
    K, M = point.matrices.K, point.matrices.M
    many = natural_modes(K, M, min(model.size, BASIS), rigid_body_modes(model, K, M))
    phi = np.vstack([many.shapes, np.zeros((1, many.shapes.shape[1]))])
    column = _column(point, many.eigenvalues, phi)
    _, weights, _ = point.differences
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
            J = np.stack([column(blocks) for blocks in change.tangent], axis=1)
            J = weights[:, None] * J
        if len(keys) == 1:
            single[keys[0]] = J
        out.append(J)
    return out


def first_order(fit: Fit, effects: Sequence[Effect]) -> list[Score]:
    """Scores in the order of ``effects``."""
    left = Projection.of(linearised(fit))
    out = [Score(e, 0.0, np.zeros(e.count)) for e in effects]
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


def _column(point: ModalPoint, eigenvalues: Real, phi: Real) -> Callable[[Sequence[Any]], Real]:
    """What gives the derivative of the rows of ``point.differences`` along one tangent: Fox and
    Kapoor's modal expansion over the modes at hand."""
    residual = point.residual
    places = np.array(
        [i for k in range(len(residual.fit)) for i in point.places[k].tolist() if i >= 0],
        dtype=np.int64,
    )
    shapes = np.vstack([point.modes.shapes, np.zeros((1, point.modes.shapes.shape[1]))])
    paired, own = np.ascontiguousarray(shapes[:, places]), point.modes.eigenvalues[places]
    rows = point.shape_rows() if residual.shapes else []

    def column(blocks: Sequence[Any]) -> Real:
        parts = [_energies(paired, own, blocks)]
        for _, _, i, sensors, x, std in rows:
            parts.append(
                _turned(
                    shapes[:, i],
                    float(point.modes.eigenvalues[i]),
                    sensors,
                    x,
                    std,
                    eigenvalues,
                    phi,
                    blocks,
                )
            )
        return np.concatenate(parts)

    return column


def _energies(shapes: Real, eigenvalues: Real, blocks: Sequence[Any]) -> Real:
    """φᵀ (∂K − λ ∂M) φ of each of ``shapes`` (N + 1, modes); the last DOF is the ground."""
    out = np.zeros(len(eigenvalues))
    for b in blocks:
        local = shapes[b.dofs]  # (elements, dofs, modes)
        if b.K is not None:
            out += np.einsum("eim,eim->m", local, b.K @ local)
        if b.M is not None:
            out -= eigenvalues * np.einsum("eim,eim->m", local, b.M @ local)
    return out


def _turned(
    shape: Real,
    eigenvalue: float,
    sensors: Any,
    x: Real,
    std: Real,
    eigenvalues: Real,
    phi: Real,
    blocks: Sequence[Any],
) -> Real:
    """Derivative of a shape (N + 1,) at ``sensors``, scaled to the measured ``x`` all the while."""
    force = _push(shape, eigenvalue, blocks)
    gap = eigenvalue - eigenvalues
    near = np.abs(gap) <= 1e-6 * max(eigenvalue, 1.0)
    d = phi[sensors] @ np.where(near, 0.0, (phi.T @ force) / np.where(near, 1.0, gap))
    w = 1.0 / std**2
    own = shape[sensors]
    q = np.sum(w * own * x) / np.sum(w * own**2)
    return np.asarray(q * d + own * (np.sum(w * (x - 2.0 * q * own) * d) / np.sum(w * own**2)))


def _push(shape: Real, lam: float, blocks: Sequence[Any]) -> Real:
    """(∂K − λ ∂M) φ, (N + 1,); the last DOF is the ground, where nothing moves."""
    out = np.zeros(len(shape))
    for b in blocks:
        local = shape[b.dofs]
        push = np.zeros(b.dofs.shape)
        if b.K is not None:
            push += np.einsum("eij,ej->ei", b.K, local)
        if b.M is not None:
            push -= lam * np.einsum("eij,ej->ei", b.M, local)
        np.add.at(out, b.dofs, push)
    out[-1] = 0.0
    return out
