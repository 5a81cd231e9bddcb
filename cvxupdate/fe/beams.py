"""The twelve-DOF prismatic beam in local axes, split by coefficient (Przemieniecki 1968, derived
here from shape functions)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np

from cvxupdate.fe.hermite import unit_matrices
from cvxupdate.fe.sections import (
    FACTORS,
    Section,
    line_properties,
    section_constants,
    shear_modulus,
)
from cvxupdate.fe.surroundings import Surroundings
from cvxupdate.fe.terms import Real, Term, Values, rotate
from cvxupdate.fe.triads import line_triads
from cvxupdate.spec.elements import BENDING, ElementText, Lacking, LineKeys, LineRow

# Places of (w₁, ψ₁, w₂, ψ₂) among the twelve local DOFs, and the sign of the rotation: θz = dv/dx,
# θy = −dw/dx.
PLANES = {"z": ((1, 5, 7, 11), 1.0), "y": ((2, 4, 8, 10), -1.0)}

THEORY = ("shear", "kappa", "rotary", "corner")
"""Properties of a beam by which its theory is more than Euler's on a centre line."""

IN_SPACE = ("x", "y", "z", "rx", "ry", "rz")
"""DOFs of each node of a beam in space."""


def text_in_space(block: type[LineKeys], **own: Any) -> ElementText:
    """What the text knows of beams in space with blocks of that model, and what is ``own`` to
    one."""
    return ElementText(
        block,
        changes=BENDING,
        outline="line",
        sections={"rectangle": (), "circle": (), "general": (("A",), ("Iy",), ("Iz",), ("J",))},
        lacking=beam_lacking,
        **own,
    )


def beam_properties(section: Section) -> tuple[str, ...]:
    """Material, dimensions, section factors, and the physics that is zero unless asked for."""
    return ("E", "nu", "G", "rho", *section.properties, *FACTORS, "N", *THEORY)


def beam_values(row: LineRow, block: LineKeys, around: Surroundings) -> dict[str, float]:
    """Of a beam as it is drawn."""
    return {**line_properties(row, around), "rotary": float(block.rotary_inertia)}


def beam_terms(
    xyz: Real,
    orientation: Real,
    planes: tuple[str, ...],
    lumped: bool,
    turning: bool,
    torsion: bool,
) -> tuple[Term, ...]:
    """All terms of a beam, (e, 12, 12), in global axes.

    ``planes`` names the bending axes that carry stiffness ("y": bending about local y, "z": about
    local z); ``turning``: it resists turning about its own axis.
    """
    e = len(xyz)
    L = np.linalg.norm(xyz[:, 1] - xyz[:, 0], axis=1)
    triads = line_triads(xyz, orientation)
    terms: list[Term] = []

    def add(matrix: str, coefficient: str, places: tuple[int, ...], local: Real) -> None:
        full = np.zeros((e, 12, 12))
        full[np.ix_(range(e), places, places)] = local
        terms.append(Term(matrix, coefficient, rotate(full, triads, 4)))

    axial, linear = np.array([[1.0, -1.0], [-1.0, 1.0]]), np.array([[2.0, 1.0], [1.0, 2.0]]) / 6.0
    half = np.eye(2) / 2.0
    add("K", "EA", (0, 6), axial / L[:, None, None])
    add("M", "rhoA", (0, 6), (half if lumped else linear) * L[:, None, None])
    if torsion:
        add("K", "GJ", (3, 9), axial / L[:, None, None])
        if turning or lumped:
            add("M", "rhoIp", (3, 9), (half if lumped else linear) * L[:, None, None])
    unit = unit_matrices()
    for axis in planes:
        places, sign = PLANES[axis]
        S = np.ones((e, 4))
        S[:, 1::2] = sign * L[:, None]
        SS = S[:, :, None] * S[:, None, :]
        for power in (0, 1):
            add("K", f"EI{axis}.{power}", places, SS * unit[f"K{power}"] / L[:, None, None] ** 3)
        for power in (0, 1, 2):
            add("K", f"N{axis}.{power}", places, SS * unit[f"G{power}"] / L[:, None, None])
        if lumped:
            add(
                "M", "rhoA", places, SS * np.diag([1 / 2, 1 / 24, 1 / 2, 1 / 24]) * L[:, None, None]
            )
            continue
        for power in (0, 1, 2):
            add("M", f"rhoA{axis}.{power}", places, SS * unit[f"M{power}"] * L[:, None, None])
            add("M", f"rhoI{axis}.{power}", places, SS * unit[f"R{power}"] / L[:, None, None])
    return tuple(terms)


def beam_coefficients(
    section: Section, p: Mapping[str, Values], polar: str = "Iy+Iz"
) -> dict[str, Values]:
    """Scalars of `beam_terms`.

    ``polar`` is what turns about the axis: rho (Iy + Iz), which is a rigid section's, or rho J, as
    the thesis has it (8.2, 8.14); of a circle they are the same.

    ``shear`` scales Φ = 12 E I / (κ G A L²): 0 is Euler–Bernoulli, 1 Timoshenko with the shear
    coefficient ``kappa``. Each plane's Φ acts on its stiffness, geometric stiffness and consistent
    mass, translational and rotary (Friedman and Kosmatka 1993); lumped mass knows none. Natural
    frequencies then converge as O(h²) where elements are shorter than deep
    (tests/fe/test_closed_forms.py says why), else as O(h⁴). ``rotary`` is the share of Rayleigh's
    rotary inertia that consistent mass has. ``N`` is an axial preload in newtons, tension positive.
    ``corner`` stiffens ends at corners (`cvxupdate.fe.analysis.corners`).
    """
    c = section_constants(section, p)
    E, rho = p["E"], p["rho"]
    G = shear_modulus(p)
    out: dict[str, Values] = {
        "EA": E * c["A"],
        "rhoA": rho * c["A"],
        "GJ": G * c["J"],
        "rhoIp": rho * (c["J"] if polar == "J" else c["Iy"] + c["Iz"]),
    }
    for axis in ("y", "z"):
        I = c["I" + axis]
        phi = p["shear"] * 12.0 * E * I / (p["kappa"] * G * c["A"] * p["length"] ** 2)
        for power in (0, 1):
            out[f"EI{axis}.{power}"] = E * I * phi**power / (1.0 + phi)
        for power in (0, 1, 2):
            share = phi**power / (1.0 + phi) ** 2
            out[f"N{axis}.{power}"] = p["N"] * share
            out[f"rhoA{axis}.{power}"] = rho * c["A"] * share
            out[f"rhoI{axis}.{power}"] = rho * I * p["rotary"] * share
        out[f"corner{axis}"] = E * I * p["corner"]
    return out


def beam_lacking(block: LineKeys, active: tuple[str, ...]) -> Lacking:
    """Translations and rotations, or the rotation about x alone: a beam along x of which only the
    torsion is wanted."""
    turns, moves = {"rx", "ry", "rz"}.intersection(active), {"x", "y", "z"}.intersection(active)
    if (turns and moves) or set(active) == {"rx"}:
        return None
    return (
        f"{block.type} elements need translations and rotations; active are {', '.join(active)}.",
        'Add to model.dofs, e.g. ["z", "ry"] for bending in the x–z plane; a rod has translations '
        "only.",
    )
