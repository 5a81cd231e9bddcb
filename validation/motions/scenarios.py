"""The five scenarios of a paper on model-form errors, as time histories of one cantilever: wrong
beam theory, damping, boundary, material, local damage (arXiv 2601.05297, which corrects states by
latent forces and names nothing).

``python -m validation.motions.scenarios [NAME …] [--out DIR] [--judge]`` writes a folder for each
(a problem file, three runs at different levels, the loudest but one held out) and, with
``--judge``, prints what `diagnose` says of it. Bending only, Hermite elements three times as fine
as the file's, marched by Runge and Kutta's rule in modal coordinates: nothing is shared with the
package.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numba
import numpy as np
from numpy.typing import NDArray
from scipy.linalg import eigh
from scipy.signal import resample

from validation import calibrate

Real = NDArray[np.float64]
E, NU, RHO, KAPPA = 207e9, 0.3, 7850.0, 5.0 / 6.0
LENGTH, WIDTH = 0.6, 0.03  # m
COUNT, FINER, MODES, ZETA = 20, 3, 6, 0.01  # elements of the file, parts of each, modes marched
LEVELS, SAMPLES, NOISE, STEPS = (1.0, 4.0, 3.0), 4096, 0.01, 24  # the last level is held out
SENSORS, DRIVE = (0.3, 0.55, 0.8, 1.0), 0.45  # of the length
GAUSS = ((-(0.6**0.5), 5.0 / 9.0), (0.0, 8.0 / 9.0), (0.6**0.5, 5.0 / 9.0))
PEAK = 0.1  # of the largest moment of the loudest run: what a softening material lacks of it


@dataclass(frozen=True)
class Scenario:
    """``height`` of the bar (m); ``shear``: it deforms in shear; ``clamp`` (N·m/rad, infinite:
    rigid) at its foot; ``damage``: the stiffness of one element of the file, as a factor; ``loss``
    (1/s) proportional to mass; ``material``: it softens as it bends."""

    height: float = 0.008
    shear: bool = False
    clamp: float = np.inf
    damage: float = 1.0
    loss: float = 0.0
    material: bool = False


WHERE = 7  # the damaged element
SCENARIOS = {
    "theory": Scenario(height=0.06, shear=True),
    "damping": Scenario(loss=6.0),
    "boundary": Scenario(clamp=2.5e4),
    "material": Scenario(material=True),
    "damage": Scenario(damage=0.6),
}


@dataclass(frozen=True)
class Beam:
    """``K``, ``M`` of all DOFs (w, dw/dx of every node), the rows of curvature ``bend`` (points,
    DOFs) with their weights ``stiff`` (EI times length)."""

    K: Real
    M: Real
    bend: Real
    stiff: Real

    def row(self, part: float) -> int:
        """The DOF w at a part of the length."""
        return 2 * round(part * COUNT) * FINER


def beam(s: Scenario) -> Beam:
    """The structure as it is, its foot still free but for the stiffness of a clamp that gives."""
    n, e = COUNT * FINER, LENGTH / (COUNT * FINER)
    I, A = WIDTH * s.height**3 / 12.0, WIDTH * s.height
    phi = 12.0 * E * I / (KAPPA * E / (2.0 + 2.0 * NU) * A * e**2) if s.shear else 0.0
    size = 2 * (n + 1)
    K, M, bend, stiff = np.zeros((size, size)), np.zeros((size, size)), [], []
    unit = np.array(
        [
            [12.0, 6 * e, -12.0, 6 * e],
            [6 * e, (4 + phi) * e * e, -6 * e, (2 - phi) * e * e],
            [-12.0, -6 * e, 12.0, -6 * e],
            [6 * e, (2 - phi) * e * e, -6 * e, (4 + phi) * e * e],
        ]
    )
    mass = np.array(
        [
            [156.0, 22 * e, 54.0, -13 * e],
            [22 * e, 4 * e * e, 13 * e, -3 * e * e],
            [54.0, 13 * e, 156.0, -22 * e],
            [-13 * e, -3 * e * e, -22 * e, 4 * e * e],
        ]
    )
    turn = np.array(
        [
            [36.0, 3 * e, -36.0, 3 * e],
            [3 * e, 4 * e * e, -3 * e, -e * e],
            [-36.0, -3 * e, 36.0, -3 * e],
            [3 * e, -e * e, -3 * e, 4 * e * e],
        ]
    )
    for i in range(n):
        at = slice(2 * i, 2 * i + 4)
        part = s.damage if i // FINER + 1 == WHERE else 1.0
        K[at, at] += part * E * I / (e**3 * (1.0 + phi)) * unit
        M[at, at] += RHO * A * e / 420.0 * mass + RHO * I / (30.0 * e) * turn
        for x, w in GAUSS:
            row = np.zeros(size)
            row[at] = [6 * x / e**2, (3 * x - 1) / e, -6 * x / e**2, (3 * x + 1) / e]
            bend.append(row)
            stiff.append(E * I * 0.5 * e * w)
    if np.isfinite(s.clamp):
        K[1, 1] += s.clamp
    return Beam(K, M, np.array(bend), np.array(stiff))


@numba.njit(cache=True)
def marched(square, slow, push, bend, stiff, soft, force, step):  # type: ignore[no-untyped-def]
    """Second rates (samples, modes) of q'' + slow q' + square q − Σ stiff κ (1 − 1/√(1 + soft κ²))
    bendᵀ = push f, κ = bend q, the force given at every half step; by Runge and Kutta's classical
    rule."""
    n, count = len(square), (len(force) - 1) // (2 * STEPS) + 1
    out = np.zeros((count, n))
    q, v = np.zeros(n), np.zeros(n)
    rates = np.zeros((4, 2, n))
    for t in range(STEPS * (count - 1) + 1):
        for k in range(4):
            h = 0.0 if k == 0 else step if k == 3 else 0.5 * step
            qk, vk = q + h * rates[k - 1, 0], v + h * rates[k - 1, 1]
            a = push * force[min(2 * t + (k + 1) // 2, len(force) - 1)] - slow * vk - square * qk
            if soft > 0.0:
                curved = bend @ qk
                a += (stiff * curved * (1.0 - 1.0 / np.sqrt(1.0 + soft * curved**2))) @ bend
            rates[k, 0], rates[k, 1] = vk, a
        if t % STEPS == 0:
            out[t // STEPS] = rates[0, 1]
        q = q + step / 6.0 * (rates[0, 0] + 2.0 * rates[1, 0] + 2.0 * rates[2, 0] + rates[3, 0])
        v = v + step / 6.0 * (rates[0, 1] + 2.0 * rates[1, 1] + 2.0 * rates[2, 1] + rates[3, 1])
    return out


@dataclass(frozen=True)
class Bench:
    """A scenario on its bench: modes ``square`` (rad/s)² with rates ``slow``, ``shapes``, curvature
    of each ``bend``; a material whose moment is EI κ / √(1 + ``soft`` κ²), m²; ``rate`` Hz of the
    records."""

    beam: Beam
    square: Real
    slow: Real
    shapes: Real
    bend: Real
    soft: float
    rate: float

    def runs(self, rng: np.random.Generator) -> list[Real]:
        """(samples, 1 + sensors) of force and accelerations at every level, without noise."""
        f = np.fft.rfftfreq(SAMPLES, 1.0 / self.rate)
        first = float(np.sqrt(self.square[0])) / (2.0 * np.pi)
        out = []
        for level in LEVELS:
            band = (f > 0.4 * first) & (f < self.rate / 3.0)
            force = np.fft.irfft(band * np.exp(2j * np.pi * rng.uniform(size=len(f))), SAMPLES)
            force *= level / np.std(force) * np.minimum(1.0, np.arange(SAMPLES) / 64.0)
            whole = resample(np.append(force, np.zeros(64)), (SAMPLES + 64) * 2 * STEPS)
            fine = whole[: 2 * STEPS * (SAMPLES - 1) + 1]  # band-limited, as the records are
            push = self.shapes[self.beam.row(DRIVE)]
            step = 1.0 / (self.rate * STEPS)
            bend = (self.bend, self.beam.stiff, self.soft)
            second = marched(self.square, self.slow, push, *bend, fine, step)
            rows = self.shapes[[self.beam.row(p) for p in SENSORS]]
            out.append(np.column_stack([force, second @ rows.T]))
        return out


def bench(s: Scenario) -> Bench:
    """Modes of a scenario; a softening material lacks `PEAK` of its moment at twice the r.m.s. of
    the first mode in the loudest run."""
    b = beam(s)
    free = slice(2 if np.isinf(s.clamp) else 1, None)
    lam, own = eigh(b.K[free, free], b.M[free, free], subset_by_index=(0, MODES - 1))
    X = np.vstack([np.zeros((len(b.K) - len(own), MODES)), own])
    bend = b.bend @ X
    rate = float(np.round(3.5 * np.sqrt(lam[2]) / (2.0 * np.pi), -1))
    plain = Bench(b, lam, 2.0 * ZETA * np.sqrt(lam) + s.loss, X, bend, 0.0, rate)
    if not s.material:
        return plain
    push = float(X[b.row(DRIVE), 0])
    band = rate / 3.0 - 0.4 * float(np.sqrt(lam[0])) / (2.0 * np.pi)
    # of the first mode under white force of the loudest run (Crandall and Mark 1963)
    power = (max(LEVELS) * push) ** 2 / band / (4.0 * float(plain.slow[0]) * float(lam[0]))
    far = 2.0 * float(np.sqrt(power)) * float(np.abs(bend[:, 0]).max())  # curvature, 1/m
    return replace(plain, soft=((1.0 - PEAK) ** -2 - 1.0) / far**2)


MODEL = """title = "{name}: {count} elements"
[model]
dofs = ["z", "ry"]
nodes = [ {nodes} ]
[model.materials.steel]
E = {E}
nu = {nu}
rho = {rho}
[model.sections.bar]
shape = "rectangle"
width = {width}
height = {height}
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [ {rows} ]
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
[model.damping]
kind = "modal"
zeta = {zeta}
"""
RUN = """[[recordings]]
kind = "time"
use = "{use}"
level = {level}
file = "run{number}.npz"
rate = {rate}
response = "acceleration"
channels = [
{channels}
]
"""


def write(name: str, folder: Path) -> Path:
    """The folder of a scenario; gives its problem file."""
    s, rng = SCENARIOS[name], np.random.default_rng([20261125, list(SCENARIOS).index(name)])
    b = bench(s)
    folder.mkdir(parents=True, exist_ok=True)
    nodes = ", ".join(f"{{ id = {i + 1}, x = {LENGTH * i / COUNT} }}" for i in range(COUNT + 1))
    rows = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "bar" }}' for i in range(COUNT)
    )
    text = MODEL.format(
        name=name,
        count=COUNT,
        nodes=nodes,
        rows=rows,
        E=E,
        nu=NU,
        rho=RHO,
        width=WIDTH,
        height=s.height,
        zeta=ZETA,
    )
    places = [("force", DRIVE), *(("acceleration", p) for p in SENSORS)]
    channels = ",\n".join(
        f'  {{ column = {k}, quantity = "{q}", node = {1 + round(p * COUNT)}, dof = "z" }}'
        for k, (q, p) in enumerate(places)
    )
    for k, (level, data) in enumerate(zip(LEVELS, b.runs(rng), strict=True)):
        spread = NOISE * np.std(data, axis=0) * np.array([0.1, *[1.0] * len(SENSORS)])
        np.savez(folder / f"run{k}.npz", data=data + spread * rng.standard_normal(data.shape))
        use = "hold-out" if k == len(LEVELS) - 1 else "fit"
        text += RUN.format(use=use, level=level, number=k, rate=b.rate, channels=channels)
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path


def main(arguments: Sequence[str] | None = None) -> int:
    """Write, and judge where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", default=list(SCENARIOS), metavar="NAME")
    parser.add_argument("--out", type=Path, default=Path("out/motions/scenarios"))
    parser.add_argument("--judge", action="store_true", help="diagnose each")
    o = parser.parse_args(arguments)
    for name in o.names:
        path = write(name, o.out / name)
        print(path, flush=True)
        if o.judge:
            found = calibrate.diagnose(path)
            said = [
                f"{f['physics']} at {f['location']} {f['parameters']} ({f['confidence']:.2f})"
                for f in found["findings"]
            ]
            print(f"  {found['verdict']}: {'; '.join(said) or 'nothing'}", flush=True)
            print(f"  {found['fit']}", flush=True)
    return 0


if __name__ == "__main__":
    sys.exit(main())
