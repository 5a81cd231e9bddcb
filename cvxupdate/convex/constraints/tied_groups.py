"""Element groups that share one value."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from pydantic import Field

from cvxupdate.keys import Names, Of, Part

from ...errors import InputError
from ..context import Context, Key
from .clauses import Clause
from .tied import Tied


class TiedGroupsTable(Part):
    """Element groups that share one value."""

    groups: Names = Field(description="element groups")
    of: Of = Field(description="the property of the parameters to be tied")


@dataclass(frozen=True)
class TiedGroups:
    """All parameters of ``names`` are equal."""

    names: tuple[str, ...]
    keys: ClassVar[Mapping[str, Key]] = {
        "tied_groups": Key(TiedGroupsTable, "tied element groups", True)
    }

    @classmethod
    def from_spec(cls, table: TiedGroupsTable, context: Context) -> TiedGroups:
        """The parameters of one property inside the groups.

        Raises
        ------
        InputError
            When there are fewer than two, or a group is not known.
        """
        names = context.inside(table.groups, table.of)
        if len(names) < 2:
            raise InputError(
                f"constraints.tied_groups: {len(names)} parameter(s) of {table.of} lie in "
                f"{', '.join(table.groups)}; two or more can be tied."
            )
        return cls(names)

    def clauses(self, columns: tuple[str, ...]) -> tuple[Clause, ...]:
        """One clause: each member equals the first."""
        return Tied((self.names,)).clauses(columns)
