"""The program that is written down is the one that cvxpy compiles: entry by entry, and in the
normal form of docs/convex-step.md, for every member of the registries that it serves."""

from __future__ import annotations

from collections.abc import Sequence

import cvxpy as cp
import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate import convex as cv
from cvxupdate.convex.cones import matrix_of
from cvxupdate.convex.constraints.clauses import ConicClause, LinearClause
from cvxupdate.convex.group_lasso import Form, group_program, grouped
from cvxupdate.convex.matrix_form import ConeProgram, Cones, cone_program
from cvxupdate.convex.problem import Model, compile_step, of_move
from cvxupdate.convex.quadratic import quadratic_program, written
from cvxupdate.system import Array

from ..cases import convex_cases as cases
from ..cases.convex_cases import CASE_COLUMNS, COLUMNS, FORMS

N = len(COLUMNS)
LOSSES = tuple(cases.LOSSES.values())
REGULARISERS = (
    *(term for terms in cases.REGULARISERS.values() for term in terms),
    *(form for form in FORMS if type(form) in cv.REGULARISERS),
)
NAMED = {name: case for name, case in cases.CONSTRAINTS.items() if name != "several"}
ELSEWHERE = {id(c): CASE_COLUMNS[name] for name in CASE_COLUMNS for c in NAMED[name]}
CONSTRAINTS = (
    *(constraint for case in NAMED.values() for constraint in case),
    *(form for form in FORMS if type(form) in cv.CONSTRAINTS),
)

Box = tuple[Array, Array]
BOXES: dict[str, Box | None] = {
    "no trust region": None,
    "trust region": (np.array([0.4, -0.2, 0.1, 0.0, 1.3, 0.1]), np.full(N, 0.3)),
    "trust region on some": (
        np.array([0.4, -0.2, 0.1, 0.0, 1.3, 0.1]),
        np.array([0.3, np.inf, 0.2, 1.0, np.inf, 0.5]),
    ),
}


def begin(box: Box | None) -> Array | None:
    """Where a step begins: the middle of its trust region."""
    return None if box is None else box[0]


def title(member: object) -> str:
    return type(member).__name__


def step_problem(
    regularisers: Sequence[cv.Regulariser] = (),
    constraints: Sequence[cv.Constraint] = (),
    loss: cv.Loss | None = None,
) -> cv.StepProblem:
    (columns,) = {ELSEWHERE.get(id(c), COLUMNS) for c in constraints} or {COLUMNS}
    return cv.StepProblem(
        loss or cv.LeastSquares(), tuple(regularisers), tuple(constraints), columns
    )


def weighed(terms: Sequence[cv.Regulariser], second: float = 1.9) -> list[float]:
    """A weight for each term: any number, but its own for a penalty of the move."""
    numbers = (0.7, second, 0.4, 1.1)
    return [float(r.weight) if of_move(r) else numbers[k % 4] for k, r in enumerate(terms)]


def reduced_data(rows: int = N) -> tuple[Array, Array]:
    rng = np.random.default_rng(3)
    return rng.normal(size=(rows, N)), rng.normal(size=rows)


def compiled(
    problem: cv.StepProblem, weights: Sequence[float], box: Box | None, rows: int = N
) -> Model:
    """cvxpy's model for N rows, with data of ``rows`` in it."""
    model = compile_step(problem, N, box is not None)
    if box is not None:
        model.set_box(*box)
    model.set_data(*reduced_data(rows), weights, begin(box))
    return model


# --- what is served, from the registries -----------------------------------------------------

SERVED_TERMS = [r for r in REGULARISERS if written(step_problem([r]))]
SERVED_CONSTRAINTS = [c for c in CONSTRAINTS if written(step_problem(constraints=[c]))]
LINEAR = [
    c
    for c in SERVED_CONSTRAINTS
    if all(isinstance(x, LinearClause) for x in step_problem(constraints=[c]).clauses)
]
TERMS = [(), *((r,) for r in SERVED_TERMS), tuple(SERVED_TERMS)]
TOGETHER = tuple(c for c in SERVED_CONSTRAINTS if id(c) not in ELSEWHERE)
CLAUSES = [(), *((c,) for c in SERVED_CONSTRAINTS), TOGETHER]
TOGETHER_LINEAR = tuple(c for c in LINEAR if id(c) not in ELSEWHERE)
LINEAR_CLAUSES = [(), *((c,) for c in LINEAR), TOGETHER_LINEAR]
# each by itself, with nothing and with all of the other kind
PAIRS = [
    (terms, clauses)
    for terms in TERMS
    for clauses in CLAUSES
    if terms in ((), TERMS[-1]) or clauses in ((), TOGETHER)
]


