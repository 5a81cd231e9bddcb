"""Natural frequencies against closed forms, at the rate the theory promises."""

from collections.abc import Callable

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from tests.cases.elements import ALLOY, SPACE, STEEL, build, chain, grid, held, lines, with_values

E, NU, RHO = STEEL["E"], STEEL["nu"], STEEL["rho"]
G = E / 2 / (1 + NU)
L = 0.8
W, H = 0.03, 0.02
BAR = {"shape": "rectangle", "width": W, "height": H}
A, IZ = W * H, H * W**3 / 12
KAPPA = 5.0 / 6.0


def omega2(model: Model, count: int) -> np.ndarray:
    return model_modes(model, count).flexible().eigenvalues


def uneven(n: int) -> np.ndarray:
    """n elements whose lengths vary by a factor of three, smoothly, so that refinement keeps the
    pattern."""
    s = np.linspace(0.0, 1.0, n + 1)
    return L * (s + 0.08 * np.sin(2 * np.pi * s))


def rate(error: Callable[[int], np.ndarray], n: int) -> np.ndarray:
    """Observed order of convergence between n and 2 n elements."""
    return np.log2(np.abs(error(n)) / np.abs(error(2 * n)))


def axis(n: int) -> np.ndarray:
    return uneven(n)[:, None] * np.array([[1.0, 0.0, 0.0]])


def beam(n: int, **block: object) -> dict[str, object]:
    text = lines("beam2d", axis(n), chain(n), ["x", "y", "rz"], BAR, **block)
    return held(text, ([1], ["x", "y"]), ([n + 1], ["y"]))


def bending(model: Model, count: int) -> np.ndarray:
    """Eigenvalues of the modes that move in y."""
    modes = model_modes(model, 2 * count + 2).flexible()
    y = np.abs(modes.shapes[model.dof_kind == 1]).max(axis=0)
    x = np.abs(modes.shapes[model.dof_kind == 0]).max(axis=0)
    return modes.eigenvalues[y > x][:count]


K123 = np.array([1, 2, 3]) * np.pi / L


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_rod(mass: str) -> None:
    """Fixed and free: ω = (2 i − 1) π c / 2 L; O(h²), from above with consistent mass, from below
    with lumped."""
    exact = ((2 * np.array([1, 2, 3]) - 1) * np.pi / 2 / L) ** 2 * E / RHO

    def error(n: int) -> np.ndarray:
        text = held(lines("rod", axis(n), chain(n), ["x"], BAR, mass=mass), ([1], ["x"]))
        return omega2(build(text), 3) / exact - 1

    assert np.allclose(rate(error, 24), 2.0, atol=0.1)
    assert np.all(error(24) > 0) if mass == "consistent" else np.all(error(24) < 0)


@pytest.mark.parametrize("mass", ["consistent", "lumped"])
def test_torsion_of_a_shaft(mass: str) -> None:
    """Free and free: ω = i π √(G J / ρ Ip) / L, of a rectangle, so J is not Ip."""
    J = W * H**3 * (1 / 3 - 0.21 * H / W * (1 - (H / W) ** 4 / 12))
    exact = K123**2 * G * J / RHO / (W * H**3 / 12 + IZ)

    def error(n: int) -> np.ndarray:
        return (
            omega2(build(lines("beam3d", axis(n), chain(n), ["rx"], BAR, mass=mass)), 3) / exact - 1
        )

    assert np.allclose(rate(error, 24), 2.0, atol=0.1)
    assert np.abs(error(48)).max() < 0.01


def test_euler_bernoulli_beam() -> None:
    exact = E * IZ * K123**4 / RHO / A
    rates = rate(lambda n: bending(build(beam(n, rotary_inertia=False)), 3) / exact - 1, 12)
    assert np.allclose(rates, 4.0, atol=0.2)
    assert np.all(bending(build(beam(12, rotary_inertia=False)), 3) > exact)


def test_free_euler_bernoulli_beam_is_as_unequal_in_both_planes() -> None:
    """Free and free in space: β L = 4.7300, 7.8532 about both axes."""
    beta = np.array([4.730040744862704, 7.853204624095838]) / L
    model = build(lines("beam3d", axis(60), chain(60), SPACE, BAR, rotary_inertia=False))
    modes = model_modes(model, 4)
    assert (
        modes.rigid == 5
    )  # without polar inertia the spin about its own axis carries no mass: no mode
    exact = np.sort(
        np.concatenate([np.sqrt(E * I / RHO / A) * beta**2 for I in (IZ, W * H**3 / 12)])
    )
    assert np.allclose(2 * np.pi * modes.flexible().frequencies, exact, rtol=1e-6)


def test_rayleigh_beam() -> None:
    """With rotary inertia: ω² = E I k⁴ / (ρ A + ρ I k²)."""
    exact = E * IZ * K123**4 / (RHO * A + RHO * IZ * K123**2)
    rates = rate(lambda n: bending(build(beam(n)), 3) / exact - 1, 12)
    assert np.allclose(rates, 4.0, atol=0.2)


