"""The convex step: losses, regularisers, constraints, solvers, certificates, conflicts.

The only room that knows cvxpy, Clarabel, OSQP, SCS and qpsolvers; they load on first use.
"""

from .certificate import Certificate, Farkas, certify, farkas
from .compare import SolverRow, compare_solvers, spread
from .conflict import Conflict, find_conflict
from .constraints import (
    CONSTRAINTS,
    Bounds,
    Budget,
    Clause,
    ConicClause,
    Connectivity,
    Constraint,
    ElementMass,
    Equations,
    Inertia,
    LinearClause,
    LinearEquality,
    LinearInequality,
    MassPositive,
    MatrixInequality,
    Mirror,
    NormAtMost,
    ReproducedMode,
    Smooth,
    StiffnessPositive,
    Symmetric,
    Tied,
    TiedGroups,
    TotalMass,
    entry_name,
)
from .context import Context, Key, MassLaw, ModeRows, RigidBody
from .losses import LOSSES, AbsoluteLoss, Huber, LeastSquares, Loss, Norm, loss_named
from .matrix_form import ConeProgram, Cones
from .problem import StepProblem
from .regularisers import (
    L1,
    REGULARISERS,
    RULES,
    Entropy,
    GroupL1,
    Regulariser,
    Robust,
    Tikhonov,
    TotalVariation,
    groups_by_carrier,
)
from .relaxation import Relaxation
from .smallest import smallest_eigenvalue
from .solve import solve_step
from .solvers import SolverChoice, available_solvers
from .step import CompiledStep, Step
from .weight import WeightChoice, choose_weight, with_chosen_weight

__all__ = [
    "CONSTRAINTS",
    "L1",
    "LOSSES",
    "REGULARISERS",
    "RULES",
    "AbsoluteLoss",
    "Bounds",
    "Budget",
    "Certificate",
    "Clause",
    "CompiledStep",
    "ConeProgram",
    "Cones",
    "Conflict",
    "ConicClause",
    "Connectivity",
    "Constraint",
    "Context",
    "ElementMass",
    "Entropy",
    "Equations",
    "Farkas",
    "GroupL1",
    "Huber",
    "Inertia",
    "Key",
    "LeastSquares",
    "LinearClause",
    "LinearEquality",
    "LinearInequality",
    "Loss",
    "MassLaw",
    "MassPositive",
    "MatrixInequality",
    "Mirror",
    "ModeRows",
    "Norm",
    "NormAtMost",
    "Regulariser",
    "Relaxation",
    "ReproducedMode",
    "RigidBody",
    "Robust",
    "Smooth",
    "SolverChoice",
    "SolverRow",
    "Step",
    "StepProblem",
    "StiffnessPositive",
    "Symmetric",
    "Tied",
    "TiedGroups",
    "Tikhonov",
    "TotalMass",
    "TotalVariation",
    "WeightChoice",
    "available_solvers",
    "certify",
    "choose_weight",
    "compare_solvers",
    "entry_name",
    "farkas",
    "find_conflict",
    "groups_by_carrier",
    "loss_named",
    "smallest_eigenvalue",
    "solve_step",
    "spread",
    "with_chosen_weight",
]
