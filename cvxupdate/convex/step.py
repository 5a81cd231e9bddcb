"""The convex step: compiled once, solved again and again, each solution with its proof."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np

from ..errors import InputError
from ..system import Array, LinearSystem
from .bounded import Limits, active_names, limits_of, minimised, quadratic_of
from .certificate import NO_CERTIFICATE, Certificate, Farkas
from .conflict import Conflict, find_conflict
from .constraints.clauses import Clause, is_active
from .group_lasso import Form, form_of
from .matrix_form import ConeProgram, cone_program
from .polish import solve_certified
from .problem import Model, StepProblem, TrustRegion, compile_projection, compile_step
from .relaxation import Relaxation
from .solvers import SolverChoice, solver_named

# A step counts as optimal when our own certificate passes this; solvers are asked for far more.
ACCEPTED = 1e-6
DIRECT = "active set"  # where a solver's name would stand


@dataclass(frozen=True, eq=False)
class Step:
    """The outcome of one step.

    ``p`` (n,) absolute parameter values (NaN unless optimal or stopped with a point); ``status``
    "optimal" (the certificate passes 1e-6), "infeasible" (``conflict`` names the clauses,
    ``infeasibility`` proves it, ``relaxation`` says what would help) or "stopped" (``note`` says
    why); ``objective`` recomputed from p by numpy; ``active`` the clauses and trust-region sides
    that hold with equality at p; ``seconds`` of wall clock, all included.
    """

    p: Array
    status: str
    objective: float
    certificate: Certificate
    solver: str
    seconds: float
    conflict: tuple[str, ...] = ()
    relaxation: tuple[Relaxation, ...] = ()
    infeasibility: Farkas | None = None
    active: tuple[str, ...] = ()
    iterations: int = 0
    note: str = ""

    @property
    def says(self) -> str:
        """The outcome in words."""
        if self.status == "optimal":
            return (
                f"optimal: every optimality condition holds to {self.certificate.worst:.1e} "
                "(relative)"
            )
        if self.status == "stopped":
            return f"{self.solver} stopped before it reached the optimum: {self.note}"
        shown = self.conflict[:10]
        more = f"; and {len(self.conflict) - 10} more like these" if len(self.conflict) > 10 else ""
        text = "these clauses cannot hold together: " + "; ".join(shown) + more
        return text + "".join(f". {item.says}" for item in self.relaxation[:3])


@dataclass(frozen=True, eq=False)
class CompiledStep:
    """A step problem compiled for systems of up to ``rows`` rows (least squares: any number once
    rows ≥ n).

    cvxpy compiles on first use, once without and once with a trust region; after that only
    Parameters change. Least squares with Tikhonov terms or a group lasso and linear inequalities
    need no compiling: their program is written down (`quadratic_program`, `group_program`).
    """

    problem: StepProblem
    rows: int
    solver: SolverChoice = field(default_factory=SolverChoice)

    @cached_property
    def plain(self) -> Model:
        """The model without a trust region."""
        return compile_step(self.problem, self.rows, box=False)

    @cached_property
    def boxed(self) -> Model:
        """The model with a trust region."""
        return compile_step(self.problem, self.rows, box=True)

    @cached_property
    def _form(self) -> Form | None:
        return form_of(self.problem)

    @cached_property
    def _limits(self) -> Limits | None:
        return limits_of(self.problem) if self.solver.direct else None

    @cached_property
    def projection(self) -> Model:
        """The model of `nearest`."""
        return compile_projection(self.problem)

    def solve(
        self, system: LinearSystem, centre: Array | None = None, radius: Array | float | None = None
    ) -> Step:
        """Minimise the objective for this system, within |p − centre| ≤ radius where a radius is
        given.

        Parameters
        ----------
        system : the same columns as the problem's.
        centre : (n,), where the step begins, 0 if None.
        radius : (n,) or a number, elementwise, inf where free, None for no trust region.

        Raises
        ------
        InputError
            When system and problem do not fit, a weight is still a rule, or the solver cannot take
            a cone of the
            problem.
        """
        start = time.perf_counter()
        self.problem.check(system)
        A, b = system.weighted()
        step = self._direct(A, b, self.problem.weights, self._region(centre, radius))
        if step is not None:
            return replace(step, seconds=time.perf_counter() - start)
        R, d, _ = self.problem.loss.reduce(A, b)
        step = self.solve_reduced(R, d, self.problem.weights, centre, radius)
        objective = (
            self.problem.objective(system, step.p, present=centre)
            if np.all(np.isfinite(step.p))
            else np.nan
        )
        return replace(step, objective=objective, seconds=time.perf_counter() - start)

    def solve_reduced(
        self,
        R: Array,
        d: Array,
        weights: Sequence[float],
        centre: Array | None = None,
        radius: Array | float | None = None,
    ) -> Step:
        """`solve` from the loss's reduced data and given weights; the objective lacks the constant
        of the reduction."""
        n = len(self.problem.columns)
        region = self._region(centre, radius)
        box = None if region is None else TrustRegion(self.problem.columns, *region)
        if self._form is not None:
            step = run_program(
                *self._form(self.problem, R, d, tuple(weights), region, centre),
                n,
                self.problem.clauses,
                self.solver,
                box,
            )
        else:
            model = self.plain if region is None else self.boxed
            if region is not None:
                model.set_box(*region)
            model.set_data(R, d, weights, centre)
            step = run_model(model, self.problem.clauses, self.solver, box)
        penalty = self.problem.penalty(step.p, centre, weights)
        return replace(step, objective=self.problem.loss.value(R @ step.p - d) + penalty)

    def _region(
        self, centre: Array | None, radius: Array | float | None
    ) -> tuple[Array, Array] | None:
        """Centre and radius (n,) of the trust region; None where there is none."""
        if radius is None:
            return None
        n = len(self.problem.columns)
        middle = np.zeros(n) if centre is None else np.asarray(centre, dtype=float)
        size = np.array(np.broadcast_to(np.asarray(radius, dtype=float), (n,)))
        if middle.shape != (n,) or not np.all(np.isfinite(middle)) or not np.all(size >= 0):
            raise InputError(
                f"trust region: the centre must be {n} finite numbers and the radius 0 or more."
            )
        return middle, size

    def _direct(
        self, A: Array, b: Array, weights: Sequence[float], region: tuple[Array, Array] | None
    ) -> Step | None:
        """The step within bounds alone, without a solver; None where it is none, or where that
        proves nothing."""
        if self._limits is None:
            return None
        limits = self._limits if region is None else self._limits.within(*region)
        quadratic = quadratic_of(self.problem, A, b, weights)
        found = minimised(quadratic, limits)
        if found is None:
            return None
        p, proof, tries = found
        active = active_names(self.problem.clauses, self._limits, p)
        active += () if region is None else TrustRegion(self.problem.columns, *region).active(p)
        value = quadratic.value(p)
        return Step(p, "optimal", value, proof, DIRECT, 0.0, active=active, iterations=tries)

    def nearest(self, p: Array) -> Step:
        """The point of the constraint set nearest to p (n,); ``objective`` is the Euclidean
        distance squared."""
        model = self.projection
        model.d.value = np.asarray(p, dtype=float)
        step = run_model(model, self.problem.clauses, self.solver)
        return replace(step, objective=float(np.sum((step.p - p) ** 2)))


def run_model(
    model: Model, clauses: tuple[Clause, ...], choice: SolverChoice, box: TrustRegion | None = None
) -> Step:
    """`run_program` of a model at its present Parameters."""
    program, (at,) = cone_program(model.problem, model.p)
    return run_program(program, at, model.p.size, clauses, choice, box)


def run_program(
    program: ConeProgram,
    at: int,
    n: int,
    clauses: tuple[Clause, ...],
    choice: SolverChoice,
    box: TrustRegion | None = None,
) -> Step:
    """Solve a program whose n parameters begin at ``at``, certify the answer, and explain an
    infeasible one; ``clauses`` and ``box`` are what it was made of."""
    start = time.perf_counter()
    solver = solver_named(choice.name)
    refusal = solver.refusal(program)
    if refusal:
        raise InputError(f"solver: {refusal} of this step; choose CLARABEL or SCS.")
    raw, certificate = solve_certified(solver, program, choice)
    if raw.status == "refused":
        raise InputError(f"solver: {raw.note}; choose CLARABEL.")
    if certificate.is_optimal(max(ACCEPTED, 10 * choice.tolerance)):
        p = raw.x[at : at + n]
        active = tuple(clause.name for clause in clauses if is_active(clause, p))
        active += () if box is None else box.active(p)
        return Step(
            p,
            "optimal",
            np.nan,
            certificate,
            solver.name,
            time.perf_counter() - start,
            active=active,
            iterations=raw.iterations,
            note=raw.note,
        )
    conflict = find_conflict((*clauses, *(() if box is None else box.clauses)), n)
    if conflict is not None:
        return infeasible_step(conflict, n, solver.name, time.perf_counter() - start)
    found = (
        raw.x[at : at + n]
        if np.all(np.isfinite(raw.x)) and raw.status != "infeasible"
        else np.full(n, np.nan)
    )
    return Step(
        found,
        "stopped",
        np.nan,
        certificate,
        solver.name,
        time.perf_counter() - start,
        iterations=raw.iterations,
        note=f"{raw.note or raw.status} (largest residual {certificate.worst:.1e})",
    )


def infeasible_step(conflict: Conflict, n: int, solver: str, seconds: float) -> Step:
    """The step of clauses that cannot hold together."""
    return Step(
        np.full(n, np.nan),
        "infeasible",
        np.nan,
        NO_CERTIFICATE,
        solver,
        seconds,
        conflict.clauses,
        conflict.relaxation,
        conflict.proof,
    )
