"""A family in a model: which elements share it, and which parameters are its entries."""

from __future__ import annotations

from dataclasses import dataclass

from cvxupdate.fe.generic.family import Family
from cvxupdate.fe.generic.shape import ElementShape


@dataclass(frozen=True, eq=False)
class FamilyUse:
    """One family of ``matrix`` "K" or "M", shared by ``elements``.

    ``columns`` are the names of its parameters, in the order of `Family.entries`; ``families`` and
    ``shapes`` those of its different elements, all with the same entries (a macro family of unlike
    elements shares the relative change P); ``bounds`` of every entry, None where the problem file
    gives none with it; ``modes`` "symmetry" or "own": how the element's modes are ordered.
    """

    name: str
    matrix: str
    columns: tuple[str, ...]
    elements: tuple[int, ...]
    group: str | None
    families: tuple[Family, ...]
    shapes: tuple[ElementShape | None, ...]
    bounds: tuple[float | None, float | None]
    modes: str = "symmetry"
