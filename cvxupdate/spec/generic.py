"""Families of element matrices: which may change (`family` of a parameter ``of = "generic"``), and
elements whose matrices have changed already ([[model.families]])."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.keys import Count, Id, Part, Text, one_of

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


Change = Annotated[
    tuple[Annotated[tuple[Mode, Mode, float], one_of("[mode, mode, number]")], ...],
    Field(min_length=1),
]


class Member(Part):
    """Elements whose matrices are other members of their families (docs/generic-elements.md): X = D
    (N + P) D in the modes of the element, N the identity where something is there.

    Rows act one after the other: modes are those of the element as the rows before leave it.
    Exactly one of ``elements`` and ``group``; ``K``, ``M`` or both.
    """

    elements: (
        Annotated[
            Literal["all"] | Annotated[tuple[Id, ...], Field(min_length=1)],
            one_of('"all", or a list of element numbers'),
        ]
        | None
    ) = Field(default=None, description='element numbers, or "all" that have matrices')
    group: Text | None = Field(default=None, description="a group")
    modes: Literal["symmetry", "own"] = Field(
        default="symmetry",
        description="the modes are told apart by the symmetries of the element, or by what its "
        'matrices keep apart (`classes = "own"`)',
    )
    K: Change | None = Field(
        default=None,
        description="P of the stiffness, relative to the element: rows [i, j, P_ij] of modes i ≤ j "
        "from 1, the lowest; what no row names stays",
    )
    M: Change | None = Field(default=None, description="P of the mass")

    def changes(self) -> dict[str, tuple[tuple[int, int, float], ...]]:
        """Matrix → what is given of it."""
        both = {"K": self.K, "M": self.M}
        return {name: rows for name, rows in both.items() if rows is not None}
