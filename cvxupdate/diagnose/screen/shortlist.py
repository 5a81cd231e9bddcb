"""Which candidates are worth a refit: the largest explained fractions of every effect type."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.settings import EACH, MEMBERS, NEAR, SHORT
from cvxupdate.diagnose.types import Key, Score


def shortlist(scores: Sequence[Score], most: int = SHORT, each: int = EACH) -> list[Score]:
    """The best of every effect type that come near the best of all, at most ``each`` of a type and
    ``most`` in all; derivatives that are not to be trusted are left out. Mirror images, whose
    fractions are equal, count as one, so that they do not keep out what is different."""
    order = sorted(
        (s for s in scores if s.fraction > 0.0 and s.trusted), key=lambda s: -rounded(s.fraction)
    )
    out: list[Score] = []
    kept: dict[str, set[float]] = {}
    seen: set[Key] = set()
    for s in order:
        fraction, key = rounded(s.fraction), s.effect.key
        if s.fraction < NEAR * order[0].fraction or key in seen:
            continue
        own = kept.setdefault(s.effect.physics, set())
        room = len(own) < each and sum(map(len, kept.values())) < most
        if room or fraction in own:
            own.add(fraction)
            seen.add(key)
            out.append(s)
    return out


def members(scores: Sequence[Score], most: int = MEMBERS) -> list[Score]:
    """Effects on whole groups, members or the structure: few, and too large for a first-order
    score to be trusted; those of stiffness and mass, best first."""
    whole = [
        s
        for s in scores
        if s.effect.place.groups and s.effect.change is not None and not s.effect.type.damping
    ]
    return sorted(whole, key=lambda s: -s.fraction)[:most]


def not_among(scores: Sequence[Score], others: Sequence[Score]) -> list[Score]:
    """Those of the scores whose hypothesis has none among the others."""
    known = {s.effect.key for s in others}
    return [s for s in scores if s.effect.key not in known]


def best_of(*lists: Sequence[Score]) -> list[Score]:
    """Lists merged: of the same hypothesis the score with the largest fraction; best first."""
    best: dict[Key, Score] = {}
    for scores in lists:
        for s in scores:
            if s.effect.key not in best or s.fraction > best[s.effect.key].fraction:
                best[s.effect.key] = s
    return sorted(best.values(), key=lambda s: -s.fraction)


def rounded(x: float) -> float:
    """Six digits: what mirror images of a symmetric structure share to rounding is a tie, and the
    first of them counts, on every machine the same."""
    return float(f"{x:.5e}")
