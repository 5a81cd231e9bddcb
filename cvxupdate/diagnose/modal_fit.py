"""A model fitted to tables of modes: frequencies and, where measured, shapes, ordinary parameters
within their scatter; its errors on what was held out."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.special import gammaincinv

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.data import WIDE
from cvxupdate.diagnose.fit import FREE, scatter_of
from cvxupdate.diagnose.mesh import MeshError
from cvxupdate.diagnose.modal_scan import SIZES
from cvxupdate.diagnose.signals import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.residual.pairing import follow
from cvxupdate.residual.repeated import aligned, clusters
from cvxupdate.update.trust_region import Options, iterate

FREQUENCY_FLOOR, SHAPE_FLOOR = (
    0.003,
    0.02,
)  # what an ordinary model may miss of a frequency (relative) and of a shape's entry
UNSTATED = (
    0.005  # relative deviation of a frequency where the table gives none: half a line in a hundred
)
CHANCE, LIKELY = 0.99, 0.95  # levels of chi-square
SAME, APART = (
    1e-12,
    1e-10,
)  # relative differences of matrices, and of shapes in their mass, that are rounding


def chi_square(level: float, freedoms: int) -> float:
    """What chi-square with so many freedoms does not exceed with probability ``level``; scipy.stats
    takes half a second to import."""
    return float(2.0 * gammaincinv(freedoms / 2.0, level))


@dataclass(frozen=True)
class Tables:
    """Tables to fit and to score only, with the allowance for what a model may miss in their
    deviations and the mesh's share taken out."""

    fit: tuple[ModeTable, ...]
    hold: tuple[ModeTable, ...]

    @property
    def top(self) -> float:
        """The highest frequency to fit, Hz."""
        return max(float(t.frequency.max()) for t in self.fit)

    @property
    def bottom(self) -> float:
        """The lowest, Hz."""
        return min(float(t.frequency.min()) for t in self.fit)

    @property
    def accelerometers(self) -> tuple[str, ...]:
        """Labels of the channels that shapes were measured with, unless they are known not to be
        accelerometers."""
        return tuple(c.label for t in self.fit for c in t.channels if c.quantity == "acceleration")

    @property
    def shapes(self) -> bool:
        """Whether any mode to fit has a shape."""
        return any(t.shapes is not None for t in self.fit)

    @property
    def noise(self) -> float:
        """R.m.s. relative error of the held-out frequencies that their deviations alone explain
        nineteen times in twenty; NaN where none are."""
        std = np.concatenate([np.zeros(0), *(t.frequency_std / t.frequency for t in self.hold)])
        return (
            float(np.sqrt(np.mean(std**2) * chi_square(LIKELY, len(std)) / len(std)))
            if len(std)
            else float("nan")
        )


def prepared(model: Model, tables: Sequence[ModeTable], mesh: MeshError) -> Tables:
    """Deviations widened by what a model may miss; measured frequencies moved to where this mesh
    would have them.

    The mesh's own error is no physics (`cvxupdate.diagnose.mesh`); the modes of ``model`` say which
    shift is whose.
    """
    fit, hold = (
        tuple(t for t in tables if (t.origin.use == "fit") == use) for use in (True, False)
    )
    start = modal_residual(model, fit, hold, False).evaluate(model.zero())
    moved = []
    for k, t in enumerate((*fit, *hold)):
        own = start.frequencies(k)
        shift = np.where(np.isfinite(own), mesh.at(np.nan_to_num(own)), 0.0)
        moved.append(
            _widened(
                replace(
                    t,
                    frequency=t.frequency / (1.0 + shift),
                    frequency_std=t.frequency_std / (1.0 + shift),
                ),
                shift * 2.0**-mesh.order,
            )
        )
    return Tables(tuple(moved[: len(fit)]), tuple(moved[len(fit) :]))


