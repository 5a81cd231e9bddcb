"""Text in: a problem file becomes a typed, validated `Spec`, or a list of faults."""

from cvxupdate.spec.given import Given, spec_of
from cvxupdate.spec.grammar import ProblemFile, Spec
from cvxupdate.spec.parameters import Target, expand_parameters, members_of
from cvxupdate.spec.problem import (
    check_problem,
    check_text,
    load_problem,
    name_of,
    read_text,
    schema,
)

__all__ = [
    "Given",
    "ProblemFile",
    "Spec",
    "Target",
    "check_problem",
    "check_text",
    "expand_parameters",
    "load_problem",
    "members_of",
    "name_of",
    "read_text",
    "schema",
    "spec_of",
]