def test_lumped_beam() -> None:
    """Half of each element's mass at its ends: O(h²)."""
    exact = E * IZ * K123**4 / RHO / A
    rates = rate(lambda n: bending(build(beam(n, mass="lumped")), 3) / exact - 1, 24)
    assert np.allclose(rates, 2.0, atol=0.1)


def timoshenko(k: np.ndarray) -> np.ndarray:
    """The lower root of ρ² I ω⁴ / κ G − (ρ A + ρ I k² (1 + E / κ G)) ω² + E I k⁴ = 0 (Timoshenko
    1921)."""
    a, b, c = (
        RHO**2 * IZ / KAPPA / G,
        -(RHO * A + RHO * IZ * k**2 * (1 + E / KAPPA / G)),
        E * IZ * k**4,
    )
    return 2 * c / (-b + np.sqrt(b**2 - 4 * a * c))


def test_timoshenko_beam() -> None:
    exact = timoshenko(K123)
    coarse, fine = (bending(with_values(build(beam(n)), shear=1.0), 3) for n in (48, 96))
    assert np.allclose(
        np.log2((coarse - exact) / (fine - exact)), 2.0, atol=0.1
    )  # elements shorter than deep: O(h²)
    assert np.allclose((4 * fine - coarse) / 3, exact, rtol=3e-6)
    assert np.all(
        exact[2] < 0.98 * E * IZ * K123[2] ** 4 / (RHO * A + RHO * IZ * K123[2] ** 2)
    )  # shear matters here


def test_timoshenko_beam_misses_only_what_bends_between_nodes() -> None:
    """Why O(h²), with a mass that is consistent: shape functions that solve the static equations
    leave out what the inertia forces q = ω² ρ A w and m = ω² ρ I ψ do inside an element, and where
    it is shorter than deep that is the energy of two rods, q² h³ / 12 κ G A + m² h³ / 12 E I
    (Rayleigh's quotient: λ errs by twice the energy). The error must approach just that, on uneven
    meshes too; with the mass of Euler and Bernoulli it approaches a constant."""
    exact = timoshenko(K123)
    ratio = (
        K123 - RHO * exact / KAPPA / G / K123
    )  # of the amplitudes of ψ = B cos k x and w = sin k x
    modal = (RHO * A + RHO * IZ * ratio**2) * L / 2

    def share(n: int) -> np.ndarray:
        """Error over its leading term."""
        x = uneven(n)
        h = np.diff(x)
        sine = np.diff(
            x[:, None] / 2 - np.sin(2 * K123 * x[:, None]) / 4 / K123, axis=0
        )  # ∫ sin² k x over each element
        bubbles = (
            h[:, None] ** 2
            / 12
            * (
                (RHO * A) ** 2 / KAPPA / G / A * sine
                + (RHO * IZ * ratio) ** 2 / E / IZ * (h[:, None] - sine)
            )
        )
        return np.asarray(
            (bending(with_values(build(beam(n)), shear=1.0), 3) / exact - 1)
            / (exact * bubbles.sum(axis=0) / modal)
        )

    coarse, fine = share(48), share(96)
    assert np.all(np.abs(fine - 1) < 0.02)
    assert np.allclose(np.log2((coarse - 1) / (fine - 1)), 2.0, atol=0.2)


def test_timoshenko_beam_of_long_elements() -> None:
    """Elements some thirty times longer than deep: what they miss is bending, O(h⁴)."""
    bar = {"shape": "rectangle", "width": 0.002, "height": H}
    area, inertia = 0.002 * H, H * 0.002**3 / 12
    a, b, c = (
        RHO**2 * inertia / KAPPA / G,
        -(RHO * area + RHO * inertia * K123**2 * (1 + E / KAPPA / G)),
        E * inertia * K123**4,
    )
    exact = 2 * c / (-b + np.sqrt(b**2 - 4 * a * c))

    def error(n: int) -> np.ndarray:
        text = held(
            lines("beam2d", axis(n), chain(n), ["x", "y", "rz"], bar),
            ([1], ["x", "y"]),
            ([n + 1], ["y"]),
        )
        return bending(with_values(build(text), shear=1.0), 3) / exact - 1

    assert np.allclose(rate(error, 12), 4.0, atol=0.2)


def test_preload() -> None:
    """ω = ω₀ √(1 + N / N_cr i²), N_cr = E I π² / L²."""
    critical = E * IZ * np.pi**2 / L**2
    for ratio in (-0.9, 0.7, 20.0):
        exact = E * IZ * K123**4 / RHO / A * (1 + ratio * critical / (E * IZ * K123**2))
        coarse, fine = (
            bending(with_values(build(beam(n, rotary_inertia=False)), N=ratio * critical), 3)
            for n in (12, 24)
        )
        assert np.allclose(np.log2((coarse - exact) / (fine - exact)), 4.0, atol=0.25)
        assert np.allclose((16 * fine - coarse) / 15, exact, rtol=1e-5)


