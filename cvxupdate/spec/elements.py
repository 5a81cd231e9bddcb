"""Element blocks of a problem file.

A block holds rows; a property given once on the block counts for every row that does not give its
own (``INHERITED`` lists which), so after loading every row is complete and the block's own copy may
be ignored.
"""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.spec.base import (
    DofKind,
    Dofs,
    Id,
    NonNegative,
    Part,
    Positive,
    Table,
    Text,
    Vector,
    one_of,
)

Group = Annotated[Text | None, Field(description="name of the group the element belongs to")]
OneNode = Annotated[tuple[Id, ...], Field(min_length=1, max_length=1)]
OneOrTwoNodes = Annotated[tuple[Id, ...], Field(min_length=1, max_length=2)]
TwoNodes = Annotated[tuple[Id, ...], Field(min_length=2, max_length=2)]
FourNodes = Annotated[tuple[Id, ...], Field(min_length=4, max_length=4)]
MassKind = Annotated[Literal["consistent", "lumped"], Field(description="mass matrix")]
StiffnessFactor = Annotated[
    Positive,
    Field(description="factor on the stiffness matrix (structural damping is not scaled by it)"),
]
MassFactor = Annotated[Positive, Field(description="factor on the mass matrix")]
Loss = Annotated[
    NonNegative | None,
    Field(description="loss factor; absent: that of the material, else of [model.damping]"),
]
ElementId = Annotated[Id, Field(description="element number, unique in the model")]
Labels = Annotated[
    Literal["auto"] | Text | tuple[Text, ...],
    one_of(
        '"auto", the name of a variable in the file, or a list of labels such as ["n6.x", "n6.y"]'
    ),
]


class SpringRow(Part):
    """A spring: to ground (one node) or between two."""

    id: ElementId
    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    k: NonNegative = Field(description="stiffness [N/m or N·m/rad]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same value"
    )
    stiffness_factor: StiffnessFactor = 1.0
    eta: Loss = None
    group: Group = None

    @property
    def directions(self) -> tuple[DofKind, ...]:
        """The DOF kinds along which it acts."""
        return _directions(self.dof, self.dofs)


class DashpotRow(Part):
    """A viscous damper: to ground (one node) or between two."""

    id: ElementId
    nodes: OneOrTwoNodes = Field(description="[i] is to ground, [i, j] between")
    c: NonNegative = Field(description="viscous coefficient [N·s/m or N·m·s/rad]")
    dof: DofKind | None = Field(default=None, description="DOF along which it acts")
    dofs: Dofs | None = Field(
        default=None, description="several DOFs instead of `dof`, each with the same value"
    )
    group: Group = None

    @property
    def directions(self) -> tuple[DofKind, ...]:
        """The DOF kinds along which it acts."""
        return _directions(self.dof, self.dofs)


class MassRow(Part):
    """A lump: mass in every active translation, inertia in the active rotations."""

    id: ElementId
    nodes: OneNode = Field(description="[i], the node that carries it")
    m: NonNegative = Field(description="mass [kg]")
    Ixx: NonNegative = Field(default=0.0, description="inertia about x through the node [kg·m²]")
    Iyy: NonNegative = Field(default=0.0, description="inertia about y [kg·m²]")
    Izz: NonNegative = Field(default=0.0, description="inertia about z [kg·m²]")
    taken_off: bool = Field(
        default=False,
        description="the lump is taken off what the other elements have: it counts negative",
    )
    mass_factor: MassFactor = 1.0
    group: Group = None


class GyroscopicRow(Part):
    """The gyroscopic moment of what spins, beside the mass or beam that carries the inertia."""

    id: ElementId
    nodes: OneOrTwoNodes = Field(description="[i] is a disc, [i, j] a piece of shaft")
    Ip: NonNegative = Field(
        description="polar moment of inertia: of a disc [kg·m²], of a shaft for each metre [kg·m] "
        "(density times Iy + Iz)"
    )
    omega: float = Field(
        description="spin [rad/s], right-handed about the axis; a shaft's axis runs from i to j"
    )
    axis: Vector | None = Field(default=None, description="axis of a disc [x, y, z]")
    group: Group = None


