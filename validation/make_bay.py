"""The bay structure of section 3.4 (Fig. 3.7, lost), rebuilt: models FE1, FE2, X1, X2 as text,
and their simulated receptances.

``python -m validation.make_bay`` writes problems/bay/problem.toml (model X1) and the models that
other problems include. ``model_toml("FE1")`` is a [model] table, ``receptance`` the FRFs of a model
by dense inversion, which shares nothing with the package's responses.
"""

from __future__ import annotations

import itertools
from pathlib import Path

import numpy as np

A, B, H = 0.458, 0.382, 0.4042
"""Lengths in m: outer bay along +x, outer bay along −x, the shared edge along y."""
STIFF = (1, 2, 3, 5, 7, 8, 9, 14, 19, 20)
"""FE1: elements whose Young's modulus is 8 % high (p-value −0.0741)."""
THICK = (2, 4, 8, 10, 12, 15, 17, 20)
"""FE2: elements whose second moments Iy and Iz are 30 % high, in K and in M."""
E, NU, RHO, WIDTH, HEIGHT = 207e9, 0.3, 7850.0, 0.1, 0.01
KINDS = ("x", "y", "z", "rx", "ry", "rz")
TEN = ("n1.x", "n1.y", "n1.z", "n5.z", "n7.z", "n9.z", "n11.z", "n13.z", "n15.z", "n18.z")
"""The ten measured coordinates of 3.4.1."""


def mesh(refine: int = 1) -> tuple[list[tuple[float, float, float]], list[tuple[int, int]]]:
    """Node coordinates and element node pairs: the outline in six edges of 3 elements, then the
    shared edge in 2, each split ``refine`` times.

    Nodes 1 to 19 keep their numbers and elements their order when the mesh is refined; new nodes
    follow from 20.
    """
    corners = [(A, 0.0), (0.0, 0.0), (-B, 0.0), (-B, H), (0.0, H), (A, H)]
    points = []
    for (x0, y0), (x1, y1) in zip(corners, corners[1:] + corners[:1], strict=True):
        points += [(x0 + (x1 - x0) * t / 3, y0 + (y1 - y0) * t / 3, 0.0) for t in range(3)]
    points.append((0.0, H / 2, 0.0))
    coarse = [(i, i % 18 + 1) for i in range(1, 19)] + [(4, 19), (19, 13)]
    pairs = []
    for u, v in coarse:
        chain = [u]
        for t in range(1, refine):
            points.append(
                tuple(
                    p + (q - p) * t / refine
                    for p, q in zip(points[u - 1], points[v - 1], strict=True)
                )
            )
            chain.append(len(points))
        chain.append(v)
        pairs += list(itertools.pairwise(chain))
    return points, pairs


def model_toml(which: str, damping: str = "") -> str:
    """The [model] table of "X1", "X2" (the twice finer X1), "FE1" or "FE2", written whole."""
    return frame_toml(which) + (f"\n{damping}\n" if damping else "") + members_toml(which)


def including(which: str, path: str = "..", damping: str = "") -> str:
    """The [model] table of a problem file that includes "X1", "FE1" or "FE2" from the folder of the
    bay, which lies at ``path``."""
    text = f'[model]\ninclude = "{path}/{which.lower()}.toml"\n'
    return text + (f"\n{damping}\n" if damping else "")


def frame_toml(which: str = "X1") -> str:
    """What the models share: nodes (X2 has more), steel, and the strip, which lies flat: it is soft
    along z."""
    if which not in ("X1", "X2", "FE1", "FE2"):
        raise ValueError(f"no model {which!r}; the bay has X1, X2, FE1 and FE2")
    points, _ = mesh(2 if which == "X2" else 1)
    nodes = ",\n".join(
        f"  {{ id = {i}, x = {x:.10g}, y = {y:.10g}, z = {z:.10g} }}"
        for i, (x, y, z) in enumerate(points, 1)
    )
    return (
        f'[model]\ndofs = ["x", "y", "z", "rx", "ry", "rz"]\nnodes = [\n{nodes},\n]\n\n'
        f"[model.materials.steel]\nE = {E:.6g}\nnu = {NU}\nrho = {RHO}\n\n" + section("strip")
    )


