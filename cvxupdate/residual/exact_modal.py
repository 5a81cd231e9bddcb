"""Derivatives of the modes of exact members (Wittrick and Williams' eigenproblem Z(λ) φ = 0).

With S = −∂Z/∂λ and φᵀ S φ = 1, differentiating Z(λ(p), p) φ(p) = 0 gives ∂λ/∂p = φᵀ ∂Z/∂p φ: Fox
and Kapoor's formula (2.100), in which ∂K − λ ∂M is ∂Z at the mode's own frequency. Shapes are
compared in forms that know no scale (`residual.shape_forms`), so what S itself changes by, which
only rescales φ, drops out, and Nelson's equation is that of the pencil (Z + λS, S), linear at the
mode.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.exact.modes import Counter
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.contraction import Derivatives, derivatives
from cvxupdate.residual.eigen import adjoint_shapes
from cvxupdate.residual.repeated import clusters
from cvxupdate.residual.shape_gradients import Compared, ShapeRow
from cvxupdate.residual.shape_rows import Index

STILL = 1e-9  # of the largest entry of all shapes: no node moves but by rounding


def undamped(model: Model, p: Real) -> tuple[Model, Real]:
    """``model`` without loss, and ``p`` with the p-values of damping at zero."""
    blocks = tuple(
        b
        if b.exact is None
        else replace(b, properties={**b.properties, "damping": np.zeros(len(b.ids))})
        for b in model.blocks
    )
    lossless = np.array([q.of == "damping" for q in model.parameters], dtype=bool)
    return replace(model, blocks=blocks), np.where(lossless, 0.0, p)


def exact_rows(
    model: Model, p: Real, modes: Modes, paired: Index, form: Compared, shapes: Sequence[ShapeRow]
) -> list[Real]:
    """∂(eigenvalues of the modes ``paired``, rows of ``shapes``)/∂p at ``p``, each (rows,
    parameters).

    Raises
    ------
    ModelError
        For a mode in which no node moves: the nodes do not tell what would move it.
    """
    model, p = undamped(model, p)
    changes = derivatives(model, p)
    rows = [np.zeros((0, changes.count))]
    rows += [_eigenvalue(modes, at, changes)[None] for at in paired.tolist()]
    return [*rows, *_shapes(model.matrices(p), modes, changes, form, shapes)]


def _eigenvalue(modes: Modes, at: int, changes: Derivatives) -> Real:
    """∂λ/∂p (parameters,) of one mode."""
    phi, omega = modes.shapes[:, [at]], float(np.sqrt(max(modes.eigenvalues[at], 0.0)))
    if np.abs(phi).max(initial=0.0) <= STILL * np.abs(modes.shapes).max(initial=0.0):
        raise ModelError(
            f"in the mode at {omega / (2.0 * np.pi):.5g} Hz, which is fitted, no node moves: it "
            "lies inside exact members whose ends stand still. Put a node inside the members."
        )
    return np.asarray(changes.between(omega, phi, phi)[0, 0].real)


def _shapes(
    m: Matrices, modes: Modes, changes: Derivatives, form: Compared, shapes: Sequence[ShapeRow]
) -> Iterator[Real]:
    together = clusters(modes)
    for s in shapes:
        phi, lam = modes.shapes[:, s.place], float(modes.eigenvalues[s.place])
        gradient = form.derivative(phi[s.sensors], s.measured, s.std)
        g = np.zeros((len(phi), len(gradient)))
        np.add.at(g, s.sensors, gradient.T)
        mates = next((at[at != s.place] for at in together if s.place in at), None)
        others = None if mates is None else modes.shapes[:, mates]
        y = adjoint_shapes(linear_at(m, lam), lam, phi, g, others)
        yield -np.asarray(changes.between(float(np.sqrt(lam)), y, phi[:, None])[:, 0].real)


def linear_at(m: Matrices, eigenvalue: float) -> Matrices:
    """The pencil (Z + λS, S) whose mode at ``eigenvalue`` λ is that of the exact members."""
    if m.beyond is None:
        return m
    counter = Counter(m, m.beyond.undamped())
    omega = float(np.sqrt(eigenvalue))
    S = counter.slope(omega)
    return replace(m, K=counter.stiffness(omega) + eigenvalue * S, M=S)
