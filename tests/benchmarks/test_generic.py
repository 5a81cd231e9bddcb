"""One convex step of families of element matrices: time, memory and certificate for 9 and 100
plates of 17 numbers each and 100 and 1000 beams of 9, by Clarabel and SCS, on 320 random equations
(far fewer than numbers) and a prior of 0.3, in a trust region.

`python tests/benchmarks/test_generic.py KIND ELEMENTS SOLVER` is one measurement in a process of
its own; the test runs them and prints the table. Seconds are those of the processor, on one
thread.
"""

from __future__ import annotations

import json
import os
import resource
import subprocess
import sys
import time
from pathlib import Path

import numpy as np

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.convex import SolverChoice  # noqa: E402
from cvxupdate.convex.step import CompiledStep  # noqa: E402
from cvxupdate.fe.build import build_model  # noqa: E402
from cvxupdate.spec import read_text  # noqa: E402
from cvxupdate.system import LinearSystem  # noqa: E402
from cvxupdate.update.parts import step_problem  # noqa: E402
from validation import make_generic as mg  # noqa: E402

EQUATIONS, NOISE, PRIOR = 320, 0.01, 0.3
PATIENCE = 900  # seconds
ROW = '{{ elements = "all", of = "generic", each = "element", name = "{}", family = {} }}'
PLATE = ROW.format("p", '{ matrices = ["K"], classes = [[1, 5, 8, 9], [2, 7], [3], [4, 6]] }')
BEAM = ", ".join(
    (
        ROW.format("k", '{ matrices = ["K"], classes = "none" }'),
        ROW.format("m", '{ matrices = ["M"] }'),
    )
)
CASES = (("plate", 9), ("plate", 100), ("beam", 100), ("beam", 1000))


def structure(kind: str, elements: int) -> str:
    """[model] of a free plate of n × n elements, or a free beam."""
    if kind == "plate":
        return mg.plate_text(round(elements**0.5))
    nodes = {1 + i: (0.1 * i, 0.0) for i in range(elements + 1)}
    rows = ",\n".join(f"{{ id = {i + 1}, nodes = [{1 + i}, {2 + i}] }}" for i in range(elements))
    section = '[model.sections.bar]\nshape = "rectangle"\nwidth = 0.02\nheight = 0.03\n'
    block = (
        '[[model.elements]]\ntype = "beam2d"\nmass = "lumped"\nmaterial = "steel"\n'
        f'section = "bar"\nrows = [{rows}]\n'
    )
    return mg.model_text('"y", "rz"', nodes, {"steel": (mg.E, 7850.0, 0.0)}, section, block)


def measured(kind: str, elements: int, solver: str) -> dict[str, float | str]:
    """One step, once with what is done only once, and again."""
    update = f'[update]\nmethod = "rfm"\nparameters = [ {PLATE if kind == "plate" else BEAM} ]\n'
    prior = f'[[regularisation]]\nkind = "prior"\ndeviation = {PRIOR}\nweight = 1.0\n'
    spec = read_text(f"{structure(kind, elements)}\n{update}\n{prior}", Path("bench.toml"))
    model = build_model(spec)
    problem, n = step_problem(spec, model, []), len(model.parameters)
    rng = np.random.default_rng(0)
    A = rng.normal(size=(EQUATIONS, n)) / np.sqrt(n)
    b = A @ (0.8 * rng.normal(size=n)) + NOISE * rng.normal(size=EQUATIONS)
    names = tuple(q.name for q in model.parameters)
    rows = tuple(f"r{i}" for i in range(EQUATIONS))
    system = LinearSystem(A, b, np.full(EQUATIONS, 1.0 / NOISE), names, rows)
    compiled = CompiledStep(problem, EQUATIONS, SolverChoice(solver))
    seconds = []
    for radius in (3.0, 2.9):
        begin = time.process_time()
        step = compiled.solve(system, np.zeros(n), np.full(n, radius))
        seconds.append(time.process_time() - begin)
    return {
        "numbers": n,
        "cones": len(problem.clauses),
        "first": seconds[0],
        "again": seconds[1],
        "status": step.status,
        "certificate": step.certificate.worst,
        "memory": resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024,
    }


def test_the_step_of_many_families() -> None:
    """Every answer that comes in a quarter of an hour is certified."""
    print(
        "\n| elements | numbers | cones | solver | first, again [s] | memory [MB] | certificate |"
    )
    print("|---|---|---|---|---|---|---|")
    for kind, elements in CASES:
        for solver in ("CLARABEL", "SCS"):
            command = [sys.executable, __file__, kind, str(elements), solver]
            env = {**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"}
            try:
                out = subprocess.run(
                    command, capture_output=True, text=True, check=True, env=env, timeout=PATIENCE
                )
            except subprocess.TimeoutExpired:
                print(
                    f"| {elements} {kind}s | | | {solver} | more than {PATIENCE} | | |", flush=True
                )
                continue
            m = json.loads(out.stdout)
            print(
                f"| {elements} {kind}s | {m['numbers']} | {m['cones']} | {solver} | "
                f"{m['first']:.1f}, {m['again']:.2f} | {m['memory']:.0f} | "
                f"{m['status']} {m['certificate']:.0e} |",
                flush=True,
            )
            assert m["status"] == "optimal", (kind, elements, solver)


if __name__ == "__main__":
    print(json.dumps(measured(sys.argv[1], int(sys.argv[2]), sys.argv[3])))
