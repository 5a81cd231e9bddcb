"""`family` of a parameter ``of = "generic"``: which element matrices may change, and how far."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.keys import Count, Part, one_of

GENERIC = "generic"
"""The word of [update] ``parameters`` for the whole matrices of an element."""
Mode = Annotated[int, Field(ge=1)]


class FamilyTable(Part):
    """The family of element matrices: V X Vᵀ with the element's own modes V."""

    matrices: Annotated[tuple[Literal["K", "M"], ...], Field(min_length=1)] = Field(
        default=("K", "M"), description="the matrices of the element that may change"
    )
    classes: Annotated[
        Literal["symmetry", "own", "diagonal", "none"]
        | Annotated[
            tuple[Annotated[tuple[Mode, ...], Field(min_length=1)], ...], Field(min_length=1)
        ],
        one_of('"symmetry", "own", "diagonal", "none", or lists of mode numbers'),
    ] = Field(
        default="symmetry",
        description="which modes may mix: those of one symmetry of the element (its half-turns and "
        "mirrors), those that neither matrix keeps apart (own), none (diagonal: R = T = I), "
        "all (none), or lists of mode numbers of one matrix, 1 the lowest; modes that no list "
        "names stay as they are",
    )
    lowest_stiffness: Count | None = Field(
        default=None, description="so many of the lowest modes of K are free; absent: all"
    )
    highest_mass: Count | None = Field(
        default=None, description="so many of the highest modes of M are free; absent: all"
    )
