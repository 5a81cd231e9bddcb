"""What the text of a problem file knows of elements: rows, blocks, and what both say of a type.

A block holds rows; a key that both have is given once on the block for every row that does not give
its own, so after loading every row is complete and the block's own copy may be ignored. A key means
the same wherever it stands (`material` names a material, `dof` a direction, `m` a mass …), so the
checks go by keys and an element from outside the package is checked like any other.

The row models of an element type stand beside its matrices, in `cvxupdate/fe/elements/`. Here are
those that several types share (rods and beams) or that other rooms read by name (plates are
refined, matrices bring DOF labels).
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any, Literal, cast

from pydantic import Field

from cvxupdate.keys import (
    DofKind,
    Id,
    Part,
    Table,
    Text,
    Vector,
    one_of,
)
from cvxupdate.registry import ELEMENTS
from cvxupdate.spec.division import Divide, undivided
from cvxupdate.spec.factors import DampingFactor, Loss, MassFactor, StiffnessFactor
from cvxupdate.spec.outlines import Inspect, sound

Group = Annotated[Text | None, Field(description="name of the group the element belongs to")]
OneNode = Annotated[tuple[Id, ...], Field(min_length=1, max_length=1)]
OneOrTwoNodes = Annotated[tuple[Id, ...], Field(min_length=1, max_length=2)]
TwoNodes = Annotated[tuple[Id, ...], Field(min_length=2, max_length=2)]
FourNodes = Annotated[tuple[Id, ...], Field(min_length=4, max_length=4)]
MassKind = Annotated[Literal["consistent", "lumped"], Field(description="mass matrix")]
ElementId = Annotated[Id, Field(description="element number, unique in the model")]
Labels = Annotated[
    Literal["auto"] | Text | tuple[Text, ...],
    one_of(
        '"auto", the name of a variable in the file, or a list of labels such as ["n6.x", "n6.y"]'
    ),
]


class Row(Part):
    """A row of an element block. Every element has a `group`, absent or not."""

    id: ElementId
    if TYPE_CHECKING:
        group: Text | None = None

    def get(self, key: str, default: Any = None) -> Any:
        """The value of a key, ``default`` where rows of this type have no such key."""
        return getattr(self, key) if key in type(self).model_fields else default

    @property
    def directions(self) -> tuple[DofKind, ...]:
        """The DOF kinds that `dof` and `dofs` name."""
        dof, dofs = self.get("dof"), self.get("dofs")
        return dofs if dofs is not None else (dof,) if dof is not None else ()


class Block(Part):
    """Rows of one element type."""

    if TYPE_CHECKING:

        @property
        def type(self) -> str: ...  # noqa: D102
        @property
        def rows(self) -> tuple[Any, ...]: ...  # noqa: D102

    def get(self, key: str) -> Any:
        """The value of a key; None where blocks of this type have no such key."""
        return getattr(self, key) if key in type(self).model_fields else None

    def drawn(self) -> list[tuple[int, tuple[int, ...]]]:
        """What a figure shows: element number and nodes, of a solid the corners of each face that
        it has for itself in the block."""
        rows = [(row.id, row.get("nodes")) for row in self.rows if row.get("nodes")]
        faces = text_of(self).faces
        if not faces:
            return rows
        found = [(i, tuple(nodes[k] for k in face)) for i, nodes in rows for face in faces]
        count = Counter(frozenset(nodes) for _, nodes in found)
        return [(i, nodes) for i, nodes in found if count[frozenset(nodes)] == 1]


Lacking = tuple[str, str] | None
"""What is wrong, and the remedy."""


def _nothing(block: Any, active: tuple[str, ...]) -> Lacking:
    return None


@dataclass(frozen=True)
class ElementText:
    """What the text needs to know of an element type.

    ``block`` is the model of its blocks, ``changes`` what a parameter may change, ``units`` those
    of properties that no other element has. ``outline`` is "line" where the nodes of an element
    must be different points, "rectangle" where they go around one, "surface" where they go around
    a triangle or quadrilateral in space, "solid" where they enclose a volume; ``joins`` is whether
    it joins nodes to the structure. ``sections`` gives, for each shape of section that it may have,
    the keys that the section needs (one of each tuple). ``lacking(block, active DOF kinds)`` says
    what keeps the elements from moving as they must. ``divide`` gives their natural subdivision,
    ``flaw(points of the nodes)`` what is wrong with an outline, ``faces`` the corners of each face
    of a solid. ``law(kind, properties)`` gives the `Laws` of a nonlinear element, which has no part
    in the matrices; None: it is linear. ``exact(kind)`` gives the `fe.elements.base.Exact` of one
    whose dynamic stiffness is no polynomial of the frequency; None: its matrices are all it has.
    """

    block: type[Block]
    changes: tuple[str, ...]
    units: Mapping[str, str] = field(default_factory=dict)
    outline: Literal["", "line", "rectangle", "surface", "solid"] = ""
    joins: bool = True
    sections: Mapping[str, tuple[tuple[str, ...], ...]] = field(default_factory=dict)
    lacking: Callable[[Any, tuple[str, ...]], Lacking] = _nothing
    divide: Divide = undivided
    flaw: Inspect = sound
    faces: tuple[tuple[int, ...], ...] = ()
    law: Callable[[Any, Mapping[str, Any]], Any] | None = None
    exact: Callable[[Any], Any] | None = None


def text_of(block: Block) -> ElementText:
    """What the type of a block says of itself."""
    return cast(ElementText, ELEMENTS.named(block.type).text)


def row_model(block: type[Block]) -> type[Row]:
    """The model of the rows of a block."""
    (row, _) = block.model_fields["rows"].annotation.__args__  # type: ignore[union-attr]
    return cast("type[Row]", row)


def inherited(kind: str) -> tuple[str, ...]:
    """Keys of a block of that type that count for its rows; none for an unknown type."""
    if kind not in ELEMENTS.names():
        return ()
    block = ELEMENTS.named(kind).text.block
    return tuple(key for key in block.model_fields if key in row_model(block).model_fields)


def from_files(kind: object) -> bool:
    """Whether the rows of a type take their matrices from files."""
    return kind in ELEMENTS.names() and "file" in inherited(str(kind))


class LineRow(Row):
    """A rod or beam between two nodes."""

    nodes: TwoNodes = Field(description="[i, j]; local x runs from i to j")
    material: Text = Field(description="name of a material")
    section: Text = Field(description="name of a section")
    group: Group = None
    orientation: Vector | None = Field(
        default=None,
        description="direction [x, y, z] towards local z, in the local x–z plane; absent: global "
        "z, or global −x for an element along z. A beam2d takes no notice of it",
    )
    N: float = Field(default=0.0, description="axial preload of a beam, tension positive [N]")
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None


class LineKeys(Block):
    """What blocks of elements between two nodes have in common."""

    type: str
    rows: Annotated[tuple[LineRow, ...], Table()] = Field(min_length=1, description="the elements")
    rotary_inertia: bool = Field(default=True, description="whether sections resist turning")
    polar_inertia: Literal["Iy+Iz", "J"] = Field(
        default="Iy+Iz", description="what turns about the axis: rho (Iy + Iz), or rho J (8.14)"
    )
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    orientation: Vector | None = Field(default=None, description="for every row without its own")
    group: Group = None


class LineBlock(LineKeys):
    """Rods and beams: ``rod`` axial only, ``beam2d`` in a plane, ``beam3d`` in space
    (Euler–Bernoulli; Timoshenko where the section has `kappa`)."""

    type: Literal["rod", "beam2d", "beam3d"]
    mass: MassKind = "consistent"


class PlateRow(Row):
    """A rectangular plate element in the x–y plane."""

    nodes: FourNodes = Field(
        description="four corners, counter-clockwise seen from +z; "
        "local x runs from first to second"
    )
    material: Text = Field(description="name of a material")
    section: Text = Field(description="name of a section of shape plate")
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None
    group: Group = None


class PlateBlock(Block):
    """Rectangular plates in bending."""

    type: Literal["plate"]
    rows: Annotated[tuple[PlateRow, ...], Table()] = Field(min_length=1, description="the elements")
    mass: MassKind = "consistent"
    material: Text | None = Field(default=None, description="for every row without its own")
    section: Text | None = Field(default=None, description="for every row without its own")
    group: Group = None


class MatrixRow(Row):
    """One element or group matrix from another finite-element program.

    A value with the ending of a matrix file is itself a file: ``.mtx`` (Matrix Market, Abaqus),
    ``.npz`` (``scipy.sparse.save_npz``), ``.sti``, ``.mas`` (CalculiX, ``.dof`` beside), ``.pch``,
    ``.dmig``, ``.op4`` (Nastran), ``.hb``, ``.rsa``, ``.rua`` (Harwell–Boeing: Ansys, ``.mapping``
    beside). Anything else is the name of a variable in ``file``.
    """

    stiffness: Text | None = Field(
        default=None, description="stiffness matrix: variable in the file, or a matrix file"
    )
    mass: Text | None = Field(default=None, description="mass matrix, likewise")
    damping: Text | None = Field(default=None, description="viscous damping matrix, likewise")
    structural: Text | None = Field(
        default=None, description="structural (hysteretic) damping matrix, likewise"
    )
    file: Path | None = Field(default=None, description=".mat, .npz, .op4, .pch file of variables")
    dataset: Text | None = Field(
        default=None, description="data set under CVXUPDATE_DATA that holds the file"
    )
    labels: Labels = Field(
        default="auto",
        description='DOF labels of the rows of the matrix; "auto": those of the file where it has '
        "any, else row i is n<i>.x",
    )
    stiffness_factor: StiffnessFactor = 1.0
    mass_factor: MassFactor = 1.0
    damping_factor: DampingFactor = 1.0
    eta: Loss = None
    group: Group = None


class MatrixBlock(Block):
    """Matrices from another program: K = Σ (1 + p_i) K_i, a row for each K_i, M_i, C_i, D_i."""

    type: Literal["matrix"]
    rows: Annotated[tuple[MatrixRow, ...], Table()] = Field(
        min_length=1, description="the matrices"
    )
    file: Path | None = Field(default=None, description="for every row without its own")
    dataset: Text | None = Field(default=None, description="for every row without its own")
    labels: Labels | None = Field(default=None, description="for every row without its own")
    group: Group = None


def translation_lacking(block: Block, active: tuple[str, ...]) -> Lacking:
    """What keeps an element that needs a translation from moving."""
    if {"x", "y", "z"}.intersection(active):
        return None
    says = f"{block.type} elements need a translation, and none is active."
    return says, "Add x, y or z to model.dofs."


EXCLUSIVE = {"dof": "dofs", "dofs": "dof", "dataset": "file", "file": "dataset"}
"""A row that gives the value does not inherit the key."""

MATRICES = ("stiffness", "mass", "damping", "structural")
"""Keys of a matrix row that name matrices."""
OWN_LABELS = (".mtx", ".sti", ".mas", ".pch", ".dmig", ".hb", ".rsa", ".rua")
"""Endings of files that may know the DOFs of their rows."""
MATRIX_FILES = (".npz", ".op4", *OWN_LABELS)
"""Endings that make such a name a file of its own."""

ELASTIC = ("stiffness", "damping", "eta", "beta", "E")
INERTIAL = ("mass", "alpha", "rho")
SIZES = ("A", "height", "width", "diameter", "wall")
BENDING = (*ELASTIC, *INERTIAL, "nu", "G", *SIZES, "I", "Iy", "Iz", "J", "N", "kappa")
