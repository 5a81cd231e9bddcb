"""Solids: patch tests, bending without locking, Lamé's modes of the cube, division."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as sla
from scipy.spatial.transform import Rotation

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements import Hex8, Hex20
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec.solids import HEX8, HEX20, TET10, divide_brick, divide_tetrahedron
from tests.cases.elements import build, held, sheet, solids

KINDS = pytest.mark.parametrize("kind", ["hex8", "hex20", "tet10"])
SOLIDS = {"hex8": HEX8, "hex20": HEX20, "tet10": TET10}
TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
STUFF = {"E": 70e9, "nu": 0.34, "rho": 2700.0}


def divided(kind: str, parts: int) -> tuple[np.ndarray, list[list[int]]]:
    """Two distorted bricks (or what six tetrahedra fill), every element divided."""
    solid = SOLIDS[kind]
    points, cells = solids(kind)
    divide = divide_tetrahedron if kind == "tet10" else divide_brick
    found = divide(solid, parts)
    assert found is not None
    place: dict[Any, int] = {}
    out, rows = [], []
    for cell in cells:
        keys = [found.key(p, cell) for p in range(len(found.weights))]
        for key, weight in zip(keys, found.weights, strict=True):
            if key not in place:
                place[key] = len(out)
                out.append(weight @ points[cell])
        rows += [[place[keys[p]] for p in child] for child in found.children]
    return np.array(out), rows


@KINDS
@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_constant_strain(kind: str, mass: str) -> None:
    """Six strains and a rotation on a distorted mesh: no force inside, the energy of the
    continuum."""
    points, cells = divided(kind, 2)
    text = sheet(points, cells, material=STUFF, kind=kind, dofs="xyz", mass=mass)
    model = build(text)
    K = model.matrices().K
    H = np.random.default_rng(2).normal(size=(3, 3))
    u = (points @ H.T).ravel()
    strain = (H + H.T) / 2
    nu = STUFF["nu"]
    mu = STUFF["E"] / 2 / (1 + nu)
    lam = 2 * mu * nu / (1 - 2 * nu)
    volume = model.total_mass() / STUFF["rho"]
    energy = (lam * np.trace(strain) ** 2 + 2 * mu * np.sum(strain**2)) * volume
    assert u @ K @ u == pytest.approx(energy, rel=1e-10)
    faces: dict[frozenset[int], int] = {}
    for cell in cells:
        for face in SOLIDS[kind].faces:
            key = frozenset(cell[k] for k in face)
            faces[key] = faces.get(key, 0) + 1
    rim = {n for face, count in faces.items() if count == 1 for n in face}
    corners = {n for cell in cells for n in cell[: len(SOLIDS[kind].corners)]}
    inside = sorted(corners - rim)
    assert inside
    force = (K @ u).reshape(-1, 3)
    assert np.abs(force[inside]).max() <= 1e-9 * np.abs(force).max()


def box(kind: str, counts: tuple[int, int, int], size: tuple[float, ...]) -> Any:
    """A box in bricks, or in six tetrahedra each."""
    solid = SOLIDS[kind]
    ticks = [np.arange(n) for n in counts]
    rounds = ((1, 2), (2, 3), (3, 7), (7, 4), (4, 5), (5, 1))
    place: dict[tuple[float, ...], int] = {}
    rows = []
    for origin in np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3):
        corners = np.array(HEX8.corners) + origin
        halves = [[0, a, b, 6] for a, b in rounds] if kind == "tet10" else [list(range(8))]
        for part in halves:
            nodes = list(corners[part].astype(float))
            nodes += [(nodes[i] + nodes[j]) / 2 for i, j in solid.edges] if solid.quadratic else []
            rows.append([place.setdefault(tuple(p), len(place)) for p in nodes])
    points = np.array(list(place)) / counts * size
    return points, rows


@KINDS
def test_lames_modes_of_the_cube(kind: str) -> None:
    """u = cos kx sin ky, v = −sin kx cos ky, k = π / L: no traction on any face (Lamé 1852), so
    ω² = 2 μ k² / ρ exactly; from above, O(h²) with linear displacements, towards O(h⁴) with
    quadratic ones."""
    side = 0.2
    mu = STUFF["E"] / 2 / (1 + STUFF["nu"])
    exact = 2 * mu * (np.pi / side) ** 2 / STUFF["rho"]

    def error(n: int) -> float:
        points, cells = box(kind, (n, n, n), (side,) * 3)
        model = build(sheet(points, cells, material=STUFF, kind=kind, dofs="xyz"))
        kx, ky = np.pi / side * points[:, 0], np.pi / side * points[:, 1]
        shape = np.stack([np.cos(kx) * np.sin(ky), -np.sin(kx) * np.cos(ky), 0 * kx], axis=1)
        modes = model_modes(model, 40).flexible()
        part = np.abs(modes.shapes.T @ (model.matrices().M @ shape.ravel()))
        return float(modes.eigenvalues[int(np.argmax(part))] / exact - 1)

    coarse, fine, order = {"hex8": (4, 8, 1.8), "hex20": (2, 4, 3.6), "tet10": (3, 5, 3.0)}[kind]
    errors = error(coarse), error(fine)
    assert 0.0 < errors[1] < 0.02
    assert np.log(errors[0] / errors[1]) / np.log(fine / coarse) > order


@KINDS
def test_a_slender_cantilever_bends(kind: str) -> None:
    """One element through the depth, oblique in space: P L³ / 3 E I + 6 P L / 5 G A."""
    L, b, h = 1.0, 0.02, 0.02
    points, cells = box(kind, (20, 1, 1), (L, b, h))
    root = [i + 1 for i in np.flatnonzero(np.isclose(points[:, 0], 0.0))]
    tip = np.flatnonzero(np.isclose(points[:, 0], L))
    stuff = {**STUFF, "nu": 0.3}
    text = sheet(points @ TURN.T, cells, material=stuff, kind=kind, dofs="xyz")
    model = build(held(text, (root, "xyz")))
    f = np.zeros((len(points), 3))
    f[tip] = TURN[:, 2] / len(tip)
    load = np.array([f[int(n) - 1] for n in model.node_ids])[model.dof_node, model.dof_kind]
    u = sla.spsolve(model.matrices().K, load)
    E, G = stuff["E"], stuff["E"] / 2.6
    wanted = L**3 / (3 * E * b * h**3 / 12) + 1.2 * L / G / b / h
    assert load @ u == pytest.approx(wanted, rel=0.02)


def test_incompatible_modes_follow_poissons_ratio_to_first_order() -> None:
    """dK/dν with the modes held is that of elements condensed anew (the energy is least)."""
    points, cells = solids("hex8")
    xyz = points[cells[:1]]
    E, rho = np.array([70e9]), np.array([2700.0])

    def K(poisson: float, nu: complex) -> np.ndarray:
        kind = Hex8(poisson)
        c = kind.coefficients({"E": E, "nu": np.array([nu]), "rho": rho})
        terms = kind.terms(xyz, np.zeros((1, 3)))
        return sum(c[t.coefficient][0] * t.values[0] for t in terms if t.matrix == "K")

    d = 1e-4
    held_ = np.imag(K(0.3, 0.3 + 1e-30j)) / 1e-30
    anew = (K(0.3 + d, 0.3 + d) - K(0.3 - d, 0.3 - d)) / (2 * d)
    assert np.abs(held_ - anew).max() <= 1e-6 * np.abs(anew).max()
    assert np.abs(K(0.3, 0.34) - K(0.34, 0.34)).max() > 0


@KINDS
def test_division_fills_the_parent(kind: str) -> None:
    """By mass, and every child is right-handed (else the terms would be refused)."""
    masses = []
    for parts in (1, 2, 4):
        points, cells = divided(kind, parts)
        masses.append(
            build(sheet(points, cells, material=STUFF, kind=kind, dofs="xyz")).total_mass()
        )
        assert len(cells) == parts**3 * len(solids(kind)[1])
    assert np.allclose(masses, masses[0], rtol=1e-12)
    assert divide_tetrahedron(TET10, 3) is None


def test_bad_solids_are_refused() -> None:
    points, cells = solids("hex8")
    inside_out = points[[cells[0][k] for k in (4, 5, 6, 7, 0, 1, 2, 3)]]
    with pytest.raises(ModelError, match="turned inside out"):
        Hex8().terms(inside_out[None], np.zeros((1, 3)))
    points, cells = solids("hex20")
    folded = points[cells[0]].copy()
    folded[8] = folded[0]
    with pytest.raises(ModelError, match="no volume"):
        Hex20().terms(folded[None], np.zeros((1, 3)))
    text = sheet(points, cells, material={**STUFF, "nu": 0.5}, kind="hex20", dofs="xyz")
    with pytest.raises(ModelError, match="no change of volume"):
        build(text)
