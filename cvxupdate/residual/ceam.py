"""Eigenstructure assignment as linear equations in the parameters (6.22, 6.23), each mode's rows
whitened by its own deviations.

For a mode (s, φ) of the real structure, Z(s, p) φ = 0 with Z = s² M + s C + K + i D. Where K, M, C,
D are linear in p and φ is known at every DOF this is *exactly* linear in p: one convex step is the
whole method. Where some DOFs were not measured they are expanded by the model at ``at`` and given
deviations as large as they are, so that whitening all but projects them out; with the shapes
expanded anew at each solution this is the variable projection of Golub and Pereyra (1973) in
Kaufman's form (1975), which converges like Gauss–Newton.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import DerivativeBlock, Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.ceam_expand import expand
from cvxupdate.residual.ceam_modes import AssignedMode, impedance
from cvxupdate.residual.ceam_whiten import Whitener, chunks, parts, whitener
from cvxupdate.system import LinearSystem

Array = NDArray[Any]
LARGE = 20_000_000
"""Entries of A (modes × equations × parameters) above which the rows of each mode are combined,
where the loss allows it."""


@dataclass(frozen=True)
class CeamResidual:
    """What is assigned: ``assigned`` modes of ``model``, ``expansion`` for incomplete ones, and the
    parameter values ``at`` at which the rows are whitened and the shapes expanded; ``modes`` of the
    model for the modal expansions. ``combine``: rows of a large system may be combined
    orthogonally, mode by mode, for a loss that sees only their norm."""

    model: Model
    assigned: tuple[AssignedMode, ...]
    expansion: str
    at: Real
    modes: Modes | None = None
    combine: bool = False

    @cached_property
    def expanded(self) -> tuple[Array, ...]:
        """Shapes at all DOFs by the model at ``at``."""
        m = self.model.matrices(self.at)
        return tuple(expand(mode, m, self.expansion, self.modes) for mode in self.assigned)

    @cached_property
    def whiteners(self) -> tuple[Whitener, ...]:
        """What makes the rows of each mode independent with unit variance."""
        m = self.model.matrices(self.at)
        return tuple(
            whitener(m, mode, full) for mode, full in zip(self.assigned, self.expanded, strict=True)
        )

    @property
    def exact(self) -> bool:
        """Whether the equations hold for every p and not near ``at`` only: every shape is complete
        (the model must be linear in p too)."""
        return all(mode.full(self.model.size) for mode in self.assigned)

    def evaluate(self, p: Real, before: CeamPoint | None = None) -> CeamPoint:
        """The equations at ``p``."""
        del before
        return CeamPoint(self, np.asarray(p, dtype=float), self.model.matrices(p))


@dataclass(frozen=True)
class CeamPoint:
    """The equations at one parameter vector."""

    residual: CeamResidual
    p: Real
    matrices: Matrices

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(whitened Z(p) φ, ones, labels): real parts, then imaginary parts, mode by mode."""
        values = []
        for mode, W, full in zip(
            self.residual.assigned, self.residual.whiteners, self.residual.expanded, strict=True
        ):
            values.append(parts(W(impedance(self.matrices, mode) @ full), mode.real))
        flat = np.concatenate(values)
        return flat, np.ones(len(flat)), self.labels

    @cached_property
    def labels(self) -> tuple[str, ...]:
        """Row labels."""
        out = []
        for mode, W in zip(self.residual.assigned, self.residual.whiteners, strict=True):
            out += [
                f"{mode.label}: equation {i + 1}{part}"
                for part in ([""] if mode.real else [" (real)", " (imaginary)"])
                for i in range(W.size)
            ]
        return tuple(out)

    def system(self) -> LinearSystem:
        """A p − b = whitened Z(p) φ at this point and, where the model is linear and the shapes are
        complete, everywhere.

        A large system (`LARGE`) has the rows of each mode combined to as many as there are
        parameters and one: the triangle of a QR factorisation, which leaves ‖A p − b‖ what it was
        for every p, so that N × parameters numbers are held for one mode at a time only.
        """
        model = self.residual.model
        values, _, labels = self.differences
        derivatives = model.derivatives(self.p)
        n, m = len(derivatives), len(values)
        small = self.residual.combine and m * n > LARGE
        A, found, rows, at = [], [], [], 0
        for mode, W, full in zip(
            self.residual.assigned, self.residual.whiteners, self.residual.expanded, strict=True
        ):
            k = W.size * (1 if mode.real else 2)
            mine = np.empty((k, n + 1), order="F")
            for some in chunks(n):
                mine[:, some] = parts(W(forces(derivatives[some], mode, full)), mode.real)
            mine[:, n] = values[at : at + k]
            if small and k > n + 1:
                mine = np.asarray(np.linalg.qr(mine, mode="r"))
                rows += [f"{mode.label}: combination {i + 1}" for i in range(n + 1)]
            else:
                rows += labels[at : at + k]
            A.append(mine[:, :n])
            found.append(mine[:, n])
            at += k
        joined, right = np.vstack(A), np.concatenate(found)
        return LinearSystem(
            joined,
            joined @ self.p - right,
            np.ones(len(right)),
            tuple(q.name for q in model.parameters),
            tuple(rows),
            m,
        )


def forces(
    derivatives: Sequence[Sequence[DerivativeBlock]], mode: AssignedMode, full: Array
) -> Array:
    """∂Z/∂p_j φ for every parameter, (N, parameters)."""
    out = np.zeros((len(full), len(derivatives)), dtype=float if mode.real else complex)
    padded = np.append(full, 0.0)
    factors = (
        {"K": 1.0, "M": float((mode.s**2).real)}
        if mode.real
        else {"K": 1.0, "M": mode.s**2, "C": mode.s, "D": 1j}
    )
    for j, blocks in enumerate(derivatives):
        for b in blocks:
            local = padded[b.dofs]
            push: Any = 0.0
            for name, factor in factors.items():
                matrix = getattr(b, name)
                if matrix is not None:
                    push = push + factor * np.einsum("eij,ej->ei", matrix, local)
            if not np.isscalar(push):
                keep = b.dofs >= 0
                np.add.at(out[:, j], b.dofs[keep], push[keep])
    return out
