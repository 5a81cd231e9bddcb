"""Matrix inequalities whole and split, cliques, equations, budgets, whole matrices: each against
its own definition."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate import convex as cv
from cvxupdate.convex.chordal import cliques
from cvxupdate.convex.constraints.clauses import violation
from cvxupdate.system import LinearSystem


def band(N, width, rng):
    A = np.triu(np.tril(rng.normal(size=(N, N)), width), -width)
    return sp.csc_array((A + A.T) / 2)


def system(n, target):
    columns = tuple(f"p{i}" for i in range(n))
    return LinearSystem(np.eye(n) + 0.1, (np.eye(n) + 0.1) @ target, np.ones(n), columns, columns)


@pytest.mark.parametrize("size", [9, 45])
@pytest.mark.parametrize("floor", [0.0, 0.05])
def test_split_and_whole_inequalities_give_the_same_step(size, floor):
    rng = np.random.default_rng(size)
    base, parts = (
        sp.csc_array(0.05 * band(size, 2, rng) + sp.eye_array(size)),
        [0.5 * band(size, 2, rng) for _ in range(4)],
    )
    data = system(4, rng.normal(size=4) + 1.0)
    steps = []
    for split in (False, True):
        clause = cv.MatrixInequality(base, parts, "S stays positive", floor, decompose=split)
        step = cv.solve_step(cv.StepProblem(constraints=(clause,), columns=data.columns), data)
        assert step.status == "optimal"
        assert clause.margin(step.p) > -1e-6
        assert "S stays positive" in step.active
        steps.append(step)
    assert steps[0].objective == pytest.approx(steps[1].objective, rel=1e-5)


def test_margin_is_the_smallest_eigenvalue_of_the_scaled_matrix():
    rng = np.random.default_rng(1)
    base, part = sp.csc_array(np.diag([4.0, 1.0, 9.0])), band(3, 2, rng)
    S = (base + 0.3 * part).toarray() / np.outer([2, 1, 3], [2, 1, 3])
    assert cv.MatrixInequality(base, [part], "S").margin(np.array([0.3])) == pytest.approx(
        np.linalg.eigvalsh(S)[0], rel=1e-12
    )


@pytest.mark.parametrize("seed", range(5))
def test_cliques_cover_every_entry_and_have_the_running_intersection(seed):
    """The union of cliques is a chordal graph that contains the pattern: a perfect elimination
    order exists."""
    rng = np.random.default_rng(seed)
    N = 30
    A = sp.random_array((N, N), density=0.06, rng=rng).tocsr()
    A = (A + A.T + sp.eye_array(N)).tocsr()
    found = cliques(A)
    G = np.zeros((N, N), dtype=bool)
    for c in found:
        G[np.ix_(c, c)] = True
    assert np.all(G[A.toarray() != 0])
    left = set(range(N))
    while left:
        simplicial = next(
            (v for v in left if all(G[a, b] for a in left for b in left if G[v, a] and G[v, b])),
            None,
        )
        assert simplicial is not None, "not chordal"
        left.discard(simplicial)


def test_equations_drop_what_says_nothing_and_keep_what_contradicts():
    A = np.array([[1.0, 1.0], [2.0, 2.0], [0.0, 0.0]])
    (clause,) = cv.Equations(A, np.array([0.5, 1.0, 0.0]), "half").clauses(("a", "b"))
    assert clause.C.shape[0] == 1
    assert violation(clause, np.array([0.2, 0.3])) < 1e-12
    conflict = cv.find_conflict(
        cv.Equations(A, np.array([0.5, 1.2, 0.0]), "two values").clauses(("a", "b")), 2
    )
    assert conflict is not None
    assert conflict.clauses == ("two values",)
    assert cv.Equations(np.zeros((2, 2)), np.zeros(2), "nothing").clauses(("a", "b")) == ()


@pytest.mark.parametrize("norm", ["l1", "l2"])
def test_a_budget_is_spent_and_not_exceeded(norm):
    data = system(3, np.array([1.0, -0.8, 0.1]))
    step = cv.solve_step(
        cv.StepProblem(constraints=(cv.Budget(0.5, norm),), columns=data.columns), data
    )
    assert np.linalg.norm(step.p, 1 if norm == "l1" else 2) == pytest.approx(0.5, abs=1e-6)


def test_symmetry_and_connectivity_of_a_whole_matrix():
    """The nearest symmetric matrix with a zero that has to stay: ((X + Xᵀ) / 2 with that entry
    0."""
    labels = ("u", "v", "w")
    columns = tuple(cv.entry_name("K", a, b) for a in labels for b in labels)
    X = np.random.default_rng(3).normal(size=(3, 3))
    data = LinearSystem(np.eye(9), X.ravel(), np.ones(9), columns, columns)
    zero = (cv.entry_name("K", "u", "w"), cv.entry_name("K", "w", "u"))
    step = cv.solve_step(
        cv.StepProblem(
            constraints=(cv.Symmetric(("K",), labels), cv.Connectivity(zero)), columns=columns
        ),
        data,
    )
    expected = (X + X.T) / 2
    expected[0, 2] = expected[2, 0] = 0.0
    assert step.p.reshape(3, 3) == pytest.approx(expected, abs=1e-8)
    clash = (
        cv.Symmetric(("K",), labels),
        cv.Connectivity(zero[:1]),
        cv.LinearEquality({zero[1]: 1.0}, 0.3),
    )
    step = cv.solve_step(cv.StepProblem(constraints=clash, columns=columns), data)
    assert set(step.conflict) == {
        "symmetry of K",
        f"connectivity: no element at {zero[0]}",
        f"{zero[1]} = 0.3",
    }


def test_smoothness_and_element_mass():
    data = system(3, np.array([1.0, -1.4, 0.2]))
    clauses = (
        cv.Smooth((("p0", "p1"), ("p1", "p2")), 0.1),
        cv.ElementMass(("p0", "p1", "p2"), 0.05),
    )
    step = cv.solve_step(cv.StepProblem(constraints=clauses, columns=data.columns), data)
    assert np.max(np.abs(np.diff(step.p))) <= 0.1 + 1e-7
    assert step.p.min() >= -0.95 - 1e-8


def test_semidefinite_and_exponential_steps_are_compared_by_the_solvers_that_take_them():
    def entropy(p, slack):
        import cvxpy as cp

        return [cp.sum(cp.entr(p + 1.0)) >= 0.2 - slack]

    exponential = cv.ConicClause(
        "entropy of 1 + p at least 0.2",
        entropy,
        lambda p: float(-np.sum((1 + p) * np.log(1 + p))) - 0.2,
    )

    class Entropy:
        def clauses(self, columns):
            return (exponential,)

    data = system(3, np.array([0.8, -0.3, 0.2]))
    for constraint, word in (
        (Entropy(), "exponential"),
        (
            cv.MatrixInequality(np.eye(3), [np.diag(r) for r in -np.eye(3)], "S", 0.5),
            "semidefinite",
        ),
    ):
        rows = {
            r.solver: r
            for r in cv.compare_solvers(
                cv.StepProblem(constraints=(constraint,), columns=data.columns), data
            )
        }
        assert rows["CLARABEL"].status == "optimal"
        assert rows["SCS"].objective == pytest.approx(rows["CLARABEL"].objective, rel=1e-4)
        for name in ("OSQP", "PIQP", "HIGHS"):
            if name in rows:
                assert rows[name].status == "refused"
                assert word in rows[name].note
