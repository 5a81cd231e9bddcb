"""CEAM by size, matrix inequalities as they grow, the step in matrix form beside cvxpy's own, whole
matrices on the pattern of the bay.

* One assignment of three modes of a clamped plate at about 114, 1e3, 1e4 and 1e5 DOFs, 40 and 2000
  parameters (or as many as there are elements),
  shapes complete or translations only: expansion, whitening, rows, convex step; time and memory,
  and how far p is from the truth.
* A linear matrix inequality of growing order, whole and split along its sparsity.
* The package's step (compiled once to its cone program, handed to Clarabel, certified) against
  ``cvxpy.Problem.solve`` of the same program.
* Whole symmetric matrices on the pattern of the bay.

`python tests/benchmarks/test_ceam.py DOFS PARAMETERS COMPLETE` is one measurement in a process of
its own; the test runs them and prints the table.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402
import pytest  # noqa: E402
import scipy.sparse as sp  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate import convex as cv  # noqa: E402
from cvxupdate import study  # noqa: E402
from cvxupdate.fe.modes import model_modes  # noqa: E402
from cvxupdate.fe.parameters import Parameter, Target  # noqa: E402
from cvxupdate.residual.ceam import CeamResidual  # noqa: E402
from cvxupdate.residual.ceam_modes import AssignedMode  # noqa: E402
from cvxupdate.system import LinearSystem  # noqa: E402
from cvxupdate.update.ceam import residual_of  # noqa: E402
from cvxupdate.update.definite import definiteness  # noqa: E402
from cvxupdate.update.matrices import derivative_matrices  # noqa: E402
from cvxupdate.update.trust_region import Options, iterate  # noqa: E402
from tests.benchmarks.test_modes import plate  # noqa: E402

BAY = ROOT / "problems" / "ceam/case1" / "problem.toml"
WHOLE = ROOT / "problems" / "ceam/whole" / "problem.toml"
MODES = 3


def shared_out(size, parameters):
    """The clamped plate, its elements shared out among half the parameters for stiffness and half
    for mass, bounded."""
    model = plate(size, True)
    half = min(parameters // 2, len(model.blocks[0].ids))
    patches = np.array_split(np.arange(len(model.blocks[0].ids)), half)
    made = [
        Parameter(
            f"patch{k}.{of}",
            of,
            (Target(0, rows, (of,), np.ones((1, len(rows)))),),
            -0.5,
            0.5,
            0.0,
            1.0,
            "",
        )
        for of in ("stiffness", "mass")
        for k, rows in enumerate(patches)
    ]
    return replace(model, parameters=tuple(made))


def modes_of(model, p, complete):
    """The lowest modes at ``p``, at every DOF or the translations, with 1 % and 0.1 % as
    deviations."""
    found = model_modes(model, MODES, p)
    at = np.arange(model.size) if complete else np.flatnonzero(model.dof_kind < 3)
    out = []
    for value, shape in zip(found.eigenvalues, found.shapes.T, strict=True):
        part = shape[at] / np.linalg.norm(shape[at])
        turns = model.dof_kind[at] >= 3
        std = (
            np.where(turns, np.abs(part[turns]).max(initial=0.0), np.abs(part[~turns]).max()) * 0.01
        )
        out.append(
            AssignedMode(
                f"{np.sqrt(value) / 2 / np.pi:.4g} Hz",
                complex(1j * np.sqrt(value)),
                at,
                part,
                std,
                1e-3,
                True,
            )
        )
    return tuple(out)


def one(size, parameters, complete):
    """Seconds of every part, peak memory in MB, largest error of p, or of A p where p is not
    determined."""
    model = shared_out(size, parameters)
    n = len(model.parameters)
    rng = np.random.default_rng(0)
    p = 0.1 * rng.uniform(-1, 1, n)
    p[n // 2 :] -= p[n // 2 :].mean()  # equal patches: the total mass is kept
    assigned = modes_of(model, p, complete)
    clock = [time.process_time()]
    residual = CeamResidual(model, assigned, "null-space", model.zero(), None, True)
    _ = residual.expanded
    clock.append(time.process_time())
    _ = residual.whiteners
    clock.append(time.process_time())
    system = residual.evaluate(model.zero()).system()
    clock.append(time.process_time())
    columns = tuple(q.name for q in model.parameters)
    constraints = (
        cv.Bounds(np.full(n, -0.5), np.full(n, 0.5)),
        cv.TotalMass(model.mass_gradient(model.zero()), model.total_mass(), None),
    )
    problem, options = (
        cv.StepProblem(constraints=constraints, columns=columns),
        Options(radius=np.inf, max_iterations=1),
    )
    loop = iterate(residual, problem, cv.SolverChoice(), options, model.zero())
    clock.append(time.process_time())
    took = np.diff(clock)
    lowest = definiteness(model, loop.point.p)
    done = time.process_time() - clock[-1]
    return {
        "dofs": model.size,
        "parameters": n,
        "shapes": "complete" if complete else "translations",
        "expand": took[0],
        "whiten": took[1],
        "rows": took[2],
        "step": took[3] - took[2],
        "lowest eigenvalues": done,
        "MB": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e3,
        "p error": float(np.abs(loop.point.p - p).max()),
        "residual": float(np.linalg.norm(system.residual(loop.point.p)) / np.linalg.norm(system.b)),
        "mass eigenvalue": lowest["mass_eigenvalue_min"],
        "stiffness eigenvalue": lowest["stiffness_eigenvalue_min"],
    }


def test_sizes(capsys):
    rows = []
    for size in (114, 1_000, 10_000, 100_000):
        for parameters in (40, 2000):
            for complete in (True, False):
                made = subprocess.run(
                    [sys.executable, __file__, str(size), str(parameters), str(int(complete))],
                    capture_output=True,
                    text=True,
                    check=True,
                )
                rows.append(json.loads(made.stdout.splitlines()[-1]))
                with capsys.disabled():
                    print(
                        ", ".join(
                            f"{k} {v:.3g}" if isinstance(v, float) else f"{k} {v}"
                            for k, v in rows[-1].items()
                        ),
                        flush=True,
                    )
    assert all(r["residual"] < 1e-3 for r in rows if r["shapes"] == "complete")


def band(N, rng):
    A = np.triu(np.tril(rng.normal(size=(N, N)), 2), -2)
    return sp.csc_array((A + A.T) / 2)


@pytest.mark.parametrize("split", [False, True])
@pytest.mark.parametrize("size", [20, 60, 120, 240])
def test_matrix_inequality(benchmark, size, split):
    rng = np.random.default_rng(0)
    base, parts = (
        sp.csc_array(0.05 * band(size, rng) + sp.eye_array(size)),
        [0.5 * band(size, rng) for _ in range(6)],
    )
    columns = tuple(f"p{i}" for i in range(6))
    data = LinearSystem(np.eye(6), rng.normal(size=6) + 1.0, np.ones(6), columns, columns)
    problem = cv.StepProblem(
        constraints=(cv.MatrixInequality(base, parts, "S", 0.01, decompose=split),), columns=columns
    )
    step = benchmark.pedantic(lambda: cv.solve_step(problem, data), rounds=1, warmup_rounds=0)
    assert step.status == "optimal"


@pytest.mark.parametrize("size", [114, 200])
def test_mass_inequality_of_a_plate(benchmark, size):
    """The assembled mass of a plate of this many DOFs in 40 patches. At 500 DOFs (split) Clarabel
    had not ended after 45 s: larger ones are left out."""
    model = shared_out(size, 40)
    columns = tuple(q.name for q in model.parameters)
    n = len(columns)
    data = LinearSystem(
        np.eye(n), np.where(np.arange(n) % 3, 0.2, -1.2), np.ones(n), columns, columns
    )
    mass = cv.MatrixInequality(*derivative_matrices(model, "M", "the mass"), "the mass", 1e-3)
    problem = cv.StepProblem(constraints=(mass,), columns=columns)
    step = benchmark.pedantic(lambda: cv.solve_step(problem, data), rounds=1, warmup_rounds=0)
    assert step.status == "optimal"
    assert any("mass" in name for name in step.active)


@pytest.mark.parametrize("definite", [False, True])
def test_whole_stiffness_on_the_pattern_of_the_bay(benchmark, tmp_path, definite):
    """362 entries from ten complete modes, symmetric and connected by their choice, rigid-body
    modes kept; with the matrix inequality or without."""
    text = WHOLE.read_text().replace("../", f"{WHOLE.parents[1].as_posix()}/")
    (tmp_path / "problem.toml").write_text(
        text if definite else text.replace("matrix = true", "matrix = false")
    )
    updated = benchmark.pedantic(
        lambda: study.run(tmp_path / "problem.toml"), rounds=1, warmup_rounds=0
    )
    assert updated.status == "converged"
    assert len(updated.parameters) == 362
    assert updated.model["stiffness_eigenvalue_min"] > -1e-12


def random_step(n):
    rng = np.random.default_rng(0)
    columns = tuple(f"p{i}" for i in range(n))
    data = LinearSystem(
        rng.normal(size=(2 * n, n)),
        rng.normal(size=2 * n),
        np.ones(2 * n),
        columns,
        tuple(map(str, range(2 * n))),
    )
    return cv.StepProblem(constraints=(cv.Bounds(-0.02, 0.02),), columns=columns), data


@pytest.mark.parametrize("n", [40, 200, 1000])
def test_step_in_matrix_form(benchmark, n):
    problem, data = random_step(n)
    compiled = cv.CompiledStep(problem, len(data.rows))
    step = benchmark.pedantic(lambda: compiled.solve(data), rounds=2, warmup_rounds=1)
    assert step.status == "optimal"


@pytest.mark.parametrize("n", [40, 200, 1000])
def test_the_same_step_by_cvxpy(benchmark, n):
    import cvxpy as cp

    problem, data = random_step(n)
    p = cp.Variable(n)
    whole = cp.Problem(cp.Minimize(cp.sum_squares(data.A @ p - data.b)), [p >= -0.02, p <= 0.02])
    benchmark.pedantic(lambda: whole.solve(solver=cp.CLARABEL), rounds=2, warmup_rounds=1)
    ours = cv.CompiledStep(problem, len(data.rows)).solve(data)
    assert np.abs(ours.p - p.value).max() < 1e-5


@pytest.mark.parametrize("n", [40, 200, 1000])
def test_the_same_step_by_cvxpy_with_parameters(benchmark, n):
    """cvxpy's own way to solve again with other data: Parameters, reduced by QR as the package
    does."""
    import cvxpy as cp

    problem, data = random_step(n)
    p, R, d = cp.Variable(n), cp.Parameter((n, n)), cp.Parameter(n)
    whole = cp.Problem(cp.Minimize(cp.sum_squares(R @ p - d)), [p >= -0.02, p <= 0.02])
    R.value, d.value, _ = problem.loss.reduce(*data.weighted())
    benchmark.pedantic(lambda: whole.solve(solver=cp.CLARABEL), rounds=2, warmup_rounds=1)
    ours = cv.CompiledStep(problem, len(data.rows)).solve(data)
    assert np.abs(ours.p - p.value).max() < 1e-5


def test_a_thousand_bounds_in_conflict(benchmark):
    """The smallest conflict among a thousand clauses, and one that needs all of them."""
    n = 1000
    columns = tuple(f"e{i}.E" for i in range(n))
    short = cv.StepProblem(
        constraints=(cv.Bounds(-0.1, 0.1), cv.LinearEquality({"e3.E": 1.0, "e700.E": 1.0}, 0.5)),
        columns=columns,
    ).clauses
    whole = cv.StepProblem(
        constraints=(
            cv.Bounds(-0.1, 0.1),
            cv.TotalMass(np.linspace(0.5, 1.0, n), base=10.0, value=100.0),
        ),
        columns=columns,
    ).clauses
    found = benchmark.pedantic(
        lambda: (cv.find_conflict(short, n), cv.find_conflict(whole, n)), rounds=1
    )
    assert all(f is not None for f in found)


def test_equations_of_ten_complete_modes(benchmark):
    spec, model, recordings = study.open_problem(BAY)
    system = benchmark.pedantic(
        lambda: residual_of(spec, model, recordings).evaluate(model.zero()).system(),
        rounds=3,
        warmup_rounds=1,
    )
    assert system.A.shape == (len(system.b), len(model.parameters))
    assert np.all(np.isfinite(system.A)) and np.all(np.isfinite(system.b))


if __name__ == "__main__":
    print(json.dumps(one(int(sys.argv[1]), int(sys.argv[2]), bool(int(sys.argv[3])))))
