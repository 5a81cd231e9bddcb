"""The 'real' structure behind a generated problem: matrices and recordings that share no code with
the package.

Chains are added spring by spring; bars and plane frames are textbook beam matrices (Przemieniecki
1968, 5.6 and 11.4; with shear 5.119) on a mesh three to ten times as fine as the analyst's; plates
are the conforming sixteen-DOF rectangle of Bogner, Fox and Schmit (1965), a tensor product of cubic
Hermite functions, on a mesh twice as fine, where the analyst's element is the non-conforming one of
Adini, Clough and Melosh. Runs are integrated exactly in complex modes. SI units.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import scipy.linalg as sl
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.typing import NDArray
from scipy.signal import lfilter

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]
Effect = Mapping[str, Any]

FINE = 3  # parts of an element of a bar in bending
SUBROD = 6  # of a rod, whose linear elements converge slower
STOCKY = 10  # of a bar with shear
REACH = 6.0  # modes up to this many times the band are dynamic, the rest a static residual
KAPPA = 5.0 / 6.0
OVERSAMPLED = 16  # inner steps of a sample


@dataclass(frozen=True)
class Element:
    """An element of the analyst's model: ``kind`` spring (``value`` k along ``dof``), mass
    (``value`` m, ``inertia`` about x, y, z), bar, shaft, rod or plate."""

    id: int
    kind: str
    nodes: tuple[int, ...]
    group: str
    value: float = 0.0
    dof: str = "x"
    inertia: tuple[float, float, float] | None = None


@dataclass(frozen=True)
class Design:
    """The drawing: what the problem file says. ``section`` is (width, height) of a bar, (diameter,)
    of a shaft, (thickness,) of a plate; ``held`` the (node, dof) of supports."""

    family: str
    dofs: tuple[str, ...]
    nodes: Mapping[int, tuple[float, float, float]]
    elements: tuple[Element, ...]
    held: tuple[tuple[int, str], ...]
    E: float
    nu: float
    rho: float
    section: tuple[float, ...]
    eta: float

    @property
    def grounded(self) -> bool:
        """Whether it stands on something; what does not hangs on soft cords."""
        return bool(self.held) or any(e.kind == "spring" for e in self.elements)


@dataclass(frozen=True)
class Structure:
    """Matrices over the free DOFs; ``place`` finds the row of a labelled (node, dof)."""

    K: Real
    M: Real
    C: Real
    D: Real
    place: Mapping[tuple[int, str], int]


@dataclass
class _Bench:
    """Matrices under construction."""

    place: dict[tuple[Any, str], int] = field(default_factory=dict)
    parts: dict[str, list[tuple[list[int], Real]]] = field(
        default_factory=lambda: {"K": [], "M": [], "C": [], "D": []}
    )

    def row(self, node: Any, dof: str) -> int:
        """The row of a DOF, made when first asked for."""
        return self.place.setdefault((node, dof), len(self.place))

    def add(self, matrix: str, rows: list[int], values: Any) -> None:
        """Add a small matrix."""
        self.parts[matrix].append((rows, np.atleast_2d(np.asarray(values, dtype=float))))

    def spring(self, matrix: str, rows: list[int], value: float) -> None:
        """A spring (dashpot) to ground, or between two DOFs."""
        self.add(
            matrix, rows, value if len(rows) == 1 else value * np.array([[1.0, -1.0], [-1.0, 1.0]])
        )

    def total(self, name: str) -> Real:
        """The assembled matrix."""
        out = np.zeros((len(self.place),) * 2)
        for rows, values in self.parts[name]:
            out[np.ix_(rows, rows)] += values
        return out


def build(
    design: Design,
    scatter: Mapping[int, tuple[float, float]],
    effects: Sequence[Effect],
    coarse: bool = False,
) -> Structure:
    """The structure on the bench: ``scatter`` gives factors (stiffness, mass) of each element,
    ``effects`` what else is real about it; ``coarse``: bars on the drawing's own mesh."""
    bench, held = _Bench(), set(design.held)
    for node in design.nodes:
        for dof in design.dofs:
            bench.row(node, dof)
    for element in design.elements:
        _element(bench, design, element, scatter.get(element.id, (1.0, 1.0)), effects, coarse)
    for e in effects:
        kind = e["physics"]
        if kind == "added_mass":
            for dof in e["dofs"]:
                row = bench.row(e["node"], dof)
                bench.add("M", [row], e["m"])
        elif kind == "grounding_spring":
            for node in e["nodes"] if "nodes" in e else (e["node"],):
                held.discard((node, e["dof"]))
                bench.spring("K", [bench.row(node, e["dof"])], e["k"])
        elif kind == "attached_resonator":
            rows = [bench.row(e["node"], e["dof"]), bench.row("hidden", e["dof"])]
            bench.add("M", [rows[1]], e["m"])
            bench.spring("K", rows, e["k"])
            bench.spring("C", rows, e["c"])
        elif kind == "viscous_damper":
            bench.spring("C", [bench.row(n, e["dof"]) for n in e["nodes"]], e["c"])
    K, M, C, D = (bench.total(name) for name in "KMCD")
    for e in effects:
        if e["physics"] == "mass_proportional_damping":
            C = C + e["alpha"] * M
    held |= _edges(design, held, bench.place)
    keep = np.array([i for key, i in bench.place.items() if key not in held])
    number = {int(old): new for new, old in enumerate(keep)}
    place = {key: number[i] for key, i in bench.place.items() if i in number}
    cut = np.ix_(keep, keep)
    return Structure(K[cut], M[cut], C[cut], D[cut], place)


