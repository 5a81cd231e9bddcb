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
SWEEPS = 12
SETTLED = 1e-3
"""Change of p over a sweep below which other instruments change nothing (as in
`update.rfm_loop`)."""


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


@dataclass(frozen=True)
class Known:
    """What a line said at its last turn: ZᵀZ (n, n) of its instruments, and its equations N p = g
    against them."""

    S: Array
    N: Array
    g: Array


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
    equations so far.

    The first lines meet an estimate that knows next to nothing, and instruments taken there may be
    of no use. So the lines pass again, each with new instruments in place of its last, until a
    sweep moves p no more: then all instruments belong to one estimate, as those of the batch form
    do. The equations of the last turns go into the trust-region loop, without the deviation that
    the filter began with.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model.
    """
    start = model.zero() if p0 is None else p0
    whole = FrfResidual(model, tuple(data), "instrumental", start).evaluate(start)
    problem, weight = with_chosen_weight(problem, whole.system(), choice)
    swept = sweeps(model, data, problem, choice, options, start)
    residual = Filtered(model, swept.lines)
    loop = iterate(residual, problem, choice, options, swept.p, progress)
    status, reason = loop.status, loop.reason
    if status == "converged" and swept.settled:
        reason = (
            f"the filter took in {len(swept.lines)} lines, {swept.count} times, and they moved it "
            "no more"
        )
    elif status == "converged":
        status, reason = "stopped", f"the lines still moved the filter after {SWEEPS} sweeps"
    return replace(
        loop, start=residual.evaluate(start), status=status, reason=reason, weight=weight
    )


@dataclass(frozen=True)
class Swept:
    """The estimate ``p`` (n,) after ``count`` sweeps, every line as it had its last turn, and
    whether the last sweep moved p no more."""

    p: Array
    lines: tuple[Line, ...]
    count: int
    settled: bool


def sweeps(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    start: Array,
) -> Swept:
    """The lines one after the other, again and again: see `fit_filtered`."""
    compiled = CompiledStep(problem, 2 * len(start), choice)
    lines: list[Line] = []
    known: list[Known] = []
    p = start
    for sweep in range(SWEEPS):
        begun = p
        for k, one in enumerate(single_lines(data)):
            line = turn(model, one, p)
            v, A = line.equations(p)
            said = Known(line.instruments.T @ line.instruments, A, A @ p - v)
            lines[k : k + 1], known[k : k + 1] = [line], [said]
            system = equations_of(known, None if sweep else start, problem.columns)
            step = compiled.solve(system, centre=p, radius=options.radius * options.unit(p))
            if step.status != "optimal":  # the loop says why
                return Swept(p, tuple(lines), sweep, False)
            p = step.p
        if sweep and float(np.max(np.abs(p - begun), initial=0.0)) <= SETTLED:
            return Swept(p, tuple(lines), sweep + 1, True)
    return Swept(p, tuple(lines), SWEEPS, False)


def equations_of(
    known: Sequence[Known], start: Array | None, columns: tuple[str, ...]
) -> LinearSystem:
    """The equations of all turns, whitened; about ``start`` (n,) with `BEFORE` where some lines
    have not had theirs."""
    n = len(columns)
    S, N = (np.sum([getattr(one, name) for one in known], axis=0) for name in ("S", "N"))
    g = np.sum([one.g for one in known], axis=0)
    R = whitening(S)
    rows, b = R @ N, R @ g
    if start is not None:
        rows, b = np.vstack([rows, np.eye(n) / BEFORE]), np.concatenate([b, start / BEFORE])
    labels = tuple(f"equation {i + 1}" for i in range(len(b)))
    return LinearSystem(rows, b, np.ones(len(b)), columns, labels)


def turn(model: Model, one: FrfData, p: Array) -> Line:
    """A line with the weights and instruments that belong to the estimate ``p``."""
    balance = FrfResidual(model, (one,), "flexibility", p)
    J = FrfResidual(model, (one,), "receptance").evaluate(p).jacobian
    return Line(balance, balance.weights[:, None] * J)


def single_lines(data: Sequence[FrfData]) -> list[FrfData]:
    """Every line of every recording by itself, from low to high."""
    every = [d.at(np.array([k])) for d in data for k in range(len(d.frequency))]
    return sorted(every, key=lambda d: float(d.frequency[0]))
