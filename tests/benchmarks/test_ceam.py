"""Time of a matrix inequality as it grows, whole and split along its sparsity, and of the CEAM equations of the bay."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate import convex as cv
from cvxupdate import study
from cvxupdate.system import LinearSystem
from cvxupdate.update.ceam import residual_of

BAY = Path(__file__).resolve().parents[2] / "problems" / "ceam_case1" / "problem.toml"


def band(N, rng):
    A = np.triu(np.tril(rng.normal(size=(N, N)), 2), -2)
    return sp.csc_array((A + A.T) / 2)


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("size", [20, 60, 120, 240])
def test_matrix_inequality(benchmark, size, split):
    rng = np.random.default_rng(0)
    base, parts = sp.csc_array(0.05 * band(size, rng) + sp.eye_array(size)), [0.5 * band(size, rng) for _ in range(6)]
    columns = tuple(f"p{i}" for i in range(6))
    data = LinearSystem(np.eye(6), rng.normal(size=6) + 1.0, np.ones(6), columns, columns)
    problem = cv.StepProblem(constraints=(cv.MatrixInequality(base, parts, "S", 0.01, decompose=split),), columns=columns)
    step = benchmark.pedantic(lambda: cv.solve_step(problem, data), rounds=1, warmup_rounds=0)
    assert step.status == "optimal"


def test_equations_of_ten_complete_modes(benchmark):
    spec, model, recordings = study.open_problem(BAY)
    benchmark.pedantic(lambda: residual_of(spec, model, recordings).evaluate(model.zero()).system(), rounds=3, warmup_rounds=1)