def _edges(
    design: Design, held: set[tuple[int, str]], place: Mapping[tuple[Any, str], int]
) -> set[tuple[Any, str]]:
    """Where a plate's edge is clamped, also what lies between its nodes: slope, twist, and the
    finer nodes on it."""
    if design.family != "plate":
        return set()
    # clamped edges run along y; one that may turn keeps its slope across and its twist
    fixed, carried = ({design.nodes[n][0] for n, dof in held if dof == d} for d in ("ry", "z"))
    xs = {n: x[0] for n, x in design.nodes.items()}
    out = set()
    for key in place:
        x = xs[key[0]] if isinstance(key[0], int) else key[0][0]
        if x in fixed or (x in carried and key[1] in ("z", "rx")):
            out.add(key)
    return out


def _element(
    bench: _Bench,
    design: Design,
    element: Element,
    scatter: tuple[float, float],
    effects: Sequence[Effect],
    coarse: bool,
) -> None:
    fk, fm = scatter
    thick, N, shear, eta, spin, rigidity = 1.0, 0.0, False, 0.0, 0.0, (1.0, 1.0, 1.0, 1.0)
    joints: dict[int, float] = {}
    for e in effects:
        if element.id not in e.get("elements", ()):
            continue
        kind = e["physics"]
        fk *= e["factor"] if kind == "stiffness_change" else 1.0
        fm *= e["factor"] if kind == "mass_change" else 1.0
        thick *= e["factor"] if kind == "thickness_change" else 1.0
        N += e["N"] if kind == "axial_preload" else 0.0
        eta += e["eta"] if kind == "structural_damping" else 0.0
        spin += e["omega"] if kind == "gyroscopic" else 0.0
        shear = shear or kind == "shear_deformation"
        if kind == "orthotropy":
            rigidity = tuple(e[n] for n in ("Dx", "Dy", "D1", "Dxy"))
        if kind == "joint_flexibility":
            joints[e["node"]] = e["k"]
    if element.kind == "spring":
        rows = [bench.row(n, element.dof) for n in element.nodes]
        bench.spring("K", rows, fk * element.value)
        bench.spring("D", rows, eta * fk * element.value)
    elif element.kind == "mass":
        turning = dict(zip(("rx", "ry", "rz"), element.inertia or (0.0, 0.0, 0.0), strict=True))
        for dof in design.dofs:
            bench.add("M", [bench.row(element.nodes[0], dof)], fm * turning.get(dof, element.value))
        if (
            spin and element.inertia
        ):  # about y: I_p Ω times the rate about z, and the reverse with the other sign
            rows = [bench.row(element.nodes[0], d) for d in ("ry", "rz")]
            bench.add(
                "C", rows, fm * spin * element.inertia[0] * np.array([[0.0, 1.0], [-1.0, 0.0]])
            )
    elif element.kind == "shaft":
        _shaft(bench, design, element, fk, fm, spin)
    elif element.kind == "plate":
        _plate(bench, design, element, fk, fm, thick, eta, rigidity)
    else:
        _bar(bench, design, element, fk, fm, thick, N, shear, eta, joints, coarse)


