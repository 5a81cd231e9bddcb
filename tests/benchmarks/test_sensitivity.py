"""`sensitivity` against scipy.optimize.least_squares (trf, finite differences) on the same model,
residual and bounds; time and memory by size.

Structure A with the five parameters of its problem file, and with the thesis' 140: E, thickness,
rho and nu of each of 35 elements (5 x 7). Eighteen rows do not determine 140 numbers, so both get
the same prior rows p / σ. Both evaluate the same `ModalResidual`.

With σ = 20 % the fit is pulled through a crossing: the measured 66.6 and 67.7 Hz have their shapes
in the other order in the model. There least_squares slides along the line where both shapes are
half mixed, so that which is which changes hands: a jump of the objective, not a minimum. The table
shows it: ``share`` is the least (φᵀMφ₀)² of a followed shape with the shape it was paired by, 0.5
where the pairing means nothing.

`python tests/benchmarks/test_sensitivity.py N FORM` is one measurement of size in a process of its
own.
"""

from __future__ import annotations

import json
import os
import subprocess
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402
import pytest  # noqa: E402
from numpy.typing import NDArray  # noqa: E402
from scipy.optimize import least_squares  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.convex import CompiledStep, SolverChoice, StepProblem, Tikhonov  # noqa: E402
from cvxupdate.fe.model import Model  # noqa: E402
from cvxupdate.fe.modes import model_modes  # noqa: E402
from cvxupdate.fe.parameters import Parameter, Target  # noqa: E402
from cvxupdate.recordings.types import Channel, ModeTable, Origin  # noqa: E402
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual  # noqa: E402
from cvxupdate.study import open_problem  # noqa: E402
from cvxupdate.update.measured_modes import modal_tables  # noqa: E402
from cvxupdate.update.modal_loop import with_pairing  # noqa: E402
from cvxupdate.update.parts import loop_options, step_problem  # noqa: E402
from cvxupdate.update.trust_region import Options, objective_at  # noqa: E402
from tests.benchmarks.test_modes import plate  # noqa: E402
from tests.cases.elements import grid  # noqa: E402
from tests.cases.structures import structure  # noqa: E402

Real = NDArray[np.float64]
PROBLEM = ROOT / "problems/structure_a/problem.toml"


@dataclass(frozen=True)
class Case:
    """One comparison: the residual, the step, where both start."""

    name: str
    residual: ModalResidual
    problem: StepProblem
    options: Options
    start: Real
    prior: float  # weight of the prior rows: 1/σ², 0 for none


def five() -> Case:
    """The problem file as shipped; least_squares cannot leave a bound, so both start with strings
    of 500 N/m."""
    spec, model, recordings = open_problem(PROBLEM)
    fit, _ = modal_tables(recordings)
    start = np.where([q.lower == 0.0 for q in model.parameters], 0.05, 0.0)
    return Case(
        "5 parameters, 1827 DOFs",
        modal_residual(model, fit, (), True),
        step_problem(spec, model, recordings),
        loop_options(spec, model),
        start,
        0.0,
    )


def many(sigma: float) -> Case:
    """140 parameters with the prior deviation ``sigma``."""
    fit, _ = modal_tables(open_problem(PROBLEM)[2])
    sheet = grid(
        np.linspace(0.0, 0.665, 8),
        np.linspace(0.0, 0.455, 6),
        {"shape": "plate", "thickness": 0.0025},
        {"E": 206e9, "nu": 0.3, "rho": 7860.0},
    )
    wanted = [
        {"elements": "all", "of": of, "each": "element"} for of in ("E", "thickness", "rho", "nu")
    ]
    spec, model = structure(
        sheet,
        wanted,
        constraints={"bounds": {"lower": -0.5, "upper": 0.5}},
        update={"method": "sensitivity"},
    )
    problem = replace(step_problem(spec, model, ()), regularisers=(Tikhonov(1.0 / sigma**2),))
    return Case(
        f"140 parameters, prior {sigma:.0%}",
        modal_residual(model, fit, (), True),
        problem,
        loop_options(spec, model),
        model.zero(),
        1.0 / sigma**2,
    )


