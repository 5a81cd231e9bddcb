"""Plates and panels of shell elements against closed forms and Leissa's tables, thin and thick, at
the rate the theory promises."""

from typing import Any

import numpy as np
import pytest

from cvxupdate.fe.modes import model_modes
from tests.cases.elements import SPACE, build, halved, held, sheet, squares

E, NU, RHO = 207e9, 0.3, 7850.0
METAL = {"E": E, "nu": NU, "rho": RHO}
A, B = 1.0, 0.7
CORNERS = pytest.mark.parametrize("corners", [4, 3])
DISTORTED = pytest.mark.parametrize("jitter", [0.0, 0.25])
FLAT = ["z", "rx", "ry"]


def plate(n: int, corners: int, jitter: float, a: float, b: float, **section: float) -> Any:
    """n × n cells, or twice as many triangles; the points of the unit square and the text. What is
    distorted is a mesh of 4 × 4, so that refinement keeps the pattern."""
    coarse = 4 if jitter else n
    points, cells = squares(coarse, coarse, jitter, n // coarse)
    cells = cells if corners == 4 else halved(cells)
    xyz = np.column_stack([points * [a, b], np.zeros(len(points))])
    return points, sheet(xyz, cells, {"shape": "plate", **section}, METAL, FLAT)


def edge(points: np.ndarray, *axes: int, ends: tuple[float, ...] = (0.0, 1.0)) -> list[int]:
    """Nodes on the edges across ``axes``."""
    return [
        i + 1 for i, p in enumerate(points) if any(np.isclose(p[k], e) for k in axes for e in ends)
    ]


def simply_supported(n: int, corners: int, jitter: float, **section: float) -> np.ndarray:
    """The lowest four ω; edges that cannot turn along themselves."""
    points, text = plate(n, corners, jitter, A, B, **section)
    text = held(text, (edge(points, 0), ["z", "rx"]), (edge(points, 1), ["z", "ry"]))
    return 2 * np.pi * model_modes(build(text), 5).frequencies[:4]


def waves(count: int) -> np.ndarray:
    """k² = (m π / a)² + (n π / b)² in order."""
    return np.sort(
        [np.pi**2 * ((m / A) ** 2 + (n / B) ** 2) for m in range(1, 6) for n in range(1, 6)]
    )[:count]


def mindlin(h: float, kappa: float) -> np.ndarray:
    """ω of a simply supported plate with shear and rotary inertia (Mindlin 1951): the lower root of
    ρ² h⁴ ω⁴ / 12 κ G h − (ρ h + ρ h³ k² / 12 + D ρ k² / κ G) ω² + D k⁴ = 0."""
    k2, G, D = waves(4), E / 2 / (1 + NU), E * h**3 / 12 / (1 - NU**2)
    a = RHO**2 * h**3 / 12 / kappa / G
    b = -(RHO * h + RHO * h**3 * k2 / 12 + D * RHO * k2 / kappa / G)
    return np.sqrt(2 * D * k2**2 / (-b + np.sqrt(b**2 - 4 * a * D * k2**2)))


@CORNERS
@DISTORTED
def test_thin_plate(corners: int, jitter: float) -> None:
    """Kirchhoff's plate: O(h²)."""
    h = 1e-4
    exact = waves(4) * np.sqrt(E * h**2 / 12 / (1 - NU**2) / RHO)
    coarse, fine = (simply_supported(n, corners, jitter, thickness=h) / exact - 1 for n in (8, 16))
    assert np.all(np.abs(fine) < 0.011)
    assert np.log2(np.linalg.norm(coarse) / np.linalg.norm(fine)) == pytest.approx(2.0, abs=0.3)


@CORNERS
@DISTORTED
@pytest.mark.parametrize("h", [0.003, 0.02, 0.1])
def test_mindlin_plate(corners: int, jitter: float, h: float) -> None:
    """From where shear hardly matters to where it takes a tenth off: the error falls as h²."""
    exact = mindlin(h, 0.86)
    coarse, fine = (
        simply_supported(n, corners, jitter, thickness=h, kappa=0.86) / exact - 1 for n in (8, 16)
    )
    assert np.all(np.abs(fine) < 0.011)
    assert np.linalg.norm(fine) < np.linalg.norm(coarse) / 3.0
    if h == 0.1:
        thin = waves(4) * np.sqrt(E * h**2 / 12 / (1 - NU**2) / RHO)
        assert np.all(thin > 1.03 * exact)


LEISSA = {  # ω a² √(ρ h / D) of the square, ν = 0.3: Leissa (1973), upper bounds of Ritz
    "free": (13.489, 19.789, 24.432, 35.024),
    "cantilever": (3.4917, 8.5246, 21.429, 27.331),
    "clamped": (35.992, 73.413, 73.413, 108.27),
}
SHARP = {  # converged: Liew, Xiang and Kitipornchai (1993)
    "free": (13.468, 19.596, 24.270, 34.801),
    "cantilever": (3.4711, 8.5067, 21.285, 27.199),
    "clamped": (35.985, 73.394, 73.394, 108.217),
}


@CORNERS
@pytest.mark.parametrize("edges", LEISSA)
def test_leissas_plates(edges: str, corners: int) -> None:
    """Extrapolated from 10 and 20 elements a side (O(h²)): within 0.25 % of the converged values,
    and below Leissa's bounds where those are further off."""
    h = 1e-4
    unit = np.sqrt(E * h**2 / 12 / (1 - NU**2) / RHO)

    def found(n: int) -> np.ndarray:
        points, text = plate(n, corners, 0.0, 1.0, 1.0, thickness=h)
        if edges != "free":
            rim = edge(points, 0, ends=(0.0,)) if edges == "cantilever" else edge(points, 0, 1)
            text = held(text, (rim, FLAT))
        modes = model_modes(build(text), 8).flexible()
        return 2 * np.pi * modes.frequencies[:4] / unit

    coarse, fine = found(10), found(20)
    extrapolated = fine + (fine - coarse) / 3.0
    assert np.allclose(extrapolated, SHARP[edges], rtol=2.5e-3)
    assert np.all(extrapolated < np.array(LEISSA[edges]) * 1.002)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_mass_matrices_agree_in_the_limit(mass: str) -> None:
    """Thick, so that rotary inertia counts: both converge to Mindlin's plate."""
    points, text = plate(20, 4, 0.2, A, B, thickness=0.1, kappa=0.86)
    text["elements"][0]["mass"] = mass
    text = held(text, (edge(points, 0), ["z", "rx"]), (edge(points, 1), ["z", "ry"]))
    omega = 2 * np.pi * model_modes(build(text), 5).frequencies[:4]
    assert np.allclose(omega, mindlin(0.1, 0.86), rtol=0.012)
    text["elements"][0]["rotary_inertia"] = False
    without = 2 * np.pi * model_modes(build(text), 5).frequencies[:4]
    assert np.all(without > 1.005 * omega)


def sanders(R: float, length: float, h: float, m: int, n: int) -> float:
    """ω of a cylinder between shear diaphragms, m half waves along and n waves around, from the
    strain energy of Sanders (1959) and in-plane inertia: the lowest of three."""
    a = m * np.pi / length
    b = n / R
    # rows: amplitudes of u = U cos ax cos ny, v = V sin ax sin ny, w = W sin ax cos ny
    strain = np.array(
        [
            [-a, 0.0, 0.0],
            [0.0, b, 1.0 / R],
            [-b, a, 0.0],
            [0.0, 0.0, a**2],
            [0.0, b / R, b**2],
            [b / 2 / R, 1.5 * a / R, 2 * a * b],
        ]
    )
    flat = np.array([[1.0, NU, 0.0], [NU, 1.0, 0.0], [0.0, 0.0, (1 - NU) / 2]]) / (1 - NU**2) * E
    C = np.kron(np.diag([h, h**3 / 12]), flat)
    return float(np.sqrt(np.linalg.eigvalsh(strain.T @ C @ strain)[0] / RHO / h))


@CORNERS
def test_curved_panel(corners: int) -> None:
    """A quarter of a cylinder between diaphragms, its straight edges on planes of symmetry: modes
    of one half wave along and four to eight waves around."""
    R, length, h = 1.0, 1.2, 0.01
    exact = np.sort([sanders(R, length, h, m, n) for m in (1, 2) for n in (2, 4, 6, 8)])[:3]

    def found(n: int) -> np.ndarray:
        points, cells = squares(n, n)
        angle = points[:, 1] * np.pi / 2
        xyz = np.stack([points[:, 0] * length, R * np.sin(angle), R * np.cos(angle)], axis=1)
        cells = cells if corners == 4 else halved(cells)
        text = sheet(xyz, cells, {"shape": "plate", "thickness": h}, METAL, SPACE)
        text = held(
            text,
            (edge(points, 0), ["y", "z"]),
            (edge(points, 1, ends=(0.0,)), ["y", "rx", "rz"]),
            (edge(points, 1, ends=(1.0,)), ["z", "rx", "ry"]),
        )
        return 2 * np.pi * model_modes(build(text), 8).flexible().frequencies[:3]

    coarse, fine = found(10), found(20)
    assert np.linalg.norm(fine / exact - 1) < 0.6 * np.linalg.norm(coarse / exact - 1)
    assert np.allclose(fine, exact, rtol=3.5e-3)
