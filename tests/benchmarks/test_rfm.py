"""One iteration of the response function method (rows and derivatives at one p): time and memory at
about 114, 1e3, 1e4 and 1e5 DOFs, 10 sensors, 2 forces, 20 lines, 40 and 1000 parameters, undamped
(real) and damped (complex); against the bare factorisations of the same matrices in the same run,
the reduced basis, and, where it still runs, the textbook: the full H and a full ∂Z/∂p_j for every
parameter (3.24).

`python tests/benchmarks/test_rfm.py METHOD DOFS PARAMETERS DAMPED` is one measurement in a process
of its own; the test runs them and prints the table. Seconds are those of the processor, on one
thread, so that what else runs on the machine counts little.
"""

from __future__ import annotations

import importlib.util
import json
import os
import resource
import subprocess
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.fe.parameters import Parameter, Target  # noqa: E402
from cvxupdate.fe.responses import (  # noqa: E402
    condenser,
    dynamic_stiffness,
    factor_at,
    matrices_with_damping,
)
from cvxupdate.fe.synthesis import receptance  # noqa: E402
from cvxupdate.residual.frf import FrfResidual  # noqa: E402
from cvxupdate.residual.frf_data import FrfData  # noqa: E402
from cvxupdate.residual.frf_reduced import ReducedResidual, make_basis  # noqa: E402

LINES, SENSORS, FORCES = 20, 10, 2
TEXTBOOK_LINES = 1


