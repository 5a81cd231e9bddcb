"""Plane beam: tension and bending in one plane (thesis 7.4)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.beams import (
    beam_coefficients,
    beam_lacking,
    beam_properties,
    beam_terms,
    beam_values,
)
from cvxupdate.fe.elements.base import Placed, Real, Surroundings, Term, Values
from cvxupdate.fe.sections import Section, shape_of
from cvxupdate.spec import division
from cvxupdate.spec.elements import BENDING, ElementText, LineBlock, LineRow

_PLANES = {"xy": ("x", "y", "rz"), "xz": ("x", "z", "ry")}


@dataclass(frozen=True)
class Beam2D:
    """Six DOFs in the global x–y plane (bends about z, so Iz) or x–z plane (bends about y, so
    Iy)."""

    section: Section
    plane: str = "xy"
    mass: str = "consistent"
    rotary_inertia: bool = True
    name: str = "beam2d"
    nodes: int = 2
    text: ClassVar[ElementText] = ElementText(
        LineBlock,
        changes=BENDING,
        outline="line",
        divide=division.line,
        sections={"rectangle": (), "circle": (), "general": (("A",), ("Iy", "Iz"))},
        lacking=beam_lacking,
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: LineRow, block: LineBlock, around: Surroundings) -> Iterator[Placed]:
        """One beam, in the x–z plane where the rotation about y is active and that about z is
        not."""
        plane = "xz" if "ry" in around.active and "rz" not in around.active else "xy"
        kind = cls(shape_of(around.section(row)), plane, block.mass, block.rotary_inertia)
        yield Placed(kind, beam_values(row, block, around), row.orientation or (0.0, 0.0, 0.0))

    @property
    def dofs(self) -> tuple[str, ...]:
        """Two translations and the rotation of the plane."""
        return _PLANES[self.plane]

    @property
    def properties(self) -> tuple[str, ...]:
        """Material, dimensions, section factors, and the physics that is zero unless asked for."""
        return beam_properties(self.section)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """Geometric factors in global axes, (e, 6, 6).

        Raises
        ------
        ModelError
            When a node lies outside the element's plane.
        """
        normal = 2 if self.plane == "xy" else 1
        if np.any(np.ptp(xyz[:, :, normal], axis=1) > 1e-9 * (1.0 + np.abs(xyz).max())):
            raise ModelError(
                f"a beam2d element leaves the {self.plane} plane. Use beam3d, or move its "
                "nodes into the plane."
            )
        # Local z in the x-y plane makes "about local y" the bending about global z and the reverse;
        # pin it to global z or to the plane.
        axis = np.array([0.0, 0.0, 1.0]) if self.plane == "xy" else _in_plane(xyz)
        terms = beam_terms(
            xyz,
            np.broadcast_to(axis, (len(xyz), 3)),
            ("z",) if self.plane == "xy" else ("y",),
            self.mass == "lumped",
            self.rotary_inertia,
            torsion=False,
        )
        kinds = ("x", "y", "z", "rx", "ry", "rz")
        keep = [6 * n + kinds.index(k) for n in (0, 1) for k in self.dofs]
        return tuple(
            Term(t.matrix, t.coefficient, t.values[np.ix_(range(len(xyz)), keep, keep)])
            for t in terms
        )

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """Section stiffnesses and masses per length."""
        return beam_coefficients(self.section, properties)


def _in_plane(xyz: Real) -> Real:
    """A vector in the x–z plane, square to each element, whose local y is global y: (e, 3)."""
    d = xyz[:, 1] - xyz[:, 0]
    return np.stack([-d[:, 2], np.zeros(len(d)), d[:, 0]], axis=1)
