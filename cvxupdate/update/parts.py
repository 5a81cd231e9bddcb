"""From the tables of a problem file to the parts of a convex step."""

from __future__ import annotations

import numpy as np

from cvxupdate.convex import (
    L1,
    Bounds,
    Entropy,
    GroupL1,
    LinearClause,
    LinearEquality,
    LinearInequality,
    Robust,
    SolverChoice,
    StepProblem,
    Tied,
    Tikhonov,
    TotalMass,
    TotalVariation,
    loss_named,
)
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.clauses import physical_constraints
from cvxupdate.update.trust_region import Options


def step_problem(spec: Spec, model: Model) -> StepProblem:
    """The step that [update], [constraints] and [regularisation] describe, over the parameters of
    ``model``.

    Raises
    ------
    InputError
        When a table does not fit the parameters: a total mass that no parameter can change, an
        unknown name.
    """
    columns = tuple(q.name for q in model.parameters)
    lower, upper = (
        np.array([q.lower for q in model.parameters]),
        np.array([q.upper for q in model.parameters]),
    )
    c = spec.constraints
    constraints: list[object] = [Bounds(lower, upper)]
    if c.tied:
        constraints.append(Tied(tuple(t.parameters for t in c.tied)))
    for row in c.linear:
        if row.equals is not None:
            constraints.append(LinearEquality(row.coefficients, row.equals))
        else:
            constraints.append(
                LinearInequality(
                    row.coefficients,
                    -np.inf if row.at_least is None else row.at_least,
                    np.inf if row.at_most is None else row.at_most,
                )
            )
    if c.total_mass is not None:
        constraints.append(_total_mass(model, c.total_mass.value))
    constraints += physical_constraints(spec, model)
    regularisers: list[object] = []
    for r in spec.regularisation:
        if r.kind == "tikhonov":
            regularisers.append(Tikhonov(r.weight))
        elif r.kind == "l1":
            regularisers.append(L1(r.weight))
        elif r.kind == "group-l1":
            regularisers.append(GroupL1(r.weight, r.groups))
        elif r.kind == "total-variation":
            regularisers.append(TotalVariation(r.weight, neighbours(model)))
        elif r.kind == "entropy":
            regularisers.append(Entropy(r.weight))
        elif r.kind == "robust":
            regularisers.append(Robust(r.weight))
    loss = loss_named(spec.update.loss if spec.update is not None else "least-squares")
    return StepProblem(loss, tuple(regularisers), tuple(constraints), columns)  # type: ignore[arg-type]


def neighbours(model: Model) -> tuple[tuple[str, str], ...]:
    """Pairs of parameters of the same property whose elements share a node."""
    places: dict[str, list[tuple[str, frozenset[int]]]] = {}
    for q in model.parameters:
        dofs = np.concatenate([model.blocks[t.block].dofs[t.rows].reshape(-1) for t in q.targets])
        places.setdefault(q.of, []).append(
            (q.name, frozenset(model.dof_node[dofs[dofs >= 0]].tolist()))
        )
    out = []
    for members in places.values():
        at: dict[int, list[int]] = {}
        for i, (_, nodes) in enumerate(members):
            for node in nodes:
                at.setdefault(node, []).append(i)
        pairs = {
            (i, j)
            for touching in at.values()
            for a, i in enumerate(touching)
            for j in touching[a + 1 :]
        }
        out += [(members[i][0], members[j][0]) for i, j in sorted(pairs)]
    return tuple(out)


def _total_mass(model: Model, value: float | None) -> TotalMass:
    gradient = model.mass_gradient(model.zero())
    if not np.any(gradient != 0.0):
        raise InputError(
            "constraints.total_mass: no parameter changes the mass. Free a mass parameter "
            "(rho, mass, m, thickness, A), or drop the clause."
        )
    probe = np.full(len(gradient), 0.01)
    bend = model.mass_gradient(probe) - gradient
    if np.any(np.abs(bend) > 1e-9 * np.abs(gradient).max()):
        raise InputError(
            "constraints.total_mass: the mass is not linear in the parameters (a section's "
            "rho and a dimension are free together). Free one of them, so that the clause "
            "stays convex."
        )
    return TotalMass(gradient, model.total_mass(model.zero()), value)


def solver_choice(spec: Spec) -> SolverChoice:
    """The [solver] table; what it leaves out takes the package's default."""
    tolerance = SolverChoice.tolerance if spec.solver.tolerance is None else spec.solver.tolerance
    return SolverChoice(spec.solver.name, tolerance, spec.solver.max_iterations)


def loop_options(spec: Spec, model: Model) -> Options:
    """Tolerance, iterations, first trust region and form of the iteration, of [update] and
    [constraints].

    In the multiplicative form every parameter of ``model`` that is a factor counts: those whose
    property is 0 today are no factors.
    """
    if spec.update is None:
        return Options()
    region = spec.constraints.trust_region
    radius = spec.update.trust_radius or (region.radius if region is not None else Options.radius)
    factors = (
        tuple(q.of in P_VALUES or q.nominal != 0.0 for q in model.parameters)
        if spec.update.form == "multiplicative"
        else ()
    )
    return Options(
        spec.update.tolerance,
        spec.update.max_iterations,
        radius,
        factors,
        spec.update.line_search,
        spec.update.second_order,
    )


def equality_rows(problem: StepProblem, p: Array) -> Array:
    """Rows (k, n) of the clauses that hold as equalities whatever the data: tied parameters, linear
    equalities, total mass."""
    n, rows = len(p), []
    for clause in problem.clauses:
        if isinstance(clause, LinearClause) and np.all(clause.lower == clause.upper):
            full = np.zeros((len(clause.lower), n))
            full[:, list(clause.on)] = clause.C
            rows.append(full)
    return np.vstack(rows) if rows else np.zeros((0, n))
