"""What screening and fitting cost in `diagnose`, each against the plain way of doing the same, in
the same run (processor seconds).

Screening columns of every set of elements of a plate: element derivatives formed once and shared,
against a model with a parameter grown for each set. Responses and receptances: modes far above the
band as one smooth function, against mode by mode. Steps: the written-down program, against cvxpy
compiling it (the first step of a fit, which most fits of a diagnosis have few of).
"""

from __future__ import annotations

import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.convex import Bounds, StepProblem, Tikhonov  # noqa: E402
from cvxupdate.convex.matrix_form import cone_program  # noqa: E402
from cvxupdate.convex.problem import compile_step  # noqa: E402
from cvxupdate.convex.quadratic import quadratic_program  # noqa: E402
from cvxupdate.diagnose.nominal.damping import undamped  # noqa: E402
from cvxupdate.diagnose.responses.signals import Signal  # noqa: E402
from cvxupdate.fe.modes import natural_modes  # noqa: E402
from cvxupdate.fe.rigid import rigid_body_modes  # noqa: E402
from cvxupdate.fe.synthesis.loss import Loss  # noqa: E402
from cvxupdate.fe.synthesis.pieces import receptances, respond  # noqa: E402
from cvxupdate.physics.growth import Rates, Wanted, append_parameters, tangents  # noqa: E402
from cvxupdate.physics.members import member_sets  # noqa: E402
from cvxupdate.study import open_problem  # noqa: E402

PLATE = ROOT / "problems/concealed/o12/problem.toml"


def seconds(run: Callable[[], object], times: int = 3) -> float:
    """The least processor time of a few runs, after one that is not counted."""
    run()
    out = []
    for _ in range(times):
        start = time.process_time()
        run()
        out.append(time.process_time() - start)
    return min(out)


def report(what: str, new: float, plain: float, against: str) -> None:
    """One line of the table."""
    print(f"\n{what}: {1e3 * new:.2f} ms, {against} {1e3 * plain:.2f} ms: {plain / new:.1f} times")


def test_columns_of_sets_of_elements() -> None:
    _, model, _ = open_problem(PLATE)
    model = undamped(model)
    sets = [ids for ids, _ in member_sets(model, "stiffness")]

    def shared() -> list[object]:
        rates = Rates.of(model, "stiffness")
        return [rates.tangent(ids) for ids in sets]

    def alone() -> list[object]:
        return [
            tangents(append_parameters(model, [Wanted("x", "stiffness", ids)]), 1)[0]
            for ids in sets
        ]

    for mine, theirs in zip(shared(), alone(), strict=True):
        for a, b in zip(mine, theirs, strict=True):  # type: ignore[call-overload]
            np.testing.assert_allclose(a.K, b.K, rtol=1e-12)
    report(
        f"derivatives of {len(sets)} sets of elements",
        seconds(shared),
        seconds(alone),
        "a model for each",
    )


def test_responses_and_receptances() -> None:
    _, model, _ = open_problem(PLATE)
    model = undamped(model)
    m = model.matrices()
    modes = natural_modes(m.K, m.M, model.size, rigid_body_modes(model, m.K, m.M))
    top = float(modes.frequencies[modes.rigid + 9])
    points, sensors = 800, np.arange(0, model.size, model.size // 12)
    s = 2j * np.pi * np.linspace(0.05 * top, top, points)
    signal = Signal(
        "a",
        "fit",
        None,
        s,
        None,
        np.ones((points, len(sensors), 1), dtype=complex),
        np.ones((points, 1, 1), dtype=complex),
        np.ones((points, len(sensors), 1)),
        2,
        ("",) * len(sensors),
        ("",),
    )
    zeta = np.full(len(modes.eigenvalues), 0.005)

    def every(near: int) -> tuple[np.ndarray, np.ndarray]:
        r = respond(signal, modes, sensors, np.array([3]), Loss(zeta), None, None, near)
        g = receptances(r, modes)
        return g.left, g.right

    for mine, theirs in zip(every(0), every(len(zeta)), strict=True):
        np.testing.assert_allclose(mine, theirs, atol=1e-10 * np.abs(theirs).max())
    report(
        f"receptances of {model.size} DOFs",
        seconds(lambda: every(0)),
        seconds(lambda: every(len(zeta))),
        "mode by mode",
    )


def test_first_step_of_a_fit() -> None:
    n = 20
    rng = np.random.default_rng(1)
    problem = StepProblem(
        regularisers=(Tikhonov(1.0, 0.0, np.full(n, 0.1)),),
        constraints=(Bounds(np.full(n, -4.0), np.full(n, 4.0)),),
        columns=tuple(f"p{i}" for i in range(n)),
    )
    R, d = np.triu(rng.normal(size=(n, n))), rng.normal(size=n)
    box = np.zeros(n), np.full(n, 0.5)

    def compiled() -> object:
        model = compile_step(problem, n, True)
        model.set_box(*box)
        model.set_data(R, d, (1.0,))
        return cone_program(model.problem, model.p)

    direct = seconds(lambda: quadratic_program(problem, R, d, (1.0,), box))
    by_cvxpy = seconds(compiled)
    report("program of a step", direct, by_cvxpy, "compiled by cvxpy")
    assert direct < by_cvxpy
