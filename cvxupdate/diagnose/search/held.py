"""Supports that give way in several of their directions at once.

A clamp that is not rigid turns and moves. Each alone may bring the model hardly nearer (a
cantilever whose clamp does both), and with few natural frequencies no second effect is sought, so
that something that swings on its own is told for it. One support is one supposition, however many
directions it has.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import combinations, groupby, product

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, seed_from
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.search.several import busy
from cvxupdate.diagnose.settings import FINE_SEVERAL, SEVERAL_LEVEL, TRIAGED
from cvxupdate.diagnose.types import Evidence, Key, Progress, Real, Score, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.physics.effect import Effect

GIVES_WAY = "grounding_spring"
DIRECTIONS = "supports that give way in several directions"
FEET = 4  # supports that are sought one by one
# Directions of a support that are sought together; sizes that are tried of each alone, and by what
# part it must change the misfit to be heard; sizes of the grid, in these; from how many of them a
# fit begins.
MOST, DECADES, HEARD = 3, np.logspace(-7.0, 2.0, 10), 0.3
PARTS, BEGUN = (0.3, 1.0, 3.0, 10.0), 3


def held(evidence: Evidence, known: Sequence[Hypothesis], progress: Progress) -> list[Hypothesis]:
    """The supports, or classes of equal ones, of more than one direction that give way in two of
    them and more; sharpened, and freed of what does nothing in them. Best first. Where all the
    directions of one together are left far behind what is ``known``, fewer of them are, too."""
    found: list[Hypothesis] = []
    bare = at_nominal(evidence, Hypothesis((), evidence.bases[-1]))
    most = TRIAGED * min((h.penalised for h in known), default=np.inf)
    for own in supports(evidence.candidates(evidence.model, (GIVES_WAY,))):
        if evidence.hurried:
            evidence.leave(DIRECTIONS)
            break
        progress(f"seeking {DIRECTIONS}")
        found += _grown(evidence, bare, own, most, progress)
    several = raced(evidence, merged(found), FINE_SEVERAL, progress)
    return merged(several, busy(evidence, several, progress))


def supports(candidates: Sequence[Effect]) -> list[list[Effect]]:
    """Those of a rig that let a held direction go, by the nodes where they do, where there are
    several; of an edge with many supports the classes only."""
    own = [e for e in candidates if e.type.rig and e.change is not None and e.change.series]
    ranked = sorted(own, key=lambda e: e.place.nodes)
    groups = [list(some) for _, some in groupby(ranked, key=lambda e: e.place.nodes)]
    several = [some for some in groups if len({e.place.dof for e in some}) > 1]
    one = [some for some in several if len(some[0].place.nodes) == 1]
    return [some for some in several if len(one) <= FEET or some not in one]


def _grown(
    evidence: Evidence, bare: Hypothesis, own: Sequence[Effect], most: float, progress: Progress
) -> list[Hypothesis]:
    """Sets of two directions and more of one support, begun at the best of a grid of sizes: alone
    one stands for the others, too, so that its best size says nothing. First all of them, and no
    other set where these leave more than ``most``."""
    sizes = {e.key: p for e in own if (p := _heard(evidence, bare, e)) is not None}
    loudest = sorted((e for e in own if e.key in sizes), key=lambda e: sizes[e.key])[:MOST]
    out: list[Hypothesis] = []
    for count in range(len(loudest), 1, -1):
        for some in combinations(loudest, count):
            out += entered(evidence, _begun(evidence, bare, some, sizes), progress)
        if min((h.penalised for h in out), default=0.0) > most:
            break
    return out


def _heard(evidence: Evidence, bare: Hypothesis, effect: Effect) -> float | None:
    """The decade of its size at which a direction begins to be heard; None where none is."""
    seed = seed_from(evidence, bare, Score(effect, 0.0, np.ones(1), exact=True), SEVERAL_LEVEL)
    if seed is None:
        return None
    for p in DECADES:
        left = _left(evidence, seed, np.array([p]))
        if abs(left - bare.fit.misfit) > HEARD * bare.fit.misfit:
            return float(p)
    return None


def _begun(
    evidence: Evidence, bare: Hypothesis, some: Sequence[Effect], sizes: Mapping[Key, float]
) -> list[Seed]:
    """Where a set is begun: at the best sizes of a grid, all directions placed."""
    h, seed = bare, None
    for key in (e.key for e in some):
        there = evidence.candidates(h.fit.setting.model, (GIVES_WAY,))
        effect = next((e for e in there if e.key == key), None)
        if effect is None:
            return []
        score = Score(effect, 0.0, np.array([sizes[key]]), exact=True)
        seed = seed_from(evidence, h, score, SEVERAL_LEVEL)
        if seed is None:
            return []
        h = Hypothesis(seed.effects, evidence.evaluated(seed.setting, seed.start))
    if seed is None:
        return []
    heard = np.array([sizes[e.key] for e in some])
    grid = [heard * np.array(parts) for parts in product(PARTS, repeat=len(some))]
    ranked = sorted(grid, key=lambda p: _left(evidence, seed, p))
    return [replace(seed, start=_at(seed, p)) for p in ranked[:BEGUN]]


def _left(evidence: Evidence, seed: Seed, p: Real) -> float:
    try:
        return evidence.evaluated(seed.setting, _at(seed, p)).misfit
    except CvxupdateError:
        return np.inf


def _at(seed: Seed, p: Real) -> Real:
    """Where the effects have sizes ``p``."""
    start = seed.start.copy()
    end = len(seed.setting.model.parameters)
    start[end - len(p) : end] = p
    return start
