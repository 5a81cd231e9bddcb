"""Non-linear and drifting structures of our own making: from a seed a folder with ``problem.toml``,
recordings at four levels and ``truth.toml``, in the form of ``problems/concealed``.

``python -m validation.nonlinear FIRST COUNT [--out DIR] [--judge]``. The structures are marched by
Runge and Kutta's method in modal coordinates, 160 steps in a sample, friction as the steep branch
of tanh, contact and slip as they are: nothing is shared with the package, and scipy's LSODA agrees
(tests/validation/test_nonlinear.py). A seed divisible by three has no non-linear law in it (scatter
alone, or a loose spring); one that leaves 1 on division by six drifts. ``--judge`` diagnoses each
and counts right, wrong and undetermined.
"""

from __future__ import annotations

import argparse
import json
import sys
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numba
import numpy as np
import scipy.signal
from numpy.typing import NDArray
from scipy.linalg import eigh

Real = NDArray[np.float64]
LEVELS = (1.0, 4.0, 2.0, 3.0)  # the last one is held out
SAMPLES = 4096
LAWS = ("cubic_stiffness", "clearance", "dry_friction", "hysteresis", "quadratic_damping")


@dataclass(frozen=True)
class Structure:
    """``K``, ``M`` (n, n) of the drawing; groups' parts of them by name; the problem file's [model]
    in TOML; DOFs as (node, kind) of every row; pairs of rows between which a law may act."""

    K: Real
    M: Real
    parts: Mapping[str, tuple[Real, Real]]
    text: str
    dofs: tuple[tuple[int, str], ...]
    pairs: tuple[tuple[int, ...], ...]
    zeta: float


@dataclass(frozen=True)
class Truth:
    """What is concealed: its physics (None: nothing), its rows, its sizes; ``drift`` of the
    stiffness from the beginning of the first run to the end of the last."""

    physics: str | None
    rows: tuple[int, ...]
    sizes: Mapping[str, float]
    drift: float = 0.0
    loose: str | None = None


def chain(rng: np.random.Generator) -> Structure:
    """Storeys with springs between neighbours and to ground."""
    n = int(rng.integers(3, 6))
    m, k = rng.uniform(4.0, 8.0, n), rng.uniform(3e5, 8e5, n)
    K, M, parts, springs = np.zeros((n, n)), np.zeros((n, n)), {}, []
    for i in range(n):
        own = np.zeros((n, n))
        v = np.zeros(n)
        v[i] = 1.0
        if i:
            v[i - 1] = -1.0
        own += k[i] * np.outer(v, v)
        parts[f"storey {i + 1}"] = (own, np.zeros((n, n)))
        K += own
        nodes = f"[{i}, {i + 1}]" if i else "[1]"
        springs.append(
            f'{{ id = {101 + i}, nodes = {nodes}, k = {k[i]}, group = "storey {i + 1}" }}'
        )
        mass = np.zeros((n, n))
        mass[i, i] = m[i]
        parts[f"mass {i + 1}"] = (np.zeros((n, n)), mass)
        M += mass
    masses = [
        f'{{ id = {201 + i}, nodes = [{i + 1}], m = {m[i]}, group = "mass {i + 1}" }}'
        for i in range(n)
    ]
    zeta = float(rng.uniform(0.006, 0.02))
    nodes = ", ".join(f"{{ id = {i + 1}, x = {i + 1}.0 }}" for i in range(n))
    text = (
        f'[model]\ndofs = ["x"]\nnodes = [ {nodes} ]\n'
        f'[[model.elements]]\ntype = "spring"\ndof = "x"\nrows = [ {", ".join(springs)} ]\n'
        f'[[model.elements]]\ntype = "mass"\nrows = [ {", ".join(masses)} ]\n'
        f'[model.damping]\nkind = "modal"\nzeta = {zeta}\n'
    )
    pairs = (*((i,) for i in range(n)), *((i - 1, i) for i in range(1, n)))
    return Structure(K, M, parts, text, tuple((i + 1, "x") for i in range(n)), pairs, zeta)


