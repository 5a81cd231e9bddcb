"""`run` by the classical solutions of chapter 4: closed forms and optimality conditions of each,
the choice of level and weight, the way from a problem file to the page, and what is refused."""

import json

import numpy as np
import pytest

from cvxupdate.convex.regularisers.entropy import Entropy
from cvxupdate.errors import InputError
from cvxupdate.report import run_files
from cvxupdate.report.words import certificate_sentence
from cvxupdate.spec.update import SOLUTIONS
from cvxupdate.study import run
from cvxupdate.update.classic_curves import entropy, entropy_of, l_curve
from cvxupdate.update.classic_solvers import tikhonov
from cvxupdate.update.classical import Asked, solve_by_name

CLASSICAL = SOLUTIONS[2:]  # the first two are convex
TRUTH = {"e2.k": 0.2, "e3.k": 0.0, "e11.m": -0.15}


def ill_posed(noise, seed=4):
    """60 equations for 12 unknowns whose singular values fall by eight decades."""
    rng = np.random.default_rng(seed)
    U = np.linalg.qr(rng.standard_normal((60, 12)))[0]
    V = np.linalg.qr(rng.standard_normal((12, 12)))[0]
    A = U * np.geomspace(1.0, 1e-8, 12) @ V.T
    p = V @ (0.3 * 0.7 ** np.arange(12))
    return A, A @ p + noise * rng.standard_normal(60), p


@pytest.mark.parametrize("solution", CLASSICAL)
def test_each_solution_regularises(solution):
    A, b, p = ill_posed(1e-4)
    found = solve_by_name(A, b, Asked(solution, None, None))
    plain = np.linalg.lstsq(A, b, rcond=None)[0]
    assert np.linalg.norm(found.p - p) < 0.6 * np.linalg.norm(p) < np.linalg.norm(plain - p)
    assert (found.alpha is None) == (solution not in ("tikhonov", "entropy"))
    assert found.alpha is not None or 1 <= found.level <= 1000


@pytest.mark.parametrize("solution", CLASSICAL)
def test_without_noise_and_well_posed_all_are_least_squares(solution):
    rng = np.random.default_rng(8)
    A = np.linalg.qr(rng.standard_normal((30, 4)))[0] * np.array([2.0, 1.5, 1.2, 1.0])
    p = np.array([0.2, -0.3, 0.1, 0.05])
    given = {"tikhonov": 1e-14, "entropy": 1e-14}.get(solution)
    level = None if given else {"landweber": 400}.get(solution, 4)
    found = solve_by_name(A, A @ p, Asked(solution, level, given))
    assert found.p == pytest.approx(p, abs=1e-9)


def test_entropy_meets_its_optimality_condition_and_stays_positive():
    A, b, _ = ill_posed(1e-3)
    for alpha in (1e-6, 1e-2, 10.0):
        p = entropy(A, b, alpha)
        assert A.T @ (A @ p - b) + alpha * np.log1p(p) == pytest.approx(0.0, abs=1e-8)
    # the right-hand side asks for a factor far below 0; the entropy keeps it above
    low = entropy(np.eye(2), np.array([-5.0, 0.4]), 1e-3)
    assert -1.0 < low[0] < -0.99 and low[1] == pytest.approx(0.4, abs=1e-3)
    columns = tuple("abc")
    p = np.array([0.3, -0.2, 0.05])
    assert entropy_of(p) == pytest.approx(2.0 * Entropy(1.0).value(p, columns), rel=1e-12)
    assert entropy_of(1e-4 * p) == pytest.approx(1e-8 * p @ p, rel=1e-3)
    with pytest.raises(InputError, match="above 0"):
        entropy(A, b, 0.0)


def test_the_l_curve_falls_and_its_corner_is_near_the_best_weight():
    A, b, p = ill_posed(1e-4)
    curve = l_curve(A, b, lambda a: tikhonov(A, b, a))
    assert np.all(np.diff(curve.residual) >= -1e-12) and np.all(np.diff(curve.size) <= 1e-9)
    errors = [np.linalg.norm(tikhonov(A, b, a) - p) for a in curve.alpha]
    assert errors[curve.corner] < 2.0 * min(errors) < 0.2 * errors[0]


MODEL = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }]

[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 9.0e5 }, { id = 2, nodes = [1, 2], k = 6.0e5 },
        { id = 3, nodes = [2, 3], k = 8.0e5 }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 2.0 }, { id = 12, nodes = [2], m = 1.5 },
        { id = 13, nodes = [3], m = 1.0 }]

[update]
method = "METHOD"
parameters = [{ elements = [2], of = "k" }, { elements = [3], of = "k" },
              { elements = [11], of = "m" }]
