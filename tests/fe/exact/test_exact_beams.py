"""Exact beams: static limit, closed forms, subdivision, a fine mesh, derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from itertools import pairwise
from typing import Any

import numpy as np
import pytest

from cvxupdate.fe.block import Block
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis import frequency_responses
from tests.cases.elements import SPACE, STEEL, build, chain, lines

E, G, RHO = 207e9, 79.6e9, 7850.0
MATERIAL = {"E": E, "G": G, "rho": RHO}
THICK = {"shape": "rectangle", "width": 0.04, "height": 0.1, "kappa": 0.85}
BENT = np.array([(0.0, 0.0, 0.0), (0.5, 0.1, 0.2), (0.9, -0.3, 0.35), (1.4, 0.2, 0.1)])
FREQUENCIES = (1.0, 37.0, 420.0, 5000.0, 40e3)
CUT_OFF = np.sqrt(0.85 * G * 0.004 / (RHO * 0.1**3 * 0.04 / 12)) / (2 * np.pi)


def one(section: Mapping[str, Any] = THICK, N: float = 0.0, eta: float = 0.0) -> Block:
    """A member along x, 0.7 m."""
    model = build(lines("exact_beam", [(0, 0, 0), (0.7, 0, 0)], [(1, 2)], SPACE, section, MATERIAL))
    block = model.blocks[0]
    block.properties["N"][:], block.properties["eta"][:] = N, eta  # type: ignore[index]
    return block


def stiffness(block: Block, frequency: float) -> np.ndarray:
    return block.dynamic_stiffness(2 * np.pi * frequency, block.properties)[0]


def divided(parts: int) -> Model:
    """The bent bar with every member in ``parts``; its corners are nodes 1, parts + 1, …"""
    points = [a + (b - a) * k / parts for a, b in pairwise(BENT) for k in range(parts)]
    return build(lines("exact_beam", [*points, BENT[-1]], chain(3 * parts), SPACE, THICK, MATERIAL))


@pytest.mark.parametrize("kappa", [None, 0.85])
def test_series_in_the_frequency_is_the_element_of_finite_elements(kappa: float | None) -> None:
    """Z(ω) = K − ω² M + O(ω⁴) for the K and M of `beam3d`: static shapes give the first two
    terms."""
    block = one(
        {**{k: v for k, v in THICK.items() if k != "kappa"}, **({"kappa": kappa} if kappa else {})}
    )
    m = block.combine(block.scalars(block.properties))
    K, M = m["K"][0], m["M"][0]
    near, far = (stiffness(block, f) for f in (1e-3, 4.0))
    assert np.abs(near - K).max() < 1e-11 * np.abs(K).max()
    w2 = (2 * np.pi * 4.0) ** 2
    assert np.abs((K - far) / w2 - M).max() < 1e-4 * np.abs(M).max()


def test_a_preload_is_the_geometric_stiffness_to_first_order() -> None:
    """A quarter of the rest at half the tension: the static shapes bend with N themselves."""
    rest = []
    for N in (4e5, 2e5):
        block = one(N=N)
        K = block.combine(block.scalars(block.properties))["K"][0]
        rest.append(np.abs(stiffness(block, 1e-3) - K).max())
    assert 3.8 < rest[0] / rest[1] < 4.2


def test_the_thesis_s_closed_form() -> None:
    """(8.16) and (8.17) in the x–y plane, with β = √((ε₁ − ε₃)/2), G₁ to G₄ and the sign of (8.15)
    corrected in the z–θy block (errata)."""
    A, I, L, kappa = 0.004, 0.1 * 0.04**3 / 12, 0.7, 0.85
    block = one()
    for f in (37.0, 420.0, 5000.0):
        w2 = (2 * np.pi * f) ** 2
        e1 = np.sqrt((RHO * w2) ** 2 * (1 / (kappa * G) - 1 / E) ** 2 + 4 * RHO * w2 * A / (E * I))
        e3 = RHO * w2 * (1 / (kappa * G) + 1 / E)
        a, b = np.sqrt((e1 + e3) / 2), np.sqrt((e1 - e3) / 2)
        g1, g2 = a**2 - RHO * w2 / (kappa * G), b**2 + RHO * w2 / (kappa * G)
        e2 = g1 * g2 / (a * b)
        s, c, S, C = np.sin(a * L), np.cos(a * L), np.sinh(b * L), np.cosh(b * L)
        K = E * I / (2 * e2 * (c * C - 1) + (g1**2 / a**2 - g2**2 / b**2) * s * S)
        f1 = K * e1 * e2 * (g1 / a * s * C + g2 / b * c * S)
        f2 = K * g1 * g2 * ((g1 / a**2 + g2 / b**2) * s * S + (g2 - g1) / (a * b) * (c * C - 1))
        f3 = K * e1 * e2 * (g1 / a * s + g2 / b * S)
        f4 = K * e1 * e2 * (c - C)
        f5 = K * e1 * (g1 / a * c * S - g2 / b * s * C)
        f6 = K * e1 * (g2 / b * s - g1 / a * S)
        psi = np.sqrt(RHO * w2 / E)
        Z = stiffness(block, f)
        found = [Z[1, 1], Z[1, 5], Z[1, 7], Z[1, 11], Z[5, 5], Z[5, 11], Z[0, 0], Z[0, 6]]
        axial = E * A * psi / np.tan(psi * L), -E * A * psi / np.sin(psi * L)
        assert np.allclose(found, [-f1, -f2, f3, f4, f5, f6, *axial], rtol=1e-9)
        assert np.abs(Z - Z.T).max() < 1e-14 * np.abs(Z).max()


@pytest.mark.parametrize("frequency", [10.0, 300.0, 5000.0])
def test_subdivision_changes_nothing(frequency: float) -> None:
    H = []
    for parts in (1, 2, 7):
        model = divided(parts)
        at = np.array([model.place[f"n{3 * parts + 1}.z"], model.place[f"n{parts + 1}.x"]])
        H.append(frequency_responses(model, [frequency], at, at)[0])
    assert np.abs(H[1] - H[0]).max() < 1e-10 * np.abs(H[0]).max()
    assert np.abs(H[2] - H[0]).max() < 1e-10 * np.abs(H[0]).max()


def test_400_finite_elements_come_near() -> None:
    """And the nearer, the finer: what is left is the mesh's."""
    exact = model_modes(divided(1), 8).flexible().frequencies
    points = [a + (b - a) * k / 133 for a, b in pairwise(BENT) for k in range(133)]
    fine = build(lines("beam3d", [*points, BENT[-1]], chain(399), SPACE, THICK, MATERIAL))
    assert np.allclose(model_modes(fine, 8).flexible().frequencies, exact, rtol=3e-5)


