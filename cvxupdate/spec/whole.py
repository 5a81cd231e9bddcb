"""Updates of matrices as a whole: every entry on a pattern, or by a closed formula."""

from __future__ import annotations

from typing import Annotated, Literal

from pydantic import Field

from cvxupdate.keys import Part

DIRECT = (
    "baruch",
    "berman-nagy",
    "caesar",
    "wei",
    "fuh-chen",
    "caesar-link",
    "ross",
    "luk",
    "sidhu-ewins",
    "second-order",
    "he-ewins",
    "park-lee",
    "gysin",
    "lieven-ewins",
    "minas-inman",
    "inman-minas",
    "zimmerman-widengren",
    "pole-placement",
    "modal-control",
)
"""The direct methods; a test compares them with `cvxupdate.direct.methods`."""
EXPANSIONS = (
    "dynamic",
    "kidder",
    "petersmann",
    "null-space",
    "guyan",
    "irs",
    "gysin",
    "serep",
    "serepa",
    "tam",
    "hybrid",
)
"""From measured DOFs to all (`cvxupdate.residual.ceam_expand`)."""


class Whole(Part):
    """Whole symmetric matrices: every entry on a pattern is a parameter. Entry (i, j) of A moves by
    p √(A_ii A_jj)."""

    matrices: Annotated[tuple[Literal["K", "M", "C", "D"], ...], Field(min_length=1)] = Field(
        description="the matrices"
    )
    pattern: Literal["model", "nodes", "all"] = Field(
        default="model",
        description="entries that may change: those that are not 0 in the model, those "
        "between DOFs of nodes that share an element, or every one",
    )
    symmetric: bool = Field(
        default=True,
        description="false: (i, j) and (j, i) are two parameters, "
        "held equal by the clause `symmetry`",
    )
    lower: float | None = Field(default=None, description="lower bound of every p")
    upper: float | None = Field(default=None, description="upper bound of every p")
