"""A problem file as a whole: `ProblemFile` is the grammar, `Spec` what the rest of the package
gets."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from pydantic import Field

from cvxupdate.spec.base import Part
from cvxupdate.spec.model import Model
from cvxupdate.spec.recordings import Recording
from cvxupdate.spec.update import Constraints, Diagnose, Regulariser, Solver, Update


class ProblemFile(Part):
    """The grammar of a problem file, key by key."""

    title: str = Field(default="", description="a line for the report")
    source: str = Field(default="", description="where the numbers come from")
    model: Model = Field(description="the finite-element model")
    recordings: tuple[Annotated[Recording, Field(discriminator="kind")], ...] = Field(
        default=(), description="what was measured"
    )
    update: Update | None = Field(default=None, description="what `run` does")
    constraints: Constraints = Field(
        default=Constraints(), description="clauses of the convex step"
    )
    regularisation: tuple[Regulariser, ...] = Field(
        default=(), description="a penalty, or a list of them"
    )
    solver: Solver = Field(default=Solver(), description="the solver of the convex step")
    diagnose: Diagnose = Field(default=Diagnose(), description="what `diagnose` may consider")


@dataclass(frozen=True)
class Spec:
    """A problem file that holds: typed, complete, every path absolute or relative to the working
    directory.

    ``name`` is the folder of a ``problem.toml``, else the stem of the file; ``update`` is None when
    the file has no [update]; ``diagnose.physics`` is None for "everything".
    """

    path: Path
    name: str
    title: str
    source: str
    model: Model
    recordings: tuple[Recording, ...]
    update: Update | None
    constraints: Constraints
    regularisation: tuple[Regulariser, ...]
    solver: Solver
    diagnose: Diagnose
