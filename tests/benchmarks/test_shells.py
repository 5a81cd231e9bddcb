"""Shells: error against DOFs of a plate by DKQ, DKT, the thick elements and the old rectangle; and
assembly and derivatives at 1e5 DOFs beside scikit-fem's assembly of Mindlin's plate in the same
run.

scikit-fem is in the `bench` extra; without it the second table has no other column. Its form is the
plain one (bilinear w and θ, full integration: it would lock), so it does less per element than
these do; mesh, DOFs and the two matrices are the same.
"""

from __future__ import annotations

import importlib.util
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402
import pytest  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.fe.block import COMMON, Block  # noqa: E402
from cvxupdate.fe.elements import Shell  # noqa: E402
from cvxupdate.fe.model import Model  # noqa: E402
from cvxupdate.fe.modes import model_modes  # noqa: E402
from cvxupdate.fe.select import select_parameters  # noqa: E402
from cvxupdate.fe.shells.frames import shear_lengths  # noqa: E402
from cvxupdate.spec.parameters import Target  # noqa: E402
from tests.cases.elements import build, halved, held, sheet, squares  # noqa: E402

E, NU, RHO, KAPPA = 207e9, 0.3, 7850.0, 5.0 / 6.0
METAL = {"E": E, "nu": NU, "rho": RHO}
A, B = 1.0, 0.7
MODES = 6
DOFS = ["z", "rx", "ry"]
WAYS = {
    "rectangle": ("plate", 4, False),
    "DKQ": ("shell", 4, False),
    "DKT": ("shell", 3, False),
    "thick quad": ("shell", 4, True),
    "thick tri": ("shell", 3, True),
}


def plate(way: str, n: int, h: float, jitter: float = 0.0) -> Model:
    """Simply supported, n × n cells."""
    kind, corners, thick = WAYS[way]
    points, cells = squares(n, n, jitter)
    cells = cells if corners == 4 else halved(cells)
    section = {"shape": "plate", "thickness": h, **({"kappa": KAPPA} if thick else {})}
    xyz = np.column_stack([points * [A, B], np.zeros(len(points))])
    text = sheet(xyz, cells, section, METAL, DOFS)
    text["elements"][0]["type"] = kind
    ends = [[i + 1 for i in np.flatnonzero(np.isin(points[:, k], (0.0, 1.0)))] for k in (0, 1)]
    return build(held(text, (ends[0], ["z", "rx"]), (ends[1], ["z", "ry"])))


def exact(h: float) -> np.ndarray:
    """Mindlin's frequencies with shear and rotary inertia, Hz."""
    k2 = np.sort([(m / A) ** 2 + (n / B) ** 2 for m in range(1, 7) for n in range(1, 7)])[:MODES]
    k2, G, D = k2 * np.pi**2, E / 2 / (1 + NU), E * h**3 / 12 / (1 - NU**2)
    a = RHO**2 * h**3 / 12 / KAPPA / G
    b = -(RHO * h + RHO * h**3 * k2 / 12 + D * RHO * k2 / KAPPA / G)
    return np.sqrt(2 * D * k2**2 / (-b + np.sqrt(b**2 - 4 * a * D * k2**2))) / 2 / np.pi


@pytest.mark.parametrize("h", [0.002, 0.05])
def test_error_against_dofs(h: float) -> None:
    """Mean error of the lowest six frequencies, %; at 0.05 what Kirchhoff's plate leaves out does
    not go away with the mesh."""
    sizes = (4, 8, 16, 32)
    print(f"\nsimply supported plate 1 x 0.7 m, h = {h} m: mean error of {MODES} frequencies, %")
    print(f"{'':12s}" + "".join(f"{plate('DKQ', n, h).size:>9d}" for n in sizes) + "  DOFs")
    last = {}
    for way in WAYS:
        for jitter in (0.0, 0.25) if way != "rectangle" else (0.0,):
            errors = []
            for n in sizes:
                found = model_modes(plate(way, n, h, jitter), MODES + 2).flexible().frequencies
                errors.append(100 * float(np.abs(found[:MODES] / exact(h) - 1).mean()))
            name = way + ("*" if jitter else "")
            print(f"{name:12s}" + "".join(f"{e:9.3f}" for e in errors))
            last[name] = errors
    print("* distorted: inner nodes moved by up to a quarter of a side")
    for way in ("thick quad", "thick tri", *(("DKQ", "DKT") if h < 0.01 else ())):
        assert last[way][3] < last[way][2] / 2.0  # O(h²), errors of both signs


def timed(run: Callable[[], Any]) -> tuple[float, Any]:
    """CPU seconds of the best of three, and what came out."""
    best, out = np.inf, None
    for _ in range(3):
        start = time.process_time()
        out = run()
        best = min(best, time.process_time() - start)
    return best, out


