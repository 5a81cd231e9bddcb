"""Text in: a problem file becomes a typed, validated `Spec`, or a list of faults."""

from cvxupdate.spec.grammar import ProblemFile, Spec
from cvxupdate.spec.parameters import Target, expand_parameters
from cvxupdate.spec.problem import check_problem, load_problem, schema

__all__ = [
    "ProblemFile",
    "Spec",
    "Target",
    "check_problem",
    "expand_parameters",
    "load_problem",
    "schema",
]