def share(residual: ModalResidual, point: ModalPoint) -> float:
    """The least (φᵀ M φ₀)² of a measured mode's shape now and the shape it was paired by."""
    M, first = point.matrices.M, residual.start
    return min(
        float((first.modes.shapes[:, i] @ (M @ point.modes.shapes[:, j])) ** 2)
        for a, b in zip(first.places, point.places, strict=True)
        for i, j in zip(a, b, strict=True)
    )


def compare(case: Case, repeats: int = 3) -> dict[str, Any]:
    """Best of ``repeats`` for ours (compilation of the step included each time), one run of
    least_squares."""
    times = []
    for _ in range(repeats + 1):  # the first also imports cvxpy
        begin = time.process_time()
        loop, _ = with_pairing(
            case.residual, case.problem, SolverChoice(), case.options, case.start
        )
        times.append(time.process_time() - begin)
    calls = 0

    def rows(p: Real) -> Real:
        nonlocal calls
        calls += 1
        values, weights, _ = case.residual.evaluate(p).differences
        return (
            np.concatenate([weights * values, np.sqrt(case.prior) * p])
            if case.prior
            else weights * values
        )

    model = case.residual.model
    lower, upper = (
        np.array([q.lower for q in model.parameters]),
        np.array([q.upper for q in model.parameters]),
    )
    begin = time.process_time()
    found = least_squares(rows, case.start, bounds=(lower, upper), method="trf")
    theirs = time.process_time() - begin
    there = case.residual.evaluate(found.x)
    return {
        "case": case.name,
        "ours": min(times[1:]),
        "steps": len(loop.history),
        "objective": objective_at(case.problem, loop.point),
        "share": share(case.residual, loop.point),
        "theirs": theirs,
        "calls": calls,
        "their objective": 2.0 * found.cost,
        "their share": share(case.residual, there),
    }


@pytest.mark.slow
def test_against_least_squares() -> None:
    found = [compare(five()), compare(many(0.05)), compare(many(0.2))]
    print(
        f"\n{'case':>26} {'method':>14} {'time s':>8} {'models':>7} {'objective':>12} "
        f"{'share':>6} {'ratio':>6}"
    )
    for r in found:
        print(
            f"{r['case']:>26} {'sensitivity':>14} {r['ours']:>8.3f} {r['steps'] + 1:>7} "
            f"{r['objective']:>12.6f} {r['share']:>6.2f}"
        )
        print(
            f"{'':>26} {'least_squares':>14} {r['theirs']:>8.3f} {r['calls']:>7} "
            f"{r['their objective']:>12.6f} {r['their share']:>6.2f} "
            f"{r['theirs'] / r['ours']:>6.1f}"
        )
    small, stiff, loose = found
    for r in (small, stiff):
        assert r["objective"] <= r["their objective"] * (1.0 + 1e-5), r
        assert min(r["share"], r["their share"]) > 0.6, r
    for r in found:
        assert r["theirs"] >= 10.0 * r["ours"], r
    assert (
        loose["objective"] <= loose["their objective"] * (1.0 + 1e-5) or loose["their share"] < 0.6
    ), loose


WORDS = ("Dx", "Dy", "D1", "Dxy", "rho")


