"""Derivatives of the rows that compare shapes, each mode solved in the cheapest exact way."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cvxupdate.fe.continued import Continued
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.residual.eigen import (
    Derivatives,
    adjoint_shapes,
    of_functionals,
    shape_motion,
)
from cvxupdate.residual.nelson import SharedSolver
from cvxupdate.residual.repeated import REPEATED, clusters
from cvxupdate.residual.shape_rows import Index

# Right-hand sides of a mode up to which conjugate gradients on the factors of K take less time than
# factors of its own (a factorisation costs 30 to 50 solutions, an iteration one; the footbridge and
# the concrete frame of problems/real/smu-modal-data).
FEW = 3


@dataclass(frozen=True)
class ShapeRow:
    """One measured shape: its ``table`` and ``mode`` there, the ``place`` of its partner, free DOFs
    ``sensors`` (s,), ``measured`` entries (s,), their deviations ``std`` (s,), and their places
    among the table's ``channels`` (s,)."""

    table: int
    mode: int
    place: int
    sensors: Index
    measured: Real
    std: Real
    channels: Index


class Compared(Protocol):
    """What a row of a shape is, as far as its derivative needs it."""

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """∂values/∂φ (rows, sensors)."""


@dataclass(frozen=True)
class Entries:
    """The entries of a shape as they are."""

    def derivative(self, phi: Real, x: Real, std: Real) -> Real:
        """The identity."""
        return np.eye(len(phi))


def shape_gradients(
    form: Compared,
    shapes: Sequence[ShapeRow],
    modes: Modes,
    m: Matrices,
    derivatives: Derivatives,
    solved: Continued | None,
) -> tuple[list[Real], list[Real]]:
    """∂values/∂p of every shape, each (rows, parameters), and what was solved for: adjoint shapes,
    or the derivatives of the shape, each (N, k).

    The adjoint form (a right-hand side for each row) where a shape has fewer rows than there are
    parameters, else Nelson's own (one for each parameter); with the factors of K that found the
    modes where those are at hand and the right-hand sides few.

    Raises
    ------
    ModelError
        When an eigenvalue is repeated beyond the modes that were computed.
    """
    together = clusters(modes)
    gradients = [
        form.derivative(modes.shapes[s.sensors, s.place], s.measured, s.std) for s in shapes
    ]
    few = [len(g) <= min(FEW, derivatives.count) for g in gradients]
    shared = _shared(shapes, gradients, few, modes, solved)
    own, solutions = dict[int, Real](), list[Real]()
    adjoint: dict[int, tuple[float, Real, Real, Real]] = {}
    for k, (s, gradient) in enumerate(zip(shapes, gradients, strict=True)):
        lam, phi = float(modes.eigenvalues[s.place]), modes.shapes[:, s.place]
        mates = next((at[at != s.place] for at in together if s.place in at), None)
        others = None if mates is None else modes.shapes[:, mates]
        if len(gradient) <= derivatives.count:
            g = _spread(gradient, s.sensors, len(phi))
            y = shared[k] if k in shared else adjoint_shapes(m, lam, phi, g, others)
            adjoint[k] = lam, phi, g, y
            solutions.append(y)
        else:
            solve = _own(m, lam, phi, others)
            moved = shape_motion(modes, s.place, solve, m, derivatives)
            own[k] = np.asarray(gradient @ moved[s.sensors])
            solutions.append(moved)
    own.update(zip(adjoint, of_functionals([*adjoint.values()], derivatives), strict=True))
    return [own[k] for k in range(len(shapes))], solutions


def _own(m: Matrices, lam: float, phi: Real, others: Real | None) -> Callable[[Real], Real]:
    def solve(f: Real) -> Real:
        return adjoint_shapes(m, lam, phi, f, others)

    return solve


def _spread(gradient: Real, sensors: Index, size: int) -> Real:
    """The gradient (rows, sensors) as functionals on all DOFs, (N, rows)."""
    g = np.zeros((size, len(gradient)))
    np.add.at(g, sensors, gradient.T)
    return g


def _shared(
    shapes: Sequence[ShapeRow],
    gradients: Sequence[Real],
    few: Sequence[bool],
    modes: Modes,
    solved: Continued | None,
) -> dict[int, Real]:
    """Adjoint shapes (N, rows) of those shapes that are worth it, all in one block: by place in
    ``shapes``."""
    chosen = [k for k in range(len(shapes)) if few[k] and solved is not None]
    if not chosen or solved is None:
        return {}
    known = modes.eigenvalues[: solved.exact]
    blocks = [_spread(gradients[k], shapes[k].sensors, len(modes.shapes)) for k in chosen]
    widths = [b.shape[1] for b in blocks]
    own = np.repeat([modes.eigenvalues[shapes[k].place] for k in chosen], widths)
    same = np.abs(known[:, None] - own[None, :]) < REPEATED * np.abs(own)
    solver = SharedSolver(solved.mass, solved.factor, known, modes.shapes[:, : solved.exact])
    y = solver.solve(own, np.hstack(blocks), same)
    return dict(zip(chosen, np.split(y, np.cumsum(widths)[:-1], axis=1), strict=True))
