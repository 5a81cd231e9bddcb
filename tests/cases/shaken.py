"""Two masses on springs shaken by the motion laboratory: linear, with a law, or changing."""

from __future__ import annotations

from functools import cache

import numpy as np

from cvxupdate.recordings.types import Channel, Origin, TimeHistory
from validation.motions.drives import FINER, Drive
from validation.motions.laws import Law
from validation.motions.march import Bench, Change, march
from validation.rigs.bench import Structure
from validation.rigs.response import modal

K, M = np.array([[9e4, -5e4], [-5e4, 5e4]]), np.diag([3.0, 2.0])
ZETA = (0.02, 0.03)
FREQUENCIES = np.sqrt(np.linalg.eigvals(np.linalg.solve(M, K)).real) / (2.0 * np.pi)
RATE, SAMPLES, NOISE = 160.0, 2000, 0.003
MODEL = """
title = "Two masses"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0, y = 0.0, z = 0.0 }, { id = 2, x = 1.0, y = 0.0, z = 0.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [
  { id = 1, nodes = [1], k = 4.0e4, group = "lower" },
  { id = 2, nodes = [1, 2], k = 5.0e4, group = "upper" },
]
[[model.elements]]
type = "mass"
rows = [
  { id = 11, nodes = [1], m = 3.0, group = "a" },
  { id = 12, nodes = [2], m = 2.0, group = "b" },
]
[model.damping]
kind = "modal"
zeta = [0.02, 0.03]
"""


@cache
def shaken(
    law: Law | None = None,
    level: float = 1.0,
    seed: int = 0,
    start: float = 0.0,
    end: float = 0.0,
    name: str = "run",
) -> TimeHistory:
    """A random force at mass 2, accelerations of both; ``law`` at mass 1 against ground; the
    stiffness of the spring between them changes from ``start`` to ``end``. Unit level moves mass 1
    by about 1 mm."""
    structure = Structure({"all": (K, M)}, (0.0 * K, 0.0 * M), (), lambda n, _: np.eye(2)[n - 1])
    bench = Bench.of(modal(structure, {}, np.array(ZETA)), 1e3, [])
    drive = Drive("random", 5.0, 45.0, RATE, SAMPLES)
    rng = np.random.default_rng([7, seed])
    force = 60.0 * level * drive.force(rng)
    upper = bench.basis.T @ (5e4 * np.array([[1.0, -1.0], [-1.0, 1.0]])) @ bench.basis
    change = Change(upper, start, end) if start or end else None
    laws = [] if law is None else [(law, np.array([1.0, 0.0]))]
    motion = march(bench, laws, np.array([0.0, 1.0]), force, RATE * FINER, change)
    clean = drive.recorded(motion.second @ bench.basis.T)
    heard = clean + NOISE * 60.0 / 2.0 * rng.standard_normal(clean.shape)
    channels = (
        Channel(2, "x", "force"),
        Channel(1, "x", "acceleration"),
        Channel(2, "x", "acceleration"),
    )
    data = np.column_stack([drive.recorded(force), heard])
    return TimeHistory(Origin(name, f"{name}.npz", "fit", level), RATE, channels, data)


def reach(history: TimeHistory) -> float:
    """R.m.s. acceleration of mass 1."""
    return float(np.std(history.data[:, 1]))
