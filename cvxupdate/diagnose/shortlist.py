"""Which candidates are worth a refit: the largest shares of the residual, level by level, of every
word."""

from __future__ import annotations

from collections.abc import Hashable, Sequence

from cvxupdate.diagnose.screen import Score

Key = tuple[Hashable, ...]  # of an effect
PER_WORD, SHORT = 3, 12  # kept: of a word, and in all
NEAR = 0.25  # of the largest share
MEMBERS = 16  # words on whole groups that are refitted whatever their share


def shortlist(ranked: Sequence[Score], most: int = SHORT, each: int = PER_WORD) -> list[Score]:
    """The best of every word that comes near the best of all, at most ``each`` of a word and
    ``most`` in all."""
    order = sorted((s for s in ranked if s.share > 0.0), key=lambda s: -s.share)
    out: list[Score] = []
    count: dict[str, int] = {}
    seen: set[Key] = set()
    for s in order:
        word, key = s.candidate.physics, s.candidate.key
        if s.share < NEAR * order[0].share or len(out) >= most:
            break
        if count.get(word, 0) < each and key not in seen:
            count[word] = count.get(word, 0) + 1
            seen.add(key)
            out.append(s)
    return out


def members(ranked: Sequence[Score], most: int = MEMBERS) -> list[Score]:
    """Words on whole groups, members or the structure: few, and too large for a first-order share
    to be trusted; those of K and M, best first."""
    whole = [
        s
        for s in ranked
        if s.candidate.place.groups
        and s.candidate.change is not None
        and not s.candidate.type.damping
    ]
    return sorted(whole, key=lambda s: -s.share)[:most]


def unsized(scores: Sequence[Score], exact: Sequence[Score]) -> list[Score]:
    """Those of the scores that have no exact one."""
    known = {s.candidate.key for s in exact}
    return [s for s in scores if s.candidate.key not in known]


def best_of(lists: Sequence[Sequence[Score]]) -> list[Score]:
    """Lists merged: of the same hypothesis the score with the largest share; best first."""
    best: dict[Key, Score] = {}
    for scores in lists:
        for s in scores:
            key = s.candidate.key
            if key not in best or s.share > best[key].share:
                best[key] = s
    return sorted(best.values(), key=lambda s: -s.share)