def beam(rng: np.random.Generator) -> Structure:
    """A cantilever or a bar on two supports, bending, in consistent Hermite elements."""
    n, L = int(rng.integers(8, 12)), float(rng.uniform(0.5, 0.9))
    b, h, E, rho = 0.03, float(rng.uniform(0.005, 0.01)), 207e9, 7850.0
    EI, mu, e = E * b * h**3 / 12.0, rho * b * h, L / n
    k = (
        EI
        / e**3
        * np.array(
            [
                [12, 6 * e, -12, 6 * e],
                [6 * e, 4 * e * e, -6 * e, 2 * e * e],
                [-12, -6 * e, 12, -6 * e],
                [6 * e, 2 * e * e, -6 * e, 4 * e * e],
            ]
        )
    )
    m = (
        mu
        * e
        / 420.0
        * np.array(
            [
                [156, 22 * e, 54, -13 * e],
                [22 * e, 4 * e * e, 13 * e, -3 * e * e],
                [54, 13 * e, 156, -22 * e],
                [-13 * e, -3 * e * e, -22 * e, 4 * e * e],
            ]
        )
    )
    size = 2 * (n + 1)
    K, M = np.zeros((size, size)), np.zeros((size, size))
    for i in range(n):
        at = slice(2 * i, 2 * i + 4)
        K[at, at] += k
        M[at, at] += m
    clamped = bool(rng.integers(2))
    held = [0, 1] if clamped else [0, size - 2]
    free = [i for i in range(size) if i not in held]
    turn = np.where(np.arange(size) % 2 == 1, -1.0, 1.0)[free]  # ry = −dw/dx
    K, M = (turn[:, None] * A[np.ix_(free, free)] * turn for A in (K, M))
    zeta = float(rng.uniform(0.005, 0.015))
    nodes = ", ".join(f"{{ id = {i + 1}, x = {i * e} }}" for i in range(n + 1))
    rows = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "bar" }}' for i in range(n)
    )
    ends = (
        '[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n'
        if clamped
        else f'[[model.supports]]\nnodes = [1, {n + 1}]\ndofs = ["z"]\n'
    )
    text = (
        f'[model]\ndofs = ["z", "ry"]\nnodes = [ {nodes} ]\n'
        f"[model.materials.steel]\nE = {E}\nnu = 0.3\nrho = {rho}\n"
        f'[model.sections.bar]\nshape = "rectangle"\nwidth = {b}\nheight = {h}\n'
        f'[[model.elements]]\ntype = "beam3d"\nmaterial = "steel"\n'
        f'section = "bar"\nrows = [ {rows} ]\n'
        f'{ends}[model.damping]\nkind = "modal"\nzeta = {zeta}\n'
    )
    dofs = tuple((i // 2 + 1, "z" if i % 2 == 0 else "ry") for i in free)
    pairs = tuple((r,) for r, d in enumerate(dofs) if d[1] == "z")
    return Structure(K, M, {"bar": (K, M)}, text, dofs, pairs, zeta)


def drive(rng: np.random.Generator, n: int, rate: float, band: tuple[float, float]) -> Real:
    """Random, unit r.m.s., from rest."""
    f = np.fft.rfftfreq(n, 1.0 / rate)
    inside = (f >= band[0]) & (f <= band[1])
    x = np.fft.irfft(inside * np.exp(2j * np.pi * rng.uniform(size=len(f))), n)
    x *= np.minimum(1.0, np.arange(n) / (0.01 * n))
    return np.asarray(x / np.std(x))


NAMES = ("", *LAWS)
STEPS = 160  # of Runge and Kutta's method in a sample
FINE = 16  # points in a sample between which the force is straight: band-limited like the record


def law(kind: int, s: Real, x: float, v: float, z: float) -> tuple[float, float]:
    """(force, rate of the memory) of a law with sizes ``s`` at x, v and its memory z."""
    if kind == 1:
        return s[0] * x**3, 0.0
    if kind == 2:
        if s[2] > 0.0:
            deep = max(abs(x) - s[1], 0.0)
            return s[0] * (deep if x > 0.0 else -deep), 0.0
        way = 1.0 if s[1] > 0.0 else -1.0
        return s[0] * way * max(way * x - abs(s[1]), 0.0), 0.0
    if kind == 3:
        return s[0] * np.tanh(v / s[1]), 0.0
    if kind == 4:
        return s[0] * z, v if abs(z) < s[1] / s[0] or z * v < 0.0 else 0.0
    if kind == 5:
        return s[0] * v * abs(v), 0.0
    return 0.0, 0.0


_law = numba.njit(law, cache=True)


def rate_of(
    y: Real,
    n: int,
    lam: Real,
    slow: Real,
    push: Real,
    place: Real,
    kind: int,
    s: Real,
    f: float,
    level: float,
    out: Real,
) -> None:
    """Derivative of (η, η̇, memory)."""
    x = v = 0.0
    for r in range(n):
        x += place[r] * y[r]
        v += place[r] * y[n + r]
    g, memory = _law(kind, s, x, v, y[2 * n])
    for r in range(n):
        out[r] = y[n + r]
        out[n + r] = push[r] * f - place[r] * g - slow[r] * y[n + r] - level * lam[r] * y[r]
    out[2 * n] = memory


_rate = numba.njit(rate_of, cache=True)


@numba.njit(cache=True)
def _march(n, lam, slow, push, place, kind, s, force, h, steps, drift, Y, A):  # type: ignore[no-untyped-def]
    """Classical Runge and Kutta, the force straight between the points of a clock FINE times as
    fast as the samples'."""
    y, k1, k2, k3, k4 = np.zeros((5, 2 * n + 1))
    samples = len(Y)
    part = steps // FINE
    for t in range(samples):
        _rate(
            y,
            n,
            lam,
            slow,
            push,
            place,
            kind,
            s,
            force[t * FINE],
            1.0 + drift[0] + (drift[1] - drift[0]) * t / samples,
            k1,
        )
        Y[t], A[t] = y, k1[n : 2 * n]
        for i in range(steps):
            at, inside = t * FINE + i // part, i % part
            f0 = force[at] + (force[at + 1] - force[at]) * inside / part
            f2 = force[at] + (force[at + 1] - force[at]) * (inside + 1) / part
            f1 = 0.5 * (f0 + f2)
            level = 1.0 + drift[0] + (drift[1] - drift[0]) * (t + i / steps) / samples
            _rate(y, n, lam, slow, push, place, kind, s, f0, level, k1)
            _rate(y + 0.5 * h * k1, n, lam, slow, push, place, kind, s, f1, level, k2)
            _rate(y + 0.5 * h * k2, n, lam, slow, push, place, kind, s, f1, level, k3)
            _rate(y + h * k3, n, lam, slow, push, place, kind, s, f2, level, k4)
            y = y + h / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)


def responses(
    K: Real,
    M: Real,
    zeta: Real,
    truth: Truth,
    at: int,
    force: Real,
    rate: float,
    drift: tuple[float, float],
    kept: int,
) -> tuple[Real, Real, Real]:
    """Accelerations of all rows (samples, n), motion and velocity at the law's place, from rest."""
    lam, phi = eigh(K, M)
    lam, phi = lam[:kept], phi[:, :kept]
    slow = 2.0 * zeta[:kept] * np.sqrt(lam)
    w = np.zeros(len(K))
    if truth.rows:
        w[list(truth.rows)] = (1.0,) if len(truth.rows) == 1 else (-1.0, 1.0)
    place = phi.T @ w
    kind = NAMES.index(truth.physics) if truth.physics in LAWS else 0
    sizes = np.array([*truth.sizes.values(), 0.0, 0.0, 0.0])[:3]
    fine = scipy.signal.resample(np.append(force, np.zeros(64)), (len(force) + 64) * FINE)
    Y, A = np.zeros((len(force), 2 * kept + 1)), np.zeros((len(force), kept))
    _march(
        kept,
        lam,
        slow,
        phi[at].copy(),
        place,
        kind,
        sizes,
        fine,
        1.0 / rate / STEPS,
        STEPS,
        drift,
        Y,
        A,
    )
    return A @ phi.T, Y[:, :kept] @ place, Y[:, kept : 2 * kept] @ place


def draw(
    seed: int,
) -> tuple[Structure, dict[str, Any], Truth, list[tuple[float, Real]], float, list[int], int]:
    """Everything of a case: structure, truth for the file, runs (level, samples × (force, sensors)
    rate, sensor rows, driven row."""
    rng = np.random.default_rng(seed)
    s = (chain if rng.integers(2) else beam)(rng)
    K, M = s.K.copy(), s.M.copy()
    scatter = {
        name: (1.0 + 0.015 * rng.uniform(-1, 1), 1.0 + 0.008 * rng.uniform(-1, 1))
        for name in s.parts
    }
    for name, (k, m) in s.parts.items():
        K += (scatter[name][0] - 1.0) * k
        M += (scatter[name][1] - 1.0) * m
    quiet, drifts = seed % 3 == 0, seed % 6 == 1
    loose = None
    if quiet and seed % 6 == 0 and len(s.parts) > 1:
        loose = f"storey {int(rng.integers(2, len(K) + 1))}"
        K -= float(rng.uniform(0.12, 0.25)) * s.parts[loose][0]
    f = np.sqrt(eigh(K, M, eigvals_only=True)) / (2.0 * np.pi)
    top = 1.3 * f[min(2, len(f) - 1)]
    rate, band = 3.0 * top, (0.4 * f[0], top)
    kept = int(np.sum(f < 2.0 * rate))
    zeta = s.zeta * rng.lognormal(0.0, 0.2, len(K))
    places = [r for r, d in enumerate(s.dofs) if d[1] != "ry"]
    at = int(rng.choice(places))
    count = min(len(places), int(rng.integers(3, 6)))
    sensors = sorted(rng.choice(places, count, replace=False).tolist())
    forces = [level * drive(rng, SAMPLES, rate, band) for level in LEVELS]
    truth = Truth(None, (), {}, loose=loose)
    if drifts:
        truth = Truth(None, (), {}, drift=float(rng.uniform(0.05, 0.12)) * rng.choice([-1.0, 1.0]))
    elif not quiet:
        truth = conceal(rng, s, K, M, zeta, at, forces, rate, kept)
    runs = []
    for i, force in enumerate(forces):
        part = (truth.drift * i / len(forces), truth.drift * (i + 1) / len(forces))
        a, _, _ = responses(K, M, zeta, truth, at, force, rate, part, kept)
        own = np.column_stack([force, a[:, sensors]])
        own += (
            0.004
            * np.std(own, axis=0)
            * rng.standard_normal(own.shape)
            * np.append(0.0, np.ones(count))
        )
        step = 10.0 * np.std(own, axis=0) / 2**15
        runs.append((LEVELS[i], np.round(own / step) * step))
    return s, {}, truth, runs, rate, sensors, at


def conceal(
    rng: np.random.Generator,
    s: Structure,
    K: Real,
    M: Real,
    zeta: Real,
    at: int,
    forces: Sequence[Real],
    rate: float,
    kept: int,
) -> Truth:
    """A law whose force is a tenth to half of the spring's where it acts, at the middle level."""
    physics = str(rng.choice(LAWS))
    rows = s.pairs[int(rng.integers(len(s.pairs)))]
    probe = Truth("none", rows, {})
    _, x, v = responses(K, M, zeta, probe, at, forces[2], rate, (0.0, 0.0), kept)
    w = np.zeros(len(K))
    w[list(rows)] = (1.0,) if len(rows) == 1 else (-1.0, 1.0)
    stiff = 1.0 / float(w @ np.linalg.solve(K, w))
    far, fast = float(np.std(x)), float(np.std(v))
    part = float(rng.uniform(0.1, 0.5))
    gap = float(rng.uniform(0.6, 1.6)) * far
    two, side = bool(rng.integers(2)), float(rng.choice([-1.0, 1.0]))
    sizes = {
        "cubic_stiffness": {"k3": part * stiff / far**2 / 3.0},
        "clearance": {
            "k": stiff * float(rng.uniform(0.5, 3.0)),
            "gap": gap if two else side * gap,
            "two": float(two),
        },
        "dry_friction": {"force": part * stiff * far, "slow": 2e-3 * fast},
        "hysteresis": {"k": part * stiff, "force": part * stiff * gap},
        "quadratic_damping": {"c2": part * stiff * far / fast**2},
    }[physics]
    return Truth(physics, rows, sizes)


def write(seed: int, folder: Path) -> None:
    """The files of a case."""
    s, _, truth, runs, rate, sensors, at = draw(seed)
    folder.mkdir(parents=True, exist_ok=True)
    blocks = []
    for i, (level, data) in enumerate(runs):
        np.savez_compressed(folder / f"run{i + 1}.npz", data=data)
        rows = [(at, "force"), *((r, "acceleration") for r in sensors)]
        channels = ",\n".join(
            f'  {{ column = {c}, quantity = "{q}", node = {s.dofs[r][0]}, dof = "{s.dofs[r][1]}" }}'
            for c, (r, q) in enumerate(rows)
        )
        use = "hold-out" if i == len(runs) - 1 else "fit"
        blocks.append(
            f'[[recordings]]\nkind = "time"\nuse = "{use}"\nlevel = {level}\n'
            f'file = "run{i + 1}.npz"\n'
            f'response = "acceleration"\nrate = {rate}\nchannels = [\n{channels}\n]\n'
        )
    (folder / "problem.toml").write_text(
        f'title = "Generated {seed}"\n{s.text}\n' + "\n".join(blocks)
    )
    nodes = [s.dofs[r][0] for r in truth.rows]
    lines = [
        f'physics = "{truth.physics or ""}"',
        f"nodes = {nodes}",
        f"drift = {truth.drift}",
        f'loose = "{truth.loose or ""}"',
    ]
    lines += [f"{k} = {v}" for k, v in truth.sizes.items()]
    (folder / "truth.toml").write_text("\n".join(lines) + "\n")


def judged(folder: Path) -> dict[str, Any]:
    """What the diagnosis said, against what is so."""
    from cvxupdate.study import diagnose

    truth = tomllib.loads((folder / "truth.toml").read_text())
    d = diagnose(folder / "problem.toml")
    said = [
        (f.physics, sorted(f.place.nodes), dict(f.parameters), round(f.confidence, 2))
        for f in d.findings
    ]
    laws = [x for x in said if x[0] in LAWS]
    if truth["drift"]:
        good = not said and "changed while" in d.says
        verdict = "right" if good else "wrong" if said else "undetermined"
    elif not truth["physics"]:
        verdict = "wrong" if laws else "right" if d.verdict != "undetermined" else "undetermined"
    elif not said:
        verdict = "undetermined" if d.verdict == "undetermined" else "wrong"
    else:
        good = said[0][0] == truth["physics"] and said[0][1] == sorted(truth["nodes"])
        verdict = "right" if good else "wrong"
    return {
        "case": folder.name,
        "judged": verdict,
        "truth": truth,
        "verdict": d.verdict,
        "said": said,
        "fit": d.fit,
        "time": d.time,
        "says": d.says,
    }


def main(arguments: Sequence[str] | None = None) -> int:
    """Make cases, and judge them where asked."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("first", type=int)
    parser.add_argument("count", type=int)
    parser.add_argument("--out", type=Path, default=Path("out/nonlinear"))
    parser.add_argument("--judge", action="store_true")
    options = parser.parse_args(arguments)
    totals: dict[str, int] = {}
    for seed in range(options.first, options.first + options.count):
        folder = options.out / f"n{seed}"
        if not (folder / "truth.toml").exists():
            write(seed, folder)
        if options.judge:
            row = judged(folder)
            totals[row["judged"]] = totals.get(row["judged"], 0) + 1
            print(json.dumps(row, default=float), flush=True)
    print(json.dumps(totals))
    return 0


if __name__ == "__main__":
    sys.exit(main())
