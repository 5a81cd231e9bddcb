"""From the tables of a problem file to the parts of a convex step."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from cvxupdate.convex import (
    Constraint,
    Context,
    LinearClause,
    Regulariser,
    SolverChoice,
    StepProblem,
    loss_named,
)
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES
from cvxupdate.recordings.types import Recording
from cvxupdate.registry import CONSTRAINTS, REGULARISERS
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.context import ModelContext
from cvxupdate.update.trust_region import Options


def step_problem(spec: Spec, model: Model, recordings: Sequence[Recording]) -> StepProblem:
    """The step that [update], [constraints] and [regularisation] describe, over the parameters of
    ``model``. Of the ``recordings`` a clause may ask for a measured mode.

    Raises
    ------
    InputError
        When a table does not fit the parameters: a total mass that no parameter can change, an
        unknown name.
    """
    context = ModelContext(spec, model, recordings)
    named = spec.update.loss if spec.update is not None else "least-squares"
    return StepProblem(
        loss_named(named) if spec.own.loss is None else spec.own.loss,
        (*_regularisers(spec, context), *spec.own.regularisers),
        (*_constraints(spec, context), *spec.own.constraints),
        context.columns,
    )


def _constraints(spec: Spec, context: Context) -> Iterator[Constraint]:
    """What every registered constraint makes of every table of its keys, in the order of the
    keys and of the tables."""
    members = CONSTRAINTS.members()
    for name, key in {name: key for kind in members for name, key in kind.keys.items()}.items():
        given = getattr(spec.constraints, name)
        tables = given if key.many else () if given is None and not key.always else (given,)
        for table in tables:
            for kind in members:
                made = kind.from_spec(table, context) if name in kind.keys else None
                if made is not None:
                    yield made


def _regularisers(spec: Spec, context: Context) -> Iterator[Regulariser]:
    for table in spec.regularisation:
        if table.kind != "none":
            yield REGULARISERS.named(table.kind).from_spec(table, context)


def solver_choice(spec: Spec) -> SolverChoice:
    """The [solver] table; what it leaves out takes the package's default."""
    tolerance = SolverChoice.tolerance if spec.solver.tolerance is None else spec.solver.tolerance
    return SolverChoice(spec.solver.name, tolerance, spec.solver.max_iterations)


def loop_options(spec: Spec, model: Model) -> Options:
    """Tolerance, iterations, first trust region and form of the iteration, of [update] and
    [constraints].

    In the multiplicative form every parameter of ``model`` that is a factor counts: those whose
    property is 0 today are no factors. In the bounded form the trust region is in widths of the
    bounds.
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
        _widths(model) if spec.update.form == "bounded" else (),
        shortest=spec.update.solution == "minimum-norm",
    )


def _widths(model: Model) -> tuple[float, ...]:
    """The distance between the bounds of each parameter, 1 where it has none."""
    width = np.array([q.upper - q.lower for q in model.parameters])
    return tuple(np.where(np.isfinite(width) & (width > 0.0), width, 1.0).tolist())


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
