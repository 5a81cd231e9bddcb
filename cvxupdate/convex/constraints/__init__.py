"""Constraints of the convex step, one small file each; each gives named clauses."""

from .bounds import Bounds
from .clauses import Clause, ConicClause, Constraint, LinearClause
from .linear import LinearEquality, LinearInequality
from .norm_at_most import NormAtMost
from .tied import Tied
from .total_mass import TotalMass

CONSTRAINTS = (Bounds, Tied, LinearEquality, LinearInequality, TotalMass, NormAtMost)

__all__ = [
    "CONSTRAINTS",
    "Bounds",
    "Clause",
    "ConicClause",
    "Constraint",
    "LinearClause",
    "LinearEquality",
    "LinearInequality",
    "NormAtMost",
    "Tied",
    "TotalMass",
]
