"""Exact members beside the coarsest mesh of the same accuracy: DOFs, CPU time per FRF line and per
derivative, for 10, 100 and 1000 members in one process.

Members of a stepped strip 0.3 m long, clamped at one end, driven and measured at the nodes between
them; lines between 20 and 2000 Hz. The mesh is refined by doubling until its responses are within
`ACCURACY` of the exact ones.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.fe.model import Model  # noqa: E402
from cvxupdate.fe.parameters import Parameter, Target  # noqa: E402
from cvxupdate.fe.synthesis import frequency_responses  # noqa: E402
from cvxupdate.residual.contraction import derivatives  # noqa: E402
from tests.cases.elements import SPACE, build, chain, lines  # noqa: E402

ACCURACY = 1e-3
LINES = np.linspace(20.0, 2000.0, 40)
MOST = 32
MATERIAL = {"E": 207e9, "G": 79.6e9, "rho": 7850.0, "eta": 0.02}
SECTION = {"shape": "rectangle", "width": 0.04, "height": 0.01, "kappa": 0.85}


def strip(kind: str, members: int, parts: int) -> tuple[Model, np.ndarray]:
    """The model with E of every member as a parameter, and z of its inner nodes."""
    points = [(0.3 * k / parts, 0.0, 0.0) for k in range(members * parts + 1)]
    text = lines(kind, points, chain(members * parts), SPACE, SECTION, MATERIAL)
    held = {"nodes": [1], "dofs": SPACE}
    model = build({**text, "supports": [held]})
    E = model.blocks[0].properties["E"]
    moved = [np.arange(k * parts, (k + 1) * parts) for k in range(members)]
    free = tuple(
        Parameter(f"m{k}.E", "E", (Target(0, rows, ("E",), E[rows][None]),), -1, 1, 1, 1, "Pa")
        for k, rows in enumerate(moved)
    )
    names = {name: i for i, name in enumerate(model.labels)}
    at = np.linspace(1, members, min(members, 8)).astype(int)
    return replace(model, parameters=free), np.array([names[f"n{k * parts + 1}.z"] for k in at])


def timed(call: Callable[[], object]) -> float:
    """CPU seconds, the least of three."""
    took = []
    for _ in range(3):
        begin = time.process_time()
        call()
        took.append(time.process_time() - begin)
    return min(took)


def figures(model: Model, at: np.ndarray) -> tuple[float, float]:
    """CPU seconds per FRF line, and per line and derivative."""
    line = timed(lambda: frequency_responses(model, LINES, at, at[-1:], way="direct"))
    d = derivatives(model, model.zero())
    X = np.random.default_rng(0).standard_normal((model.size + 1, len(LINES), 2)) + 0j
    X[-1] = 0.0
    omega, left, right = 2 * np.pi * LINES, np.array([0]), np.array([1])
    each = timed(lambda: d.over_lines(omega, X, left, right))
    return line / len(LINES), each / len(LINES) / len(model.parameters)


@pytest.mark.parametrize("members", [10, 100, 1000])
def test_exact_against_the_mesh_of_equal_accuracy(members: int) -> None:
    exact, at = strip("exact_beam", members, 1)
    H = frequency_responses(exact, LINES, at, at[-1:], way="direct")
    for parts in (1, 2, 4, 8, 16, MOST):
        mesh, places = strip("beam3d", members, parts)
        found = frequency_responses(mesh, LINES, places, places[-1:], way="direct")
        error = np.linalg.norm(found - H) / np.linalg.norm(H)
        if error < ACCURACY:
            break
    assert error < ACCURACY
    ours, theirs = figures(exact, at), figures(mesh, places)
    print(
        f"{members} members: exact {exact.size} DOFs, {1e3 * ours[0]:.2f} ms a line, "
        f"{1e6 * ours[1]:.1f} us a derivative; mesh of {parts} parts {mesh.size} DOFs "
        f"(error {error:.1e}), {1e3 * theirs[0]:.2f} ms, {1e6 * theirs[1]:.1f} us"
    )
    assert exact.size < mesh.size