def members_toml(which: str) -> str:
    """The elements of a model, and the material or the section that its wrong ones have."""
    high = {"FE1": STIFF, "FE2": THICK}.get(which, ())
    own = ', material = "high"' if which == "FE1" else ', section = "thick"'
    _, pairs = mesh(2 if which == "X2" else 1)
    rows = ",\n".join(
        f"  {{ id = {i}, nodes = [{u}, {v}]{own if i in high else ''} }}"
        for i, (u, v) in enumerate(pairs, 1)
    )
    other = {
        "FE1": f"\n[model.materials.high]\nE = {1.08 * E:.6g}\nnu = {NU}\nrho = {RHO}\n",
        "FE2": "\n" + section("thick", 1.3),
    }.get(which, "")
    return (
        f'{other}\n[[model.elements]]\ntype = "beam3d"\nmaterial = "steel"\nsection = "strip"\n'
        f"orientation = [0.0, 0.0, 1.0]\nrows = [\n{rows},\n]\n"
    )


def section(name: str, factor: float = 1.0) -> str:
    """The strip's section with its second moments times ``factor``."""
    iy, iz = factor * WIDTH * HEIGHT**3 / 12, factor * HEIGHT * WIDTH**3 / 12
    return (
        f'[model.sections.{name}]\nshape = "general"\nA = {WIDTH * HEIGHT:.10g}\n'
        f"Iy = {iy:.10g}\nIz = {iz:.10g}\nJ = {torsion_constant():.10g}\n"
    )


def torsion_constant() -> float:
    """J of the rectangle by Saint-Venant's series (Timoshenko and Goodier, art. 109)."""
    series = sum(np.tanh(n * np.pi * WIDTH / (2 * HEIGHT)) / n**5 for n in range(1, 40, 2))
    return float(WIDTH * HEIGHT**3 / 3 * (1 - 192 * HEIGHT / (np.pi**5 * WIDTH) * series))


def build(which: str, damping: str = "", folder: Path | None = None):
    """The package's model of one of the four, without parameters."""
    import tempfile

    from cvxupdate.study import open_problem

    with tempfile.TemporaryDirectory(dir=folder) as made:
        path = Path(made) / "problem.toml"
        path.write_text(model_toml(which, damping), encoding="utf-8")
        return open_problem(path)[1]


def receptance(model, frequency, responses, references):
    """H (lines, responses, references) in m/N of a package model, by dense inversion of K + iD +
    iωC − ω²M at every line (Hz)."""
    m = model.matrices()
    K, M, C, D = (x.toarray() for x in (m.K, m.M, m.C, m.D))
    at, by = [model.place[q] for q in responses], [model.place[q] for q in references]
    unit = np.zeros((model.size, len(by)))
    unit[by, np.arange(len(by))] = 1.0
    out = []
    for f in frequency:
        w = 2 * np.pi * f
        Z = K - w**2 * M
        if C.any() or D.any():
            Z = Z + 1j * (w * C + D)
        out.append(np.linalg.solve(Z, unit)[at])
    return np.array(out, dtype=complex)


def noisy(H, level, seed):
    """H (1 + level·u) with u uniform in [−1, 1] (3.27, 5.31), independent for real and
    imaginary part where H is complex; seeded."""
    rng = np.random.default_rng(seed)
    factor = 1.0 + level * rng.uniform(-1.0, 1.0, H.shape)
    if np.any(H.imag != 0.0):
        factor = factor + 1j * level * rng.uniform(-1.0, 1.0, H.shape)
    return H * factor


def save_frf(path, frequency, H, responses, references):
    """The recording as arrays that a problem file of kind "frf" reads."""

    def split(labels):
        nodes, dofs = zip(*(label[1:].split(".") for label in labels), strict=True)
        return np.array(nodes, dtype=int), np.array([KINDS.index(d) + 1 for d in dofs])

    (rn, rd), (fn, fd) = split(responses), split(references)
    np.savez_compressed(
        path,
        frequency=np.asarray(frequency, dtype=float),
        H=H,
        response_node=rn,
        response_dof=rd,
        reference_node=fn,
        reference_dof=fd,
    )


def main() -> None:
    """problem.toml and the models that the problems of the bay include."""
    folder = Path(__file__).resolve().parents[1] / "problems" / "bay"
    head = (
        'title = "The bay structure: two rectangular frames that share an edge (model X1)"\n'
        'source = "Thesis 3.4; Fig. 3.7 is lost and its geometry is a reconstruction: see '
        'source.md"\n\n'
    )
    files = {"problem.toml": head + including("X1", "."), "frame.toml": frame_toml()}
    for which in ("X1", "FE1", "FE2"):
        text = '[model]\ninclude = "frame.toml"\n' + members_toml(which)
        files[f"{which.lower()}.toml"] = text
    for name, text in files.items():
        (folder / name).write_text(text, encoding="utf-8")


if __name__ == "__main__":
    main()
