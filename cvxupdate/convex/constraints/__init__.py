"""Constraints of the convex step, one small file each; each gives named clauses."""

from .bounds import Bounds
from .budget import Budget
from .clauses import Clause, ConicClause, Constraint, LinearClause
from .element_mass import ElementMass
from .equations import Equations
from .generic import Generic
from .inertia import Inertia
from .linear import LinearEquality, LinearInequality
from .mass_positive import MassPositive
from .matrix_inequality import MatrixInequality
from .mirror import Mirror
from .mode import ReproducedMode
from .norm_at_most import NormAtMost
from .pattern import Connectivity, Symmetric, entry_name
from .smooth import Smooth
from .stiffness_positive import StiffnessPositive
from .tied import Tied
from .tied_groups import TiedGroups
from .total_mass import TotalMass

CONSTRAINTS = (
    Bounds,
    Tied,
    LinearEquality,
    LinearInequality,
    TotalMass,
    MassPositive,
    StiffnessPositive,
    Inertia,
    ReproducedMode,
    Mirror,
    TiedGroups,
    Symmetric,
    Connectivity,
    Budget,
    Smooth,
    Generic,
    ElementMass,
    NormAtMost,
    Equations,
    MatrixInequality,
)
"""In the order of their keys in the problem file and of their clauses in the step; the last four
have no key, the others are made of them."""

__all__ = [
    "CONSTRAINTS",
    "Bounds",
    "Budget",
    "Clause",
    "ConicClause",
    "Connectivity",
    "Constraint",
    "ElementMass",
    "Equations",
    "Generic",
    "Inertia",
    "LinearClause",
    "LinearEquality",
    "LinearInequality",
    "MassPositive",
    "MatrixInequality",
    "Mirror",
    "NormAtMost",
    "ReproducedMode",
    "Smooth",
    "StiffnessPositive",
    "Symmetric",
    "Tied",
    "TiedGroups",
    "TotalMass",
    "entry_name",
]
