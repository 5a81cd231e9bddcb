"""A stretch of a member in place of the changes of elements, and the joints, that imitate it.

What is burnt, corroded or cracked does not keep to the elements' lines. A search among sets of
whole elements says such a stretch by several changes that overlap, of opposite signs even, or by
joints one beside the other. So what lies together along a straight member is tried as one stretch
whose ends may lie within elements (`cvxupdate.physics.zone`), and pays for its unknowns as anything
else does.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import product

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from, without
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.search.spread import spread_seeds
from cvxupdate.diagnose.settings import STRETCHED, ZONED
from cvxupdate.diagnose.types import Evidence, Key, Progress, Real, Score, Seed
from cvxupdate.fe.model import Model
from cvxupdate.physics.chains import Chain, beside, chains, inner_joint
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.zone import BENDS, BOTH, JOINT, WHOLE, Ends, ZoneChange, zone

SOFTER, GIVES = "stiffness_change", "joint_flexibility"
BEGUN = 0.3  # of an element at an end: how much of it a stretch begins with
JOINTED = 0.6  # of an element's own compliance: where the size of a stretch for a joint begins


@dataclass(frozen=True)
class Cluster:
    """Effects (``indices``) of a hypothesis that lie together on a stretch (``elements``) of a
    straight member."""

    indices: tuple[int, ...]
    elements: tuple[int, ...]
    chain: Chain


def clusters(h: Hypothesis, model: Model) -> list[Cluster]:
    """What lies together: changes of stiffness of elements that are no whole member or group, and
    joints within a straight member, that share an element or stand side by side."""
    out: list[Cluster] = []
    for chain in chains(model):
        stretches = [
            (k, here) for k, e in enumerate(h.effects) if (here := covers_of(e, chain)) != ()
        ]
        while stretches:
            k, here = stretches.pop(0)
            indices, elements = [k], set(here)
            while near := [(j, s) for j, s in stretches if touching(chain, elements, s)]:
                stretches = [x for x in stretches if x not in near]
                indices += [j for j, _ in near]
                elements.update(*(s for _, s in near))
            whole = chain.stretch(frozenset(elements))
            out.append(Cluster(tuple(sorted(indices)), whole, chain))
    return out


def covers_of(effect: Effect, chain: Chain) -> tuple[int, ...]:
    """The elements of a chain that an effect softens or stiffens: its own, or those on both sides
    of a joint within the chain; none of others, nor of the whole chain or a group."""
    place = effect.place
    if effect.physics == SOFTER and not place.groups:
        inside = set(place.elements) <= set(chain.elements)
        return place.elements if inside and len(place.elements) < len(chain.elements) else ()
    joint = effect.physics == GIVES and len(place.nodes) == 1 and len(place.elements) == 1
    if joint and inner_joint(chain, place.nodes[0], place.elements[0]):
        at = chain.nodes.index(place.nodes[0])
        return chain.elements[at - 1 : at + 1]
    return ()


def touching(chain: Chain, one: Iterable[int], other: Iterable[int]) -> bool:
    """Whether two sets of elements of a chain share one, or stand side by side."""
    a, b = ([chain.elements.index(i) for i in s] for s in (one, other))
    return bool(a and b) and max(a) + 1 >= min(b) and max(b) + 1 >= min(a)


def zone_seeds(evidence: Evidence, h: Hypothesis, tried: set[frozenset[Key]]) -> list[Seed]:
    """A fitted set with what lies together said by one stretch: that, one element shorter or longer
    at either end, its ends wholly or partly inside; those that were not ``tried``."""
    if SOFTER not in evidence.names:
        return []
    out: list[Seed] = []
    for cluster in clusters(h, evidence.model):
        rest = without(evidence, h, *cluster.indices)
        if rest is None:
            continue
        give = _give(h, cluster)
        for elements, ends in _stretches(cluster):
            effect = zone(rest.fit.setting.model, elements, ends)
            if effect is None or rest.keys | {effect.key} in tried:
                continue
            tried.add(rest.keys | {effect.key})
            size = _sizes(give, len(elements), ends)
            seed = seed_from(
                evidence, rest, Score(effect, 1.0, size, exact=True), h.fit.setting.level
            )
            out += [] if seed is None else [seed]
    return out


def _stretches(cluster: Cluster) -> list[tuple[tuple[int, ...], Ends]]:
    """Elements, and how they are inside at the ends: partly at one of them at least."""
    before, after = beside(cluster.chain, cluster.elements)
    core = cluster.elements
    ways = [(core, WHOLE), (core, JOINT), (core, BOTH)]
    firsts = [*ways, *([((before, *core), JOINT)] if before is not None else [])]
    lasts = [*ways, *([((*core, after), JOINT)] if after is not None else [])]
    out = []
    for (left, first), (right, last) in product(firsts, lasts):
        elements = cluster.chain.stretch(frozenset(left) | frozenset(right))
        out += [(elements, (first, last))] if first or last else []
    return out


def _give(h: Hypothesis, cluster: Cluster) -> float:
    """What the stretch gives way by as a whole, in elements' own compliances."""
    whole = 0.0
    for k in cluster.indices:
        e, p = h.effects[k], h.sizes(k)
        if isinstance(e.change, ZoneChange):
            inside = len(e.place.elements) - sum(end > WHOLE for end in e.change.ends)
            whole += (inside + 0.5) * (1.0 / max(1.0 + float(p[0]), 0.05) - 1.0)
        elif e.physics == SOFTER:
            whole += len(e.place.elements) * (1.0 / max(1.0 + float(p[0]), 0.05) - 1.0)
        else:
            whole += JOINTED
    return whole


def _sizes(give: float, count: int, ends: Ends) -> Real:
    """Unknowns of a stretch that gives way so much, a third of the elements at its ends inside."""
    partly = sum(end > WHOLE for end in ends)
    each = give / (count - (1.0 - BEGUN) * partly)
    soft = [1.0 / (1.0 + BEGUN**2 * each) - 1.0 for end in ends if end == BOTH]
    turns = [BENDS * BEGUN * each for end in ends if end > WHOLE]
    return np.array([1.0 / max(1.0 + each, 0.2) - 1.0, *soft, *turns])


def zoned(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress, legs: int
) -> list[Hypothesis]:
    """The best of fitted sets with a stretch in place of what lies together in them, or a lump with
    a footprint in place of a point, sharpened as far as the level ``legs``, best first; again from
    the best as long as that is better."""
    tried = {h.keys for h in known}
    parents, found = list(known[:ZONED]), list[Hypothesis]()
    for _ in range(STRETCHED):
        ways = (zone_seeds, spread_seeds)
        seeds = [s for h in parents for way in ways for s in way(evidence, h, tried)]
        if not seeds:
            break
        if evidence.hurried:
            evidence.leave("stretches of members and footprints of lumps", len(seeds))
            break
        progress("seeking stretches and lumps that do not keep to elements and nodes")
        levelled = entered(evidence, seeds, progress)
        fresh = raced(evidence, levelled, ((legs, ZONED),), progress) if legs else levelled
        best = min((h.penalised for h in found), default=np.inf)
        found = merged(found, fresh)
        parents = [h for h in fresh[:1] if h.penalised < best]
    return found
