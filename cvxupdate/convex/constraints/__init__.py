"""Constraints of the convex step, one small file each; each gives named clauses."""

from .bounds import Bounds
from .budget import Budget
from .clauses import Clause, ConicClause, Constraint, LinearClause
from .element_mass import ElementMass
from .equations import Equations
from .linear import LinearEquality, LinearInequality
from .matrix_inequality import MatrixInequality
from .norm_at_most import NormAtMost
from .pattern import Connectivity, Symmetric, entry_name
from .smooth import Smooth
from .tied import Tied
from .total_mass import TotalMass

CONSTRAINTS = (
    Bounds,
    Tied,
    LinearEquality,
    LinearInequality,
    TotalMass,
    NormAtMost,
    Equations,
    MatrixInequality,
    ElementMass,
    Budget,
    Smooth,
    Symmetric,
    Connectivity,
)

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
    "LinearClause",
    "LinearEquality",
    "LinearInequality",
    "MatrixInequality",
    "NormAtMost",
    "Smooth",
    "Symmetric",
    "Tied",
    "TotalMass",
    "entry_name",
]