def _widened(table: ModeTable, missed: Real) -> ModeTable:
    std = UNSTATED * table.frequency if table.relative_only else table.frequency_std
    wide = np.sqrt(std**2 + (FREQUENCY_FLOOR**2 + missed**2) * table.frequency**2)
    shape = table.shape_std
    if table.shapes is not None:
        known = (
            np.full(table.shapes.shape, np.nan)
            if shape is None
            else np.broadcast_to(shape, table.shapes.shape)
        )
        shape = np.sqrt(np.where(np.isfinite(known), known, 0.05) ** 2 + SHAPE_FLOOR**2)
    return replace(table, frequency_std=wide, shape_std=shape, relative_only=False)


@dataclass(frozen=True)
class ModalFit:
    """A model fitted to the tables: weighted squares (``cost``, priors included), ``rows``,
    deviations of the parameters."""

    model: Model
    point: ModalPoint
    cost: float
    rows: int
    std: Real

    @property
    def misfit(self) -> float:
        """Weighted squares per row, priors included."""
        return self.cost / max(1, self.rows)

    @property
    def explained(self) -> bool:
        """Whether noise, the allowance for what a model may miss and the priors alone would leave
        as much once in a hundred times (chi-square)."""
        return bool(self.cost <= chi_square(CHANCE, self.rows))


def prior_scales(model: Model, wide: bool = False) -> Real:
    """Standard deviations of the parameters before any table: groups scatter ordinarily (``wide``:
    their stiffness as far as a parameter error is followed; frequencies alone would not keep mass
    and stiffness apart), physics under trial is free."""
    return np.array(
        [
            FREE if q.group is None else WIDE if wide and q.of != "mass" else scatter_of(q)
            for q in model.parameters
        ]
    )


def residual_of(model: Model, data: Tables, like: ModalResidual | None = None) -> ModalResidual:
    """The tables beside a model's modes. ``like``: of a model that is the same structure today,
    with other parameters, whose modes and pairing are then those of this one; found again where it
    is not, or where eigenvalues are repeated, for parameters say how those split.

    Raises
    ------
    ModelError, InputError
        As `modal_residual`.
    """
    if like is None or like.model.labels != model.labels or clusters(like.start.modes):
        return modal_residual(model, data.fit, data.hold, data.shapes)
    mine, theirs = (m.matrices(m.zero()) for m in (model, like.model))
    if any(
        abs(a - b).max() > SAME * abs(b).max() for a, b in ((mine.K, theirs.K), (mine.M, theirs.M))
    ):
        return modal_residual(model, data.fit, data.hold, data.shapes)
    return replace(like, model=model)


def fit_modes(
    model: Model,
    data: Tables,
    start: Real,
    far: bool = False,
    wide: bool = False,
    like: ModalResidual | None = None,
) -> ModalFit:
    """Weighted differences of eigenvalues and shapes plus Gaussian priors, minimised from
    ``start``; ``far``: modes are followed there from today's model; ``wide`` as in `prior_scales`,
    ``like`` as in `residual_of`.

    Raises
    ------
    ModelError, InputError
        A model that is no structure, modes that cannot be paired.
    """
    residual = residual_of(model, data, like)
    residual = _walked(residual, start) if far else residual
    scales = prior_scales(model, wide)
    bounds = Bounds(
        np.array([q.lower for q in model.parameters]), np.array([q.upper for q in model.parameters])
    )
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, scales),),
        constraints=(bounds,),
        columns=tuple(q.name for q in model.parameters),
    )
    point = iterate(residual, problem, SolverChoice(), Options(1e-4, 25, 0.3), start).point
    values, weights, _ = point.differences
    cost = float(np.sum((weights * values) ** 2) + np.sum((point.p / scales) ** 2))
    A, _ = point.system().weighted()
    grow = max(1.0, cost / max(1, len(values) - len(scales)))
    spread = np.sqrt(
        np.maximum(np.diag(np.linalg.pinv(A.T @ A + np.diag(1.0 / scales**2))), 0.0) * grow
    )
    return ModalFit(model, point, cost, len(values), spread)