"""


def modes():
    """The chain with its second spring a fifth stiffer and its first mass lighter by 15 %."""
    k = np.array([9.0, 7.2, 8.0]) * 1e5
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    m = np.array([1.7, 1.5, 1.0])
    values, vectors = np.linalg.eigh(K / np.sqrt(np.outer(m, m)))
    shapes = vectors / np.sqrt(m)[:, None]
    rows = ", ".join(
        f"{{ frequency = {float(np.sqrt(w)) / (2 * np.pi)!r}, shape = {s.tolist()} }}"
        for w, s in zip(values, shapes.T, strict=True)
    )
    names = ", ".join(
        f'{{ column = {c}, quantity = "displacement", node = {c + 1}, dof = "x" }}'
        for c in range(3)
    )
    return f'\n[[recordings]]\nkind = "modes"\nchannels = [{names}]\nrows = [{rows}]\n'


@pytest.fixture
def problem(tmp_path):
    def write(keys, method="sensitivity", more=""):
        text = MODEL.replace('"METHOD"', f'"{method}"\n{keys}') + more + modes()
        path = tmp_path / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return path

    return write


@pytest.mark.parametrize("solution", ["truncated-svd", "total-least-squares", "landweber"])
def test_run_finds_exact_parameters(problem, solution):
    level = 400 if solution == "landweber" else 3
    found = run(problem(f'solution = "{solution}"\nlevel = {level}'))
    assert found.status == "converged" and found.solver == solution
    assert {q.name: q.p for q in found.parameters} == pytest.approx(TRUTH, abs=1e-5)
    assert found.classical.chosen == "given"


def test_the_multiplicative_form_holds_each_change_and_not_their_product(problem):
    """(3.50), (3.51): where it stays no change is left, so that Tikhonov's weight no longer draws
    the factors back to the nominal ones, as it does where all of p is solved for."""
    keys = 'solution = "tikhonov"\nalpha = 100.0\n'
    truth = np.array(list(TRUTH.values()))
    ends = {}
    for form in ("additive", "multiplicative"):
        found = run(problem(f'{keys}form = "{form}"'))
        assert found.status == "converged"
        ends[form] = np.linalg.norm([q.p for q in found.parameters] - truth)
    assert ends["multiplicative"] < 1e-5 and ends["additive"] > 1e-2


def test_factors_multiply(problem):
    """One step of least squares in relative changes is that of p; the second multiplies on it."""
    p = {}
    for form in ("additive", "multiplicative"):
        for steps in (1, 2):
            keys = f'solution = "truncated-svd"\nlevel = 3\nform = "{form}"\n'
            found = run(problem(f"{keys}max_iterations = {steps}"))
            p[form, steps] = np.array([q.p for q in found.parameters])
    for steps in (1, 2):  # of full rank: the unknowns in other units
        assert p["additive", steps] == pytest.approx(p["multiplicative", steps], abs=1e-9)


def test_a_truncated_solution_leaves_what_it_does_not_see_nominal(problem):
    found = run(problem('solution = "truncated-svd"\nlevel = 1\nmax_iterations = 8'))
    p = np.array([q.p for q in found.parameters])
    assert 0.0 < np.linalg.norm(p) < np.linalg.norm(list(TRUTH.values()))
    assert found.classical.level == 1


def test_the_page_and_the_data(problem, tmp_path):
    found = run(problem('solution = "tikhonov"'))
    assert "minimises no objective under constraints" in certificate_sentence(found)
    files, text = run_files(found, tmp_path)
    page = files["report.html"]
    assert "Picard plot" in page and "L-curve" in page and "(classical, not convex)" in page
    data = json.loads(text)["classical"]
    assert data["solution"] == "tikhonov" and data["alpha"] > 0.0
    assert len(data["curve_alpha"]) == len(data["curve_size"]) > len(data["singular"]) == 3


@pytest.mark.parametrize(
    ("keys", "method", "more", "words"),
    [
        ('solution = "entropy"\nlevel = 2', "sensitivity", "", "regularisation is update.alpha"),
        ('solution = "landweber"\nalpha = 2.0', "sensitivity", "", "is update.level"),
        ("level = 2", "sensitivity", "", "belong to a classical solution"),
        ('solution = "tikhonov"\nloss = "l1"', "sensitivity", "", "the loss l1"),
        (
            'solution = "tikhonov"',
            "sensitivity",
            '\n[regularisation]\nkind = "l1"\nweight = 1.0\n',
            "the penalty l1",
        ),
        ('solution = "tikhonov"\nstarts = 3', "sensitivity", "", "update.starts is of the convex"),
        ('solution = "tikhonov"', "minimum-variance", "", "does not apply to method"),
    ],
)
def test_what_does_not_go_together_is_refused(problem, keys, method, more, words):
    with pytest.raises(InputError, match=words):
        run(problem(keys, method, more))