def scikit_fem(n: int, jitter: float) -> Callable[[], Any] | None:
    """Assembly of K and M of Mindlin's plate on the same mesh; None where it is not installed."""
    if importlib.util.find_spec("skfem") is None:
        return None
    from skfem import Basis, BilinearForm, ElementQuad1, ElementVector, MeshQuad
    from skfem.helpers import dot, grad

    points, cells = squares(n, n, jitter)
    mesh = MeshQuad(*(np.ascontiguousarray(v.T) for v in (points * [A, B], np.array(cells))))
    h, G = 0.01, E / 2 / (1 + NU)
    D = E * h**3 / 12 / (1 - NU**2)

    @BilinearForm
    def stiffness(u: Any, v: Any, w: Any) -> Any:
        du, dv = grad(u), grad(v)
        kx, ky, kxy = du[1, 0], du[2, 1], du[1, 1] + du[2, 0]
        lx, ly, lxy = dv[1, 0], dv[2, 1], dv[1, 1] + dv[2, 0]
        bend = D * (kx * lx + ky * ly + NU * (kx * ly + ky * lx) + (1 - NU) / 2 * kxy * lxy)
        gx, gy = du[0, 0] + u[1], du[0, 1] + u[2]
        return bend + KAPPA * G * h * (gx * (dv[0, 0] + v[1]) + gy * (dv[0, 1] + v[2]))

    @BilinearForm
    def mass(u: Any, v: Any, w: Any) -> Any:
        return RHO * h * u[0] * v[0] + RHO * h**3 / 12 * (dot(u, v) - u[0] * v[0])

    basis = Basis(mesh, ElementVector(ElementQuad1(), 3), intorder=2)
    return lambda: (stiffness.assemble(basis), mass.assemble(basis))


def free_plate(n: int, h: float, jitter: float) -> Model:
    """Thick quadrilaterals, n × n, without the text of a problem file on the way."""
    points, cells = squares(n, n, jitter)
    xyz = np.column_stack([points * [A, B], np.zeros(len(points))])
    nodes, kind = np.array(cells), Shell(dofs=tuple(DOFS))
    ids = np.arange(1, len(cells) + 1)
    values = {**COMMON, **METAL, "thickness": h, "shear": 1.0, "kappa": KAPPA}
    values |= dict.fromkeys(("Dx", "Dy", "D1", "Dxy"), 1.0) | dict.fromkeys(("offset", "seat"), 0.0)
    properties = {key: np.full(len(ids), value) for key, value in values.items()}
    properties["length"] = shear_lengths(xyz[nodes])
    dofs = (3 * nodes[:, :, None] + np.arange(3)).reshape(len(ids), 12)
    block = Block(
        kind,
        ids,
        ("",) * len(ids),
        dofs,
        np.tile([2, 3, 4], 4)[None],
        kind.terms(xyz[nodes], np.zeros((len(ids), 3))),
        np.arange(len(ids)),
        properties,
        nodes,
    )
    labels = tuple(f"n{i + 1}.{kind}" for i in range(len(xyz)) for kind in DOFS)
    where = np.repeat(np.arange(len(xyz)), 3), np.tile([2, 3, 4], len(xyz))
    return Model(labels, np.arange(1, len(xyz) + 1), xyz, *where, (block,))


@pytest.mark.parametrize("n", [182])
def test_assembly_and_derivatives(n: int) -> None:
    """1e5 DOFs, every element of another shape: K and M, and dK, dM of four parameters."""
    start = time.process_time()
    model = free_plate(n, 0.01, 0.2)
    built = time.process_time() - start
    first, _ = timed(model.matrices)
    wanted = [
        Target(of, of, tuple(model.blocks[0].ids.tolist()), None, None, None, None, 0)
        for of in ("thickness", "E", "Dx", "rho")
    ]
    model = model.with_parameters(select_parameters(wanted, model))
    slopes, found = timed(model.derivatives)
    print(f"\nplate of {model.size} DOFs, {len(model.blocks[0].ids)} elements, all distinct; CPU s")
    print(f"terms of the geometry (once)          {built:8.2f}")
    print(f"K, M, C, D at a point                 {first:8.2f}")
    print(f"derivatives of four parameters        {slopes:8.2f}")
    other = scikit_fem(n, 0.2)
    if other is None:
        print("scikit-fem is not installed: no other column")
    else:
        theirs, (K, M) = timed(other)
        print(f"scikit-fem: K and M of Mindlin's form {theirs:8.2f}")
        print(f"ratios: assembly {first / theirs:.2f}, one derivative {slopes / 4 / theirs:.2f}")
        assert K.shape == M.shape
    assert len(found) == 4 and all(blocks for blocks in found)