def _walked(residual: ModalResidual, start: Real) -> ModalResidual:
    """Pairs modes at ``start``, where a fit begins far off, by following them there step by step:
    one large step may mistake them.

    On the way they are sought in the space of the modes at both ends (Ritz). Modes that veer change
    their shapes but not their order, so without measured shapes the order is the other way to pair
    them, and the better one counts.

    Raises
    ------
    ModelError
        A model that is no structure there.
    """
    point = residual.evaluate(start, _nearly(residual, residual.evaluate(start)))
    ways = [point] if residual.shapes else [point, replace(point, places=residual.start.places)]
    best = min(ways, key=lambda way: float(np.sum((way.differences[1] * way.differences[0]) ** 2)))
    return replace(residual, start=replace(residual.start, modes=best.modes, places=best.places))


def _nearly(residual: ModalResidual, end: ModalPoint) -> ModalPoint:
    """The last point before ``end`` on the way there from today's model, in `SIZES` steps, its
    modes in the space of those at both ends."""
    begin, count = residual.start, len(end.modes.eigenvalues)
    basis = _independent(np.hstack([begin.modes.shapes, end.modes.shapes]), end.matrices.M)
    fitted = _used(begin.places[: len(residual.fit)])
    scored = np.setdiff1d(
        _used(begin.places), fitted
    )  # a fitted mode that was measured again goes with it
    now = first = np.concatenate([fitted, scored])
    modes = Modes(
        begin.modes.eigenvalues, basis.T @ (end.matrices.M @ begin.modes.shapes), begin.modes.rigid
    )
    for size in np.geomspace(1e-4, 1.0, SIZES)[:-1]:
        m = residual.model.matrices(size * end.p)
        K, M = (basis.T @ (x @ basis) for x in (m.K, m.M))
        values, V = la.eigh((K + K.T) / 2.0, (M + M.T) / 2.0)
        held, mass = modes.shapes[:, now], sp.csc_array(M)
        modes = aligned(
            Modes(values[:count], V[:, :count], end.modes.rigid), replace(m, M=mass), held
        )
        taken = follow(held[:, : len(fitted)], mass, modes)
        now = np.concatenate([taken, follow(held[:, len(fitted) :], mass, modes, taken)])
    went = {-1: -1} | dict(zip(first.tolist(), now.tolist(), strict=True))
    places = tuple(np.array([went[i] for i in q.tolist()], dtype=np.int64) for q in begin.places)
    return replace(end, modes=replace(modes, shapes=basis @ modes.shapes), places=places)


def _used(places: Sequence[Index]) -> Index:
    every = np.unique(np.concatenate([np.zeros(0, dtype=np.int64), *places]))
    return every[every >= 0]


def _independent(shapes: Real, M: sp.csc_array) -> Real:
    """Columns (N, q) that span the same as ``shapes`` (N, n), orthonormal in M, those left out that
    rounding alone tells from the others."""
    shapes = shapes / np.sqrt(np.einsum("ij,ij->j", shapes, M @ shapes))
    values, vectors = la.eigh(shapes.T @ (M @ shapes))
    keep = values > APART * values[-1]
    return np.asarray(shapes @ (vectors[:, keep] / np.sqrt(values[keep])))


def errors_of(point: ModalPoint, fitted: bool) -> Real:
    """Relative errors of the frequencies of the fitted or the held-out modes."""
    residual = point.residual
    errors: list[float] = []
    for k, table in enumerate(residual.tables):
        if (k < len(residual.fit)) == fitted:
            f = point.frequencies(k)
            errors += ((f - table.frequency) / table.frequency)[np.isfinite(f)].tolist()
    return np.array(errors)


def error_of(point: ModalPoint, fitted: bool) -> float:
    """R.m.s. of `errors_of`; NaN where there are none."""
    errors = errors_of(point, fitted)
    return float(np.sqrt(np.mean(errors**2))) if len(errors) else float("nan")


def metrics_of(before: ModalPoint, after: ModalPoint, fitted: bool) -> dict[str, Any]:
    """The contract's metrics."""
    pairs = [100.0 * np.abs(errors_of(point, fitted)) for point in (before, after)]
    if not len(pairs[0]) or not len(pairs[1]):
        return {}
    return {
        f"frequency_error_percent_{name}": {
            "before": float(f(pairs[0])),
            "after": float(f(pairs[1])),
        }
        for name, f in (("mean", np.mean), ("max", np.max))
    }