class LineRow(Part):
    """A rod or beam between two nodes."""

    id: ElementId
    nodes: TwoNodes = Field(description="[i, j]; local x runs from i to j")
    material: Text = Field(description="name of a material")
    section: Text = Field(description="name of a section")
    group: Group = None
    orientation: Vector | None = Field(
        default=None, description="vector [x, y, z] in the local x–z plane [m]"
    )
    N: float = Field(default=0.0, description="axial preload of a beam, tension positive [N]")
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    eta: Loss = None


class PlateRow(Part):
    """A rectangular plate element in the x–y plane."""

    id: ElementId
    nodes: FourNodes = Field(
        description="four corners, counter-clockwise seen from +z; "
        "local x runs from first to second"
    )
    material: Text = Field(description="name of a material")
    section: Text = Field(description="name of a section of shape plate")
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    eta: Loss = None
    group: Group = None


class MatrixRow(Part):
    """One element or group matrix from another finite-element program.

    A value that ends in ``.mtx`` or ``.npz`` is itself a file (Matrix Market, or
    ``scipy.sparse.save_npz``), anything else the name of a variable in ``file``.
    """

    id: ElementId
    stiffness: Text | None = Field(
        default=None, description="stiffness matrix: variable in the file, or a .mtx/.npz file"
    )
    mass: Text | None = Field(default=None, description="mass matrix, likewise")
    damping: Text | None = Field(default=None, description="viscous damping matrix, likewise")
    structural: Text | None = Field(
        default=None, description="structural (hysteretic) damping matrix, likewise"
    )
    file: Path | None = Field(default=None, description=".mat or .npz file with the variables")
    dataset: Text | None = Field(
        default=None, description="data set under CVXUPDATE_DATA that holds the file"
    )
    labels: Labels = Field(
        default="auto", description='DOF labels of the rows of the matrix; "auto": row i is n<i>.x'
    )
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    eta: Loss = None
    group: Group = None


