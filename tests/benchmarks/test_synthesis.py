"""CPU time of the three ways of `fe.synthesis` on a clamped plate with hysteretic damping: where
its switch points come from."""

import importlib.util
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.fe.synthesis import WAYS, frequency_responses

SIZES, POINTS = (126, 600, 2500), (10, 20, 80, 400)
SENSORS, FORCES = 8, 2
WITHIN = 4.0
"""Times the best way that the chosen one may take: half the distance between neighbouring rows."""
SMALL = 0.05
"""Seconds below which nobody waits."""


def plate(size):
    spec = importlib.util.spec_from_file_location(
        "bench_rfm", Path(__file__).with_name("test_rfm.py")
    )
    module = importlib.util.module_from_spec(spec)
    sys.modules["bench_rfm"] = module
    spec.loader.exec_module(module)
    return module.plate(size, 4, True)


def seconds(model, points, way):
    at = np.linspace(5, model.size - 3, SENSORS).astype(int)
    f = np.linspace(5.0, 160.0, points)
    begin = time.process_time()
    H = frequency_responses(model, f, at, at[:FORCES], way=way)
    return time.process_time() - begin, H


@pytest.mark.slow
@pytest.mark.parametrize("size", SIZES)
def test_the_chosen_way_is_near_the_best(size):
    model = plate(size)
    for points in POINTS:
        times = {way: seconds(model, points, way) for way in (*WAYS, None)}
        best = min(t for t, _ in times.values())
        exact = times["direct"][1]
        print(model.size, points, {way: round(t, 3) for way, (t, _) in times.items()})
        assert times[None][0] < max(WITHIN * best, SMALL), points
        for _, H in times.values():
            assert np.linalg.norm(H - exact) < 1e-6 * np.linalg.norm(exact)