def plate(size, parameters, damped):
    """The clamped plate of the benchmark of modes, its elements shared out among half the
    parameters for stiffness and half for mass."""
    spec = importlib.util.spec_from_file_location(
        "bench_modes", Path(__file__).with_name("test_modes.py")
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["bench_modes"] = module
    spec.loader.exec_module(module)
    model = module.plate(size, True)
    block = model.blocks[0]
    if damped:
        block = replace(
            block, properties={**block.properties, "eta": np.full(len(block.ids), 0.02)}
        )
    half = min(parameters // 2, len(block.ids))
    patches = np.array_split(np.arange(len(block.ids)), half)
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
    return replace(model, blocks=(block,), parameters=tuple(made))


def recorded(model):
    """Receptances of the model itself at seeded sensors (translations), lines spread over its first
    modes."""
    rng = np.random.default_rng(0)
    z = np.flatnonzero(model.dof_kind == 2)
    at = np.sort(rng.choice(z, SENSORS, replace=False))
    f = np.linspace(6.3, 151.7, LINES)
    X = receptance(model, f, at, at[:FORCES])
    return FrfData(
        "plate",
        "fit",
        f,
        X,
        0.01 * np.abs(X) + 1e-3 * np.abs(X).max(),
        at,
        at[:FORCES],
        None,
        True,
        np.ones((SENSORS, FORCES), dtype=bool),
    )


def peak():
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024


def textbook(model, data):
    """H in full at every line, and H_n ∂Z_j H_f with a full ∂Z_j for each parameter."""
    m = model.matrices()
    d = [model.derivative(j) for j in range(len(model.parameters))]
    out = []
    for f in data.frequency:
        w = 2 * np.pi * f
        H = np.linalg.inv(dynamic_stiffness(m, w).toarray())
        for blocks in d:
            full = np.zeros(H.shape, dtype=H.dtype)
            for b in blocks:
                local = (
                    (b.K if b.K is not None else 0)
                    + (1j * b.D if b.D is not None else 0)
                    - w**2 * (b.M if b.M is not None else 0)
                )
                for e, dofs in enumerate(b.dofs):
                    keep = dofs >= 0
                    full[np.ix_(dofs[keep], dofs[keep])] += local[e][np.ix_(keep, keep)]
            out.append((H @ full @ H)[np.ix_(data.responses, data.references)])
    return out


def measure(method, size, parameters, damped):
    """{"dofs", "seconds", "memory", and for the methods that need it "prepare"}."""
    model = plate(size, parameters, damped)
    data = recorded(model)
    p = 0.01 * np.ones(len(model.parameters))
    residual = FrfResidual(model, (data,), "receptance")
    out = {"dofs": model.size, "parameters": len(model.parameters), "prepare": 0.0}
    run = None
    if method == "full":
        residual.evaluate(p)  # caches warm: an iteration, not the first call
        run = lambda: residual.evaluate(p)  # noqa: E731
    elif method == "factor":
        m = matrices_with_damping(model, p)
        # one at a time: they are most of the memory
        run = lambda: [factor_at(m, f) and None for f in data.frequency]  # noqa: E731
    elif method == "factor+solve":
        m = matrices_with_damping(model, p)
        run = lambda: [  # noqa: E731
            condenser(m, data.responses, data.references).at(f) and None for f in data.frequency
        ]
    elif method == "reduced":
        begin = time.process_time()
        basis = make_basis(
            model, model.zero(), float(data.frequency.max()), data.responses, (5.0, 80.0, 160.0)
        )
        out["prepare"] = time.process_time() - begin
        out["basis"] = basis.V.shape[1]
        reduced = ReducedResidual(residual, basis)
        _ = residual.weights
        zero = model.zero()
        a, b = residual.evaluate(zero), reduced.evaluate(zero)
        out["agree"] = float(np.abs(a.jacobian - b.jacobian).max() / np.abs(a.jacobian).max())
        run = lambda: reduced.evaluate(p)  # noqa: E731
    elif method == "textbook":
        data = data.at(np.arange(0, LINES, LINES // TEXTBOOK_LINES))
        run = lambda: textbook(model, data)  # noqa: E731
    else:
        raise ValueError(method)
    before = peak()
    times = []
    for _ in range(1 if size > 50_000 or method == "textbook" else 3 if size > 5000 else 15):
        begin = time.process_time()
        run()
        times.append(time.process_time() - begin)
    scale = LINES / TEXTBOOK_LINES if method == "textbook" else 1  # every line costs the same
    return {**out, "seconds": scale * min(times), "memory": peak() - before, "peak": peak()}


def apart(*arguments):
    done = subprocess.run(
        [sys.executable, __file__, *map(str, arguments)],
        capture_output=True,
        text=True,
        check=True,
        timeout=3000,
        env={**os.environ, "OPENBLAS_NUM_THREADS": "1", "OMP_NUM_THREADS": "1"},
    )
    return json.loads(done.stdout.splitlines()[-1])


@pytest.mark.parametrize("damped", [0, 1])
def test_one_iteration(damped):
    print(
        "\n    DOFs  params   full s  factor s  ratio   peak MB  reduced ms  (basis s, k, "
        "agree)   full/reduced   textbook s"
    )
    for size in (114, 1_000, 10_000, 100_000):
        for parameters in (40, 1000):
            if parameters == 1000 and size == 114:
                continue
            full, bare, reduced = (
                apart(m, size, parameters, damped) for m in ("full", "factor", "reduced")
            )
            book = (
                apart("textbook", size, parameters, damped)["seconds"]
                if size <= 1000 and parameters == 40
                else float("nan")
            )
            ratio = full["seconds"] / bare["seconds"]
            print(
                f"{full['dofs']:8d} {full['parameters']:7d} {full['seconds']:8.3f} "
                f"{bare['seconds']:9.3f} {ratio:6.2f} {full['peak']:9.0f} "
                f"{1e3 * reduced['seconds']:11.1f}  ({reduced['prepare']:.1f} s, "
                f"{reduced['basis']}, {reduced['agree']:.0e}) "
                f"{full['seconds'] / reduced['seconds']:12.0f} {book:14.3f}",
                flush=True,
            )
            assert reduced["agree"] < 1e-4


if __name__ == "__main__":
    print(
        json.dumps(measure(sys.argv[1], int(sys.argv[2]), int(sys.argv[3]), bool(int(sys.argv[4]))))
    )