def huang(ends: str, f: float, L: float, r2: float, s2: float, b2: float) -> float:
    """The frequency function of a Timoshenko beam (Huang 1961) for b² = ρA L⁴ ω²/EI at ``f`` times
    that of the closed form."""
    b2 = b2 * f**2
    b = np.sqrt(b2)
    root = np.sqrt((r2 - s2) ** 2 + 4 / b2)
    al, be = np.sqrt((root - r2 - s2) / 2), np.sqrt((root + r2 + s2) / 2)
    ch, sh, c, s = np.cosh(b * al), np.sinh(b * al), np.cos(b * be), np.sin(b * be)
    under = b / np.sqrt(1 - b2 * r2 * s2)
    if ends == "hinged":
        return float(s)
    if ends == "clamped-free":
        free = 2 + (b2 * (r2 - s2) ** 2 + 2) * ch * c
        return float(free - b * (r2 + s2) / np.sqrt(1 - b2 * r2 * s2) * sh * s)
    x, y = (r2, s2) if ends == "free" else (s2, r2)
    return float(2 - 2 * ch * c + under * (b2 * x * (r2 - s2) ** 2 + 3 * x - y) * sh * s)


@pytest.mark.parametrize("ends", ["hinged", "clamped-free", "free", "clamped"])
def test_frequencies_of_timoshenko_beams(ends: str) -> None:
    """Two members between four pairs of ends, with Cowper's κ = 10 (1 + ν)/(12 + 11 ν): every
    natural frequency is a root of the closed form, to 1e-9 of itself, and none of its first roots
    is missed."""
    nu, L, h = 0.3, 1.0, 0.08
    kappa = 10 * (1 + nu) / (12 + 11 * nu)
    section = {"shape": "rectangle", "width": h, "height": 0.02, "kappa": kappa}
    model = lines(
        "exact_beam",
        [(0, 0, 0), (0.37, 0, 0), (L, 0, 0)],
        chain(2),
        ["y", "rz"],
        section,
        {"E": E, "nu": nu, "rho": RHO},
    )
    held = {
        "hinged": {1: ["y"], 3: ["y"]},
        "clamped-free": {1: ["y", "rz"]},
        "free": {},
        "clamped": {1: ["y", "rz"], 3: ["y", "rz"]},
    }[ends]
    model["supports"] = [{"nodes": [n], "dofs": d} for n, d in held.items()]
    omega = 2 * np.pi * model_modes(build(model), 5).flexible().frequencies
    A, I = h * 0.02, 0.02 * h**3 / 12
    shear = E / (2 * (1 + nu))
    r2, s2 = I / (A * L**2), E * I / (kappa * shear * A * L**2)
    for w in omega:
        b2 = RHO * A * L**4 * w**2 / (E * I)
        around = [huang(ends, 1 + d, L, r2, s2, b2) for d in (-1e-9, 1e-9)]
        assert around[0] * around[1] < 0
    grid = np.linspace(0.02 * omega[0], 1.0001 * omega[-1], 4000)
    signs = [np.sign(huang(ends, 1.0, L, r2, s2, RHO * A * L**4 * w**2 / (E * I))) for w in grid]
    assert int(np.sum(np.diff(signs) != 0)) == 5


