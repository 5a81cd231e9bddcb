"""A lump with a footprint in place of the point that comes near.

A block on a plate is a point to long waves only. Said by a point it leaves the shorter ones
unexplained, and is too light. Where a point is among the best, its second moment is tried as well
and pays for its unknown as anything else does.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seed_from, without
from cvxupdate.diagnose.search.race import Legs, entered, merged, raced
from cvxupdate.diagnose.settings import ZONED
from cvxupdate.diagnose.types import Evidence, Key, Progress, Score, Seed
from cvxupdate.physics.spread_lump import SpreadLump, spread

LUMP = SpreadLump.name
BEGUN = 0.1  # of a lump: how much of it begins on the nodes around, so that it is there at all


def spread_out(
    evidence: Evidence, known: Sequence[Hypothesis], legs: Legs, progress: Progress
) -> list[Hypothesis]:
    """Fitted sets, and the best of them with a lump's second moment, carried on through ``legs``:
    before anything is sought beside a point, for what that leaves is imitated by lumps elsewhere,
    and by material that grows lighter."""
    if not known or evidence.clear(known[0].fit):
        return list(known)
    tried = {h.keys for h in known}
    seeds = [s for h in known[:ZONED] for s in spread_seeds(evidence, h, tried)]
    if not seeds:
        return list(known)
    if evidence.hurried:
        evidence.leave("footprints of lumps", len(seeds))
        return list(known)
    progress("seeking lumps that are no points")
    return merged(known, raced(evidence, entered(evidence, seeds, progress), legs, progress))


def spread_seeds(evidence: Evidence, h: Hypothesis, tried: set[frozenset[Key]]) -> list[Seed]:
    """A fitted set with one of its points, something that is put on a single node, spread over its
    surroundings; those that were not ``tried``."""
    out: list[Seed] = []
    if LUMP not in evidence.names:
        return out
    for k, e in enumerate(h.effects):
        point = e.physics == LUMP and e.change is not None and not e.change.detail
        if not point or len(e.place.nodes) != 1:
            continue
        size, rest = float(h.sizes(k)[0]), without(evidence, h, k)
        if size <= 0.0 or rest is None:
            continue
        effect = spread(evidence.context(rest.fit.setting.model), e.place.nodes[0])
        if effect is None or rest.keys | {effect.key} in tried:
            continue
        tried.add(rest.keys | {effect.key})
        begun = np.array([size, BEGUN * size])
        level = h.fit.setting.level
        seed = seed_from(evidence, rest, Score(effect, 1.0, begun, exact=True), level)
        out += [] if seed is None else [seed]
    return out
