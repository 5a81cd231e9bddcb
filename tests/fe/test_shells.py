"""Shells: patch tests, frames, offsets, warping, locking; plates against closed forms are in
test_shell_plates.py."""

from typing import Any

import numpy as np
import pytest
import scipy.sparse.linalg as sla
from scipy.spatial.transform import Rotation

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements import Shell
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from tests.cases.elements import (
    ALLOY,
    CREASED,
    QUADS,
    SECTIONS,
    SPACE,
    TRIANGLES,
    build,
    halved,
    held,
    sheet,
    squares,
)

A, B = 0.5, 0.4
TURN = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
SHIFT = np.array([0.3, -0.2, 1.1])
CORNERS = pytest.mark.parametrize("corners", [4, 3])
THEORY = pytest.mark.parametrize("section", ["rolled", "thick"])
ROLLED = TURN @ [1.0, 0.0, 0.0]


def patch(corners: int, section: Any, turn: np.ndarray = TURN, **block: Any) -> Model:
    """A distorted mesh of 3 × 3 quadrilaterals, or of twice as many triangles, in a plane of
    space."""
    points, cells = squares(3, 3, 0.3)
    xyz = np.column_stack([points * [A, B], np.zeros(len(points))]) @ turn.T + SHIFT
    cells = cells if corners == 4 else halved(cells)
    block = {"orientation": turn @ [1.0, 0.0, 0.0], **block}
    return build(sheet(xyz, cells, section, ALLOY, **block))


def motion(model: Model, u: np.ndarray, theta: np.ndarray, turn: np.ndarray = TURN) -> np.ndarray:
    """Local displacements (n, 3) and rotations (n, 3) on the DOFs."""
    return np.hstack([u @ turn.T, theta @ turn.T]).ravel()


def check_patch(model: Model, u: np.ndarray, energy: float) -> None:
    """Energy as given, forces on the rim only."""
    K = model.matrices().K
    assert u @ K @ u == pytest.approx(energy, rel=1e-10)
    local = (model.xyz - SHIFT) @ TURN
    x, y = local[:, 0], local[:, 1]
    inside = (x > 1e-9) & (x < A - 1e-9) & (y > 1e-9) & (y < B - 1e-9)
    assert inside.sum() == 4
    force = (K @ u).reshape(-1, 6)
    assert np.abs(force[inside]).max() <= 1e-9 * np.abs(force).max()


@THEORY
@CORNERS
@pytest.mark.parametrize("field", [(1.0, 0.0, 0.0), (0.7, -1.3, 0.0), (0.0, 0.0, 1.0)])
def test_constant_curvature(corners: int, section: str, field: tuple[float, ...]) -> None:
    kx, ky, kxy = field
    model = patch(corners, section)
    x, y = ((model.xyz - SHIFT) @ TURN)[:, :2].T
    zero = np.zeros_like(x)
    w = 0.5 * kx * x**2 + 0.5 * ky * y**2 + kxy * x * y
    theta = np.stack([ky * y + kxy * x, -(kx * x + kxy * y), zero], axis=1)
    s = {"Dx": 1.0, "Dy": 1.0, "D1": 1.0, "Dxy": 1.0, **SECTIONS[section]}
    nu = ALLOY["nu"]
    D = ALLOY["E"] * s["thickness"] ** 3 / 12 / (1 - nu**2)
    energy = D * (s["Dx"] * kx**2 + s["Dy"] * ky**2 + 2 * s["D1"] * nu * kx * ky)
    energy += 4 * s["Dxy"] * (1 - nu) / 2 * D * kxy**2
    check_patch(model, motion(model, np.stack([zero, zero, w], axis=1), theta), energy * A * B)