@pytest.mark.parametrize(
    ("registry", "instances"),
    [(cv.LOSSES, LOSSES), (cv.REGULARISERS, REGULARISERS), (cv.CONSTRAINTS, CONSTRAINTS)],
    ids=["losses", "regularisers", "constraints"],
)
def test_every_member_has_an_instance(
    registry: Sequence[type], instances: Sequence[object]
) -> None:
    """Whether a member is served is asked of its instances, so each needs one."""
    assert {type(x) for x in instances} == set(registry)


@pytest.mark.parametrize(
    "problem",
    [
        *(step_problem(loss=loss) for loss in LOSSES),
        *(step_problem([r]) for r in REGULARISERS),
        *(step_problem(constraints=[c]) for c in CONSTRAINTS),
    ],
    ids=[title(x) for x in (*LOSSES, *REGULARISERS, *CONSTRAINTS)],
)
def test_what_is_served_is_what_cvxpy_makes_a_plain_least_squares_program_of(
    problem: cv.StepProblem,
) -> None:
    """Served exactly where cvxpy's form has no linear cost, no cone beyond inequalities and
    semidefinite matrices, and no auxiliary variable but those that an equality each defines."""
    model = compiled(problem, problem.weights, None)
    program, (at,) = cone_program(model.problem, model.p)
    plain = (
        program.cones.beyond_qp <= {"psd"}
        and not np.any(program.q)
        and defining_rows(program, at).size == program.q.size - N
    )
    assert written(problem) == plain


def defining_rows(program: ConeProgram, at: int) -> Array:
    """Equalities with one auxiliary variable that stands nowhere else, one for each of those."""
    A = program.A.toarray() != 0.0
    y = np.setdiff1d(np.arange(program.q.size), np.arange(at, at + N))
    alone = y[A[:, y].sum(axis=0) == 1]
    rows = np.unique(np.argmax(A[:, alone], axis=0)) if alone.size else np.zeros(0, dtype=int)
    rows = rows[rows < program.cones.zero]
    return np.asarray(rows[A[np.ix_(rows, y)].sum(axis=1) == 1])


# --- the same program -------------------------------------------------------------------------


@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize(
    ("terms", "clauses"), PAIRS, ids=lambda c: "+".join(map(title, c)) or "nothing"
)
def test_it_is_cvxpy_s_program(
    terms: tuple[cv.Regulariser, ...], clauses: tuple[cv.Constraint, ...], box: str
) -> None:
    """The same variables, rows, cones and entries, in the same order."""
    check_same(step_problem(terms, clauses), weighed(terms), BOXES[box])


def test_a_term_of_weight_zero_keeps_its_place() -> None:
    weights = weighed(SERVED_TERMS, 0.0)
    assert 0.0 in weights
    check_same(step_problem(SERVED_TERMS), weights, BOXES["trust region"])


@pytest.mark.parametrize("seed", range(5))
def test_whatever_the_linear_inequalities(seed: int) -> None:
    """Clauses of no class: any rows, on any parameters, with either side open."""
    rng = np.random.default_rng(seed)

    class Rows:
        def clauses(self, columns: tuple[str, ...]) -> tuple[cv.Clause, ...]:
            made = []
            for k in range(4):
                on = tuple(map(int, rng.permutation(N)[: rng.integers(1, N + 1)]))
                C = rng.normal(size=(int(rng.integers(1, 4)), len(on)))
                C[rng.random(C.shape) < 0.3] = 0.0
                middle, half = rng.normal(size=len(C)), rng.uniform(0.1, 1.0, size=len(C))
                low, high = middle - half, middle + half
                low[rng.random(len(C)) < 0.4] = -np.inf
                high[rng.random(len(C)) < 0.4] = np.inf
                made.append(LinearClause(f"rows {k}", on, C, low, high))
            return tuple(made)

    check_same(step_problem(SERVED_TERMS[:1], [Rows()]), [1.3], BOXES["trust region on some"])


