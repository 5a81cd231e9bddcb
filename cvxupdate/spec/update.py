"""What is to be done: [update], [constraints], [regularisation], [solver], [diagnose]."""

from __future__ import annotations

from typing import TYPE_CHECKING, Annotated, Any, Literal, Protocol

from pydantic import BeforeValidator, Field

from cvxupdate.keys import (
    Count,
    NonNegative,
    OneOf,
    Part,
    Positive,
    Table,
    one_of,
)
from cvxupdate.registry import REGULARISERS
from cvxupdate.spec.update_parameters import ParameterRow
from cvxupdate.spec.whole import DIRECT, EXPANSIONS, Whole

NonNegativeCount = Annotated[int, Field(ge=0)]
SOLVERS = ("CLARABEL", "OSQP", "SCS", "PIQP", "PROXQP", "DAQP", "QUADPROG", "HIGHS")
SOLUTIONS = (
    "convex",
    "minimum-norm",
    "truncated-svd",
    "tikhonov",
    "total-least-squares",
    "entropy",
    "landweber",
    "conjugate-gradients",
)
"""How linearised equations may be solved."""
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
    "flexible_support",
    "sensor_mass",
    "sensor_fault",
)
"""The effects that the contract names, those that are not implemented included."""


class Update(Part):
    """What ``run`` does."""

    method: Literal[
        "frequencies", "sensitivity", "minimum-variance", "modal-dynamic", "rfm", "ceam", "direct"
    ] = Field(description="the method")
    direct: Literal[DIRECT] = Field(  # type: ignore[valid-type]
        default="baruch",
        description="direct: the closed-form method (thesis 2.7) whose matrices are the result; "
        "all the others are shown beside it, and the constrained convex update, which alone knows "
        "the parameters, constraints and penalties of the file",
    )
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
    solution: Literal[SOLUTIONS] = Field(  # type: ignore[valid-type]
        default="convex",
        description="frequencies, sensitivity, rfm: how linearised equations are solved: convex; "
        "minimum-norm, of the convex steps that fit equally well the shortest (2.101); or a "
        "classical solution (thesis 2.9, chapter 4), which keeps no bounds or clauses",
    )
    level: Count | None = Field(
        default=None,
        description="terms of truncated-svd, rank of total-least-squares, iterations of landweber "
        "and conjugate-gradients; absent: by Picard's condition, or where the residual has come "
        "down to the noise",
    )
    alpha: Positive | None = Field(
        default=None,
        description="weight of tikhonov and entropy; absent: the corner of the L-curve",
    )
    max_iterations: Count = Field(default=30, description="iterations of the loop at most")
    tolerance: Positive = Field(
        default=1e-6, description="relative decrease of the objective at which the loop ends"
    )
    pairing: Literal["auto", "mac", "frequency", "fixed", "misfit"] = Field(
        default="auto",
        description="how measured modes find the model's; auto: as fixed by `mode`, else MAC, else "
        "frequency; misfit: as auto at first, then anew at every point, by the least misfit",
    )
    shape_residual: Literal["scale", "difference", "mac"] = Field(
        default="scale",
        description="sensitivity: how shapes are compared: entries after the modal scale factor "
        "(2.3), entries normalised as measured, or (1 - sqrt MAC)/sqrt MAC",
    )
    shape_weight: Positive = Field(
        default=1.0, description="sensitivity: factor on the weights of the shapes"
    )
    begin_with: Literal["all", "shapes", "low"] = Field(
        default="all",
        description="finds the way from far-off starts: shapes fits the shapes alone at first "
        "(sensitivity), low the lowest lines, then two more at a time (rfm)",
    )
    release_bounds: bool = Field(
        default=False,
        description="frequencies, sensitivity: release the parameters that ended on a bound, and "
        "go on where that leads lower; where the fit crawls, begin again halfway to the initial "
        "model",
    )
    starts: NonNegativeCount = Field(
        default=0,
        description="further starts, uniformly random inside the bounds; the best end counts, and "
        "the minima that were found are reported",
    )
    seed: NonNegativeCount = Field(default=0, description="of the random starts")
    refine: Literal[4, 8, 16] | None = Field(
        default=None,
        description="parts of each edge of a rod, beam or plate whose matrices, reduced to the "
        "DOFs of its nodes and a few inner ones, take the place of its own; 8 is fine for most; "
        "absent: as [model] says. Not with ceam, which updates the file's own matrices",
    )
    estimates: Literal["correlated", "independent"] = Field(
        default="correlated",
        description="minimum-variance: whether an iteration knows that the parameters came from "
        "the same measurements (Friswell), or takes both for independent (Collins), which counts "
        "the measurements once more at every iteration",
    )
    trust_radius: Positive | None = Field(
        default=None, description="first trust-region radius; absent: chosen"
    )
    form: Literal["additive", "multiplicative", "bounded"] = Field(
        default="additive",
        description="multiplicative: the trust region is a share of each parameter's "
        "present factor 1 + p, so that none changes its sign; bounded: of the distance between its "
        "bounds. With a classical solution, which has no trust region: multiplicative solves for "
        "changes of the present factors, 1 + p = Π (1 + Δp) (3.50, 3.51), others for all of p",
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
    residual: Literal[
        "auto",
        "force-balance",
        "flexibility",
        "receptance",
        "instrumental",
        "filter",
        "filled",
        "modal-balance",
    ] = Field(
        default="auto",
        description="rfm: force balance (3.9, 3.16), weighted by the dynamic "
        "flexibility (3.37), both with weights taken anew at the solution, "
        "or output error (3.30); instrumental: the balance against the model's own responses, "
        "unbiased by noise in them (2.8.4); filter: the same line by line (Mottershead); filled: "
        "the model's receptances where none were measured (Lin and Ewins); modal-balance: reduced "
        "to the model's modes (Friswell and Penny); auto: flexibility, then output error",
    )
    reweight: Literal["converged", "step"] = Field(
        default="converged",
        description="rfm, flexibility: whether the weights are taken anew where a loop on the last "
        "has converged, or at every step, until one lowers the output error by less than "
        "`tolerance` of it: fewer steps where the model keeps an error of its own",
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
    expansion: Literal[EXPANSIONS] = Field(  # type: ignore[valid-type]
        default="null-space",
        description="ceam, direct: how DOFs that were not measured are found; null-space, "
        "dynamic, its series kidder and petersmann (2.54 to 2.56), and gysin are repeated by ceam "
        "as the model improves",
    )
    self_assign: NonNegativeCount = Field(
        default=0,
        description="ceam: number of the model's own modes above the "
        "measured ones to be kept as well",
    )
    stages: Literal[1, 2] = Field(
        default=1, description="ceam: 2 assigns the eigenvalues with the model's own shapes first"
    )


class TrustRegion(Part):
    """A limit on the step of one iteration."""

    radius: Positive = Field(description="largest ‖Δp‖")


class Limits(Protocol):
    """What [constraints] bounds says."""

    @property
    def lower(self) -> float | None: ...  # noqa: D102
    @property
    def upper(self) -> float | None: ...  # noqa: D102


class Constraints(Part):
    """The clauses of the convex step; absent means absent."""

    # `grammar` adds the keys of every registered constraint; these two are read by other rooms.
    if TYPE_CHECKING:
        bounds: Limits | None = None
        trust_region: TrustRegion | None = None

        def __getattr__(self, key: str) -> Any: ...


class Regulariser(Part):
    """A penalty on p."""

    # `grammar` adds the keys of every registered regulariser.
    kind: Annotated[str, OneOf(lambda: ("none", *REGULARISERS.names()))] = Field(
        description="the penalty"
    )
    weight: Annotated[
        NonNegative | Literal["l-curve", "gcv", "discrepancy"],
        one_of('a number ≥ 0, or one of "l-curve", "gcv", "discrepancy"'),
    ] = Field(
        default="l-curve",
        description='a number, "l-curve", "gcv" or "discrepancy"; absent in a prior: 1',
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
