"""FRFs as a reader assembles them, before their variance is known."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cvxupdate.recordings.types import Channel, Complex, Real


@dataclass(frozen=True)
class FrfParts:
    """``axis`` (lines,) Hz; ``H`` (lines, responses, references) in SI; ``coherence`` of the same
    shape, NaN where it was not recorded, None where it never was; ``quantity`` of the responses."""

    axis: Real
    H: Complex
    coherence: Real | None
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    quantity: str


def distinct(points: Sequence[tuple[int, str]]) -> list[tuple[int, str]]:
    """Nodes and DOFs in the order in which they first appear."""
    return list(dict.fromkeys(points))
