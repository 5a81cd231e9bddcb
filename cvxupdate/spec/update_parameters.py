"""The rows of [update] parameters."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.keys import Id, Names, Of, Part, Positive, Text, one_of
from cvxupdate.spec.generic import FamilyTable


class ParameterRow(Part):
    """One parameter, or one for each element or group: what it acts on, and the property it
    changes.

    Exactly one of ``elements``, ``group``, ``groups``, ``material`` (none for the damping of the
    whole model).
    """

    of: Of = Field(description="the property it changes")
    elements: (
        Annotated[
            Literal["all"] | Annotated[tuple[Id, ...], Field(min_length=1)],
            one_of('"all", or a list of element numbers'),
        ]
        | None
    ) = Field(default=None, description='element numbers, or "all" that have the property')
    group: Text | None = Field(default=None, description="a group")
    groups: Names | None = Field(default=None, description="several groups")
    material: Text | None = Field(default=None, description="all elements of a material")
    each: Literal["element", "group"] | None = Field(
        default=None,
        description="a parameter for each element or each group; "
        "absent: one for all (a macro element)",
    )
    grouping: Literal["clusters", "subset", "total-variation"] | None = Field(
        default=None,
        description="beside `each`: the recordings join those single parameters to macro elements, "
        "by clusters of sensitivities that they hardly tell apart, by stable selection of the few "
        "that differ from all the others, or by total variation between neighbours",
    )
    resolution: Positive | None = Field(
        default=None,
        description="grouping: the standard deviation of p to which the recordings must know a "
        "group; absent: 0.1",
    )
    name: Text | None = Field(default=None, description="name in results and constraints")
    lower: float | None = Field(default=None, description="lower bound of the relative change p")
    upper: float | None = Field(default=None, description="upper bound of the relative change p")
    scale: Positive | None = Field(
        default=None,
        description="size of one unit of p in the unit of the "
        "property, where the nominal value is 0",
    )
    family: FamilyTable | None = Field(
        default=None, description="generic: which family; absent: K and M by symmetry"
    )
