"""A small free frame of space beams with unequal bays, unequal masses and (where asked)
non-proportional loss, as problem files and models."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
import scipy.linalg as la

from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.spec import load_problem

NODES = ((0.0, 0.0), (0.7, 0.0), (1.6, 0.05), (1.65, 0.6), (0.7, 0.55), (0.0, 0.6))
BEAMS = ((0, 1), (1, 2), (2, 3), (3, 4), (4, 5), (5, 0), (1, 4))
BAY = (0, 4, 5, 6)  # of these: the first bay, for what takes time
GROUPS = ("deck", "deck", "end", "top", "top", "end", "post")
E, RHO = 206e9, 7850.0


def model_text(stiff=None, mass=None, eta=None, ground=False, c=0.0, beams=range(7)) -> str:
    """The [model] with factors on E and rho of every beam, loss factors, a spring to ground of zero
    stiffness, a dashpot; of some ``beams`` alone."""
    stiff, mass = np.ones(7) if stiff is None else stiff, np.ones(7) if mass is None else mass
    there = {i for k in beams for i in BEAMS[k]}
    nodes = ", ".join(
        f"{{ id = {i + 1}, x = {x}, y = {y}, z = {0.1 * (i == 3)} }}"
        for i, (x, y) in enumerate(NODES)
        if i in there
    )
    out = [f'title = "frame"\n[model]\ndofs = ["x", "y", "z", "rx", "ry", "rz"]\nnodes = [{nodes}]']
    for i in beams:
        loss = "" if eta is None else f"eta = {float(np.broadcast_to(eta, 7)[i])!r}\n"
        out.append(
            f"[model.materials.m{i}]\nE = {E * float(stiff[i])!r}\nnu = 0.3\nrho = "
            f"{RHO * float(mass[i])!r}\n{loss}"
        )
    out.append('[model.sections.bar]\nshape = "rectangle"\nwidth = 0.02\nheight = 0.03')
    for i, (a, b) in ((i, BEAMS[i]) for i in beams):
        out.append(
            f'[[model.elements]]\ntype = "beam3d"\nmaterial = "m{i}"\nsection = "bar"\n'
            f'rows = [{{ id = {i + 1}, nodes = [{a + 1}, {b + 1}], group = "{GROUPS[i]}" }}]'
        )
    if ground:
        out.append(
            '[[model.elements]]\ntype = "spring"\ndof = "y"\nk = 0.0\nrows = [{ id = 20, '
            'nodes = [2], group = "ground" }]'
        )
    if c:
        out.append(
            '[[model.elements]]\ntype = "dashpot"\ndof = "y"\n'
            f"rows = [{{ id = 30, nodes = [1, 4], c = {c!r} }}, "
            f"{{ id = 31, nodes = [2, 5], c = {2 * c!r} }}]"
        )
    return "\n".join(out) + "\n"


@dataclass(frozen=True)
class Measured:
    """Modes of a structure: λ or s, shapes (N, m), labels of the DOFs."""

    model: Model
    values: np.ndarray
    shapes: np.ndarray
    viscous: bool = False


def built(text: str, folder: Path, name: str = "problem.toml") -> Model:
    (folder / name).write_text(text)
    return build_model(load_problem(folder / name))


def measure(model: Model, count: int, viscous: bool = False) -> Measured:
    """The lowest ``count`` flexible modes, complex where the structure is damped."""
    m = model.matrices(model.zero())
    K, M, C, D = (np.asarray(a.toarray()) for a in (m.K, m.M, m.C, m.D))
    if viscous:
        N = len(K)
        s, v = la.eig(np.block([[np.zeros((N, N)), np.eye(N)], [-la.solve(M, K), -la.solve(M, C)]]))
        up = np.flatnonzero(s.imag > 2 * np.pi)
        up = up[np.argsort(np.abs(s[up]))][:count]
        return Measured(model, s[up], v[:N, up] / np.abs(v[:N, up]).max(axis=0), True)
    values, shapes = la.eig(K + 1j * D, M) if np.any(D) else la.eigh(K, M)
    order = np.argsort(values.real)
    order = order[values.real[order] > (2 * np.pi) ** 2][:count]
    return Measured(model, values[order], shapes[:, order] / np.abs(shapes[:, order]).max(axis=0))


def recording(
    found: Measured,
    dofs=("x", "y", "z", "rx", "ry", "rz"),
    noise: float = 0.0,
    std: float | None = None,
    use: str = "fit",
    seed: int = 0,
) -> str:
    """A [[recordings]] table of modes at the DOFs named; ``noise`` relative to the largest entry,
    ``std`` the stated deviation, relative too."""
    rng = np.random.default_rng(seed)
    keep = [i for i, label in enumerate(found.model.labels) if label.split(".")[1] in dofs]
    split = [found.model.labels[i].split(".") for i in keep]
    channels = ", ".join(
        f'{{ column = {k}, quantity = "displacement", node = {int(n[1:])}, dof = "{d}" }}'
        for k, (n, d) in enumerate(split)
    )
    rows = []
    for value, shape in zip(found.values, found.shapes.T, strict=True):
        complex_ = np.iscomplexobj(found.shapes)
        if found.viscous:
            f, zeta = abs(value) / (2 * np.pi), -value.real / abs(value)
        else:
            f, zeta = np.sqrt(value.real) / (2 * np.pi), 0.5 * np.imag(value) / value.real
        x = shape[keep]
        if noise:
            x = x + noise * np.abs(x).max() * (
                rng.normal(size=len(x)) + (1j * rng.normal(size=len(x)) if complex_ else 0)
            )
        entries = ", ".join(
            f"[{v.real!r}, {v.imag!r}]" if complex_ else repr(float(v)) for v in x.tolist()
        )
        damping = f", damping = {float(zeta)!r}" if complex_ else ""
        stated = (
            ""
            if std is None
            else f", shape_std = {float(std * np.abs(x).max())!r}, frequency_std = "
            f"{float(1e-4 * f)!r}"
        )
        rows.append(f"{{ frequency = {float(f)!r}{damping}{stated}, shape = [{entries}] }}")
    return (
        f'[[recordings]]\nkind = "modes"\nuse = "{use}"\nname = "frame"\nchannels = '
        f"[{channels}]\nrows = [\n" + ",\n".join(rows) + "\n]\n"
    )


def update_text(of=("stiffness",), low=-0.9, high=1.0, method="ceam", more="", extra="") -> str:
    """The [update] with a p-value for every beam and property."""
    rows = ", ".join(
        f'{{ elements = [1, 2, 3, 4, 5, 6, 7], of = "{o}", each = "element", lower = '
        f"{-1.0 if o == 'damping' else low}, upper = {high} }}"
        for o in of
    )
    return f'[update]\nmethod = "{method}"\nparameters = [{rows}{extra}]\n{more}'
