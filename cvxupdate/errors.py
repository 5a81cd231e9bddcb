"""The error tree of cvxupdate.

::

    CvxupdateError
    ├── InputError            what the user gave cannot be used (exit 2)
    │   ├── ProblemFileError  faults of a problem file, all of them at once
    │   ├── RecordingError    a recording cannot be read or does not fit the model
    │   └── ModelError        the model is not a structure (mechanism, negative mass, ...)
    ├── InfeasibleError       the clauses of a convex step cannot hold together (exit 3)
    └── ConvergenceError      an iteration stopped short of its tolerance (exit 3)

A message says where, what, and what to do next.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass


class CvxupdateError(Exception):
    """Base of every error that cvxupdate raises on purpose."""


class InputError(CvxupdateError):
    """What the user gave cannot be used; the command line ends with status 2."""


@dataclass(frozen=True)
class Fault:
    """One fault: the file, the key in it, what is wrong, and the remedy."""

    file: str
    key: str
    problem: str
    remedy: str

    def __str__(self) -> str:
        place = f"{self.file}: {self.key}" if self.key else self.file
        return f"{place}: {self.problem} {self.remedy}".rstrip()


class ProblemFileError(InputError):
    """A problem file, or something it names, has faults; ``faults`` lists every one."""

    def __init__(self, faults: Sequence[Fault]) -> None:
        self.faults = tuple(faults)
        super().__init__("\n".join(str(f) for f in self.faults))

    def __reduce__(self) -> tuple[type[ProblemFileError], tuple[tuple[Fault, ...]]]:
        return type(self), (self.faults,)  # how another process makes it again


class RecordingError(InputError):
    """A recording cannot be read, or does not fit the model."""


class ModelError(InputError):
    """The model is not a structure: a mechanism, a negative mass, a missing property."""


class ProblemWarning(UserWarning):
    """Something in a problem that is probably a mistake; the work goes on."""


class InfeasibleError(CvxupdateError):
    """The clauses of a convex step cannot hold together; ``conflict`` names them."""

    def __init__(self, message: str, conflict: Sequence[str] = ()) -> None:
        self.conflict = tuple(conflict)
        super().__init__(message)


class ConvergenceError(CvxupdateError):
    """An iteration or a solver stopped short of its tolerance."""