def measure(size: int, shapes: bool, patches: int = 1) -> dict[str, Any]:
    """Five parameters for each of ``patches`` parts of the plate. Seconds of the processor of the
    modes (pairing included), of the linearisation (2.100, and shapes at 20 sensors where asked) and
    of the convex step; peak MB."""
    import cvxpy  # noqa: F401  # its import (a second) is no part of a step

    model = plate(size, clamped=True)
    every = np.array_split(np.arange(len(model.blocks[0].ids)), patches)
    parameters = tuple(
        Parameter(
            f"{w}{k}",
            w,
            (Target(0, rows, (w,), model.blocks[0].properties[w][rows][None]),),
            -0.5,
            0.5,
            1.0,
            1.0,
            "1",
        )
        for w in WORDS
        for k, rows in enumerate(every)
    )
    names = tuple(q.name for q in parameters)
    model = model.with_parameters(parameters)
    frequency = model_modes(
        plate(600, clamped=True), 10
    ).frequencies  # those of a coarse plate: near enough, and they cost nothing
    before = peak_memory()
    begin = time.process_time()
    residual = modal_residual(model, [table(model, frequency, shapes)], [], shapes)
    point = residual.evaluate(np.full(len(parameters), 0.01))
    found = time.process_time()
    system = point.system()
    linear = time.process_time()
    step = CompiledStep(
        StepProblem(regularisers=(Tikhonov(1.0),), columns=names), len(system.rows), SolverChoice()
    ).solve(system, point.p, 0.3)
    end = time.process_time()
    peak = peak_memory()
    return {
        "dofs": model.size,
        "modes": (found - begin) / 2,
        "linearise": linear - found,
        "step": end - linear,
        "status": step.status,
        "rows": len(system.rows),
        "peak": (peak - before) / 1024,
    }


def peak_memory() -> float:
    """Peak resident memory of this process in kB. Not ru_maxrss: a child inherits that of the
    process that started it."""
    return float(
        next(
            line.split()[1]
            for line in Path("/proc/self/status").read_text().splitlines()
            if line.startswith("VmHWM")
        )
    )


def table(model: Model, frequency: Real, shapes: bool) -> ModeTable:
    """Ten measured modes, 3 % off; shapes of the first five at 20 sensors are the displacements of
    a smooth field, only their cost matters here."""
    unknown = np.full(10, np.nan)
    free = np.unique(model.node_ids[model.dof_node])
    nodes = free[np.linspace(0, len(free) - 1, 20).astype(int)]
    at = [model.place[f"n{n}.z"] for n in nodes]
    xyz = model.xyz[model.dof_node[at]]
    values = np.array(
        [
            np.cos((k + 1) * xyz[:, 0]) * np.sin((k + 1) * xyz[:, 1]) + xyz[:, 0] ** 2
            for k in range(10)
        ]
    )
    values[5:] = np.nan
    channels = tuple(Channel(int(n), "z", "displacement") for n in nodes)
    return ModeTable(
        Origin("made", "made"),
        1.03 * frequency,
        0.01 * frequency,
        unknown,
        unknown,
        channels,
        values if shapes else None,
        None,
        np.arange(1, 11),
    )


@pytest.mark.slow
def test_time_and_memory_of_a_step() -> None:
    print(
        f"\n{'DOFs':>8} {'rows':>5} {'modes s':>9} {'linearise s':>12} {'step s':>7} "
        f"{'peak MB':>8}   five parameters of every element, ten modes"
    )
    for form in ("frequencies", "shapes"):
        for size in (1_000, 10_000, 100_000, 300_000):
            r = apart(size, form, 1)
            print(
                f"{r['dofs']:>8} {r['rows']:>5} {r['modes']:>9.3f} {r['linearise']:>12.3f} "
                f"{r['step']:>7.3f} {r['peak']:>8.0f}   {form}"
            )
            assert r["status"] == "optimal"


def apart(size: int, form: str, patches: int) -> dict[str, Any]:
    """`measure` in a process of its own."""
    done = subprocess.run(
        [sys.executable, __file__, str(size), form, str(patches)],
        capture_output=True,
        text=True,
        timeout=3600,
        cwd=ROOT,
    )
    assert not done.returncode, done.stderr
    return dict(json.loads(done.stdout.splitlines()[-1]))


@pytest.mark.slow
def test_growth_with_parameters() -> None:
    print(f"\n{'parameters':>11} {'linearise s':>12} {'step s':>7} {'peak MB':>8}   10 000 DOFs")
    for form in ("frequencies", "shapes"):
        for patches in (1, 10, 100):
            r = apart(10_000, form, patches)
            print(
                f"{len(WORDS) * patches:>11} {r['linearise']:>12.3f} {r['step']:>7.3f} "
                f"{r['peak']:>8.0f}   {form}"
            )
            assert r["status"] == "optimal"


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]), sys.argv[2] == "shapes", int(sys.argv[3]))))
