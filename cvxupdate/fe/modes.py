"""Natural modes K φ = λ M φ of a model: the rigid-body ones from geometry, the flexible ones from
`eigen`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.linalg.lapack import dpotrf, dtrtrs

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.eigen import Problem, filled, flexible_modes, unresisted
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.rigid import free_motions, mass_normalised, pins, rigid_motions, rounding

DENSE = (
    300  # DOFs below which LAPACK beats shift-invert (measured in tests/benchmarks/test_modes.py)
)

# of the stiffest motion's eigenvalue: no eigenvalue solver tells a slower motion (1e-10 of its
# frequency) from rest
FREE = ("entry", "generic")  # blocks whose factors may be of any sign
STILL = 1e-20


@dataclass(frozen=True)
class Modes:
    """Modes in ascending order: ``eigenvalues`` (m,) in (rad/s)², ``shapes`` (N, m) with φᵀ M φ =
    1, the first ``rigid`` of them rigid."""

    eigenvalues: Real
    shapes: Real
    rigid: int

    @property
    def frequencies(self) -> Real:
        """Natural frequencies in Hz; rigid-body modes are 0."""
        return np.sqrt(np.maximum(self.eigenvalues, 0.0)) / (2.0 * np.pi)

    def flexible(self) -> Modes:
        """Without the rigid-body modes."""
        return Modes(self.eigenvalues[self.rigid :], self.shapes[:, self.rigid :], 0)


def model_modes(
    model: Model, count: int, p: Real | None = None, matrices: Matrices | None = None
) -> Modes:
    """The lowest ``count`` flexible modes of a model and all its rigid-body modes (fewer where the
    model has fewer).

    ``matrices`` are those at ``p`` where the caller has them already.

    Raises
    ------
    ModelError
        For a mechanism (a motion without stiffness that is not a rigid-body motion; the message
        names the DOF that moves most), for
        negative stiffness (a buckled member), or a mass matrix that is not positive semidefinite.
    """
    m = model.matrices(p) if matrices is None else matrices
    bare = _bare(m.K, m.M)
    if bare.size:
        raise ModelError(
            f"{model.labels[bare[0]]} has neither stiffness nor "
            f"mass{f' (and {bare.size - 1} more)' if bare.size > 1 else ''}: the model is a "
            "mechanism. Hold it by a support, take its kind out of model.dofs, or add the "
            "missing element."
        )
    drawn = not any(b.kind.name == "matrix" for b in model.blocks)
    motions = free_motions(model, m.K) if drawn else None
    sound = drawn and (p is not None or matrices is None) and not _negative_mass(model, p)
    modes = _solve(m.K, m.M, count, motions, (model.dof_kind >= 3).astype(float), not sound)
    if m.beyond is not None:
        return _exact(modes, m, count)
    flexible = modes.shapes[:, modes.rigid :]
    noise = np.maximum(rounding(m.K, flexible), STILL * _stiffest(m))
    for wrong, what in (
        (
            modes.eigenvalues[modes.rigid :] < -noise,
            "with negative stiffness (a member has buckled, or a stiffness is below zero)",
        ),
        (np.abs(modes.eigenvalues[modes.rigid :]) <= noise, "without stiffness: it is a mechanism"),
    ):
        if np.any(wrong):
            shape = _besides_rigid(model, flexible[:, int(np.argmax(wrong))])
            raise ModelError(
                f"the model has {int(np.sum(wrong))} motion(s) besides the {modes.rigid} "
                f"rigid-body modes {what}. The first moves "
                f"{model.labels[int(np.argmax(shape))]} most. Add the missing element or "
                "support there, or correct the property."
            )
    return modes


def loose_dofs(model: Model) -> tuple[str, ...]:
    """Labels of the DOFs that no stiffness acts on."""
    free = np.flatnonzero(~filled(model.matrices().K))
    return tuple(model.labels[i] for i in free)


def _exact(series: Modes, m: Matrices, count: int) -> Modes:
    """The modes of a model with exact members; ``series`` those of its Taylor series, whose
    rigid-body modes are exact and whose first frequency is where the search begins."""
    from cvxupdate.fe.exact.modes import exact_modes

    rigid = series.shapes[:, : series.rigid]
    first = (
        float(np.sqrt(series.eigenvalues[series.rigid]))
        if len(series.eigenvalues) > (series.rigid)
        else 2.0 * np.pi
    )
    values, shapes = exact_modes(m, rigid, count, first)
    return Modes(
        np.concatenate([np.zeros(series.rigid), values]), np.hstack([rigid, shapes]), series.rigid
    )


def natural_modes(K: sp.csc_array, M: sp.csc_array, count: int, rigid: Real | None = None) -> Modes:
    """The lowest ``count`` flexible modes after the rigid-body modes ``rigid`` (N, r),
    mass-normalised.

    None: the motions that K does not resist are looked for and come first. Massless DOFs follow
    statically. Repeated eigenvalues are complete: large models are checked by counting the negative
    pivots of K − μ M (Sylvester's law of inertia). A negative eigenvalue (negative stiffness) is
    returned as it is.

    Raises
    ------
    ModelError
        When M has a negative eigenvalue or both K and M vanish on some motion.
    """
    return _solve(K, M, count, rigid, np.zeros(K.shape[0]), True)


def _solve(
    K: sp.csc_array,
    M: sp.csc_array,
    count: int,
    motions: Real | None,
    rotations: Real,
    check_mass: bool,
) -> Modes:
    bare = _bare(K, M)
    if bare.size:
        raise ModelError(
            f"DOF number {bare[0]} has neither stiffness nor mass: the model is a mechanism. "
            "Add the missing element or support."
        )
    if motions is None:
        motions = unresisted(K, M, DENSE)
    R = mass_normalised(
        motions, M
    )  # a motion with neither stiffness nor mass is held and is no mode
    problem = Problem(K, M, R, pins(motions, rotations), check_mass)
    values, shapes = flexible_modes(problem, max(count, 0), DENSE)
    shapes = _orthonormal(shapes, M)
    largest = shapes[np.argmax(np.abs(shapes), axis=0), np.arange(shapes.shape[1])]
    shapes = shapes * np.where(largest < 0, -1.0, 1.0)
    return Modes(np.concatenate([np.zeros(R.shape[1]), values]), np.hstack([R, shapes]), R.shape[1])


def _orthonormal(shapes: Real, M: sp.csc_array) -> Real:
    """Rounding leaves a trace of the softer modes in the stiffer ones; Cholesky takes it out in
    that order and normalises (by LAPACK itself: scipy's functions take longer than it where models
    are small)."""
    if not shapes.shape[1]:
        return shapes
    L, wrong = dpotrf(shapes.T @ (M @ shapes), lower=1, clean=1)
    if wrong:
        raise la.LinAlgError("the modal masses are not positive definite.")
    return np.asarray(dtrtrs(L, shapes.T, lower=1)[0]).T


def _stiffest(m: Matrices) -> float:
    """The largest k/m on the diagonals: what the stiffest motion is about, (rad/s)²."""
    k, mass = m.K.diagonal(), m.M.diagonal()
    moving = mass > 0.0
    return float(np.max(np.abs(k[moving]) / mass[moving], initial=0.0))


def _besides_rigid(model: Model, shape: Real) -> Real:
    """How far each DOF moves in ``shape`` (N,) beside the nearest rigid motion, rotations as
    lengths on the scale of the structure."""
    Q = rigid_motions(model)
    rest = np.abs(shape - Q @ (Q.T @ shape))
    return np.where(model.dof_kind >= 3, np.ptp(model.xyz, axis=0).max() / 2.0, 1.0) * rest


def _bare(K: sp.csc_array, M: sp.csc_array) -> Index:
    """DOFs that have neither stiffness nor mass."""
    return np.flatnonzero(~filled(K) & ~filled(M)).astype(np.int64)


def _negative_mass(model: Model, p: Real | None) -> bool:
    """Whether any element's mass carries a negative factor, or an entry of M moves; where none
    does, M is positive semidefinite by construction."""
    return any(
        matrix == "M"
        and bool(
            np.any(np.real(factor) != 0.0 if block.kind.name in FREE else np.real(factor) < 0.0)
        )
        for block, values in zip(model.blocks, model.properties(p), strict=True)
        for matrix, _, factor in block.scalars(values)
    )
