"""What is to be done: [update], [constraints], [regularisation], [solver], [diagnose]."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import BeforeValidator, Field

from cvxupdate.spec.base import Count, Id, NonNegative, Part, Positive, Table, Text, Vector, one_of

Of = Literal[
    "stiffness",
    "mass",
    "damping",
    "E",
    "nu",
    "rho",
    "A",
    "I",
    "Iy",
    "Iz",
    "J",
    "Ixx",
    "Iyy",
    "Izz",
    "thickness",
    "height",
    "width",
    "diameter",
    "wall",
    "Dx",
    "Dy",
    "D1",
    "Dxy",
    "k",
    "m",
    "c",
    "eta",
    "alpha",
    "beta",
    "Ip",
    "omega",
    "N",
    "kappa",
]
NonNegativeCount = Annotated[int, Field(ge=0)]
Names = Annotated[tuple[Text, ...], Field(min_length=1)]
SOLVERS = ("CLARABEL", "OSQP", "SCS", "PIQP", "PROXQP", "DAQP", "QUADPROG", "HIGHS")
PHYSICS = (
    "stiffness_change",
    "mass_change",
    "thickness_change",
    "orthotropy",
    "added_mass",
    "grounding_spring",
    "joint_flexibility",
    "shear_deformation",
    "axial_preload",
    "gyroscopic",
    "attached_resonator",
    "viscous_damper",
    "structural_damping",
    "mass_proportional_damping",
    "cubic_stiffness",
    "clearance",
    "dry_friction",
    "hysteresis",
    "quadratic_damping",
    "sensor_fault",
    "sensor_mass",
)
"""The physics words of the contract."""


class ParameterRow(Part):
    """One parameter, or one for each element or group: what it acts on, and the property it
    changes.

    Exactly one of ``elements``, ``group``, ``groups``, ``material`` (none for the damping of the
    whole model).
    """

    of: Of = Field(description="the property it changes")
    elements: (
        Annotated[
            Literal["all"] | Annotated[tuple[Id, ...], Field(min_length=1)],
            one_of('"all", or a list of element numbers'),
        ]
        | None
    ) = Field(default=None, description='element numbers, or "all" that have the property')
    group: Text | None = Field(default=None, description="a group")
    groups: Names | None = Field(default=None, description="several groups")
    material: Text | None = Field(default=None, description="all elements of a material")
    each: Literal["element", "group"] | None = Field(
        default=None,
        description="a parameter for each element or each group; "
        "absent: one for all (a macro element)",
    )
    name: Text | None = Field(default=None, description="name in results and constraints")
    lower: float | None = Field(default=None, description="lower bound of the relative change p")
    upper: float | None = Field(default=None, description="upper bound of the relative change p")
    scale: Positive | None = Field(
        default=None,
        description="size of one unit of p in the unit of the "
        "property, where the nominal value is 0",
    )


class Whole(Part):
    """Whole symmetric matrices: every entry on a pattern is a parameter. Entry (i, j) of A moves by
    p √(A_ii A_jj)."""

    matrices: Annotated[tuple[Literal["K", "M", "C", "D"], ...], Field(min_length=1)] = Field(
        description="the matrices"
    )
    pattern: Literal["model", "nodes", "all"] = Field(
        default="model",
        description="entries that may change: those that are not 0 in the model, those "
        "between DOFs of nodes that share an element, or every one",
    )
    symmetric: bool = Field(
        default=True,
        description="false: (i, j) and (j, i) are two parameters, "
        "held equal by the clause `symmetry`",
    )
    lower: float | None = Field(default=None, description="lower bound of every p")
    upper: float | None = Field(default=None, description="upper bound of every p")


class Update(Part):
    """What ``run`` does."""

    method: Literal["frequencies", "sensitivity", "rfm", "ceam"] = Field(description="the method")
    parameters: Annotated[tuple[ParameterRow, ...], Table()] = Field(
        default=(), description="the parameters; none are needed beside `whole`"
    )
    whole: Whole | None = Field(
        default=None,
        description="ceam: whole matrices on a sparsity pattern; the names are like K[n1.x, n2.x]",
    )
    loss: Literal["least-squares", "l1", "huber", "norm"] = Field(
        default="least-squares",
        description="measure of the residual; norm (not squared) beside the penalty "
        "robust is worst-case least squares",
    )
    max_iterations: Count = Field(default=30, description="iterations of the loop at most")
    tolerance: Positive = Field(
        default=1e-6, description="relative decrease of the objective at which the loop ends"
    )
    pairing: Literal["auto", "mac", "frequency", "fixed"] = Field(
        default="auto",
        description="how measured modes find the model's; auto: as fixed by `mode`, else MAC, else "
        "frequency",
    )
    trust_radius: Positive | None = Field(
        default=None, description="first trust-region radius; absent: chosen"
    )
    form: Literal["additive", "multiplicative"] = Field(
        default="additive",
        description="multiplicative: the trust region is a share of each parameter's "
        "present factor 1 + p (3.50), so that none changes its sign",
    )
    line_search: bool = Field(
        default=False,
        description="search along a step that gains less than a quarter of what it promised (3.52)",
    )
    second_order: bool = Field(
        default=False,
        description="second-order terms along each step: fewer iterations, each with a "
        "second convex step and evaluation",
    )
    residual: Literal["auto", "force-balance", "flexibility", "receptance"] = Field(
        default="auto",
        description="rfm: force balance (3.9, 3.16), weighted by the dynamic "
        "flexibility (3.37), both with weights taken anew at the solution, "
        "or output error (3.30); auto: flexibility, then output error",
    )
    frequency_points: Annotated[
        Literal["between", "best", "log-function", "all"]
        | Annotated[tuple[Positive, ...], Field(min_length=1)],
        one_of('"between", "best", "log-function", "all", or a list of frequencies [Hz]'),
    ] = Field(
        default="between",
        description="rfm: lines that are fitted: between resonances (3.5.5); best, "
        "those that tell most of the parameters; log-function, where the "
        "data may be least accurate (5.32); all; or those nearest to a list",
    )
    points: Count | None = Field(
        default=None,
        description="rfm: how many lines of each recording; absent: "
        "enough for the modes and parameters",
    )
    basis: Literal["full", "reduced"] = Field(
        default="full",
        description="rfm: reduced fits the output error on modes and static residual "
        "vectors, for large models",
    )
    noise: Positive | None = Field(
        default=None,
        description="rfm: relative standard deviation of the FRFs; absent: what the recordings say",
    )
    expansion: Literal[
        "dynamic", "null-space", "guyan", "irs", "gysin", "serep", "serepa", "tam", "hybrid"
    ] = Field(
        default="null-space",
        description="ceam: how DOFs that were not measured are found; null-space, "
        "dynamic and gysin are repeated as the model improves",
    )
    self_assign: NonNegativeCount = Field(
        default=0,
        description="ceam: number of the model's own modes above the "
        "measured ones to be kept as well",
    )
    stages: Literal[1, 2] = Field(
        default=1, description="ceam: 2 assigns the eigenvalues with the model's own shapes first"
    )


class Bounds(Part):
    """Bounds on every p that has none of its own."""

    lower: float | None = Field(default=None, description="lowest p")
    upper: float | None = Field(default=None, description="highest p")


class Tied(Part):
    """Parameters that share one value."""

    parameters: Annotated[tuple[Text, ...], Field(min_length=2)] = Field(
        description="names of at least two parameters"
    )


class Linear(Part):
    """A linear clause, Σ a_i p_i = or ≤ or ≥ a number."""

    coefficients: Annotated[dict[str, float], Field(min_length=1)] = Field(
        description="a_i by name of the parameter"
    )
    equals: float | None = Field(default=None, description="right-hand side")
    at_most: float | None = Field(default=None, description="upper limit")
    at_least: float | None = Field(default=None, description="lower limit")


class TotalMass(Part):
    """The mass of the whole structure, conserved or set."""

    conserve: bool | None = Field(default=None, description="keep the initial mass")
    value: Positive | None = Field(default=None, description="weighed mass [kg]")


class MassPositive(Part):
    """The mass stays positive: of every element, of the assembled matrix (a linear matrix
    inequality), or both."""

    elements: bool = Field(default=True, description="every mass p-value stays above -1")
    matrix: bool = Field(
        default=False, description="the assembled mass matrix stays positive definite"
    )
    floor: NonNegative = Field(
        default=1e-3,
        description="smallest eigenvalue, of the matrix scaled to a unit diagonal; "
        "smallest 1 + p of an element",
    )


class StiffnessPositive(Part):
    """The stiffness stays positive semidefinite, and rigid-body modes stay free."""

    matrix: bool = Field(
        default=True, description="the assembled stiffness matrix stays positive semidefinite"
    )
    rigid_modes: bool = Field(default=True, description="what moved freely still does: K Phi_R = 0")
    floor: NonNegative = Field(
        default=0.0,
        description="smallest eigenvalue beside rigid-body modes, of "
        "the matrix scaled to a unit diagonal",
    )


class Inertia(Part):
    """Mass properties of the whole structure as a rigid body; what is not given is kept, or left
    free with `conserve = false`."""

    conserve: bool = Field(default=True, description="keep what is not given below")
    mass: Positive | None = Field(default=None, description="weighed mass [kg]")
    centre: Vector | None = Field(default=None, description="centre of gravity [m]")
    moments: Vector | None = Field(
        default=None,
        description="moments of inertia Ixx, Iyy, Izz about the centre of gravity [kg m^2]",
    )


class ModeClause(Part):
    """A measured mode that the updated model must reproduce, shape included."""

    mode: Count = Field(description="number of the row among the fitted modes (1 = first)")
    within: Positive | None = Field(
        default=None, description="r.m.s. in its standard deviations; absent: exactly"
    )


class Mirror(Part):
    """A plane of symmetry: parameters of elements that are mirror images share one value."""

    plane: Literal["x", "y", "z"] = Field(description="the axis that the plane is normal to")
    at: float = Field(default=0.0, description="where the plane cuts it [m]")


class TiedGroups(Part):
    """Element groups that share one value."""

    groups: Names = Field(description="element groups")
    of: Of = Field(description="the property of the parameters to be tied")


class Budget(Part):
    """A budget on the whole change."""

    at_most: NonNegative = Field(description="largest norm of p")
    norm: Literal["l1", "l2"] = Field(
        default="l2", description="l2: root of the sum of squares; l1: sum of absolute values"
    )


class Smoothness(Part):
    """Parameters of elements that share a node differ little."""

    at_most: NonNegative = Field(description="largest difference of neighbours")


class Symmetry(Part):
    """Matrices stay symmetric: entries (i, j) and (j, i) of `update.whole` are equal. Elements are
    symmetric by themselves."""


class Connectivity(Part):
    """No element appears that was not there: entries and properties that are 0 in the model stay
    0."""


class TrustRegion(Part):
    """A limit on the step of one iteration."""

    radius: Positive = Field(description="largest ‖Δp‖")


class Constraints(Part):
    """The clauses of the convex step; absent means absent."""

    bounds: Bounds | None = Field(default=None, description="bounds on every p")
    tied: tuple[Tied, ...] = Field(default=(), description="tied parameters")
    linear: tuple[Linear, ...] = Field(default=(), description="linear clauses")
    total_mass: TotalMass | None = Field(default=None, description="total mass")
    mass_positive: MassPositive | None = Field(default=None, description="mass positive definite")
    stiffness_positive: StiffnessPositive | None = Field(
        default=None, description="stiffness positive semidefinite, rigid-body modes kept"
    )
    inertia: Inertia | None = Field(default=None, description="rigid-body mass properties")
    modes: tuple[ModeClause, ...] = Field(default=(), description="modes to be reproduced")
    mirror: tuple[Mirror, ...] = Field(default=(), description="planes of symmetry")
    tied_groups: tuple[TiedGroups, ...] = Field(default=(), description="tied element groups")
    symmetry: Symmetry | None = Field(default=None, description="matrices stay symmetric")
    connectivity: Connectivity | None = Field(default=None, description="zeros stay zero")
    budget: Budget | None = Field(default=None, description="budget on the change")
    smoothness: Smoothness | None = Field(default=None, description="smoothness along neighbours")
    trust_region: TrustRegion | None = Field(default=None, description="trust region")


class Regulariser(Part):
    """A penalty on p."""

    kind: Literal["none", "tikhonov", "l1", "group-l1", "total-variation", "entropy", "robust"] = (
        Field(description="the penalty")
    )
    weight: Annotated[
        NonNegative | Literal["l-curve", "gcv", "discrepancy"],
        one_of('a number ≥ 0, or one of "l-curve", "gcv", "discrepancy"'),
    ] = Field(default="l-curve", description='a number, "l-curve", "gcv" or "discrepancy"')
    groups: Annotated[tuple[Names, ...], Field(min_length=1)] | None = Field(
        default=None, description="group-l1: lists of parameter names; absent: by element group"
    )


SolverName = Annotated[
    Literal["CLARABEL", "OSQP", "SCS", "PIQP", "PROXQP", "DAQP", "QUADPROG", "HIGHS"],
    BeforeValidator(lambda v: v.upper() if isinstance(v, str) else v),
]


class Solver(Part):
    """The solver of the convex step."""

    name: SolverName = Field(default="CLARABEL", description="the solver, in any case")
    tolerance: Positive | None = Field(default=None, description="absent: the solver's own")
    max_iterations: Count | None = Field(default=None, description="absent: the solver's own")


class Diagnose(Part):
    """What ``diagnose`` may consider."""

    physics: tuple[Literal[PHYSICS], ...] | None = Field(  # type: ignore[valid-type]
        default=None, description="physics words; absent: everything the recordings can tell"
    )
    scatter: Annotated[float, Field(gt=0.0, le=1.0)] = Field(
        default=1.0,
        description="part of the usual scatter of groups (2 % stiffness, 1.2 % mass) "
        "that remains: below 1 for a model calibrated on this very "
        "structure",
    )
