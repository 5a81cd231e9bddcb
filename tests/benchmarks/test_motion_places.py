"""What a whole diagnosis costs by the number of places where something may be missing: a cantilever
of 10, 100 and 1000 elements with a hardening spring near its end that the file leaves out, two
levels fitted, a third held out, four accelerometers. Processor seconds; the usual budget stands.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.correlate.response_error import simulated_history
from cvxupdate.study import diagnose, open_problem
from validation.real.laws import FINER, finer

SAMPLES, LEVELS, NOISE = 4096, (1.0, 4.0, 2.5), 0.005
BAND = 3.2  # times the second natural frequency: the rate
K3, FORCE = 2e9, 1.5  # N/m³; N r.m.s. at the lowest level
MODEL = """title = "{count} places"
[model]
dofs = ["z", "ry"]
nodes = [ {nodes} ]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.03
height = 0.008
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [ {rows} ]
{spring}
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
[model.damping]
kind = "modal"
zeta = 0.01
{recordings}
"""
SPRING = """[[model.elements]]
type = "cubic_spring"
rows = [ {{ id = 9001, nodes = [{node}], dof = "z", k3 = {k3} }} ]
"""
RUN = """[[recordings]]
kind = "time"
use = "{use}"
level = {level}
file = "{file}"
rate = {rate}
response = "acceleration"
channels = [ {channels} ]
"""


def node_at(part: float, count: int) -> int:
    """The node at a part of the length."""
    return 1 + round(part * count)


def text(count: int, spring: str, runs: str) -> str:
    nodes = ", ".join(f"{{ id = {i + 1}, x = {0.6 * i / count} }}" for i in range(count + 1))
    rows = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "bar" }}' for i in range(count)
    )
    return MODEL.format(count=count, nodes=nodes, rows=rows, spring=spring, recordings=runs)


def written(count: int, folder: Path) -> tuple[Path, int]:
    """(a problem file with its recordings, the node where its spring is)."""
    rate, rng, there = 1500.0, np.random.default_rng(5), node_at(0.8, count)
    places = [node_at(p, count) for p in (0.3, 0.5, 0.7, 1.0)]
    channels = [f'{{ column = 0, quantity = "force", node = {node_at(0.5, count)}, dof = "z" }}']
    channels += [
        f'{{ column = {k + 1}, quantity = "acceleration", node = {n}, dof = "z" }}'
        for k, n in enumerate(places)
    ]
    f = np.fft.rfftfreq(SAMPLES, 1.0 / rate)
    runs = ""
    for k, level in enumerate(LEVELS):
        spectrum = ((f > 8.0) & (f < 250.0)) * np.exp(2j * np.pi * rng.uniform(size=len(f)))
        push = np.fft.irfft(spectrum, SAMPLES)
        push *= FORCE * level / np.std(push) * np.minimum(1.0, np.arange(SAMPLES) / 40.0)
        np.savez(folder / f"run{k}.npz", data=np.column_stack([push, np.zeros((SAMPLES, 4))]))
        runs += RUN.format(
            use="fit" if k < 2 else "hold-out",
            level=level,
            file=f"run{k}.npz",
            rate=rate,
            channels=", ".join(channels),
        )
    full, path = folder / "full.toml", folder / "problem.toml"
    full.write_text(text(count, SPRING.format(node=there, k3=K3), runs))
    path.write_text(text(count, "", runs))
    _, model, histories = open_problem(full)
    for k, history in enumerate(histories):
        data = simulated_history(model, finer(history)).data[::FINER]
        own = np.std(data[:, 1:], axis=0)
        data[:, 1:] += NOISE * own * rng.standard_normal(data[:, 1:].shape)
        np.savez(folder / f"run{k}.npz", data=data)
    return path, there


@pytest.mark.parametrize("count", [10, 100, 1000])
def test_places(count: int, tmp_path: Path) -> None:
    path, there = written(count, tmp_path)
    begin, clock = time.process_time(), time.perf_counter()
    found = diagnose(path)
    used, passed = time.process_time() - begin, time.perf_counter() - clock
    first = found.findings[0]
    off = abs(first.place.nodes[0] - there) / count
    print(
        f"\n{count} places: {used:.1f} s of the processor ({passed:.0f} s by the clock), "
        f"{first.physics} {100.0 * off:.1f} % of the length from its place, "
        f"confidence {first.confidence:.2f}, {dict(first.parameters)}"
    )
    assert first.physics == "cubic_stiffness" and off < 0.1
