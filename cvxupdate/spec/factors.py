"""Factors on the matrices of an element, and its loss factor."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from cvxupdate.keys import NonNegative, Positive

StiffnessFactor = Annotated[
    Positive,
    Field(description="factor on the stiffness matrix (structural damping is not scaled by it)"),
]
MassFactor = Annotated[Positive, Field(description="factor on the mass matrix")]
DampingFactor = Annotated[
    NonNegative,
    Field(description="factor on its damping: matrix, loss factor, alpha and beta alike"),
]
Loss = Annotated[
    NonNegative | None,
    Field(description="loss factor; absent: that of the material, else of [model.damping]"),
]