@THEORY
@CORNERS
@pytest.mark.parametrize("field", [(1.0, 0.0, 0.0), (0.7, -1.3, 0.0), (0.0, 0.0, 1.0)])
def test_constant_strain(corners: int, section: str, field: tuple[float, ...]) -> None:
    """With the drilling rotation that goes with it: that of the sheet, here not zero."""
    ex, ey, g = field
    model = patch(corners, section)
    x, y = ((model.xyz - SHIFT) @ TURN)[:, :2].T
    zero, spin = np.zeros_like(x), 0.37
    u = np.stack([ex * x + (g / 2 - spin) * y, ey * y + (g / 2 + spin) * x, zero], axis=1)
    theta = np.stack([zero, zero, zero + spin], axis=1)
    s = {"Dx": 1.0, "Dy": 1.0, "D1": 1.0, "Dxy": 1.0, **SECTIONS[section]}
    nu, h = ALLOY["nu"], s["thickness"]
    energy = s["Dx"] * ex**2 + s["Dy"] * ey**2 + 2 * s["D1"] * nu * ex * ey
    energy += s["Dxy"] * (1 - nu) / 2 * g**2
    check_patch(model, motion(model, u, theta), energy * ALLOY["E"] * h / (1 - nu**2) * A * B)


@CORNERS
def test_a_wide_bar_bends_and_shears(corners: int) -> None:
    """A cantilever sheet without lateral contraction: P L³ / 3 D + P L / κ G h per width at the
    tip, on distorted meshes: what is left is a small part of the deflection by shear."""
    section = {"shape": "plate", "thickness": 0.2, "kappa": 0.8}
    material = {"E": 70e9, "nu": 0.0, "rho": 1.0}
    L, width = 1.0, 0.25
    D, S = 70e9 * 0.2**3 / 12, 0.8 * 35e9 * 0.2

    def error(n: int) -> float:
        points, cells = squares(4 * n, n, 0.2)
        xyz = np.column_stack([points * [L, width], np.zeros(len(points))])
        cells = cells if corners == 4 else halved(cells)
        text = sheet(xyz, cells, section, material, ["z", "rx", "ry"])
        ends = [[i + 1 for i in np.flatnonzero(np.isclose(points[:, 0], x))] for x in (0.0, 1.0)]
        model = build(held(text, (ends[0], ["z", "rx", "ry"])))
        share = np.where(np.isin(np.arange(n + 1), (0, n)), 0.5, 1.0) / n
        f = np.zeros(model.size)
        tip = [model.place[f"n{i}.z"] for i in ends[1]]
        f[tip] = share
        return float(share @ sla.spsolve(model.matrices().K, f)[tip] * width - L**3 / 3 / D - L / S)

    assert abs(error(3)) < 0.02 * L / S
    assert abs(error(9)) < 0.002 * L / S


@pytest.mark.parametrize("aspect", [0.3, 1.0, 4.0])
def test_in_plane_bending_of_a_rectangle_is_exact(aspect: float) -> None:
    """One element under pure bending in its plane: E h b³ a / 12 κ², at any aspect ratio and at
    any attitude (ν = 0.3, at which the triangles' only number is best)."""
    nu, h, a, b = 0.3, 0.01, aspect, 1.0
    x, y = (np.array([[0, a, a, 0], [0, 0, b, b]]) - [[a / 2], [b / 2]]).astype(float)
    zero = np.zeros(4)
    text = sheet(
        np.column_stack([x, y, zero]) @ TURN.T,
        [[0, 1, 2, 3]],
        {"shape": "plate", "thickness": h},
        {"E": 1.0, "nu": nu, "rho": 1.0},
    )
    model = build(text)
    u = np.stack([-x * y, 0.5 * x**2 + 0.5 * nu * y**2, zero], axis=1)
    q = motion(model, u, np.stack([zero, zero, x], axis=1))
    assert q @ model.matrices().K @ q == pytest.approx(h * a * b**3 / 12, rel=1e-9)


@CORNERS
def test_where_the_shell_stands_does_not_matter(corners: int) -> None:
    """Turned in space, and its cells numbered from another corner, with the material axis kept."""
    text = patch_text(corners, TURN)
    here, there = (build(t) for t in (text, patch_text(corners, np.eye(3))))
    rows = [{**r, "nodes": r["nodes"][1:] + r["nodes"][:1]} for r in text["elements"][0]["rows"]]
    first = build({**text, "elements": [{**text["elements"][0], "rows": rows}]})
    expected = model_modes(there, 16).flexible().eigenvalues
    assert np.allclose(model_modes(here, 16).flexible().eigenvalues, expected, rtol=1e-6)
    assert np.allclose(model_modes(first, 16).flexible().eigenvalues, expected, rtol=1e-6)
    assert model_modes(here, 16).rigid == 6


