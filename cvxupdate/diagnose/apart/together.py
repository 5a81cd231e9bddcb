"""Several responses measured together: which tell explanations apart that none of them does
alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.apart.measurement import Measurement, MeasurementSet
from cvxupdate.diagnose.apart.responses import Responses
from cvxupdate.diagnose.settings import APART_ENOUGH
from cvxupdate.diagnose.types import Real

BEST, OTHERS = 24, 24
"""Responses from which sets are made: the most telling ones, and others evenly down the ranking,
which may tell the pairs that the first do not."""


@dataclass(frozen=True)
class Told:
    """What responses tell of each pair of explanations: Δᵀ Δ, Sᵀ Δ and Sᵀ S of their rows, in
    deviations (see `separation`). Those of a set are the sums, for their noises are independent."""

    squares: Real
    heard: tuple[Real, ...]
    inner: tuple[Real, ...]

    def __add__(self, other: Told) -> Told:
        return Told(
            self.squares + other.squares,
            tuple(a + b for a, b in zip(self.heard, other.heard, strict=True)),
            tuple(a + b for a, b in zip(self.inner, other.inner, strict=True)),
        )

    @property
    def separations(self) -> tuple[float, ...]:
        """Of each pair, in deviations: √(Δᵀ (I + S Sᵀ)⁻¹ Δ)."""
        out = []
        for q, h, G in zip(self.squares, self.heard, self.inner, strict=True):
            rest = float(q) - float(h @ np.linalg.solve(np.eye(len(h)) + G, h))
            out.append(float(np.sqrt(max(rest, 0.0))))
        return tuple(out)

    @property
    def information(self) -> float:
        """What the responses tell of the explanations' unknowns, ln det(I + Sᵀ S), mean of the
        pairs."""
        return float(np.mean([np.linalg.slogdet(np.eye(len(G)) + G)[1] for G in self.inner]))

    @property
    def rank(self) -> tuple[float, float]:
        """By the mean separation of the pairs, to a tenth of a deviation; of equals the one that
        tells most of the unknowns. Pairs that nothing tells, or that are told for good, must not
        choose by what is left of them: what comes up beside the explanations is ruled out by
        knowing the structure better."""
        worth = float(np.mean(np.minimum(self.separations, APART_ENOUGH)))
        return round(worth, 1), self.information


def together(
    responses: Responses, ranked: Sequence[Measurement], count: int
) -> MeasurementSet | None:
    """A set of ``count`` responses, each the one that tells most beside those before it, and each
    at another place while there are any; None where fewer than two were compared.

    By reciprocity a response and that with force and sensor exchanged are one and the same: it
    would average noise, and what the model misses is in both. One place each also shows what none
    of the explanations foretells.
    """
    further = [m for m in ranked if m.kind == "response"]
    some = shortlist(further)
    if len(some) < 2 or count < 2:
        return None
    known = told_by(responses, some)
    chosen = [max(range(len(some)), key=lambda k: known[k].rank)]
    whole = known[chosen[0]]
    while len(chosen) < min(count, len(some)):
        so_far = [some[c] for c in chosen]
        other = [k for k in range(len(some)) if is_other(some[k], so_far)]
        free = [k for k in other if all(some[k].sensor != m.sensor for m in so_far)] or other
        if not free:
            break
        grown = {k: whole + known[k] for k in free}
        best = max(grown, key=lambda k: grown[k].rank)
        chosen.append(best)
        whole = grown[best]
    return MeasurementSet(tuple(some[k] for k in chosen), whole.separations)


def is_other(m: Measurement, chosen: Sequence[Measurement]) -> bool:
    """Whether no chosen response is this one, with force and sensor exchanged or not."""
    same = ((m.sensor, m.drive), (m.drive, m.sensor))
    return all((c.sensor, c.drive) not in same for c in chosen)


def shortlist(further: Sequence[Measurement]) -> list[Measurement]:
    """The best, and some of the others."""
    rest = further[BEST:]
    step = max(1, -(-len(rest) // OTHERS))
    return [*further[:BEST], *rest[::step]]


def told_by(responses: Responses, some: Sequence[Measurement]) -> list[Told]:
    """What each of them tells by itself; those to one force are computed at once."""
    out: dict[int, Told] = {}
    for drive in dict.fromkeys(m.drive for m in some):
        mine = [k for k, m in enumerate(some) if m.drive == drive]
        rows = responses.rows([some[k].sensor for k in mine], drive)
        for k, pairs in zip(mine, rows, strict=True):
            out[k] = Told(
                np.array([float(gap @ gap) for gap, _ in pairs]),
                tuple(spread.T @ gap for gap, spread in pairs),
                tuple(spread.T @ spread for _, spread in pairs),
            )
    return [out[k] for k in range(len(some))]
