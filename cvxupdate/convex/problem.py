"""What a step shall minimise, and its cvxpy model: compiled once, with Parameters for all that
changes in a loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from ..errors import InputError
from ..system import Array, LinearSystem
from .constraints.clauses import (
    ACTIVE,
    Clause,
    ConicClause,
    Constraint,
    LinearClause,
    LinearRows,
    stack,
)
from .losses import LeastSquares, Loss
from .regularisers.common import Regulariser
from .regularisers.prior import Prior


@dataclass(frozen=True, eq=False)
class StepProblem:
    """minimise loss(W (A p − b)) + Σ weight · regulariser(p) subject to the constraints' clauses.

    ``columns`` are the n parameter names, in the order of p.
    """

    loss: Loss = field(default_factory=LeastSquares)
    regularisers: tuple[Regulariser, ...] = ()
    constraints: tuple[Constraint, ...] = ()
    columns: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        if not self.columns or len(set(self.columns)) != len(self.columns):
            raise InputError(
                "the step has no parameters, or two of the same name; give every parameter "
                "its own name."
            )

    @cached_property
    def clauses(self) -> tuple[Clause, ...]:
        """Every named clause of every constraint."""
        return tuple(
            clause for constraint in self.constraints for clause in constraint.clauses(self.columns)
        )

    @cached_property
    def rows(self) -> LinearRows:
        """The rows of the linear clauses."""
        return linear_rows(self.clauses, len(self.columns))

    @property
    def weights(self) -> tuple[float, ...]:
        """The regularisers' weights as numbers; InputError when one is still a rule."""
        found = []
        for regulariser in self.regularisers:
            if isinstance(regulariser.weight, str):
                raise InputError(
                    f"{regulariser.name}: the weight is still the rule {regulariser.weight!r}; "
                    "choose_weight or with_chosen_weight turns it into a number first."
                )
            found.append(float(regulariser.weight))
        return tuple(found)

    def check(self, system: LinearSystem) -> None:
        """Raise InputError unless the system's columns are this problem's."""
        if system.columns != self.columns:
            raise InputError(
                f"the step was set up for {len(self.columns)} parameters "
                f"({', '.join(self.columns[:4])} …), but the system has {len(system.columns)} "
                f"({', '.join(system.columns[:4])} …); they must be the same, in order."
            )

    def penalty(
        self, p: Array, present: Array | None = None, weights: Sequence[float] | None = None
    ) -> float:
        """The weighted penalties at p (n,) of a step that begins at ``present`` (None: at 0)."""
        chosen = self.weights if weights is None else weights
        begin = 0.0 if present is None else present
        return float(
            sum(
                w * reg.value(p - begin if of_move(reg) else p, self.columns)
                for w, reg in zip(chosen, self.regularisers, strict=True)
            )
        )

    def objective(
        self,
        system: LinearSystem,
        p: Array,
        weights: Sequence[float] | None = None,
        present: Array | None = None,
    ) -> float:
        """The objective at p (n,) of a step that begins at ``present`` (None: at 0), by numpy."""
        return self.loss.value(system.residual(p)) + self.penalty(p, present, weights)


def of_move(regulariser: Regulariser) -> bool:
    """Whether a penalty is of the move from where the step begins, not of p itself."""
    return isinstance(regulariser, Prior) and regulariser.of_move


# Distances of the projection are counted in thousandths, so that a gap of 1e-9 still means 1e-7 in
# p.
FINE = 1e3


@dataclass(frozen=True, eq=False)
class TrustRegion:
    """|p − centre| ≤ radius, both (n,), for parameters of these names; free where the radius is
    infinite."""

    columns: tuple[str, ...]
    centre: Array
    radius: Array

    @property
    def clauses(self) -> tuple[LinearClause, ...]:
        """A clause for each parameter with a finite radius."""
        one = np.ones((1, 1))
        return tuple(
            LinearClause(self._name(i), (i,), one, np.array([c - r]), np.array([c + r]))
            for i, (c, r) in enumerate(zip(self.centre, self.radius, strict=True))
            if np.isfinite(r)
        )

    def active(self, p: Array) -> tuple[str, ...]:
        """Names of the clauses that are active at p (n,), as `is_active` says of each: a loop asks
        at every step, and writes a thousand clauses down for one that is."""
        radius = np.where(np.isfinite(self.radius), self.radius, 0.0)
        near = np.zeros(len(p), dtype=bool)
        for limit in (self.centre - radius, self.centre + radius):
            near |= np.abs(p - limit) <= ACTIVE * np.maximum(1e-3, np.abs(limit))
        on = np.flatnonzero(near & np.isfinite(self.radius))
        return tuple(self._name(i) for i in on.tolist())

    def _name(self, i: int) -> str:
        return f"trust region on {self.columns[i]}: within {self.radius[i]:g} of {self.centre[i]:g}"