def patch_text(corners: int, turn: np.ndarray) -> dict[str, Any]:
    cells = QUADS if corners == 4 else TRIANGLES
    axis = turn @ [1.0, 0.2, 0.1]
    return sheet(CREASED @ turn.T, cells, "rolled", ALLOY, orientation=axis, offset=0.01)


def test_isotropic_shells_have_no_axis() -> None:
    """The orientation changes nothing where the sheet is isotropic, also of a warped one."""
    models = [
        build(sheet(CREASED, QUADS, "sheet", orientation=axis))
        for axis in ([1.0, 0.0, 0.0], [0.2, 1.0, 0.3])
    ]
    for name in ("K", "M"):
        a, b = (getattr(m.matrices(), name).toarray() for m in models)
        assert np.abs(a - b).max() <= 1e-12 * np.abs(a).max()


@CORNERS
@THEORY
def test_two_layers_are_one_sheet(corners: int, section: str) -> None:
    """Half the thickness above the nodes and half below: energy of curvature, of twist and of
    strain, and mass, are those of the whole sheet."""
    half = {**SECTIONS[section], "thickness": SECTIONS[section]["thickness"] / 2}
    whole = patch(corners, section)
    layers = [patch(corners, half, surface=s) for s in ("bottom", "top")]
    x, y = ((whole.xyz - SHIFT) @ TURN)[:, :2].T
    zero = np.zeros_like(x)
    for kx, ky, kxy in ((1.0, 0.0, 0.0), (0.4, -0.9, 0.6)):
        w = 0.5 * kx * x**2 + 0.5 * ky * y**2 + kxy * x * y
        theta = np.stack([ky * y + kxy * x, -(kx * x + kxy * y), zero], axis=1)
        u = motion(whole, np.stack([zero, zero, w], axis=1), theta)
        energies = [u @ m.matrices().K @ u for m in (whole, *layers)]
        assert energies[1] + energies[2] == pytest.approx(energies[0], rel=1e-10)
    masses = [m.matrices().M for m in (whole, *layers)]
    turned = motion(whole, np.zeros((len(x), 3)), np.ones((len(x), 3)))
    assert turned @ (masses[1] + masses[2]) @ turned == pytest.approx(turned @ masses[0] @ turned)


def test_an_offset_is_a_rigid_link() -> None:
    """A sheet 30 mm aside moves as one on nodes of its own that rigid links hold to the others."""
    normal, e = TURN @ [0.0, 0.0, 1.0], 0.03
    aside, own = patch(4, "rolled", offset=e), patch(4, "rolled")
    link = np.eye(own.size)
    for node in range(len(own.xyz)):
        for k in range(3):
            link[6 * node : 6 * node + 3, 6 * node + 3 + k] = np.cross(np.eye(3)[k], e * normal)
    for name in ("K", "M"):
        a = getattr(aside.matrices(), name).toarray()
        b = link.T @ getattr(own.matrices(), name).toarray() @ link
        assert np.abs(a - b).max() <= 1e-12 * np.abs(b).max()


@CORNERS
def test_thin_and_thick_agree_where_the_sheet_is_thin(corners: int) -> None:
    """No locking: at a thousandth and a millionth of the span the frequencies of a clamped plate
    on the same distorted mesh are those of the element without shear."""
    points, cells = squares(6, 6, 0.25)
    xyz = np.column_stack([points, np.zeros(len(points))])
    rim = [i + 1 for i in np.flatnonzero(np.any(np.abs(points - 0.5) > 0.5 - 1e-9, axis=1))]
    cells = cells if corners == 4 else halved(cells)
    for h in (1e-3, 1e-6):
        found = []
        for extra in ({}, {"kappa": 5 / 6}):
            section = {"shape": "plate", "thickness": h, **extra}
            text = sheet(xyz, cells, section, ALLOY, ["z", "rx", "ry"])
            model = build(held(text, (rim, ["z", "rx", "ry"])))
            found.append(model_modes(model, 6).frequencies)
        assert np.allclose(found[1], found[0], rtol=10 * (h / (1.0 / 6)) ** 2 + 1e-9)


