"""A frame of two bays, fine enough that its mesh does not matter, and what a rig does to it, put
together by hand as problem files: joints as tied nodes with springs, supports as springs and lumps.
"""

from __future__ import annotations

import copy
import itertools
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
import scipy.linalg

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.context import SearchContext
from cvxupdate.spec import load_problem
from tests.cases.cantilever import rows_of
from tests.cases.effects import context_of, nuisance, problem
from tests.cases.elements import STEEL, toml

Structure = dict[str, Any]
CORNERS = {1: (0.0, 0.0), 2: (0.0, 0.4), 3: (0.5, 0.0), 4: (0.5, 0.4), 5: (0.9, 0.0), 6: (0.9, 0.4)}
CORNERS |= {7: (0.0, 0.7), 8: (0.5, 0.7)}
POSTS, BEAMS = ((1, 2), (2, 7), (3, 4), (4, 8), (5, 6)), ((2, 4), (6, 4), (7, 8))
PARTS = 4  # elements of a member
FEET = (1, 3, 5)
JOINTS = ((2, 4), (4, 2), (4, 6), (6, 4), (7, 8), (8, 7))  # of a beam: at a node, towards another


def frame() -> Structure:
    """Posts and beams, clamped feet."""
    nodes = [{"id": i, "x": x, "y": 0.0, "z": z} for i, (x, z) in CORNERS.items()]
    blocks: list[Structure] = []
    top, number = 8, 0
    for group, members in (("posts", POSTS), ("beams", BEAMS)):
        rows = []
        for a, b in members:
            chain = [a, *range(top + 1, top + PARTS), b]
            for k, node in enumerate(chain[1:-1], 1):
                x, z = (
                    p + (q - p) * k / PARTS for p, q in zip(CORNERS[a], CORNERS[b], strict=True)
                )
                nodes.append({"id": node, "x": x, "y": 0.0, "z": z})
            top += PARTS - 1
            for pair in itertools.pairwise(chain):
                number += 1
                rows.append({"id": number, "nodes": list(pair), "group": group})
        blocks.append({"type": "beam3d", "material": "steel", "section": group, "rows": rows})
    return {
        "dofs": ["x", "z", "ry"],
        "nodes": nodes,
        "materials": {"steel": STEEL},
        "sections": {
            "posts": {"shape": "rectangle", "width": 0.02, "height": 0.012},
            "beams": {"shape": "rectangle", "width": 0.03, "height": 0.009},
        },
        "elements": blocks,
        "supports": [
            {"nodes": "all", "dofs": ["y", "rx", "rz"]},
            {"nodes": list(FEET), "dofs": ["x", "z", "ry"]},
        ],
        "damping": {"kind": "modal", "zeta": 0.005},
    }


def with_joints(
    structure: Structure, k: float, joints: Sequence[tuple[int, int]] = JOINTS
) -> Structure:
    """Ends of members turn on springs of k: every beam's."""
    out = copy.deepcopy(structure)
    rows = {r["id"]: r for block in out["elements"] for r in block["rows"]}
    place = {n["id"]: (n["x"], n["z"]) for n in out["nodes"]}
    springs, ties = [], []
    for at, towards in joints:
        way = np.subtract(place[towards], place[at])

        def goes(row: Structure, at: int = at, way: Any = way) -> bool:
            other = next(n for n in row["nodes"] if n != at)
            own = np.subtract(place[other], place[at])
            return bool(own @ way > 0.99 * np.linalg.norm(own) * np.linalg.norm(way))

        row = next(r for r in rows.values() if at in r["nodes"] and goes(r))
        fresh = max(n["id"] for n in out["nodes"]) + 1
        x, z = place[at]
        out["nodes"].append({"id": fresh, "x": x, "y": 0.0, "z": z})
        row["nodes"] = [fresh if n == at else n for n in row["nodes"]]
        ties.append({"nodes": [at, fresh], "dofs": ["x", "z"]})
        springs.append({"id": 500 + fresh, "nodes": [at, fresh], "k": k, "dof": "ry"})
    out["ties"] = ties
    out["elements"].append({"type": "spring", "rows": springs})
    return out


def freed(structure: Structure, nodes: Sequence[int], dof: str, k: float) -> Structure:
    """Supports of one direction replaced by springs of k."""
    out = copy.deepcopy(structure)
    out["supports"] = [s for s in out["supports"] if s["nodes"] == "all"]
    for s in structure["supports"]:
        for n in s["nodes"] if s["nodes"] != "all" else ():
            kept = [d for d in s["dofs"] if not (d == dof and n in nodes)]
            out["supports"] += [{"nodes": [n], "dofs": kept}] if kept else []
    springs = [{"id": 600 + n, "nodes": [n], "k": k, "dof": dof} for n in nodes]
    out["elements"].append({"type": "spring", "rows": springs})
    return out


def table(folder: Path, real: Structure, drawn: Structure, modes: int) -> Path:
    """A problem file of the structure as ``drawn`` beside the lowest natural frequencies of the
    ``real`` one, with noise of 0.03 %."""
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(real)}\n", encoding="utf-8")
    f = model_modes(build_model(load_problem(path)), modes).flexible().frequencies[:modes]
    f = f * (1.0 + 3e-4 * np.random.default_rng(3).standard_normal(len(f)))
    kind = '[[recordings]]\nkind = "modes"\n'
    text = f"model = {toml(drawn)}\n{kind}rows = [{rows_of(f)}]\n"
    path.write_text(text, encoding="utf-8")
    return path


