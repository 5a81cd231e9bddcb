"""Derivatives of mode shapes by Nelson's method on a plate of 1e5 DOFs: time of the processor and
peak memory of the whole process, the model and its modes in it.

Five modes at 20 sensors, ten parameters (Young's modulus and density of five strips). ``own``: a
factorisation of K − λM for each mode, one right-hand side for each parameter. ``shared``: conjugate
gradients with the factors of K that found the modes, all modes together, a right-hand side for each
mode (a functional of its entries at the sensors, as the MAC is). The test asks that both agree and
that neither needs more than `STATED`.

`python tests/benchmarks/test_nelson.py N` measures in a process of its own (Linux).
"""

from __future__ import annotations

import json
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.fe.continued import continued_modes  # noqa: E402
from cvxupdate.fe.model import Model  # noqa: E402
from cvxupdate.fe.modes import model_modes  # noqa: E402
from cvxupdate.fe.parameters import Parameter, Target, unit_of  # noqa: E402
from cvxupdate.residual.derivatives import derivatives_of  # noqa: E402
from cvxupdate.residual.eigen import (  # noqa: E402
    adjoint_shapes,
    functional_derivatives,
    shape_motion,
)
from cvxupdate.residual.nelson import SharedSolver  # noqa: E402
from tests.benchmarks.test_modes import plate  # noqa: E402

MODES, STRIPS, SENSORS = 5, 5, 20
STATED = 1500.0  # MB at 1e5 DOFs, SuperLU's factors (1325 measured)


def strips(size: int) -> Model:
    """The clamped plate of about so many DOFs, E and rho of each of five strips its parameters."""
    model = plate(size, True)
    rows = np.array_split(np.arange(len(model.blocks[0].ids)), STRIPS)
    parameters = tuple(
        Parameter(
            f"{k}.{of}",
            of,
            (Target(0, part, (of,), np.full((1, len(part)), nominal)),),
            -0.5,
            1.0,
            nominal,
            nominal,
            unit_of(of),
        )
        for k, part in enumerate(rows)
        for of, nominal in (("E", 207e9), ("rho", 7850.0))
    )
    return replace(model, parameters=parameters)


def begin() -> float:
    """The time; the peak of the memory is measured from here."""
    Path("/proc/self/clear_refs").write_text("5")
    return time.process_time()


def peak() -> float:
    """MB."""
    status = Path("/proc/self/status").read_text()
    return next(float(x.split()[1]) for x in status.splitlines() if x.startswith("VmHWM")) / 1024


def measure(size: int) -> dict[str, Any]:
    """Seconds and MB of either way, and the largest difference of what both give."""
    model = strips(size)
    m = model.matrices()
    modes = model_modes(model, MODES + 4, model.zero(), m)
    d = derivatives_of(model, model.zero())
    sensors = np.linspace(0, model.size // 3 - 1, SENSORS).astype(int) * 3
    rng = np.random.default_rng(0)
    g = np.zeros((model.size, MODES))
    g[sensors] = rng.standard_normal((SENSORS, MODES))
    out: dict[str, Any] = {"dofs": model.size}
    start = begin()
    found = continued_modes(m, modes, MODES + 2)
    assert found is not None
    values = found.modes.eigenvalues
    solver = SharedSolver(
        found.mass, found.factor, values[: MODES + 2], found.modes.shapes[:, : MODES + 2]
    )
    same = np.arange(MODES + 2)[:, None] == np.arange(MODES)[None, :]
    y = solver.solve(values[:MODES], g, same)
    shared = [
        functional_derivatives(values[i], found.modes.shapes[:, i], g[:, [i]], y[:, [i]], d)[0]
        for i in range(MODES)
    ]
    out |= {"shared s": time.process_time() - start, "shared MB": peak()}
    del solver, y
    start = begin()
    own = []
    for i in range(MODES):
        lam, phi = float(values[i]), found.modes.shapes[:, i]
        moved = shape_motion(
            found.modes, i, lambda f, lam=lam, phi=phi: adjoint_shapes(m, lam, phi, f), m, d
        )
        own.append(g[:, i] @ moved)
    out |= {"own s": time.process_time() - start, "own MB": peak()}
    size_of = np.abs(np.array(own)).max(axis=1)
    out["apart"] = float((np.abs(np.array(own) - np.array(shared)).max(axis=1) / size_of).max())
    return out


@pytest.mark.slow
def test_memory_and_agreement() -> None:
    done = subprocess.run(
        [sys.executable, __file__, "100000"], capture_output=True, text=True, timeout=1800, cwd=ROOT
    )
    assert done.returncode == 0, done.stderr
    found = json.loads(done.stdout.splitlines()[-1])
    print(found)
    assert max(found["own MB"], found["shared MB"]) <= STATED
    assert found["apart"] <= 1e-6


if __name__ == "__main__":
    print(json.dumps(measure(int(sys.argv[1]))))
