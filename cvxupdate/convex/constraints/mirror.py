"""Mirror symmetry: what lies opposite shares one value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar, Literal

from pydantic import Field

from cvxupdate.keys import Part

from ..context import Context, Key
from .clauses import Clause
from .tied import Tied


class MirrorTable(Part):
    """A plane of symmetry: parameters of elements that are mirror images share one value."""

    plane: Literal["x", "y", "z"] = Field(description="the axis that the plane is normal to")
    at: float = Field(default=0.0, description="where the plane cuts it [m]")


@dataclass(frozen=True)
class Mirror:
    """The parameters of each pair are equal."""

    pairs: tuple[tuple[str, ...], ...]
    keys: ClassVar[Mapping[str, Key]] = {"mirror": Key(MirrorTable, "planes of symmetry", True)}

    @classmethod
    def from_spec(cls, table: MirrorTable, context: Context) -> Mirror:
        """The mirror images in one plane."""
        return cls(context.mirror_images(table.plane, table.at))

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause per pair."""
        return Tied(self.pairs).clauses(columns)
