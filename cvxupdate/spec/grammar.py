"""A problem file as a whole: `ProblemFile` is the grammar, `Spec` what the rest of the package
gets.

The classes below hold what every problem file may say; `grammar()` adds what the registered
elements, constraints and regularisers bring: their blocks, tables and keys.
"""

from __future__ import annotations

import contextlib
from dataclasses import dataclass
from functools import lru_cache, reduce
from operator import or_
from pathlib import Path
from typing import Annotated, Any, TypeVar

from pydantic import Field, create_model

from cvxupdate.errors import InputError
from cvxupdate.keys import Part
from cvxupdate.registry import CONSTRAINTS, ELEMENTS, REGULARISERS
from cvxupdate.spec.model import Model
from cvxupdate.spec.recordings import Recording
from cvxupdate.spec.update import Constraints, Diagnose, Regulariser, Solver, TrustRegion, Update

P = TypeVar("P", bound=Part)


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


def grammar() -> type[ProblemFile]:
    """The grammar with everything that is registered.

    Raises
    ------
    InputError
        When two constraints, or two regularisers, mean different things by one key.
    """
    return _grammar(ELEMENTS.members(), CONSTRAINTS.members(), REGULARISERS.members())


@lru_cache(maxsize=8)
def _grammar(
    elements: tuple[Any, ...], constraints: tuple[Any, ...], regularisers: tuple[Any, ...]
) -> type[ProblemFile]:
    union: Any = reduce(or_, dict.fromkeys(e.text.block for e in elements))
    block: Any = Annotated[union, Field(discriminator="type")]
    model = _with(Model, {"elements": (tuple[block, ...], Model.model_fields["elements"])})
    clauses = _with(Constraints, _constraint_keys(constraints))
    penalty: Any = _with(Regulariser, _merged("regulariser", [r.keys for r in regularisers]))
    own = ProblemFile.model_fields
    return _with(
        ProblemFile,
        {
            "model": (model, own["model"]),
            "constraints": (
                clauses,
                Field(default=clauses(), description=own["constraints"].description),
            ),
            "regularisation": (tuple[penalty, ...], own["regularisation"]),
        },
    )


def _with(base: type[P], fields: dict[str, Any]) -> type[P]:
    """A table with further keys, or with keys made narrower."""
    return create_model(base.__name__, __base__=base, __doc__=base.__doc__, **fields)


def _constraint_keys(constraints: tuple[Any, ...]) -> dict[str, Any]:
    keys = _merged("constraint", [c.keys for c in constraints])
    fields: dict[str, Any] = {}
    for name, key in keys.items():
        table: Any = key.table
        if key.many:
            fields[name] = (tuple[table, ...], Field(default=(), description=key.meaning))
        else:
            fields[name] = (table | None, Field(default=None, description=key.meaning))
    fields["trust_region"] = (TrustRegion | None, Field(default=None, description="trust region"))
    return fields


def _merged(kind: str, members: list[Any]) -> dict[str, Any]:
    """Every key of every member; several may have one key, if they mean the same by it."""
    out: dict[str, Any] = {}
    for keys in members:
        for name, key in keys.items():
            if out.setdefault(name, key) is not key:
                raise InputError(
                    f"two {kind}s mean different things by the key {name!r}. Give the new "
                    f"{kind} another key."
                )
    return out


@dataclass(frozen=True)
class Own:
    """What a program brings to the convex step as objects, which no file can hold: constraints,
    regularisers, a loss instead of the one that [update] names."""

    constraints: tuple[Any, ...] = ()
    regularisers: tuple[Any, ...] = ()
    loss: Any = None


@dataclass(frozen=True)
class Spec:
    """A problem file that holds: typed, complete, every path absolute or relative to the working
    directory.

    ``name`` is the folder of a ``problem.toml``, else the stem of the file; ``update`` is None when
    the file has no [update]; ``diagnose.physics`` is None for "everything"; ``own`` is empty for
    what comes from a file.
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
    own: Own = Own()

    @property
    def shown(self) -> str:
        """The path as results state it: as given where it is relative or lies below the working
        directory, else the folder and the file, for a result tells nobody whose disk it was on."""
        if not self.path.is_absolute():
            return str(self.path)
        with contextlib.suppress(ValueError, OSError):
            return str(self.path.resolve().relative_to(Path.cwd().resolve()))
        return str(Path(self.path.parent.name, self.path.name))
