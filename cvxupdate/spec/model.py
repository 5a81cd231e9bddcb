"""The [model] table: nodes, materials, sections, element blocks, supports, damping."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.keys import Dofs, Id, NonNegative, Part, Positive, Table, Text, one_of
from cvxupdate.spec.elements import Block
from cvxupdate.spec.generic import Member


class Node(Part):
    """A point of the model."""

    id: Id = Field(description="node number, unique")
    x: float = Field(description="coordinate [m]")
    y: float = Field(default=0.0, description="coordinate [m]")
    z: float = Field(default=0.0, description="coordinate [m]")


class Material(Part):
    """A linear elastic, isotropic material."""

    E: Positive = Field(description="Young's modulus [Pa]")
    nu: Annotated[float, Field(gt=-1.0, le=0.5)] = Field(default=0.3, description="Poisson's ratio")
    rho: NonNegative = Field(default=0.0, description="density [kg/m³]")
    G: Positive | None = Field(
        default=None,
        description="shear modulus [Pa]; absent: E / (2 (1 + nu)). Of rods and beams it is then "
        "independent of E",
    )
    eta: NonNegative | None = Field(
        default=None, description="loss factor; absent: that of [model.damping]"
    )


Kappa = Annotated[
    Positive | None,
    Field(
        description="shear coefficient; given, beams and shells deform in shear too (Timoshenko, "
        "Reissner–Mindlin); absent: Euler–Bernoulli, Kirchhoff"
    ),
]


class Rectangle(Part):
    """A solid rectangle."""

    shape: Literal["rectangle"]
    width: Positive = Field(description="along local y [m]")
    height: Positive = Field(description="along local z [m]")
    kappa: Kappa = None


class Circle(Part):
    """A round bar, or a tube when ``wall`` is given."""

    shape: Literal["circle"]
    diameter: Positive = Field(description="outer diameter [m]")
    wall: Positive | None = Field(default=None, description="wall thickness [m]; absent: solid")
    kappa: Kappa = None


class PlateSection(Part):
    """A plate; the factors multiply the isotropic bending rigidities (1 = isotropic), and the
    membrane ones of a shell, whose sheet is one material through its thickness."""

    shape: Literal["plate"]
    thickness: Positive = Field(description="thickness [m]")
    Dx: Positive = Field(default=1.0, description="factor on the bending rigidity along local x")
    Dy: Positive = Field(default=1.0, description="factor on the bending rigidity along local y")
    D1: NonNegative = Field(default=1.0, description="factor on the coupling rigidity")
    Dxy: Positive = Field(default=1.0, description="factor on the twisting rigidity")
    kappa: Kappa = None


class General(Part):
    """A cross-section by its properties."""

    shape: Literal["general"]
    A: Positive = Field(description="area [m²]")
    Iy: Positive | None = Field(
        default=None, description="second moment about local y (bending in local z) [m⁴]"
    )
    Iz: Positive | None = Field(
        default=None, description="second moment about local z (bending in local y) [m⁴]"
    )
    J: Positive | None = Field(default=None, description="torsion constant [m⁴]")
    kappa: Kappa = None


Section = Annotated[Rectangle | Circle | PlateSection | General, Field(discriminator="shape")]


class Support(Part):
    """DOFs held at zero; kinds that are not active in the model are held anyway."""

    nodes: Annotated[
        Literal["all"] | Annotated[tuple[Id, ...], Field(min_length=1)],
        one_of('"all", or a list of node numbers'),
    ] = Field(description='node numbers, or "all"')
    dofs: Dofs = Field(description="DOF kinds held")


class Tie(Part):
    """Nodes at one point that share some of their DOFs, as where a joint gives way: the others are
    joined by springs."""

    nodes: Annotated[tuple[Id, ...], Field(min_length=2)] = Field(
        description="the DOFs are those of the first node"
    )
    dofs: Dofs = Field(description="DOF kinds shared")


class Base(Part):
    """Nodes that a table, a fixture or the ground moves along one direction as one: its motion is
    the input."""

    nodes: Annotated[tuple[Id, ...], Field(min_length=1)] = Field(
        description="the nodes that stand on it; no support holds them along `dof`"
    )
    dof: Literal["x", "y", "z"] = Field(description="the direction in which it moves")
    mass: Positive | None = Field(
        default=None,
        description="mass that stands for what moves it [kg]; absent: 1e7 times the structure's, "
        "up to the next power of ten, so that the structure does not move its base",
    )


class StructuralDamping(Part):
    """Structural (hysteretic) damping, D = eta K."""

    kind: Literal["structural"]
    eta: NonNegative = Field(description="loss factor")


class RayleighDamping(Part):
    """Proportional viscous damping, C = alpha M + beta K."""

    kind: Literal["rayleigh"]
    alpha: NonNegative = Field(default=0.0, description="factor on the mass matrix [1/s]")
    beta: NonNegative = Field(default=0.0, description="factor on the stiffness matrix [s]")


class ModalDamping(Part):
    """Modal damping, as fractions of critical; viscous but for its hysteretic share."""

    kind: Literal["modal"]
    zeta: Annotated[
        NonNegative | Annotated[tuple[NonNegative, ...], Field(min_length=1)],
        one_of(
            "a number ≥ 0, or a list of them from the lowest flexible mode on (the last "
            "counts for the rest)"
        ),
    ] = Field(
        description="fraction of critical: one for all, or a list from the lowest flexible mode on"
    )
    alpha: NonNegative = Field(
        default=0.0,
        description="beside it, a factor on the mass matrix: the same decay rate alpha "
        "/ 2 for every mode [1/s]",
    )
    hysteretic: float = Field(
        default=0.0,
        ge=0.0,
        le=1.0,
        description="share of the loss that is hysteretic: 0 goes with velocity, 1 is a loss "
        "factor 2 zeta of each mode; at a resonance both are alike (frequency responses; in time "
        "all is viscous)",
    )


Damping = Annotated[StructuralDamping | RayleighDamping | ModalDamping, Field(discriminator="kind")]


class Model(Part):
    """A finite-element model in text; after loading, ``include`` is None and what it named is in
    place."""

    include: Text | None = Field(
        default=None, description="a file with a [model] that this one adds to (see below)"
    )
    dofs: Dofs = Field(description="the active DOF kinds")
    nodes: Annotated[tuple[Node, ...], Table()] = Field(
        default=(), description="the nodes; may be left out when a matrix block brings the DOFs"
    )
    materials: dict[str, Material] = Field(default={}, description="by name")
    sections: dict[str, Section] = Field(default={}, description="by name")
    elements: tuple[Block, ...] = Field(min_length=1, description="the blocks")
    supports: tuple[Support, ...] = Field(default=(), description="absent: free")
    ties: tuple[Tie, ...] = Field(default=(), description="nodes that share DOFs")
    refine: Literal[4, 8, 16] | None = Field(
        default=None,
        description="parts of each edge of a rod, beam or plate whose matrices, reduced to the "
        "DOFs of its nodes and a few inner ones, take the place of its own (plan keeps them); 8 "
        "is fine for most; absent: the elements as they are",
    )
    solid: bool | Literal["sheared", "turning"] = Field(
        default=False,
        description="with `refine`: plates with what the theory of thin plates leaves out of a "
        "solid sheet, to first order in its thickness, as `diagnose` takes them: rotary inertia "
        "(`turning`), shear and free rims (`sheared`), or both",
    )
    families: tuple[Member, ...] = Field(
        default=(), description="elements whose matrices are other members of their family"
    )
    bases: tuple[Base, ...] = Field(
        default=(),
        description="what moves the structure; absent: the supports where a motion is imposed",
    )
    damping: Damping | None = Field(default=None, description="absent: undamped")
