"""The exact beam in space: sixteen scalars times fixed patterns (thesis 8.15)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.beams import PLANES
from cvxupdate.fe.exact.members import Bending, Both, bar, bending, sines, supported_below
from cvxupdate.fe.sections import Section, section_constants, shear_modulus
from cvxupdate.fe.terms import Real, Term, Values, rotate
from cvxupdate.fe.triads import line_triads

Index = NDArray[np.int64]
STEP = 1e-30
PARTS = ("s11", "s12", "s22", "a11", "a12", "a22")
_BASE = ("EA", "GJ", "rhoA", "rhoIp", "N")


def _patterns() -> dict[str, Real]:
    """4 × 4 patterns of (w₁, ψ₁, w₂, ψ₂) for the motion symmetric and antisymmetric about the
    middle."""
    rows = {
        "s": np.array([[0.5, 0.0, 0.5, 0.0], [0.0, -0.5, 0.0, 0.5]]),
        "a": np.array([[-0.5, 0.0, 0.5, 0.0], [0.0, 0.5, 0.0, 0.5]]),
    }
    out = {}
    for kind, (w, turn) in rows.items():
        out[f"{kind}11"] = 2.0 * np.outer(w, w)
        out[f"{kind}12"] = 2.0 * (np.outer(w, turn) + np.outer(turn, w))
        out[f"{kind}22"] = 2.0 * np.outer(turn, turn)
    return out


@dataclass(frozen=True)
class ExactBeam:
    """A prismatic beam on a section: tension, torsion, bending in two planes.

    ``rotary`` is whether its sections resist turning (Rayleigh; none: Euler–Bernoulli, and torsion
    without inertia), ``polar`` which inertia turns about the axis, as in `fe.beams`. Shear comes
    with the property ``shear`` (1: Timoshenko's kappa).
    """

    section: Section
    rotary: bool = True
    polar: str = "Iy+Iz"

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Patterns (e, 12, 12) in global axes, matrix "Z"."""
        e, triads, terms = len(xyz), line_triads(xyz, orientation), []

        def add(name: str, places: tuple[int, ...], local: Real) -> None:
            full = np.zeros((e, 12, 12))
            full[np.ix_(range(e), places, places)] = local
            terms.append(Term("Z", name, rotate(full, triads, 4)))

        together, apart = np.full((2, 2), 0.5), np.array([[0.5, -0.5], [-0.5, 0.5]])
        for name, pair in (("axial", (0, 6)), ("torsion", (3, 9))):
            add(f"{name}.s", pair, together)
            add(f"{name}.a", pair, apart)
        for axis, (places, sign) in PLANES.items():
            turn = np.array([1.0, sign, 1.0, sign])
            for part, pattern in _patterns().items():
                add(f"{axis}.{part}", places, np.outer(turn, turn) * pattern)
        return tuple(terms)

    def dynamic_stiffness(
        self, omega: complex | NDArray[np.complex128], properties: Mapping[str, Values]
    ) -> dict[str, Values]:
        """The scalars of `terms` at ``omega`` in rad/s, one for all or one for each element, each
        (elements,), complex.

        ``properties`` are those of a block: complex numbers pass through, so E (1 + iη) and a
        complex step do. A complex ω = −is gives Laplace's s.
        """
        none = {k: np.zeros(np.shape(v)) for k, v in properties.items()}
        return {k: v for k, (v, _) in self.change(omega, properties, none).items()}

    def change(
        self,
        omega: complex | NDArray[np.complex128],
        properties: Mapping[str, Values],
        moves: Mapping[str, Real],
    ) -> dict[str, Both]:
        """The scalars and their derivatives when every property moves by ``moves`` (elements,) per
        unit: the closed forms of A.3."""
        base, d = self._base(properties, moves)
        s = 1j * omega
        loss, d_loss, inertia, d_inertia = _damped(s, properties, moves)
        h = properties["length"] / 2.0
        # a property with its loss or inertia, and its change
        kept: dict[str, Both] = {}
        for name, value in base.items():
            factor, d_factor = (inertia, d_inertia) if name.startswith("rho") else (loss, d_loss)
            kept[name] = value * factor, d[name] * factor + value * d_factor
        out: dict[str, Both] = {}
        for name, k, m in (("axial", "EA", "rhoA"), ("torsion", "GJ", "rhoIp")):
            (K, dK), (M, dM) = kept[k], kept[m]
            out[f"{name}.s"], out[f"{name}.a"] = bar(K, M, h, dK, dM)
        flexible = base["flexible"] / loss
        d_flexible = (d["flexible"] - flexible * d_loss) / loss
        now, then = (  # both planes at once
            Bending(
                np.stack([kept["EI" + axis][side] for axis in PLANES]),
                (flexible, d_flexible)[side],
                kept["N"][side],
                kept["rhoA"][side],
                np.stack([kept["rhoI" + axis][side] for axis in PLANES]),
            )
            for side in (0, 1)
        )
        for part, (value, slope) in zip(PARTS, bending(now, h, then), strict=True):
            for at, axis in enumerate(PLANES):
                out[f"{axis}.{part}"] = value[at], slope[at]
        return out

    def clamped_below(self, omega: Real, properties: Mapping[str, Values]) -> dict[str, Index]:
        """How many natural frequencies of each element with both ends clamped lie below its
        ``omega``, by what moves: "axial", "torsion", "y", "z"; without damping, (elements,).

        Tension and torsion in closed form. Bending by the count of a simply supported member, also
        in closed form, less that of the negative rotational stiffnesses of its ends (Howson and
        Williams 1973).
        """
        p = {**properties, "damping": np.zeros(len(properties["length"]))}
        base = self._constants(p)
        ends = self.dynamic_stiffness(omega.astype(complex), p)
        stiff, heavy = p["stiffness"], -(omega**2) * p["mass"]
        h = p["length"] / 2.0
        out = {}
        for name, k, m in (("axial", "EA", "rhoA"), ("torsion", "GJ", "rhoIp")):
            out[name] = sines(h**2 * heavy * base[m] / (stiff * base[k]))
        for axis in PLANES:
            made = Bending(
                stiff * base[f"EI{axis}"],
                base["flexible"] / stiff,
                stiff * base["N"],
                heavy * base["rhoA"],
                heavy * base[f"rhoI{axis}"],
            )
            turning = [np.real(ends[f"{axis}.{k}"]) < 0.0 for k in ("s22", "a22")]
            out[axis] = supported_below(made, h) - np.sum(turning, axis=0)
        return out

    def _base(
        self, properties: Mapping[str, Values], moves: Mapping[str, Real]
    ) -> tuple[dict[str, Values], dict[str, Values]]:
        """Rigidities and inertias per length without loss, and their change; products and powers of
        properties, so their change is a complex step where they are real."""
        if any(np.any(np.imag(v) != 0.0) for v in properties.values()):
            value = self._constants(properties)
            return value, {k: np.zeros(np.shape(v)) for k, v in value.items()}
        moved = {
            k: v + 1j * STEP * moves[k] if k in moves and np.any(moves[k]) else v
            for k, v in properties.items()
        }
        both = self._constants(moved)
        return (
            {k: np.real(v) for k, v in both.items()},
            {k: np.imag(v) / STEP for k, v in both.items()},
        )

    def _constants(self, p: Mapping[str, Values]) -> dict[str, Values]:
        c = section_constants(self.section, p)
        E, rho, G = p["E"], p["rho"], shear_modulus(p)
        polar = c["J"] if self.polar == "J" else c["Iy"] + c["Iz"]
        turning = 1.0 if self.rotary else 0.0
        return {
            "EA": E * c["A"],
            "GJ": G * c["J"],
            "N": p["N"],
            "flexible": p["shear"] / (p["kappa"] * G * c["A"]),
            "EIy": E * c["Iy"],
            "EIz": E * c["Iz"],
            "rhoA": rho * c["A"],
            "rhoIp": turning * rho * polar,
            "rhoIy": turning * rho * c["Iy"],
            "rhoIz": turning * rho * c["Iz"],
        }


def _damped(
    s: complex | NDArray[np.complex128], p: Mapping[str, Values], d: Mapping[str, Real]
) -> tuple[Values, Values, Values, Values]:
    """The factor on every stiffness (p-value, loss factor, Rayleigh's beta), on every inertia (s²,
    Rayleigh's alpha), and their changes: what `fe.block` makes of K, M, C and D."""

    def move(name: str) -> Values:
        return np.asarray(d.get(name, 0.0))

    lossy = 1j * p["eta"] + s * p["beta"]
    loss = p["stiffness"] + p["damping"] * lossy
    d_loss = move("stiffness") + move("damping") * lossy
    d_loss = d_loss + p["damping"] * (1j * move("eta") + s * move("beta"))
    inertia = s**2 * p["mass"] + s * p["damping"] * p["alpha"]
    d_inertia = s**2 * move("mass") + s * (move("damping") * p["alpha"])
    return loss, d_loss, inertia, d_inertia + s * p["damping"] * move("alpha")