def hung_bar() -> Structure:
    """A free bar of uneven section, nodes at mirror images."""
    x = [-0.4, -0.31, -0.22, -0.13, -0.05, 0.05, 0.13, 0.22, 0.31, 0.4]
    rows = [
        {"id": i, "nodes": [i, i + 1], "group": "thick" if i < 4 else "thin"} for i in range(1, 10)
    ]
    shape = {"shape": "rectangle", "width": 0.04}
    return {
        "dofs": ["z", "ry"],
        "nodes": [{"id": i, "x": v, "y": 0.0, "z": 0.0} for i, v in enumerate(x, 1)],
        "materials": {"steel": STEEL},
        "sections": {"thick": {**shape, "height": 0.008}, "thin": {**shape, "height": 0.006}},
        "elements": [
            {"type": "beam3d", "material": "steel", "section": group, "rows": part}
            for group, part in (("thick", rows[:3]), ("thin", rows[3:]))
        ],
        "supports": [{"nodes": "all", "dofs": ["x", "y", "rx", "rz"]}],
        "damping": {"kind": "modal", "zeta": 0.02},
    }


def with_springs(structure: Structure, nodes: Sequence[int], dof: str, k: float) -> Structure:
    """Springs of k to ground."""
    out = copy.deepcopy(structure)
    rows = [{"id": 700 + n, "nodes": [n], "k": k, "dof": dof} for n in nodes]
    out["elements"].append({"type": "spring", "rows": rows})
    return out


def with_lumps(structure: Structure, nodes: Sequence[int], m: float) -> Structure:
    """Lumps of m."""
    out = copy.deepcopy(structure)
    rows = [{"id": 800 + n, "nodes": [n], "m": m} for n in nodes]
    out["elements"].append({"type": "mass", "rows": rows})
    return out


def frfs(
    folder: Path,
    real: Structure,
    drawn: Structure,
    sensors: Sequence[tuple[int, str]],
    drives: Sequence[tuple[int, str]],
    lines: np.ndarray,
    gain: float = 1.0,
    zeta: float = 0.02,
    off: float = 0.0,
) -> Path:
    """A problem file of the structure as ``drawn`` beside accelerances of the ``real`` one by dense
    inversion, a recording for each drive, the last one held out; noise of 0.3 %; the force channel
    reads ``gain`` times the force. Forces act and sensors stand ``off`` metres beside their nodes,
    to either side in turn, where these turn about y."""
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(real)}\n", encoding="utf-8")
    model = build_model(load_problem(path))
    m = model.matrices()
    K, M = m.K.toarray(), m.M.toarray()
    lam, phi = scipy.linalg.eigh(K, M)
    C = M @ phi @ np.diag(2.0 * zeta * np.sqrt(np.maximum(lam, 0.0))) @ phi.T @ M
    s = 2j * np.pi * np.asarray(lines)[:, None, None]
    at = np.zeros((len(sensors), model.size))
    for row, (n, d) in enumerate(sensors):
        at[row, model.place[f"n{n}.{d}"]] = 1.0
        at[row, model.place.get(f"n{n}.ry", 0)] += off * (-1) ** row
    text = f"model = {toml(drawn)}\n"
    for k, (node, dof) in enumerate(drives):
        unit = np.zeros((model.size, 1))
        unit[model.place[f"n{node}.{dof}"]] = 1.0
        unit[model.place.get(f"n{node}.ry", 0)] += off
        seen = at @ (s**2 * np.linalg.solve(K + s * C + s**2 * M, unit[None])) / gain
        std = 3e-3 * np.sqrt(np.mean(np.abs(seen) ** 2, axis=0, keepdims=True))
        std = std * np.ones(seen.shape)
        rng = np.random.default_rng(k)
        wave = rng.normal(size=seen.shape) + 1j * rng.normal(size=seen.shape)
        np.savez(
            folder / f"drive{k}.npz",
            frequency=lines,
            H=seen + std * wave / np.sqrt(2.0),
            variance=std**2,
            response_node=[n for n, _ in sensors],
            response_dof=[KINDS.index(d) + 1 for _, d in sensors],
            reference_node=[node],
            reference_dof=[KINDS.index(dof) + 1],
        )
        use = "hold-out" if len(drives) > 1 and k == len(drives) - 1 else "fit"
        text += f'[[recordings]]\nkind = "frf"\nuse = "{use}"\nfile = "drive{k}.npz"\n'
        text += 'response = "acceleration"\n'
    path.write_text(text, encoding="utf-8")
    return path


def on_fixture(structure: Structure, dof: str, k: float, m: float) -> Structure:
    """The feet stand on one fixture of mass m that a spring of k holds along one direction."""
    out = copy.deepcopy(structure)
    kinds, node = structure["dofs"], 900
    out["nodes"].append({"id": node, "x": 0.0, "y": 0.0, "z": -0.1})
    out["supports"] = [s for s in structure["supports"] if s["nodes"] == "all"]
    rest = [d for d in kinds if d != dof]
    out["supports"].append({"nodes": [*FEET, node], "dofs": rest})
    out["ties"] = [{"nodes": [node, n], "dofs": [dof]} for n in FEET]
    spring = {"type": "spring", "rows": [{"id": 901, "nodes": [node], "k": k, "dof": dof}]}
    lump = {"type": "mass", "rows": [{"id": 902, "nodes": [node], "m": m}]}
    out["elements"] += [spring, *([lump] if m > 0.0 else [])]
    return out


def frame_context(folder: Path) -> SearchContext:
    """For placing effects on the frame as it is drawn."""
    spec = problem(folder, frame())
    return context_of(spec, nuisance(undamped(build_model(spec))))


def eigenvalues(model: Model, p: Any = None, count: int = 8) -> Any:
    """The lowest, by a dense solution."""
    m = model.matrices(p)
    return scipy.linalg.eigh(m.K.toarray(), m.M.toarray(), eigvals_only=True)[:count]
