"""Several responses measured together: which leave fewest of the effects in question listed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

from cvxupdate.diagnose.apart.responses import Responses
from cvxupdate.diagnose.apart.worth import Products
from cvxupdate.diagnose.settings import FEWEST_TOGETHER, LEFT_ENOUGH, RESPONSES_TOGETHER

Pair = tuple[str, str]  # sensor, drive
LOOKED = 48
"""Responses from which sets are made: the best half by themselves, and others evenly down the
ranking, which may tell the pairs that the first do not."""


@dataclass(frozen=True)
class Asked:
    """A question with what is ``known`` of it, and with what every ``further`` response would add;
    ``members``: how many explanations are listed."""

    responses: Responses
    known: Products
    further: Mapping[Pair, Products]

    @property
    def members(self) -> int:
        """Explanations that the diagnosis lists."""
        return len(self.responses.question.members)

    def left(self, more: Products | None = None, listed: bool = False) -> float:
        """How many others are expected to be listed beside the true one (``listed``: of those that
        the diagnosis lists)."""
        whole = self.known if more is None else self.known + more
        return self.responses.scale.left(whole, self.members if listed else None)

    def separations(self, more: Products | None = None) -> list[float]:
        """Of the pairs that the diagnosis lists, in deviations."""
        whole = self.known if more is None else self.known + more
        return self.responses.scale.separations(whole, self.members)

    def having(self, pair: Pair) -> Asked:
        """Once that was measured."""
        return replace(self, known=self.known + self.further[pair])


def together(asked: Sequence[Asked], count: int | None) -> list[Pair]:
    """A set of responses, each the one that leaves fewest effects listed beside those before it:
    ``count`` of them, or as many as are worth it (None). Each is at another place while there are
    any: that also shows what none of the explanations foretells."""
    some, now = shortlist(asked), list(asked)
    chosen: list[Pair] = []
    left = sum(a.left() for a in now)
    while len(chosen) < min(count or RESPONSES_TOGETHER, len(some)):
        rest = [k for k in some if k not in chosen]
        free = [k for k in rest if all(k[0] != c[0] for c in chosen)] or rest
        worth = {k: sum(a.left(a.further[k]) for a in now) for k in free}
        best = min(worth, key=lambda k: worth[k])
        enough = left <= LEFT_ENOUGH or worth[best] >= left
        if count is None and len(chosen) >= FEWEST_TOGETHER and enough:
            break
        chosen.append(best)
        now, left = [a.having(best) for a in now], worth[best]
    return chosen


def shortlist(asked: Sequence[Asked]) -> list[Pair]:
    """The best, and some of the others."""
    left = {k: sum(a.left(a.further[k]) for a in asked) for k in asked[0].further}
    order = sorted(left, key=lambda k: left[k])
    best, rest = order[: LOOKED // 2], order[LOOKED // 2 :]
    step = max(1, -(-len(rest) // (LOOKED // 2)))
    return [*best, *rest[::step]]
