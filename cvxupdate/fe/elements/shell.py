"""Shell: a flat or warped sheet of three or four nodes in space, in bending, shear and tension.

Bending by the discrete Kirchhoff elements (DKQ, DKT), which become Reissner–Mindlin elements
without locking where the sheet deforms in shear (`cvxupdate.fe.shells.bending`), membrane with
drilling rotations (`cvxupdate.fe.shells.membrane`). Rigidities as those of the rectangle (`Plate`),
in and out of plane; the node plane may lie aside.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Annotated, ClassVar, Literal, cast

import numpy as np
from pydantic import Field

from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.sections import material_properties
from cvxupdate.fe.shells.global_terms import shell_terms
from cvxupdate.keys import Id, Table, Text, Vector
from cvxupdate.spec import division, outlines
from cvxupdate.spec.elements import (
    ELASTIC,
    INERTIAL,
    Block,
    ElementText,
    Group,
    Lacking,
    MassKind,
    Row,
)
from cvxupdate.spec.factors import DampingFactor, Loss, MassFactor, StiffnessFactor
from cvxupdate.spec.model import PlateSection

_SIX = ("x", "y", "z", "rx", "ry", "rz")
_AT_ONCE = 2048  # elements whose matrices in all six kinds are in memory at a time
_KAPPA = 5.0 / 6.0
_SEAT = {"middle": 0.0, "bottom": 0.5, "top": -0.5}
_RIGIDITIES = ("Dx", "Dy", "D1", "Dxy")

Offset = Annotated[
    float,
    Field(
        description="how far along the normal of the element its `surface` lies from the nodes [m]"
    ),
]
Surface = Annotated[
    Literal["middle", "bottom", "top"],
    Field(
        description="which surface of the shell the `offset` is that of; the normal points to "
        "the top"
    ),
]


class ShellRow(Row):
    """A triangle or quadrilateral in space."""

    nodes: Annotated[tuple[Id, ...], Field(min_length=3, max_length=4)] = Field(
        description="three or four corners in order; the normal is that of a right-handed turn"
    )
    material: Text = Field(description="name of a material")
    section: Text = Field(
        description="name of a section of shape plate; where it has `kappa`, the shell deforms in "
        "shear"
    )
    orientation: Vector | None = Field(
        default=None,
        description="vector [x, y, z] whose projection is local x; absent: from first to second "
        "corner",
    )
    offset: Offset = 0.0
    surface: Surface = "middle"
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None
    group: Group = None


class ShellBlock(Block):
    """Shells of three or four nodes in space, thin or thick."""

    type: Literal["shell"]
    rows: Annotated[tuple[ShellRow, ...], Table()] = Field(min_length=1, description="the elements")
    mass: MassKind = "consistent"
    rotary_inertia: bool = Field(
        default=True, description="rotary-inertia terms in the mass matrix"
    )
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    orientation: Vector | None = Field(default=None, description="for every row without its own")
    offset: Offset | None = Field(default=None, description="for every row without its own")
    surface: Surface | None = Field(default=None, description="for every row without its own")
    group: Group = None


def _lacking(block: ShellBlock, active: tuple[str, ...]) -> Lacking:
    """A sheet bends in a coordinate plane, or stretches in one, at least."""
    for k, normal in enumerate("xyz"):
        others = "xyz".replace(normal, "")
        bends = {normal, *(f"r{o}" for o in others)}
        stretches = {*others, f"r{'xyz'[k]}"}
        if bends <= set(active) or stretches <= set(active):
            return None
    return (
        f"shell elements bend or stretch; {', '.join(active)} allows neither.",
        "Activate all six kinds in model.dofs, or z, rx and ry for a plate in the x-y plane.",
    )


@dataclass(frozen=True)
class Shell:
    """Dx, Dy, D1, Dxy are factors on the isotropic rigidities; ``shear`` = 1 lets it deform in
    shear; ``offset`` (m) and ``seat`` (thicknesses) say how far the sheet lies from its nodes."""

    nodes: int = 4
    mass: str = "consistent"
    rotary_inertia: bool = True
    eccentric: bool = False
    name: str = "shell"
    dofs: tuple[str, ...] = _SIX
    properties: tuple[str, ...] = (
        "E",
        "nu",
        "rho",
        "thickness",
        *_RIGIDITIES,
        "shear",
        "kappa",
        "offset",
        "seat",
    )
    text: ClassVar[ElementText] = ElementText(
        ShellBlock,
        changes=(*ELASTIC, *INERTIAL, "nu", "thickness", *_RIGIDITIES, "kappa", "offset"),
        units={"offset": "m"},
        outline="surface",
        divide=division.surface,
        flaw=outlines.sheet,
        sections={"plate": ()},
        lacking=_lacking,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: ShellRow, block: ShellBlock, around: Surroundings) -> Iterator[Placed]:
        """One shell element."""
        s = cast(PlateSection, around.section(row))
        aside = row.offset != 0.0 or row.surface != "middle"
        properties = {
            **material_properties(around.material(row)),
            "thickness": s.thickness,
            **{key: getattr(s, key) for key in _RIGIDITIES},
            "shear": 0.0 if s.kappa is None else 1.0,
            "kappa": _KAPPA if s.kappa is None else s.kappa,
            "offset": row.offset,
            "seat": _SEAT[row.surface],
        }
        active = tuple(d for d in _SIX if d in around.active)
        kind = cls(len(row.nodes), block.mass, block.rotary_inertia, aside, dofs=active)
        yield Placed(kind, properties, row.orientation or (0.0, 0.0, 0.0))

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors in global axes, (e, n d, n d) for the d kinds of ``dofs``: a flat plate
        with three active kinds does not carry the other three along."""
        kinds = tuple(_SIX.index(d) for d in self.dofs)
        lumped = self.mass == "lumped"
        parts = [
            tuple(
                shell_terms(
                    xyz[i : i + _AT_ONCE],
                    orientation[i : i + _AT_ONCE],
                    lumped,
                    self.rotary_inertia,
                    self.eccentric,
                    kinds,
                )
            )
            for i in range(0, len(xyz), _AT_ONCE)
        ]
        whole = (
            Term(same[0].matrix, same[0].coefficient, np.concatenate([t.values for t in same]))
            for same in zip(*parts, strict=True)
        )
        return tuple(term for term in whole if np.any(term.values != 0.0))

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Rigidities in bending (N·m) and tension (N/m), mass and rotary inertia per area.

        Φ = 12 D / (κ G h L²) of the isotropic sheet weighs bubbles against shear (`bending`);
        the shear term is κ G h (Φ / (1 + Φ))², written so that it may vanish.
        """
        p = properties
        nu, h = p["nu"], p["thickness"]
        A = p["E"] * h / (1.0 - nu**2)
        D = A * h**2 / 12.0
        unsheared = 12.0 * D / p["length"] ** 2
        phi = p["shear"] * 2.0 * h**2 / (p["kappa"] * (1.0 - nu) * p["length"] ** 2)
        a = 1.0 / (1.0 + phi)
        out: dict[str, Values] = {"shear": unsheared * phi * a**2}
        iso = {"x": 1.0, "y": 1.0, "1": nu, "xy": (1.0 - nu) / 2.0}
        for key, value in iso.items():
            bending = p[f"D{key}"] * value * D
            out |= {f"D{key}.0": bending, f"D{key}.1": bending * a, f"D{key}.2": bending * a**2}
        e = p["offset"] + p["seat"] * h
        flat = {f"A{key}": p[f"D{key}"] * value * A for key, value in iso.items()}
        flat["rhoh"] = p["rho"] * h
        for key, value in flat.items():
            out |= {key: value, f"{key}.1": value * e, f"{key}.2": value * e**2}
        out["rhoI"] = p["rho"] * h**3 / 12.0
        return out
