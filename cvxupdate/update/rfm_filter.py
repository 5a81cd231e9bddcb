"""Mottershead's recursive filter in the frequency domain, with instrumental variables (2.8.4)."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.linalg as la

from cvxupdate.convex import CompiledStep, SolverChoice, StepProblem, with_chosen_weight
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import INDEPENDENT, FrfPoint, FrfResidual
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate

BEFORE = 1.0
"""Deviation of every p before the first line. The filter needs one, because a few lines do not
determine p; its end does not rest on it."""


@dataclass(frozen=True)
class Line:
    """One line with the weights and the instruments (rows, n) of the estimate before it."""

    balance: FrfResidual
    instruments: Real

    def equations(self, p: Real) -> tuple[Real, Real]:
        """Zᵀ W v (n,) and Zᵀ W ∂v (n, n) at ``p``."""
        point, w = self.balance.evaluate(p), self.balance.weights
        Z = self.instruments
        return Z.T @ (w * point.values), Z.T @ (w[:, None] * point.jacobian)


@dataclass(frozen=True)
class Filtered:
    """The equations Σ Zᵀ W (A p − b) = 0 of all lines, each with the instruments of its own turn,
    combined to rows of unit deviation."""

    model: Model
    lines: tuple[Line, ...]

    @cached_property
    def _whiten(self) -> Real:
        """R (r, n) with R (Σ ZᵀZ) Rᵀ = 1."""
        each = [line.instruments.T @ line.instruments for line in self.lines]
        return whitening(np.sum(each, axis=0))

    @property
    def weights(self) -> Real:
        """One for every row."""
        return np.ones(len(self._whiten))

    @property
    def labels(self) -> tuple[str, ...]:
        """What each row is."""
        return tuple(f"instrument {i + 1}" for i in range(len(self._whiten)))

    def evaluate(self, p: Real, before: FrfPoint | None = None) -> FrfPoint:
        """The rows at ``p`` (n,)."""
        found = [line.equations(p) for line in self.lines]
        v, A = (sum(part) for part in zip(*found, strict=True))
        return FrfPoint(self, np.asarray(p, dtype=float), self._whiten @ v, self._whiten @ A)


def whitening(S: Array) -> Array:
    """R (r, n) with R S Rᵀ = 1 on the range of the symmetric S (n, n)."""
    size = np.sqrt(np.maximum(np.diag(S), 0.0))
    size = np.where(size > 0.0, size, 1.0)  # unlike units would cost digits
    values, U = la.eigh(S / np.outer(size, size))
    on = values > INDEPENDENT * values.max(initial=0.0)
    return np.asarray((U[:, on] / np.sqrt(values[on])).T / size)


def fit_filtered(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array | None = None,
    progress: Callable[[Iteration], None] | None = None,
) -> LoopResult[FrfPoint]:
    """Equation error (2.110, 2.113) by Mottershead's filter (1988): one line after the other, from
    low to high, corrects the estimate of those before.

    The balance of a line is weighed by the model's flexibility, and asked for against instruments
    that belong to the estimate *before* that line, the derivatives of the model's own responses:
    the line's noise cannot be correlated with them, so nothing is biased, where his first filter
    (Mottershead and Lees 1987), recursive least squares, is. Each estimate is a convex step on the
    equations so far. Once all lines are in, their equations go into the trust-region loop, without
    the deviation that the filter began with.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model.
    """
    start = p = model.zero() if p0 is None else p0
    n = len(start)
    S, N, g = np.zeros((n, n)), np.zeros((n, n)), np.zeros(n)
    lines: list[Line] = []
    columns = tuple(q.name for q in model.parameters)
    compiled: CompiledStep | None = None
    for one in single_lines(data):
        line = turn(model, one, p)
        v, A = line.equations(p)
        lines.append(line)
        S, N, g = S + line.instruments.T @ line.instruments, N + A, g + (A @ p - v)
        R = whitening(S)
        rows = np.vstack([R @ N, np.eye(n) / BEFORE])
        b = np.concatenate([R @ g, start / BEFORE])
        labels = tuple(f"equation {i + 1}" for i in range(len(b)))
        system = LinearSystem(rows, b, np.ones(len(b)), columns, labels)
        if compiled is None:
            problem, _ = with_chosen_weight(problem, system, choice)
            compiled = CompiledStep(problem, 2 * n, choice)
        step = compiled.solve(system, centre=p, radius=options.radius * options.unit(p))
        if step.status != "optimal":
            break
        p = step.p
    residual = Filtered(model, tuple(lines))
    loop = iterate(residual, problem, choice, options, p, progress)
    reason = f"the filter has taken in {len(lines)} lines, and its equations hold"
    return replace(
        loop,
        start=residual.evaluate(start),
        reason=reason if loop.status == "converged" else loop.reason,
    )


def turn(model: Model, one: FrfData, p: Array) -> Line:
    """A line with the weights and instruments that belong to the estimate ``p``."""
    balance = FrfResidual(model, (one,), "flexibility", p)
    J = FrfResidual(model, (one,), "receptance").evaluate(p).jacobian
    return Line(balance, balance.weights[:, None] * J)


def single_lines(data: Sequence[FrfData]) -> list[FrfData]:
    """Every line of every recording by itself, from low to high."""
    every = [d.at(np.array([k])) for d in data for k in range(len(d.frequency))]
    return sorted(every, key=lambda d: float(d.frequency[0]))