def test_a_twisted_beam() -> None:
    """MacNeal and Harder (1985): 12 × 2 elements, 90° of twist, all of them warped; tip loads in
    the plane of the root and across it; 0.005424 and 0.001754 (thin: Belytschko and Wong 1989)."""
    for t, load, wanted in (
        (0.32, 1.0, (5.424e-3, 1.754e-3)),
        (0.0032, 1e-6, (5.256e-3, 1.294e-3)),
    ):
        points, cells = squares(12, 2)
        s, w = points[:, 0] * 12.0, (points[:, 1] - 0.5) * 1.1
        angle = s / 12.0 * np.pi / 2
        xyz = np.stack([s, w * np.cos(angle), w * np.sin(angle)], axis=1)
        section = {"shape": "plate", "thickness": t, "kappa": 5 / 6}
        text = sheet(xyz, cells, section, {"E": 29e6, "nu": 0.22, "rho": 1.0})
        model = build(held(text, ([i + 1 for i in np.flatnonzero(s == 0)], SPACE)))
        tip = np.flatnonzero(np.isclose(s, 12.0))
        for kind, expected in zip("zy", wanted, strict=True):
            f = np.zeros(model.size)
            f[[model.place[f"n{n + 1}.{kind}"] for n in tip]] = load * np.array([0.25, 0.5, 0.25])
            u = sla.spsolve(model.matrices().K, f)
            assert u[model.place[f"n{tip[1] + 1}.{kind}"]] == pytest.approx(expected, rel=0.01)


@CORNERS
def test_the_scordelis_lo_roof(corners: int) -> None:
    """A quarter of the roof by 16 × 16: 0.3024 at the middle of the free edge (MacNeal and Harder
    1985)."""
    points, cells = squares(16, 16)
    angle = np.deg2rad(40.0) * points[:, 1]
    xyz = np.stack([25.0 * points[:, 0], 25.0 * np.sin(angle), 25.0 * np.cos(angle)], axis=1)

    def line(axis: int, at: float) -> list[int]:
        return [i + 1 for i in np.flatnonzero(np.isclose(points[:, axis], at))]

    text = sheet(
        xyz,
        cells if corners == 4 else halved(cells),
        {"shape": "plate", "thickness": 0.25},
        {"E": 4.32e8, "nu": 0.0, "rho": 4.0},
        mass="lumped",
    )
    text = held(
        text,
        (line(0, 0.0), ["y", "z"]),
        (line(0, 1.0), ["x", "ry", "rz"]),
        (line(1, 0.0), ["y", "rx", "rz"]),
    )
    model = build(text)
    m = model.matrices()
    f = -90.0 * (m.M @ (model.dof_kind == 2).astype(float)) * (model.dof_kind == 2)
    u = sla.spsolve(m.K, f)
    assert u[model.place["n289.z"]] == pytest.approx(-0.3024, rel=0.01)


@pytest.mark.parametrize(
    ("points", "axis", "words"),
    [
        ([[0, 0, 0], [1, 0, 0], [2, 0, 0]], [0, 0, 0], "no area"),
        ([[0, 0, 0], [1, 0, 0], [0.2, 0.2, 0], [0, 1, 0]], [0, 0, 0], "not convex"),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [0, 0, 0], "no area"),
        ([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], [0, 0, 2], "along its normal"),
    ],
)
def test_bad_shells_are_refused(points: list[Any], axis: list[float], words: str) -> None:
    with pytest.raises(ModelError, match=words):
        Shell(len(points)).terms(np.array([points], dtype=float), np.array([axis], dtype=float))