def check_same(
    problem: cv.StepProblem,
    weights: Sequence[float],
    box: Box | None,
    form: Form = quadratic_program,
) -> None:
    model = compiled(problem, weights, box)
    wanted, (at,) = cone_program(model.problem, model.p)
    R, d = reduced_data()
    found, begins = form(problem, R, d, tuple(weights), box, begin(box))
    assert (begins, found.cones, found.constant) == (at, wanted.cones, wanted.constant)
    for mine, theirs in ((found.P, wanted.P), (found.A, wanted.A)):
        np.testing.assert_array_equal(mine.toarray(), theirs.toarray())
        assert mine.nnz == theirs.nnz
    np.testing.assert_array_equal(found.q, wanted.q)
    np.testing.assert_allclose(found.b, wanted.b, rtol=1e-15, atol=1e-15)


@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("bounded", [False, True])
def test_a_group_lasso_is_cvxpy_s_program(bounded: bool, box: str) -> None:
    """Groups of one, of several and none; a wish and a scale of each parameter's own."""
    wish, scale = np.linspace(-0.2, 0.3, N), np.linspace(1.0, 3.0, N)
    groups = ((COLUMNS[0],), COLUMNS[2:4], (COLUMNS[1],), COLUMNS[4:])
    lower = np.array([0.0, *np.full(N - 2, -np.inf), -1.0])
    limits = [cv.Bounds(lower, np.where(lower < 0.0, 0.7, np.inf))] if bounded else []
    for term in (cv.GroupL1(0.6, groups, wish, scale), cv.GroupL1(0.6, groups[:2])):
        problem = step_problem([term], limits)
        assert grouped(problem) and not written(problem)
        check_same(problem, [0.6], BOXES[box], group_program)


def test_a_semidefinite_block_is_the_matrix_of_its_clause() -> None:
    """Its least eigenvalue, of the rows that are written down, is the clause's own margin."""
    rng = np.random.default_rng(5)
    blocks = [
        clause
        for constraint in SERVED_CONSTRAINTS
        for clause in step_problem(constraints=[constraint]).clauses
        if isinstance(clause, ConicClause)
    ]
    assert blocks
    for clause in blocks:
        assert clause.matrix is not None
        for p in 0.3 * rng.normal(size=(3, N)):
            block = matrix_of(clause.matrix.F @ p[list(clause.matrix.on)] + clause.matrix.f)
            assert np.linalg.eigvalsh(block)[0] == pytest.approx(clause.margin(p), abs=1e-12)


# --- the normal form --------------------------------------------------------------------------


def normal_form(program: ConeProgram, at: int) -> tuple[Array, Array, float, Array]:
    """(H, g, c, rows): minimise ½ pᵀH p + gᵀp + c subject to rows[:, :n] p ≤ rows[:, n].

    Auxiliary variables have an equality each: E y + F p = e with E square and regular. With y =
    E⁻¹(e − F p) put in, only p is left; any other equality is two inequalities. Each row is divided
    by its largest coefficient; rows without one (trust region switched off) say 0 ≤ b, b > 0, and
    go; the rest are sorted.
    """
    zero, size = program.cones.zero, program.q.size
    A, b, p = program.A.toarray(), program.b, np.arange(at, at + N)
    y = np.setdiff1d(np.arange(size), p)
    defining = defining_rows(program, at)
    assert y.size == defining.size
    T, t = np.zeros((size, N)), np.zeros(size)
    T[p] = np.eye(N)
    T[y] = -np.linalg.solve(A[np.ix_(defining, y)], A[np.ix_(defining, p)]) if y.size else T[y]
    t[y] = np.linalg.solve(A[np.ix_(defining, y)], b[defining]) if y.size else t[y]
    P = program.P.toarray()
    equal = np.setdiff1d(np.arange(zero), defining)
    A, b = np.vstack([A[equal], -A[equal], A[zero:]]), np.r_[b[equal], -b[equal], b[zero:]]
    G, h = A @ T, b - A @ t
    scale = np.abs(G).max(axis=1, initial=0.0)
    assert np.all(h[scale == 0.0] > 0.0)
    rows = np.column_stack([G, h])[scale > 0.0] / scale[scale > 0.0, None]
    order = np.lexsort(np.round(rows, 9).T + 0.0)  # + 0.0: -0 sorts as 0
    cost = 0.5 * t @ P @ t + program.q @ t + program.constant
    return T.T @ P @ T, T.T @ (P @ t + program.q), float(cost), rows[order]