WORDS = (
    "E",
    "G",
    "rho",
    "A",
    "Iy",
    "Iz",
    "J",
    "width",
    "height",
    "kappa",
    "N",
    "stiffness",
    "mass",
)


@pytest.mark.parametrize("frequency", [*FREQUENCIES, CUT_OFF * 0.999, CUT_OFF * 1.001])
@pytest.mark.parametrize("N", [0.0, 3e4])
def test_derivatives_by_complex_step(frequency: float, N: float) -> None:
    """The closed forms of A.3, below and above the cut-off √(κGA/ρI)."""
    block = one(N=N)
    rows = np.zeros(1, dtype=np.int64)
    omega = 2 * np.pi * frequency
    for word in WORDS:
        scale = np.abs(block.properties[word]) + (word == "N") * 1e4
        mine = block.dynamic_change(omega, block.properties, rows, {word: scale})[0]
        stepped = {**block.properties, word: block.properties[word] + 1e-30j * scale}
        exact = block.dynamic_stiffness(omega, stepped)[0].imag / 1e-30
        size = np.abs(exact).max(axis=1, keepdims=True)
        assert np.all(np.abs(mine - exact) <= 1e-8 * np.maximum(size, 1e-9 * size.max())), word


def slope(function: Callable[[complex], np.ndarray]) -> np.ndarray:
    """The derivative at 0 of a holomorphic function by Cauchy's integral on a circle."""
    turn = np.exp(2j * np.pi * np.arange(12) / 12)
    return np.asarray(sum(function(0.004 * z) / z for z in turn) / (12 * 0.004))


@pytest.mark.parametrize("word", ["E", "rho", "eta", "alpha", "beta", "damping", "mass"])
def test_derivatives_with_damping(word: str) -> None:
    """Complex E (1 + iη) and Rayleigh's two, where no complex step can be taken."""
    block = one(eta=0.02)
    p = {**block.properties, "alpha": np.array([3.0]), "beta": np.array([2e-5])}
    rows = np.zeros(1, dtype=np.int64)
    scale = np.abs(p[word])
    for f in (37.0, 420.0):
        w = 2 * np.pi * f
        mine = block.dynamic_change(w, p, rows, {word: scale})[0]
        exact = slope(
            lambda d, w=w: block.dynamic_stiffness(w, {**p, word: p[word] + d * scale})[0]
        )
        rounding = 1e-13 * np.abs(block.dynamic_stiffness(w, p)).max()
        assert np.abs(mine - exact).max() < 1e-10 * np.abs(exact).max() + rounding


def test_loss_is_the_complex_modulus() -> None:
    """η on the element is E (1 + iη) and G (1 + iη) (8.18)."""
    lossy, plain = one(eta=0.02), one()
    p = {**plain.properties, "E": E * (1 + 0.02j), "G": G * (1 + 0.02j)}
    p = {k: np.asarray(v) * np.ones(1) for k, v in p.items()}
    Z = plain.dynamic_stiffness(2 * np.pi * 300, p)[0]
    assert np.abs(stiffness(lossy, 300.0) - Z).max() < 1e-13 * np.abs(Z).max()


def test_a_tie_rod_by_its_tension() -> None:
    """A hinged member under N: ω_n² = (EI k⁴ + N k²)/ρA, k = nπ/L, without rotary inertia."""
    L, N = 1.3, 4e3
    model = lines(
        "exact_beam",
        [(0, 0, 0), (L, 0, 0)],
        [(1, 2)],
        ["z", "ry"],
        {"shape": "circle", "diameter": 0.012},
        STEEL,
        rotary_inertia=False,
    )
    model["elements"][0]["rows"][0]["N"] = N
    model["supports"] = [{"nodes": [1, 2], "dofs": ["z"]}]
    found = 2 * np.pi * model_modes(build(model), 4).frequencies
    A, I = np.pi * 0.012**2 / 4, np.pi * 0.012**4 / 64
    k = np.arange(1, 5) * np.pi / L
    assert np.allclose(
        found, np.sqrt((STEEL["E"] * I * k**4 + N * k**2) / (STEEL["rho"] * A)), rtol=1e-9
    )
