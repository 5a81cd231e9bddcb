"""Findings that no engineer would believe beside one another."""

from __future__ import annotations

from itertools import combinations

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.zones import GIVES, SOFTER, covers_of, touching
from cvxupdate.fe.model import Model
from cvxupdate.physics.chains import Chain, chains
from cvxupdate.physics.effect import Effect


def jumbled(h: Hypothesis, model: Model) -> bool:
    """Whether changes of stiffness contradict or repeat one another: elements that are no group are
    softer by one and softer, or stiffer, by another; an element is softer and the next one stiffer;
    or the joints of one element after the other within a straight member give way, which are no
    joints. Such a set says that something is there, and neither what nor how much: one stretch
    would (`cvxupdate.diagnose.search.zones`)."""
    if sum(e.physics in (SOFTER, GIVES) for e in h.effects) < 2:
        return False
    if _again(h):
        return True
    return any(_along(h, chain) for chain in chains(model))


def _again(h: Hypothesis) -> bool:
    """Whether two sets of elements that are no groups share some, of plates too."""
    sets = [set(e.place.elements) for e in h.effects if e.physics == SOFTER and not e.place.groups]
    return any(a & b for a, b in combinations(sets, 2))


def _along(h: Hypothesis, chain: Chain) -> bool:
    there = [(k, s) for k, e in enumerate(h.effects) if (s := covers_of(e, chain))]
    return any(
        touching(chain, a, b) and _unlike(h, j, k) for (j, a), (k, b) in combinations(there, 2)
    )


def _unlike(h: Hypothesis, one: int, other: int) -> bool:
    """Whether two effects that touch are of opposite signs, or one at least is a joint."""
    signs = [_softens(h, k) for k in (one, other)]
    return signs[0] != signs[1] or any(_joint(h.effects[k]) for k in (one, other))


def _joint(effect: Effect) -> bool:
    return effect.physics == GIVES


def _softens(h: Hypothesis, k: int) -> bool:
    return _joint(h.effects[k]) or float(h.sizes(k)[0]) < 0.0