def test_buckling() -> None:
    """ω² falls linearly to zero at Euler's load, and past it the model is refused by name."""
    critical = E * IZ * np.pi**2 / L**2
    model = build(beam(24, rotary_inertia=False))
    loads = np.array([0.9, 0.99, 0.999]) * critical
    squares = [bending(with_values(model, N=-n), 1)[0] for n in loads]
    slope, rest = np.polyfit(loads, squares, 1)
    assert -rest / slope == pytest.approx(critical, rel=1e-6)
    with pytest.raises(ModelError, match=r"negative stiffness.*n\d+\.\w+ most"):
        model_modes(with_values(model, N=-1.01 * critical), 3)


A_SIDE, B_SIDE, T = 0.7, 0.5, 0.004


def plate(
    n: int, section: dict[str, object], material: dict[str, float] = STEEL
) -> dict[str, object]:
    """Simply supported all round: the edge keeps its place and does not turn along itself."""
    s = np.linspace(0.0, 1.0, n + 1)
    uneven_ = s + 0.05 * np.sin(2 * np.pi * s)
    text = grid(A_SIDE * uneven_, B_SIDE * uneven_, section, material)
    ids = np.arange(1, (n + 1) ** 2 + 1).reshape(n + 1, n + 1)
    bottom_top, left_right = (
        np.concatenate([ids[0], ids[-1]]),
        np.concatenate([ids[:, 0], ids[:, -1]]),
    )
    return held(
        text,
        (np.union1d(bottom_top, left_right), ["z"]),
        (bottom_top, ["ry"]),
        (left_right, ["rx"]),
    )


FACTORS = {"isotropic": (1.0, 1.0, 1.0, 1.0), "orthotropic": (1.5, 0.8, 0.6, 1.2)}


@pytest.mark.parametrize("kind", FACTORS)
def test_simply_supported_plate(kind: str) -> None:
    """ρ h ω² = Dx kx⁴ + 2 (D1 + 2 Dxy) kx² ky² + Dy ky⁴ (Timoshenko and Woinowsky-Krieger); O(h²),
    from below."""
    fx, fy, f1, fxy = FACTORS[kind]
    nu = ALLOY["nu"]
    D = ALLOY["E"] * T**3 / 12 / (1 - nu**2)
    kx, ky = np.meshgrid(np.arange(1, 5) * np.pi / A_SIDE, np.arange(1, 5) * np.pi / B_SIDE)
    bilinear = f1 * nu + 2 * fxy * (1 - nu) / 2
    exact = np.sort(
        (D * (fx * kx**4 + 2 * bilinear * kx**2 * ky**2 + fy * ky**4) / ALLOY["rho"] / T).ravel()
    )[:4]
    section = {"shape": "plate", "thickness": T, "Dx": fx, "Dy": fy, "D1": f1, "Dxy": fxy}

    def error(n: int) -> np.ndarray:
        return omega2(build(plate(n, section, ALLOY)), 4) / exact - 1

    assert np.allclose(rate(error, 10), 2.0, atol=0.25)
    assert np.abs(error(20)).max() < 0.02
    assert np.all(error(20) < 0)


def test_oscillator_chain() -> None:
    """n equal masses on n + 1 equal springs: ω = 2 √(k/m) sin(i π / 2 (n + 1))."""
    n, k, m = 9, 4.2e5, 6.5
    text = {
        "dofs": ["x"],
        "nodes": [{"id": i, "x": float(i)} for i in range(n + 2)],
        "elements": [
            {
                "type": "spring",
                "dof": "x",
                "rows": [{"id": i + 1, "nodes": [i, i + 1], "k": k} for i in range(n + 1)],
            },
            {
                "type": "mass",
                "rows": [{"id": 100 + i, "nodes": [i], "m": m} for i in range(1, n + 1)],
            },
        ],
        "supports": [{"nodes": [0, n + 1], "dofs": ["x"]}],
    }
    exact = 2 * np.sqrt(k / m) * np.sin(np.arange(1, n + 1) * np.pi / 2 / (n + 1)) / 2 / np.pi
    modes = model_modes(build(text), 50)
    assert np.allclose(modes.frequencies, exact, rtol=1e-12)


@pytest.mark.parametrize(
    ("nx", "ny", "expected"),
    [
        (7, 5, [27.4, 29.9, 63.4, 66.3, 79.7, 90.9, 118.0, 132.4, 168.7, 181.6]),
        (28, 20, [27.3, 29.8, 63.3, 66.1, 79.3, 91.0, 118.1, 133.6, 167.3, 180.1]),
    ],
)
def test_structure_a(nx: int, ny: int, expected: list[float]) -> None:
    """The free plate of chapter 9 against an independent calculation of the twelve-DOF element (Hz,
    to one decimal)."""
    steel = {"E": 206e9, "nu": 0.3, "rho": 7860.0}
    model = build(
        grid(
            np.linspace(0, 0.665, nx + 1),
            np.linspace(0, 0.455, ny + 1),
            {"shape": "plate", "thickness": 0.0025},
            steel,
        )
    )
    modes = model_modes(model, 10)
    assert modes.rigid == 3
    assert np.allclose(modes.flexible().frequencies, expected, atol=0.0501)
