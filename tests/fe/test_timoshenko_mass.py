"""The consistent mass of a beam that deforms in shear: published matrices, definiteness, rigid
motion, and both bending planes."""

import numpy as np
import pytest

from cvxupdate.fe.model import Model
from tests.cases.elements import SPACE, STEEL, build, lines, with_values

E, NU, RHO = STEEL["E"], STEEL["nu"], STEEL["rho"]
G = E / 2 / (1 + NU)
L, A, INERTIA, KAPPA = 0.37, 6.0e-4, {"y": 5.0e-8, "z": 2.0e-8}, 0.8
SECTION = {"shape": "general", "A": A, "Iy": INERTIA["y"], "Iz": INERTIA["z"], "J": 1.3e-8}
# w and the rotation of two nodes, as labels; θy = −dw/dx
PLANES = {
    "z": (("n1.y", "n1.rz", "n2.y", "n2.rz"), 1.0),
    "y": (("n1.z", "n1.ry", "n2.z", "n2.ry"), -1.0),
}
PHIS = [0.0, 0.03, 0.7, 4.0, 90.0]


def beam(phi: float, axis: str, **block: object) -> Model:
    """One element along x, oriented so that local and global axes agree, whose Φ about ``axis`` is
    ``phi``."""
    full = 12 * E * INERTIA[axis] / (KAPPA * G * A * L**2)
    text = lines(
        "beam3d",
        [[0, 0, 0], [L, 0, 0]],
        [(1, 2)],
        SPACE,
        SECTION,
        orientation=[0.0, 0.0, 1.0],
        **block,
    )
    return with_values(build(text), shear=phi / full, kappa=KAPPA)


def plane(model: Model, axis: str) -> np.ndarray:
    """The mass matrix of (w₁, ψ₁, w₂, ψ₂), ψ counted as dw/dx."""
    labels, sign = PLANES[axis]
    at = [model.place[label] for label in labels]
    turn = np.array([1.0, sign, 1.0, sign])
    return model.matrices().M.toarray()[np.ix_(at, at)] * np.outer(turn, turn)


def published(phi: float, inertia: float) -> np.ndarray:
    """Friedman and Kosmatka (1993), the translational and the rotary mass matrix as printed; Φ = 0
    gives 156, 22, 54, 13 / 420."""
    a = [
        70 * phi**2 + 147 * phi + 78,
        (35 * phi**2 + 77 * phi + 44) / 4,
        35 * phi**2 + 63 * phi + 27,
        (35 * phi**2 + 63 * phi + 26) / 4,
    ]
    b = [(7 * phi**2 + 14 * phi + 8) / 4, (7 * phi**2 + 14 * phi + 6) / 4]
    translation = np.array(
        [
            [a[0], a[1], a[2], -a[3]],
            [a[1], b[0], a[3], -b[1]],
            [a[2], a[3], a[0], -a[1]],
            [-a[3], -b[1], -a[1], b[0]],
        ]
    )
    c, d, e = 15 * phi - 3, 10 * phi**2 + 5 * phi + 4, 5 * phi**2 - 5 * phi - 1
    rotation = np.array([[36, -c, -36, -c], [-c, d, c, e], [-36, c, 36, c], [-c, e, c, d]])
    scale = np.outer([1, L, 1, L], [1, L, 1, L]) / (1 + phi) ** 2
    return np.asarray(scale * (RHO * A * L / 210 * translation + RHO * inertia / 30 / L * rotation))


@pytest.mark.parametrize("axis", PLANES)
@pytest.mark.parametrize("phi", PHIS)
def test_published_matrix(phi: float, axis: str) -> None:
    """Each plane has its own Φ: I differs between them by a factor of 2.5."""
    expected = published(phi, INERTIA[axis])
    assert np.abs(plane(beam(phi, axis), axis) - expected).max() <= 1e-14 * np.abs(expected).max()
    other = "y" if axis == "z" else "z"
    expected = published(phi * INERTIA[other] / INERTIA[axis], INERTIA[other])
    assert np.abs(plane(beam(phi, axis), other) - expected).max() <= 1e-14 * np.abs(expected).max()


@pytest.mark.parametrize("axis", PLANES)
@pytest.mark.parametrize("phi", PHIS)
def test_rigid_motion(phi: float, axis: str) -> None:
    """Mass, first moment and inertia about the first node, whatever Φ."""
    M = plane(beam(phi, axis), axis)
    shift, turn = np.array([1.0, 0, 1, 0]), np.array([0.0, 1, L, 1])
    m = RHO * A * L
    assert shift @ M @ shift == pytest.approx(m, rel=1e-13)
    assert shift @ M @ turn == pytest.approx(m * L / 2, rel=1e-13)
    assert turn @ M @ turn == pytest.approx(m * L**2 / 3 + RHO * INERTIA[axis] * L, rel=1e-13)


@pytest.mark.parametrize("axis", PLANES)
def test_mass_is_positive_definite(axis: str) -> None:
    """For any Φ: where w has lost a motion (equal and opposite rotations bend no chord as Φ grows),
    rotary inertia carries it."""
    for phi in np.concatenate([[0.0], np.logspace(-3, 6, 37)]):
        M = plane(beam(phi, axis), axis)
        d = np.sqrt(np.diag(M))
        assert np.linalg.eigvalsh(M / np.outer(d, d))[0] > 1e-3, phi
        bare = plane(beam(phi, axis, rotary_inertia=False), axis)
        assert np.linalg.eigvalsh(bare / np.outer(d, d))[0] > -1e-15, phi


def test_lumped_mass_knows_no_shear() -> None:
    for axis in PLANES:
        assert np.array_equal(
            plane(beam(4.0, axis, mass="lumped"), axis), plane(beam(0.0, axis, mass="lumped"), axis)
        )


@pytest.mark.parametrize("axis", PLANES)
@pytest.mark.parametrize("word", ["shear", "kappa", "E", "nu", "Iy", "Iz", "A"])
def test_mass_moves_with_every_property_of_phi(word: str, axis: str) -> None:
    """Complex step through the element's coefficients against central differences of the published
    matrix: dM/dΦ · dΦ/dp, and I and A besides."""
    model = beam(0.7, axis)
    block = model.blocks[0]

    def reference(t: float) -> np.ndarray:
        """The published matrix where the word is (1 + t) times as large."""
        f = {word: 1 + t}
        stiffer = (1 + NU * f.get("nu", 1)) / (1 + NU)  # E / G: E itself cancels
        inertia, area = f.get("I" + axis, 1), f.get("A", 1)
        phi = 0.7 * f.get("shear", 1) * stiffer * inertia / f.get("kappa", 1) / area
        rotary = published(phi, INERTIA[axis]) - published(phi, 0.0)
        return np.asarray(area * published(phi, 0.0) + inertia * rotary)

    h = 1e-3
    expected = (
        (8 * (reference(h) - reference(-h)) - (reference(2 * h) - reference(-2 * h))) / 12 / h
    )
    parts = block.derivative(block.properties, np.array([0]), (word,), block.properties[word])
    if "M" not in parts:  # E cancels in Φ, and the inertia of the other plane is none of this one's
        assert np.abs(expected).max() <= 1e-12 * np.abs(reference(0.0)).max()
        return
    labels, sign = PLANES[axis]
    turn = np.array([1.0, sign, 1.0, sign])
    at = [int(np.flatnonzero(block.dofs[0] == model.place[label])[0]) for label in labels]
    found = parts["M"][0][np.ix_(at, at)] * np.outer(turn, turn)
    assert np.abs(found - expected).max() <= 1e-9 * np.abs(reference(0.0)).max()