@dataclass(frozen=True, eq=False)
class Model:
    """A cvxpy problem with its variable and its Parameters (None where it has none)."""

    problem: Any
    p: Any
    R: Any = None
    d: Any = None
    weights: tuple[Any, ...] = ()
    on: Any = None
    low: Any = None
    high: Any = None
    present: Any = None

    def set_data(
        self, R: Array, d: Array, weights: Sequence[float], present: Array | None = None
    ) -> None:
        """Put in the reduced data, padded with zero rows to the compiled size, and where the step
        begins (None: at 0)."""
        rows, n = self.R.shape
        if R.shape[0] > rows:
            raise InputError(
                f"the step was compiled for {rows} rows of data, but the system has {R.shape[0]}; "
                "compile it with the larger number."
            )
        full_R, full_d = np.zeros((rows, n)), np.zeros(rows)
        full_R[: R.shape[0]], full_d[: R.shape[0]] = R, d
        self.R.value, self.d.value = full_R, full_d
        for parameter, weight in zip(self.weights, weights, strict=True):
            parameter.value = weight
        self.present.value = np.zeros(n) if present is None else present

    def set_box(self, centre: Array, radius: Array) -> None:
        """Put in the trust region; an infinite radius switches its row off (0 ≤ 1)."""
        finite = np.isfinite(radius)
        self.on.value = finite.astype(float)
        self.low.value = np.where(finite, centre - np.where(finite, radius, 0.0), -1.0)
        self.high.value = np.where(finite, centre + np.where(finite, radius, 0.0), 1.0)


def constraint_list(p: Any, clauses: Sequence[Clause], rows: LinearRows) -> list[Any]:
    """The clauses as cvxpy constraints: all equalities, all inequalities, then the conic ones."""
    equal = rows.equal
    below = np.isfinite(rows.upper) & ~equal
    above = np.isfinite(rows.lower) & ~equal
    made = []
    if np.any(equal):
        made.append(rows.C[equal] @ p == rows.upper[equal])
    if np.any(below):
        made.append(rows.C[below] @ p <= rows.upper[below])
    if np.any(above):
        made.append(rows.C[above] @ p >= rows.lower[above])
    for clause in clauses:
        if isinstance(clause, ConicClause):
            made.extend(clause.constraints(p, 0.0))
    return made


def linear_rows(clauses: Sequence[Clause], n: int) -> LinearRows:
    """The rows of the linear ones among the clauses."""
    return stack([clause for clause in clauses if isinstance(clause, LinearClause)], n)


def compile_step(problem: StepProblem, rows: int, box: bool) -> Model:
    """The cvxpy model of a step for systems of up to ``rows`` rows, with or without a trust
    region."""
    import cvxpy as cp

    n = len(problem.columns)
    p = cp.Variable(n, name="p")
    size = problem.loss.data_rows(rows, n)
    R, d = cp.Parameter((size, n), name="R"), cp.Parameter(size, name="d")
    weights = tuple(
        cp.Parameter(nonneg=True, name=f"weight {k}") for k in range(len(problem.regularisers))
    )
    present = cp.Parameter(n, name="present", value=np.zeros(n))
    objective = problem.loss.expression(R @ p - d)
    for weight, regulariser in zip(weights, problem.regularisers, strict=True):
        if of_move(regulariser):  # one Parameter may not multiply another: its weight is a number
            move = regulariser.expression(p - present, problem.columns)
            objective = objective + float(regulariser.weight) * move
        else:
            objective = objective + weight * regulariser.expression(p, problem.columns)
    constraints = constraint_list(p, problem.clauses, linear_rows(problem.clauses, n))
    if not box:
        problem_ = cp.Problem(cp.Minimize(objective), constraints)
        return Model(problem_, p, R, d, weights, present=present)
    on, low, high = (
        cp.Parameter(n, nonneg=True, name="on"),
        cp.Parameter(n, name="low"),
        cp.Parameter(n, name="high"),
    )
    region = cp.multiply(on, p)
    return Model(
        cp.Problem(cp.Minimize(objective), [*constraints, region <= high, region >= low]),
        p,
        R,
        d,
        weights,
        on,
        low,
        high,
        present,
    )


def compile_projection(problem: StepProblem) -> Model:
    """The cvxpy model of min ‖p − d‖² subject to the clauses, ``d`` a Parameter."""
    import cvxpy as cp

    n = len(problem.columns)
    p, d = cp.Variable(n, name="p"), cp.Parameter(n, name="d")
    constraints = constraint_list(p, problem.clauses, linear_rows(problem.clauses, n))
    return Model(cp.Problem(cp.Minimize(cp.sum_squares(FINE * (p - d))), constraints), p, None, d)