def osqp_program(model: Model) -> tuple[ConeProgram, int]:
    """cvxpy's other canonical form, that of quadratic-program solvers: A x = b, F x ≤ G."""
    data, _, inverse = model.problem.get_problem_data(cp.OSQP)
    program = ConeProgram(
        data["P"],
        np.asarray(data["q"]),
        sp.vstack([data["A"], data["F"]]),
        np.concatenate([data["b"], data["G"]]),
        Cones(data["A"].shape[0], data["F"].shape[0]),
        float(np.ravel(inverse[-1][cp.settings.OFFSET])[0]),
    )
    return program, int(data["param_prob"].var_id_to_col[model.p.id])


def stated(
    problem: cv.StepProblem, weights: Sequence[float], box: Box | None, rows_of_data: int = N
) -> tuple[Array, Array, float, Array]:
    """The normal form from the definitions: no matrices of cvxpy, none of the package."""
    R, d = reduced_data(rows_of_data)
    H, g, c = 2 * R.T @ R, -2 * R.T @ d, d @ d
    for weight, term in zip(weights, problem.regularisers, strict=True):
        if isinstance(term, cv.Prior):
            price = weight * np.linalg.inv(term.matrix)
            wish = box[0] if term.about == "present" and box is not None else np.zeros(N)
        else:
            assert isinstance(term, cv.Tikhonov)
            price = np.diag(weight / np.broadcast_to(np.asarray(term.scale), (N,)) ** 2)
            wish = np.broadcast_to(np.asarray(term.reference), (N,))
        H, g, c = H + 2 * price, g - 2 * price @ wish, c + wish @ price @ wish
    rows = []
    for clause in problem.clauses:
        assert isinstance(clause, LinearClause)
        full = np.zeros((len(clause.lower), N))
        full[:, list(clause.on)] = clause.C
        rows += [np.append(a, b) for a, b in zip(full, clause.upper, strict=True)]
        rows += [np.append(-a, -b) for a, b in zip(full, clause.lower, strict=True)]
    if box is not None:
        rows += [np.append(e, m + r) for e, m, r in zip(np.eye(N), *box, strict=True)]
        rows += [np.append(-e, r - m) for e, m, r in zip(np.eye(N), *box, strict=True)]
    table = np.array([row / np.abs(row[:N]).max() for row in rows if np.isfinite(row[N])])
    table = table.reshape(-1, N + 1)
    return H, g, float(c), table[np.lexsort(np.round(table, 9).T + 0.0)]


@pytest.mark.parametrize("box", BOXES)
@pytest.mark.parametrize("clauses", LINEAR_CLAUSES, ids=lambda c: "+".join(map(title, c)) or "free")
def test_the_normal_form_is_that_of_the_step(clauses: tuple[cv.Constraint, ...], box: str) -> None:
    """Written down, compiled for conic solvers, compiled for quadratic ones, and as the step is
    defined: one normal form."""
    problem, weights = step_problem(SERVED_TERMS, clauses), weighed(SERVED_TERMS)
    model = compiled(problem, weights, BOXES[box])
    conic, (at,) = cone_program(model.problem, model.p)
    R, d = reduced_data()
    programs = (
        quadratic_program(problem, R, d, tuple(weights), BOXES[box], begin(BOXES[box])),
        osqp_program(model),
        (conic, at),
    )
    wanted = stated(problem, weights, BOXES[box])
    for program, begins in programs:
        for mine, theirs in zip(normal_form(program, begins), wanted, strict=True):
            np.testing.assert_allclose(mine, theirs, rtol=1e-12, atol=1e-12)


def test_zero_rows_that_fill_the_compiled_data_change_nothing() -> None:
    """A system with fewer rows than parameters: cvxpy's data are filled with zero rows, the program
    that is written down has none of them."""
    problem, box = step_problem(SERVED_TERMS, TOGETHER_LINEAR), BOXES["trust region on some"]
    weights = weighed(SERVED_TERMS)
    model = compiled(problem, weights, box, 3)
    conic, (at,) = cone_program(model.problem, model.p)
    found, begins = quadratic_program(problem, *reduced_data(3), tuple(weights), box, begin(box))
    assert conic.q.size == found.q.size + N - 3
    forms = (
        normal_form(found, begins),
        normal_form(conic, at),
        stated(problem, weights, box, 3),
    )
    for written_down, by_cvxpy, by_definition in zip(*forms, strict=True):
        np.testing.assert_allclose(written_down, by_cvxpy, rtol=1e-12, atol=1e-12)
        np.testing.assert_allclose(written_down, by_definition, rtol=1e-12, atol=1e-12)
