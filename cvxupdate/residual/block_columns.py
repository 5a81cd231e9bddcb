"""Derivatives of modes along single changes of a few elements, in a basis of modes.

`residual.eigen` takes all parameters of a model at once; here each of thousands of candidate
changes is one set of element blocks, and shapes move in the space of the modes at hand (Fox and
Kapoor 1968).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import DerivativeBlock
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.eigen import padded
from cvxupdate.residual.modal import ModalPoint, scaled_derivative

REPEATED = 1e-6  # relative distance of eigenvalues whose shapes do not turn into one another


@dataclass(frozen=True)
class BlockColumns:
    """At a point of the modal residual: shapes with the ground (N + 1, modes) of the basis
    (``phi``), of all modes (``shapes``) and their places that tables are paired with; ``turns`` of
    each shape that is fitted its place, and what its rows make of the forces of a change on the
    basis, (rows, modes)."""

    point: ModalPoint
    phi: Real
    shapes: Real
    paired: Index
    turns: tuple[tuple[int, Real], ...]

    @classmethod
    def of(cls, point: ModalPoint, basis: Modes) -> BlockColumns:
        """In the space of ``basis``."""
        fitted = point.places[: len(point.residual.fit)]
        paired = np.concatenate([np.zeros(0, dtype=np.int64), *(q[q >= 0] for q in fitted)])
        own, turns = point.modes, []
        for _, _, i, sensors, x, std in point.shape_rows() if point.residual.shapes else ():
            gap = float(own.eigenvalues[i]) - basis.eigenvalues
            near = np.abs(gap) <= REPEATED * max(float(own.eigenvalues[i]), 1.0)
            moved = basis.shapes[sensors] * np.where(near, 0.0, 1.0 / np.where(near, 1.0, gap))
            turns.append((i, scaled_derivative(own.shapes[sensors, i], moved, x, std)))
        return cls(point, padded(basis.shapes), padded(own.shapes), paired, tuple(turns))

    def of_blocks(self, blocks: Sequence[DerivativeBlock]) -> Real:
        """Derivative of the rows of ``point.differences`` along one change, (rows,)."""
        own = self.point.modes.eigenvalues
        parts = [_energies(self.shapes[:, self.paired], own[self.paired], blocks)]
        parts += [
            turn @ self._pushed(self.shapes[:, i], float(own[i]), blocks) for i, turn in self.turns
        ]
        return np.concatenate(parts)

    def _pushed(self, shape: Real, eigenvalue: float, blocks: Sequence[DerivativeBlock]) -> Real:
        """Forces of a change on the basis, (modes,)."""
        if sum(b.dofs.size for b in blocks) > len(shape):
            return np.asarray(self.phi.T @ _push(shape, eigenvalue, blocks))
        out = np.zeros(self.phi.shape[1])
        for b in blocks:
            out += self.phi[b.dofs.reshape(-1)].T @ _forces(shape, eigenvalue, b).reshape(-1)
        return out


def _energies(shapes: Real, eigenvalues: Real, blocks: Sequence[DerivativeBlock]) -> Real:
    """φᵀ (∂K − λ ∂M) φ of each of ``shapes`` (N + 1, modes); the last DOF is the ground."""
    out = np.zeros(len(eigenvalues))
    for b in blocks:
        local = shapes[b.dofs]  # (elements, dofs, modes)
        if b.K is not None:
            out += np.einsum("eim,eim->m", local, b.K @ local)
        if b.M is not None:
            out -= eigenvalues * np.einsum("eim,eim->m", local, b.M @ local)
    return out


def _push(shape: Real, eigenvalue: float, blocks: Sequence[DerivativeBlock]) -> Real:
    """(∂K − λ ∂M) φ, (N + 1,); the last DOF is the ground, where nothing moves."""
    out = np.zeros(len(shape))
    for b in blocks:
        np.add.at(out, b.dofs, _forces(shape, eigenvalue, b))
    out[-1] = 0.0
    return out


def _forces(shape: Real, eigenvalue: float, b: DerivativeBlock) -> Real:
    """The same of one block, (elements, dofs)."""
    local, out = shape[b.dofs], np.zeros(b.dofs.shape)
    if b.K is not None:
        out += np.einsum("eij,ej->ei", b.K, local)
    if b.M is not None:
        out -= eigenvalue * np.einsum("eij,ej->ei", b.M, local)
    return out