def beam_matrices(
    EA: float, EI: float, mass: float, spin: float, L: float, N: float, phi: float
) -> tuple[Real, Real]:
    """(K, M) of a plane beam, DOFs (u₁, w₁, θ₁, u₂, w₂, θ₂) with θ = dw/dx: mass per length, rotary
    inertia per length ``spin``, tension N, shear Φ."""
    a = EI / (L**3 * (1.0 + phi))
    bend = a * np.array(
        [
            [12, 6 * L, -12, 6 * L],
            [6 * L, (4 + phi) * L**2, -6 * L, (2 - phi) * L**2],
            [-12, -6 * L, 12, -6 * L],
            [6 * L, (2 - phi) * L**2, -6 * L, (4 + phi) * L**2],
        ]
    )
    slope = np.array(
        [
            [36, 3 * L, -36, 3 * L],
            [3 * L, 4 * L**2, -3 * L, -(L**2)],
            [-36, -3 * L, 36, -3 * L],
            [3 * L, -(L**2), -3 * L, 4 * L**2],
        ]
    ) / (30.0 * L)
    if (
        phi > 0.0
        # shear: rotations are not slopes, so lumps are at the nodes: fourth order beside a
        # stiffness that is exact at rest
    ):
        lateral = np.diag([mass, spin, mass, spin]) * L / 2.0
    else:
        lateral = (
            mass
            * L
            / 420.0
            * np.array(
                [
                    [156, 22 * L, 54, -13 * L],
                    [22 * L, 4 * L**2, 13 * L, -3 * L**2],
                    [54, 13 * L, 156, -22 * L],
                    [-13 * L, -3 * L**2, -22 * L, 4 * L**2],
                ]
            )
            + spin * slope
        )
    K, M = np.zeros((6, 6)), np.zeros((6, 6))
    places = [1, 2, 4, 5]
    K[np.ix_(places, places)] = bend + N * slope
    M[np.ix_(places, places)] = lateral
    K[np.ix_([0, 3], [0, 3])] = EA / L * np.array([[1.0, -1.0], [-1.0, 1.0]])
    M[np.ix_([0, 3], [0, 3])] = mass * L / 12.0 * np.array([[5.0, 1.0], [1.0, 5.0]])
    return K, M


