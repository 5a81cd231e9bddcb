"""Runs a case: states of the real thing, recordings, files."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from validation.fifteenth import build as b
from validation.fifteenth.analyst import Mesh, model_text, update_text
from validation.fifteenth.shapes import DOFS, Case, Effect
from validation.fifteenth.testing import Modal, accelerance, measured, modal, table
from validation.fifteenth.truth import truth_text

DRIFT = 0.9995  # of the moduli between reference and changed state: temperature


@dataclass
class Rigging:
    """What stays the same from state to state: places, directions, gains, damping."""

    places: list[Any]
    directions: list[np.ndarray]
    gains: np.ndarray
    zetas: np.ndarray
    scatter: dict[str, tuple[float, float]]


def rigging(case: Case, rng: np.random.Generator) -> Rigging:
    """Draws the scatter of the test."""
    s = case.structure
    scatter = b.material_scatter(case, rng)
    places, memory = [], {}
    for a, i, _ in case.sensors:
        if (a, i) not in memory:
            memory[a, i] = b.shifted(s, b.place(s, a, i), rng)
        places.append(memory[a, i])
    directions = [b.direction(s, d, rng) for *_, d in case.sensors]
    gains = 1 + 0.012 * rng.standard_normal(len(places))
    zetas = case.zeta * np.exp(0.35 * rng.standard_normal(80))
    return Rigging(places, directions, gains, zetas, scatter)


def outputs(m_system: Any, r: Rigging) -> np.ndarray:
    """Rows of the sensors."""
    return np.array([m_system.pick(p, d) for p, d in zip(r.places, r.directions, strict=True)])


def state(
    case: Case,
    effects: list[Effect],
    r: Rigging,
    scatter: dict[str, tuple[float, float]] | None = None,
) -> Modal:
    """Modes of one state."""
    return modal(b.build(case, effects, scatter or r.scatter, r.places), r.zetas)


def band(nominal: np.ndarray, real: np.ndarray, rigid: int, n: int) -> tuple[float, float]:
    """From below the first bending mode to behind the n-th."""
    lo = 0.55 * min(real[rigid], nominal[rigid])
    hi = 0.5 * (real[rigid + n - 1] + real[rigid + n])
    return float(lo), float(max(hi, real[rigid + n - 1] * 1.04))


def write_frf(
    case: Case,
    m: Modal,
    r: Rigging,
    drives: list[Any],
    f: np.ndarray,
    rng: np.random.Generator,
    file: Path,
) -> np.ndarray:
    """Measures with each hammer or shaker place in turn; returns the noise-free responses."""
    mesh, s = Mesh(case.structure), case.structure
    outs = outputs(m.system, r)
    place_rng = np.random.default_rng(case.seed + 77)
    clean, h, coh = [], [], []
    for a, i, dof in drives:
        at = b.place(s, a, i)
        at = at if not case.hammer else b.shifted(s, at, place_rng)
        force = m.system.pick(at, b.direction(s, dof, place_rng))
        one = accelerance(m, f, outs, force)
        got, c = measured(
            one, f, rng, case.averages, case.noise, case.hammer, r.gains, case.force_gain
        )
        clean.append(one)
        h.append(got)
        coh.append(c)
    np.savez(
        file,
        frequency=f,
        H=np.stack(h, 2).astype(np.complex64),
        coherence=np.stack(coh, 2).astype(np.float32),
        response_node=np.array([mesh.node(a, i) for a, i, _ in case.sensors]),
        response_dof=np.array([DOFS.index(d) + 1 for *_, d in case.sensors]),
        reference_node=np.array([mesh.node(a, i) for a, i, _ in drives]),
        reference_dof=np.array([DOFS.index(d) + 1 for *_, d in drives]),
    )
    return np.stack(clean, 2)


def frf_block(case: Case, file: str, use: str, name: str | None) -> str:
    """A [[recordings]] block of FRFs."""
    tag = f'state = "{name}"\n' if name else ""
    return (
        f'[[recordings]]\nkind = "frf"\nuse = "{use}"\n{tag}file = "{file}"\n'
        f'response = "acceleration"\naverages = {case.averages}\n'
    )


def modes_block(case: Case, rows: list[dict[str, Any]], name: str | None) -> str:
    """A [[recordings]] block of modes."""
    mesh = Mesh(case.structure)
    tag = f'state = "{name}"\n' if name else ""
    out = [
        f'[[recordings]]\nkind = "modes"\nuse = "fit"\n{tag}'
        f"frequency_std_relative = {case.f_scatter}",
        "channels = [",
    ]
    for c, (a, i, d) in enumerate(case.sensors):
        out.append(
            f'  {{ column = {c}, quantity = "acceleration", '
            f'node = {mesh.node(a, i)}, dof = "{d}" }},'
        )
    out += ["]", "rows = ["]
    for row in rows:
        shape = ", ".join(f"{v:.4f}" for v in row["shape"])
        out.append(
            f"  {{ frequency = {row['frequency']:.3f}, damping = {row['damping']:.5f}, "
            "damping_std = "
            f"{0.1 * row['damping']:.5f}, shape_std = {case.s_scatter}, shape = [{shape}] }},"
        )
    return "\n".join([*out, "]", ""])


def paired(case: Case, rig: Modal, real: Modal, rigid: int, n: int) -> np.ndarray:
    """Relative shift of each mode of the rig alone to the one most like it (MAC, all nodes)."""
    mesh, kinds = Mesh(case.structure), [d for d in ("x", "y", "z") if d in case.structure.dofs]
    places = {node: b.place(case.structure, *key) for key, node in mesh.inner.items()}
    shapes = []
    for m in (rig, real):
        rows = np.array(
            [m.system.pick(p, np.eye(6)[DOFS.index(d)]) for p in places.values() for d in kinds]
        )
        shapes.append(rows @ m.phi)
    out = []
    for i in range(rigid, rigid + n):
        a = shapes[0][:, i]
        mac = (
            (a @ shapes[1][:, rigid:]) ** 2
            / (a @ a)
            / np.maximum(np.sum(shapes[1][:, rigid:] ** 2, axis=0), 1e-30)
        )
        out.append(real.hz[rigid + int(np.argmax(mac))] / rig.hz[i] - 1)
    return np.array(out)


def _record_frf(
    case: Case,
    states: dict[str | None, Modal],
    r: Rigging,
    f: np.ndarray,
    folder: Path,
) -> tuple[str, float]:
    blocks, clean, rng = [], {}, np.random.default_rng(case.seed + 5)
    for name, m in states.items():
        tail = f"_{name}" if name else ""
        clean[name] = write_frf(case, m, r, case.drives, f, rng, folder / f"frf_fit{tail}.npz")
        blocks.append(frf_block(case, f"frf_fit{tail}.npz", "fit", name))
        again = [case.holdout] if case.holdout else case.drives
        write_frf(case, m, r, again, f, rng, folder / f"frf_holdout{tail}.npz")
        blocks.append(frf_block(case, f"frf_holdout{tail}.npz", "hold-out", name))
    return "\n".join(blocks), 0.0


def tests_text(r: Rigging) -> str:
    """The scatter of the test, for the truth file."""
    gains = ", ".join(f"{g:.4f}" for g in r.gains)
    turns = ", ".join(f"{np.degrees(np.arccos(np.clip(d.max(), -1, 1))):.2f}" for d in r.directions)
    zetas = ", ".join(f"{z:.5f}" for z in r.zetas[:10])
    return (
        f"\n[test]\nsensor_gains = [{gains}]\nsensors_turned_degrees = [{turns}]\n"
        f"modal_damping = [{zetas}]\n"
    )


def run(case: Case, folder: Path) -> str:
    """Writes the folder of a case; returns a line on it."""
    folder.mkdir(parents=True, exist_ok=True)
    r = rigging(case, np.random.default_rng(case.seed))
    plain = Case(**{**case.__dict__, "sensor_mass": 0.0})
    nominal = state(plain, [], r, {k: (1.0, 1.0) for k in r.scatter})
    rig = state(case, case.rig, r)
    drift = {k: (e * DRIFT, d) for k, (e, d) in r.scatter.items()} if case.reference else r.scatter
    if case.reference:
        r.zetas = r.zetas * (1 + 0.02 * np.random.default_rng(case.seed + 9).standard_normal(80))
    real = state(case, case.rig + case.concealed, r, drift)
    rigid = int(np.sum(nominal.hz < 0.5))
    text = model_text(case, Mesh(case.structure))
    states: dict[str | None, Modal] = (
        {"reference": rig, "changed": real} if case.reference else {None: real}
    )
    n = case.n_modes
    if case.kind == "frf":
        f = np.linspace(*band(nominal.hz, real.hz, rigid, n), case.lines)
        blocks, _ = _record_frf(case, states, r, f, folder)
        a, c = (accelerance(m, f, outputs(m.system, r), _drive(case, m)) for m in (rig, real))
        change = float(np.linalg.norm(c - a) / np.linalg.norm(a))
    else:
        rng, parts, change = np.random.default_rng(case.seed + 5), [], 0.0
        for name, m in states.items():
            rows = table(
                m, outputs(m.system, r), rigid, n, rng, case.f_scatter, case.s_scatter, r.gains
            )
            parts.append(modes_block(case, rows, name))
        blocks = "\n".join(parts)
    (folder / "problem.toml").write_text(text + "\n" + blocks + "\n" + update_text(case))
    hz = {
        k: m.hz[rigid : rigid + n + 1]
        for k, m in (("model", nominal), ("rig_only", rig), ("real", real))
    }
    shifts = 100 * paired(case, rig, real, rigid, n)
    (folder / "truth.toml").write_text(
        truth_text(case, hz, shifts / 100, change, r.scatter) + tests_text(r)
    )
    first = 100 * (hz["rig_only"] / hz["model"] - 1)
    return (
        f"{case.name}: f {np.round(hz['model'], 1)}\n   rig {np.round(first, 1)} % "
        f"effect {np.round(shifts, 2)} % "
        f"response {change:.2f}"
    )


def _drive(case: Case, m: Modal) -> np.ndarray:
    a, i, dof = case.drives[0]
    d = np.zeros(6)
    d[DOFS.index(dof)] = 1.0
    return m.system.pick(b.place(case.structure, a, i), d)
