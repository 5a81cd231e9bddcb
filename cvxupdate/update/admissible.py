"""Whether any admissible parameters explain measured modes at all: a proof when none do.

For complete shapes the equations of motion are linear in p, so the set of parameters that explain
the modes within a noise band is a polytope, and Farkas' lemma proves it empty. The band is worked
out for the worst admissible p (interval bounds), so the proof holds whatever p is: when the true
structure were the model with admissible parameters and every error lay within its band, the truth
itself would satisfy every clause. With incomplete shapes the equations are linear only locally and
nothing is proved; the function refuses them.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.convex import Bounds, Clause, LinearClause, Relaxation, StepProblem, find_conflict
from cvxupdate.convex.certificate import Farkas
from cvxupdate.errors import InputError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.quantiles import normal_above
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.ceam import forces
from cvxupdate.residual.ceam_modes import AssignedMode, assigned_modes, impedance


@dataclass(frozen=True)
class Admissible:
    """The answer: ``possible`` False is a proof (at the stated ``confidence``); ``conflict`` names
    the modes and clauses that exclude one another, ``relaxation`` what would reconcile them,
    ``proof`` the multipliers recomputed. ``factor``: half width of the band in standard
    deviations."""

    possible: bool
    conflict: tuple[str, ...]
    relaxation: tuple[Relaxation, ...]
    proof: Farkas | None
    confidence: float
    factor: float
    says: str


def admissible(
    model: Model, tables: Sequence[ModeTable], problem: StepProblem, confidence: float = 0.99
) -> Admissible:
    """Do parameters that keep every clause of ``problem`` explain the complete modes of ``tables``
    within their noise?

    Parameters
    ----------
    model : linear in its parameters; tables : modes with shapes at every free DOF and stated
    deviations.
    problem : its clauses are kept; it must bound every parameter. confidence : that all normal
    errors together lie within the band (Bonferroni).

    Raises
    ------
    InputError
        Incomplete shapes, a parameter without bounds, or a model that is not linear in its
        parameters: nothing could be proved.
    """
    n = len(model.parameters)
    if problem.columns != tuple(q.name for q in model.parameters):
        raise InputError(
            "admissible: the clauses are over other parameters than the model's; make both "
            "from one problem file."
        )
    reach = _reach(problem)
    modes = _complete_modes(model, tables)
    _check_linear(model, reach)
    count = sum(len(mode.at) + 1 for mode in modes)
    factor = normal_above((1.0 - confidence) / (2.0 * count))
    clauses: list[Clause] = [
        *problem.clauses,
        *(band_clause(model, mode, reach, factor) for mode in modes),
    ]
    found = find_conflict(clauses, n)
    if found is None:
        return Admissible(
            True,
            (),
            (),
            None,
            confidence,
            factor,
            "admissible parameters explain every mode within its noise",
        )
    says = (
        "no admissible parameters explain these modes (the noise would have to exceed "
        f"{factor:.1f} standard deviations, chance below {1.0 - confidence:.1g}): "
        + "; ".join(found.clauses)
    )
    return Admissible(False, found.clauses, found.relaxation, found.proof, confidence, factor, says)


def band_clause(model: Model, mode: AssignedMode, reach: Real, factor: float) -> LinearClause:
    """|Z(p) φ| ≤ band, row by row, for a complete measured mode.

    The truth has Z(p, s + δs) (φ + δφ) = 0, so |Z(p, s) φ| ≤ |Z|·|δφ| + |δ(s²)| |M| (|φ| + |δφ|) +
    |δs| |C| (|φ| + |δφ|), each matrix replaced by the entrywise largest over |p_j| ≤ reach_j.
    """
    derivatives = [model.derivative(j, model.zero()) for j in range(len(model.parameters))]
    m = model.matrices(model.zero())
    shape = np.zeros(model.size, dtype=mode.shape.dtype)
    error = np.zeros(model.size)
    shape[mode.at], error[mode.at] = mode.shape, factor * mode.std
    change = factor * mode.rate_std
    squared = abs(mode.s) ** 2 * (2.0 * change + change**2)
    moved = np.abs(shape) + error
    band = abs(impedance(m, mode)) @ error + squared * (abs(m.M) @ moved)
    if not mode.real:
        band = band + abs(mode.s) * change * (abs(m.C) @ moved)
    for j, blocks in enumerate(derivatives):
        for b in blocks:
            keep = b.dofs >= 0
            push = np.zeros(b.dofs.shape)
            for name, size, extra in (
                ("K", 1.0, 0.0),
                ("M", abs(mode.s) ** 2, squared),
                ("C", abs(mode.s), abs(mode.s) * change),
                ("D", 1.0, 0.0),
            ):
                matrix = getattr(b, name)
                if matrix is None or (mode.real and name in "CD"):
                    continue
                push += size * np.einsum(
                    "eij,ej->ei", np.abs(matrix), np.where(keep, error[b.dofs], 0.0)
                )
                push += extra * np.einsum(
                    "eij,ej->ei", np.abs(matrix), np.where(keep, moved[b.dofs], 0.0)
                )
            np.add.at(band, b.dofs[keep], reach[j] * push[keep])
    A, force = forces(derivatives, mode, shape), impedance(m, mode) @ shape
    if not mode.real:
        A, force, band = (
            np.vstack([A.real, A.imag]),
            np.concatenate([force.real, force.imag]),
            np.concatenate([band, band]),
        )
    # Rows of newtons and newton metres: each divided by its own band, so that every limit is 1.
    scale = 1.0 / np.where(band > 0.0, band, np.finfo(float).tiny)
    A, right = np.real(A) * scale[:, None], -np.real(force) * scale
    return LinearClause(
        f"equation of motion of {mode.label} within {factor:.1f} standard deviations",
        tuple(range(A.shape[1])),
        A,
        right - 1.0,
        right + 1.0,
        "noise bands",
    )


def _reach(problem: StepProblem) -> Real:
    """The largest magnitude that the bounds allow each parameter; InputError where it is not
    finite."""
    n = len(problem.columns)
    limits = [c.limits(n) for c in problem.constraints if isinstance(c, Bounds)]
    reach = (
        np.min([np.maximum(np.abs(lo), np.abs(hi)) for lo, hi in limits], axis=0)
        if limits
        else np.full(n, np.inf)
    )
    if not np.all(np.isfinite(reach)):
        open_ = problem.columns[int(np.argmax(~np.isfinite(reach)))]
        raise InputError(
            f"admissible: the parameter {open_} has no bounds, so the noise band of the worst "
            "case is infinite. Give it bounds."
        )
    return np.asarray(reach)


def _complete_modes(model: Model, tables: Sequence[ModeTable]) -> tuple[AssignedMode, ...]:
    """The measured modes; InputError where a shape is incomplete."""
    modes = assigned_modes(model, tables)
    if any(not mode.full(model.size) for mode in modes):
        raise InputError(
            "admissible: a mode was not measured at every free DOF; its equation is linear "
            "in the parameters only locally, so nothing would be proved. Use complete (not "
            "expanded) shapes."
        )
    return modes


def _check_linear(model: Model, reach: Real) -> None:
    p = 0.5 * reach * np.where(np.arange(len(reach)) % 2, -1.0, 1.0)
    zero, there, mirror = (model.matrices(x) for x in (model.zero(), p, -p))
    for name in ("K", "M", "C", "D"):
        base = getattr(zero, name)
        curved = getattr(there, name) + getattr(mirror, name) - 2.0 * base
        if abs(curved).max() > 1e-9 * max(abs(base).max(), np.finfo(float).tiny):
            raise InputError(
                f"admissible: {name} is not linear in the parameters, so infeasibility would "
                "prove nothing. Free p-values, E, rho or k instead."
            )