def _bar(
    bench: _Bench,
    design: Design,
    element: Element,
    fk: float,
    fm: float,
    thick: float,
    N: float,
    shear: bool,
    eta: float,
    joints: Mapping[int, float],
    coarse: bool,
) -> None:
    a, b = (np.array(design.nodes[n]) for n in element.nodes)
    width, height = design.section[0], design.section[1] * thick
    area, inertia = width * height, width * height**3 / 12.0
    parts = 1 if coarse else STOCKY if shear else SUBROD if element.kind == "rod" else FINE
    L = float(np.linalg.norm(b - a)) / parts
    c, s = (b - a)[0] / (L * parts), (b - a)[2] / (L * parts)
    G = design.E / (2.0 * (1.0 + design.nu))
    phi = 12.0 * design.E * inertia / (KAPPA * G * area * L**2) if shear else 0.0
    K, M = beam_matrices(
        fk * design.E * area,
        fk * design.E * inertia,
        fm * design.rho * area,
        fm * design.rho * inertia,
        L,
        0.0,
        phi,
    )
    K = K + N * (beam_matrices(0.0, 0.0, 0.0, 0.0, L, 1.0, phi)[0] if N else 0.0)
    turn = np.zeros((6, 6))  # local (u, w, θ) from global (x, z, ry): ry = −θ
    for k in (0, 3):
        turn[k : k + 3, k : k + 3] = [[c, s, 0], [-s, c, 0], [0, 0, -1]]
    K, M = turn.T @ K @ turn, turn.T @ M @ turn
    keep = [i for i in range(6) if ("x", "z", "ry")[i % 3] in design.dofs]
    dofs = [("x", "z", "ry")[i % 3] for i in keep]
    chain = [
        element.nodes[0],
        *((element.id, "part", k) for k in range(1, parts)),
        element.nodes[1],
    ]
    for k in range(parts):
        rows = [bench.row(chain[k + i // 3], d) for i, d in zip(keep, dofs, strict=True)]
        for end, node in ((0, chain[k]), (1, chain[k + 1])):
            if node in joints and "ry" in dofs:
                own = bench.row((element.id, "joint", node), "ry")
                rows[keep.index(2 + 3 * end)] = own
                bench.spring("K", [bench.row(node, "ry"), own], joints[node])
        cut = np.ix_(keep, keep)
        bench.add("K", rows, K[cut])
        bench.add("M", rows, M[cut])
        if eta:
            bench.add("D", rows, eta * K[cut])


def _shaft(
    bench: _Bench, design: Design, element: Element, fk: float, fm: float, spin: float
) -> None:
    """A round shaft along x in both planes; what spins turns with ``spin`` rad/s about +x
    (Friswell, Penny, Garvey and Lees 2010, 5.4)."""
    x = [design.nodes[n][0] for n in element.nodes]
    L = (x[1] - x[0]) / FINE
    area, inertia = np.pi * design.section[0] ** 2 / 4.0, np.pi * design.section[0] ** 4 / 64.0
    K, M = beam_matrices(
        0.0, fk * design.E * inertia, fm * design.rho * area, fm * design.rho * inertia, L, 0.0, 0.0
    )
    turning = beam_matrices(0.0, 0.0, 0.0, 1.0, L, 0.0, 0.0)[1]  # ∫ w'w'
    keep = np.ix_([1, 2, 4, 5], [1, 2, 4, 5])
    K, M, turning = K[keep], M[keep], 2.0 * fm * design.rho * inertia * spin * turning[keep]
    sign = np.array(
        [1.0, -1.0, 1.0, -1.0]
    )  # in the x–z plane ry = −dw/dx, in the x–y plane rz = +dv/dx
    chain = [element.nodes[0], *((element.id, "part", k) for k in range(1, FINE)), element.nodes[1]]
    for k in range(FINE):
        flat = [bench.row(chain[k + i], d) for i in (0, 1) for d in ("y", "rz")]
        upright = [bench.row(chain[k + i], d) for i in (0, 1) for d in ("z", "ry")]
        for rows, s in ((flat, np.ones(4)), (upright, sign)):
            bench.add("K", rows, s[:, None] * K * s)
            bench.add("M", rows, s[:, None] * M * s)
        if spin:
            cross = np.zeros((8, 8))
            cross[4:, :4] = -sign[:, None] * turning
            cross[:4, 4:] = turning * sign
            bench.add("C", flat + upright, cross)


_HERMITE = (
    np.array([1.0, 0, -3, 2]),
    np.array([0, 1.0, -2, 1]),
    np.array([0, 0, 3.0, -2]),
    np.array([0, 0, -1.0, 1]),
)


def _integrals(L: float) -> list[list[Real]]:
    """∫₀ᴸ Hᵢ⁽ᵖ⁾ Hⱼ⁽ᵍ⁾ dx of the four cubic Hermite functions (w, w' at both ends), for derivatives
    p, q up to 2, by Gauss's rule."""
    x, weight = np.polynomial.legendre.leggauss(5)
    x, weight = (x + 1.0) / 2.0, weight / 2.0
    values = []
    for order in range(3):
        rows = []
        for i, h in enumerate(_HERMITE):
            q = np.polynomial.polynomial.polyval(
                x, np.polynomial.polynomial.polyder(h, order) if order else h
            )
            rows.append(q * (L if i % 2 else 1.0) / L**order)
        values.append(np.array(rows))
    return [[L * (values[p] * weight) @ values[q].T for q in range(3)] for p in range(3)]


def _plate(
    bench: _Bench,
    design: Design,
    element: Element,
    fk: float,
    fm: float,
    thick: float,
    eta: float,
    rigidity: Sequence[float],
) -> None:
    corners = np.array([design.nodes[n] for n in element.nodes])
    a, b = (
        float(np.ptp(corners[:, 0])) / 2.0,
        float(np.ptp(corners[:, 1])) / 2.0,
    )  # four elements for each of the analyst's
    h = design.section[0] * thick
    D = fk * design.E * h**3 / (12.0 * (1.0 - design.nu**2))
    Dx, Dy, D1, Dxy = (
        f * D * g
        for f, g in zip(rigidity, (1.0, 1.0, design.nu, (1.0 - design.nu) / 2.0), strict=True)
    )
    X, Y = _integrals(a), _integrals(b)
    K = (
        Dx * np.kron(X[2][2], Y[0][0])
        + Dy * np.kron(X[0][0], Y[2][2])
        + D1 * (np.kron(X[2][0], Y[0][2]) + np.kron(X[0][2], Y[2][0]))
        + 4.0 * Dxy * np.kron(X[1][1], Y[1][1])
    )
    M = fm * design.rho * h * np.kron(X[0][0], Y[0][0])
    order = [
        (i, j) for i in range(4) for j in range(4)
    ]  # Hermite functions along x, along y: (end, derivative) each
    sign = np.array([-1.0 if (i % 2, j % 2) == (1, 0) else 1.0 for i, j in order])  # ry = −∂w/∂x
    K, M = (sign[:, None] * A * sign for A in (K, M))
    named = {tuple(np.round(design.nodes[n][:2], 9)): n for n in element.nodes}
    for p in range(2):
        for q in range(2):
            rows = []
            for i, j in order:
                at = tuple(
                    np.round(
                        corners[:, :2].min(axis=0) + np.array([(p + i // 2) * a, (q + j // 2) * b]),
                        9,
                    )
                )
                rows.append(
                    bench.row(
                        named.get(at, at),
                        {(0, 0): "z", (0, 1): "rx", (1, 0): "ry", (1, 1): "twist"}[(i % 2, j % 2)],
                    )
                )
            bench.add("K", rows, K)
            bench.add("M", rows, M)
            if eta:
                bench.add("D", rows, eta * K)


@dataclass(frozen=True)
class Modal:
    """The structure in its modes up to `REACH` times the band: ``omega`` (m,), ``shapes`` (DOFs,
    m), ``zeta`` (m,), ``C`` and ``D`` (m, m) of the physics."""

    structure: Structure
    omega: Real
    shapes: Real
    zeta: Real
    C: Real
    D: Real

    def rows(self, places: Sequence[tuple[int, str]]) -> list[int]:
        """Rows of (node, dof)."""
        return [self.structure.place[p] for p in places]

    def residual(self, sensors: Sequence[int], drives: Sequence[int]) -> Real:
        """Flexibility of all other modes, (sensors, drives), as it is at a frequency σ in the band.

        σ lies midway between two natural frequencies, where (K − σ²M)⁻¹ is well conditioned: at
        rest a structure on soft cords is so compliant that nothing is left of the digits of the
        other modes.
        """
        below = (
            self.omega[self.omega < 0.7 * self.omega[-1] / REACH]
            if len(self.omega) > 1
            else self.omega[:0]
        )
        k = max(len(below), 1)
        square = (
            (0.25 * self.omega[0] ** 2)
            if len(self.omega) < 2
            else 0.5 * (self.omega[k - 1] ** 2 + self.omega[k] ** 2)
        )
        n = len(self.structure.K)
        load = np.zeros((n, len(drives)))
        load[list(drives), range(len(drives))] = 1.0
        whole = np.linalg.solve(self.structure.K - square * self.structure.M, load)
        mine = self.shapes @ (self.shapes[list(drives)].T / (self.omega**2 - square)[:, None])
        return np.asarray((whole - mine)[list(sensors)])

    def inverse(self, s: Complex) -> Complex:
        """Modal receptances Z⁻¹ at points ``s``, (points, m, m)."""
        index = np.arange(len(self.omega))
        d = s[:, None] ** 2 + 2.0 * self.zeta * self.omega * s[:, None] + self.omega**2
        if not (np.any(self.C) or np.any(self.D)):
            out = np.zeros((len(s), len(index), len(index)), dtype=complex)
            out[:, index, index] = 1.0 / d
            return out
        Z = s[:, None, None] * self.C + 1j * self.D
        Z[:, index, index] += d
        return np.asarray(np.linalg.inv(Z))

    def accelerance(self, s: Complex, sensors: Sequence[int], drives: Sequence[int]) -> Complex:
        """(m/s²)/N at points ``s`` (2πi f for an FRF), (points, sensors, drives)."""
        force, read, still = (
            self.shapes[list(drives)].T,
            self.shapes[list(sensors)],
            self.residual(sensors, drives),
        )
        out = np.empty((len(s), len(sensors), len(drives)), dtype=complex)
        for start in range(0, len(s), 500):  # a few hundred at a time keep the inverses in memory
            part = slice(start, start + 500)
            out[part] = s[part, None, None] ** 2 * (read @ (self.inverse(s[part]) @ force) + still)
        return out

    def run(self, force: Real, rate: float, sensors: Sequence[int], drive: int) -> Real:
        """Accelerations (samples, sensors) from rest under a band-limited ``force`` (samples,),
        which is zero at both ends.

        The force between inner steps is a straight line, whose spectrum sinc² is undone beforehand;
        what goes through without delay takes the force itself, because the kinks of the straight
        lines would fold back into the band. Hysteretic losses are not causal and not allowed.
        """
        n, m = len(force), len(self.omega)
        fine, dt = n * OVERSAMPLED, 1.0 / (rate * OVERSAMPLED)
        spectrum = np.zeros(fine // 2 + 1, dtype=complex)
        spectrum[: n // 2 + 1] = np.fft.rfft(force) * OVERSAMPLED
        f = np.fft.rfftfreq(fine, dt)
        u = np.fft.irfft(spectrum / np.sinc(f * dt) ** 2, fine)
        A = np.block(
            [
                [np.zeros((m, m)), np.eye(m)],
                [-np.diag(self.omega**2), -np.diag(2.0 * self.zeta * self.omega) - self.C],
            ]
        )
        values, vectors = np.linalg.eig(A)
        B = np.linalg.solve(vectors, np.concatenate([np.zeros(m), self.shapes[drive]]))
        out = np.zeros((fine, len(sensors)))
        phi = self.shapes[list(sensors)]
        rate_of = phi @ vectors[m:]  # velocities
        for k, value in enumerate(values):
            if value.imag < 0.0:
                continue
            twice = 2.0 if value.imag > 0.0 else 1.0
            z = value * dt
            a = np.exp(z)
            late, early = (
                (a - 1.0 - z) / (z**2) * dt,
                (a * (z - 1.0) + 1.0) / (z**2) * dt,
            )  # weights of u at the end and the beginning of a step
            x = lfilter([late, early], [1.0, -a], u.astype(complex)) * B[k]
            out += twice * np.real(np.outer(value * x, rate_of[:, k]))
        out += np.fft.irfft(spectrum, fine)[:, None] * (phi @ self.shapes[drive])
        bend = np.fft.irfft(-((2.0 * np.pi * f) ** 2) * spectrum, fine)
        return np.asarray(
            (out + bend[:, None] * self.residual(sensors, [drive])[:, 0])[::OVERSAMPLED]
        )

    def damped(self) -> tuple[Real, Real]:
        """(frequency in Hz, damping ratio) of every mode, losses taken one mode at a time."""
        zeta = (
            self.zeta
            + np.diag(self.C) / (2.0 * self.omega)
            + np.diag(self.D) / (2.0 * self.omega**2)
        )
        return self.omega / (2.0 * np.pi), zeta


def natural(structure: Structure, top: float, count: int | None = None) -> tuple[Real, Real]:
    """(ω in rad/s, mass-normalised shapes) of the modes up to ``top`` Hz, at least one; only the
    lowest ``count`` where that is given."""
    n = len(structure.K)
    if n <= 240:
        values, vectors = sl.eigh(structure.K, structure.M)
    else:
        k, K, M = count or 40, sp.csc_array(structure.K), sp.csc_array(structure.M)
        while True:
            values, vectors = spl.eigsh(K, k, M, sigma=-1.0, v0=np.ones(n))
            if count or values.max() > (2.0 * np.pi * top) ** 2 or k >= n // 2:
                break
            k = min(2 * k, n // 2)
        order = np.argsort(values)
        values, vectors = values[order], vectors[:, order]
    omega = np.sqrt(np.maximum(values, 1e-12))
    keep = (
        max(1, int(np.sum(omega <= 2.0 * np.pi * top))) if count is None else min(count, len(omega))
    )
    return omega[:keep], vectors[:, :keep]


def modal(structure: Structure, top: float, zeta: Real) -> Modal:
    """The structure in its modes, ``zeta`` from the lowest on (the last counts for the rest)."""
    omega, shapes = natural(structure, REACH * top)
    ratios = np.append(zeta, np.full(max(0, len(omega) - len(zeta)), zeta[-1]))[: len(omega)]
    return Modal(
        structure,
        omega,
        shapes,
        ratios,
        shapes.T @ structure.C @ shapes,
        shapes.T @ structure.D @ shapes,
    )