class SpringBlock(Part):
    """Springs."""

    type: Literal["spring"]
    rows: Annotated[tuple[SpringRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    k: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


class DashpotBlock(Part):
    """Viscous dampers."""

    type: Literal["dashpot"]
    rows: Annotated[tuple[DashpotRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    c: NonNegative | None = Field(default=None, description="for every row without its own")
    dof: DofKind | None = Field(default=None, description="for every row without its own")
    dofs: Dofs | None = Field(default=None, description="for every row without its own")
    group: Group = None


class MassBlock(Part):
    """Lumped masses."""

    type: Literal["mass"]
    rows: Annotated[tuple[MassRow, ...], Table()] = Field(min_length=1, description="the elements")
    m: NonNegative | None = Field(default=None, description="for every row without its own")
    Ixx: NonNegative | None = Field(default=None, description="for every row without its own")
    Iyy: NonNegative | None = Field(default=None, description="for every row without its own")
    Izz: NonNegative | None = Field(default=None, description="for every row without its own")
    group: Group = None


class GyroscopicBlock(Part):
    """What spins: a skew-symmetric velocity term."""

    type: Literal["gyroscopic"]
    rows: Annotated[tuple[GyroscopicRow, ...], Table()] = Field(
        min_length=1, description="the elements"
    )
    Ip: NonNegative | None = Field(default=None, description="for every row without its own")
    omega: float | None = Field(default=None, description="for every row without its own")
    axis: Vector | None = Field(default=None, description="for every row without its own")
    group: Group = None


class LineBlock(Part):
    """Rods and beams: ``rod`` axial only, ``beam2d`` in a plane, ``beam3d`` in space
    (Euler–Bernoulli; Timoshenko where the section has `kappa`)."""

    type: Literal["rod", "beam2d", "beam3d"]
    rows: Annotated[tuple[LineRow, ...], Table()] = Field(min_length=1, description="the elements")
    mass: MassKind = "consistent"
    rotary_inertia: bool = Field(
        default=True, description="rotary-inertia terms in the mass matrix of a beam"
    )
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    orientation: Vector | None = Field(default=None, description="for every row without its own")
    group: Group = None


class PlateBlock(Part):
    """Rectangular plates in bending."""

    type: Literal["plate"]
    rows: Annotated[tuple[PlateRow, ...], Table()] = Field(min_length=1, description="the elements")
    mass: MassKind = "consistent"
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    group: Group = None


class MatrixBlock(Part):
    """Matrices from another program: K = Σ (1 + p_i) K_i, a row for each K_i, M_i, C_i, D_i."""

    type: Literal["matrix"]
    rows: Annotated[tuple[MatrixRow, ...], Table()] = Field(
        min_length=1, description="the matrices"
    )
    file: Path | None = Field(default=None, description="for every row without its own")
    dataset: Text | None = Field(default=None, description="for every row without its own")
    labels: Labels | None = Field(default=None, description="for every row without its own")
    group: Group = None


Block = (
    SpringBlock | DashpotBlock | MassBlock | GyroscopicBlock | LineBlock | PlateBlock | MatrixBlock
)
Row = SpringRow | DashpotRow | MassRow | GyroscopicRow | LineRow | PlateRow | MatrixRow

INHERITED: dict[str, tuple[str, ...]] = {
    "spring": ("k", "dof", "dofs", "group"),
    "dashpot": ("c", "dof", "dofs", "group"),
    "mass": ("m", "Ixx", "Iyy", "Izz", "group"),
    "gyroscopic": ("Ip", "omega", "axis", "group"),
    "rod": ("material", "section", "orientation", "group"),
    "beam2d": ("material", "section", "orientation", "group"),
    "beam3d": ("material", "section", "orientation", "group"),
    "plate": ("material", "section", "group"),
    "matrix": ("file", "dataset", "labels", "group"),
}
"""Keys of a block that count for its rows, by element type."""

EXCLUSIVE = {"dof": "dofs", "dofs": "dof", "dataset": "file", "file": "dataset"}
"""A row that gives the value does not inherit the key."""

MATRICES = ("stiffness", "mass", "damping", "structural")
"""Keys of a matrix row that name matrices."""
MATRIX_FILES = (".mtx", ".npz")
"""Endings that make such a name a file of its own."""

ELASTIC = ("stiffness", "damping", "eta", "beta", "E")
INERTIAL = ("mass", "alpha", "rho")
SIZES = ("A", "height", "width", "diameter", "wall")
OF_BY_TYPE: dict[str, tuple[str, ...]] = {
    "spring": ("stiffness", "k", "damping", "eta", "beta"),
    "dashpot": ("damping", "c"),
    "mass": ("mass", "m", "Ixx", "Iyy", "Izz", "damping", "alpha"),
    "gyroscopic": ("Ip", "omega"),
    "rod": (*ELASTIC, *INERTIAL, *SIZES),
    "beam2d": (*ELASTIC, *INERTIAL, "nu", *SIZES, "I", "Iy", "Iz", "J", "N", "kappa"),
    "beam3d": (*ELASTIC, *INERTIAL, "nu", *SIZES, "I", "Iy", "Iz", "J", "N", "kappa"),
    "plate": (*ELASTIC, *INERTIAL, "nu", "thickness", "Dx", "Dy", "D1", "Dxy"),
    "matrix": ("stiffness", "mass", "damping", "eta", "alpha", "beta"),
}
"""What a parameter may change, by element type."""


def _directions(dof: DofKind | None, dofs: tuple[DofKind, ...] | None) -> tuple[DofKind, ...]:
    if dofs is not None:
        return dofs
    return (dof,) if dof is not None else ()
