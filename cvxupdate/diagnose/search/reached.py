"""How near sets of effects come by the bounded comparison, and which of them go on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.settings import BEAM
from cvxupdate.diagnose.types import Key


@dataclass(frozen=True)
class Reached:
    """A hypothesis and what the bounded comparison leaves of it."""

    hypothesis: Hypothesis
    left: float


def abreast(found: Sequence[Reached]) -> list[Reached]:
    """Those to go on from, nearest first: none of as few effects is nearer, as far as there are
    such. Among sets of any number alone, many small effects would crowd out the one that they
    stand for."""
    ranked, leading = nearest_first(found), list[Reached]()
    for r in ranked:
        if not leading or len(r.hypothesis.effects) < len(leading[-1].hypothesis.effects):
            leading.append(r)
    others = [r for r in ranked if r not in leading]
    return sorted([*leading, *others][:BEAM], key=lambda r: r.left)


def nearest_first(found: Sequence[Reached]) -> list[Reached]:
    """Nearest first, each set once."""
    best: dict[frozenset[Key], Reached] = {}
    for r in sorted(found, key=lambda r: r.left):
        best.setdefault(r.hypothesis.keys, r)
    return list(best.values())
