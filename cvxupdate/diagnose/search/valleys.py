"""Other valleys of a fixture, for sets by tables of modes.

A fixture that moves and turns has a valley for nearly every way to tune its mass on its springs and
its inertia on theirs, and ridges between them that no fit goes over. What stands beside it is known
the sooner: so all of these ways are looked at beside the rest as it is, and a fit begins in each of
the deepest.
"""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress

import numpy as np

from cvxupdate.diagnose.hypothesis import FIXTURE, SPRINGS, Hypothesis, together, without
from cvxupdate.diagnose.modes.finite_size import BASIS
from cvxupdate.diagnose.modes.fits import followed_at, paired_at
from cvxupdate.diagnose.modes.fixtures import Feet, Stood
from cvxupdate.diagnose.modes.scene import scene_of
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import lightened
from cvxupdate.diagnose.search.race import merged, refitted
from cvxupdate.diagnose.settings import MOVES
from cvxupdate.diagnose.types import Evidence, Progress, Real, Seed
from cvxupdate.errors import ModelError
from cvxupdate.physics.compliance import RIGID
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import TRANSLATIONS

MOVES_AND_TURNS = 4  # unknowns of a fixture that does both
COMPLIANCES = np.geomspace(1e-2, 30.0, 8)  # in the structure's at the place
TUNINGS = 9  # frequencies of the mass on its springs
BELOW, ABOVE = 0.5, 4.0  # of the lowest and the highest frequency of the tables
APART = 4.0  # valleys differ by so much in a compliance or a mass
DEEPEST = 4  # valleys in which a fit begins
TINY = 1e-9
AT_A_TIME = 500  # eigenproblems that are held in memory


def in_other_valleys(
    evidence: Evidence, sets: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Of each of the likeliest of ``sets`` on a fixture that moves and turns what begins in another
    valley, where that is likelier, and the same without what it is likelier without there; best
    first. Nothing of others."""
    out: list[Hypothesis] = []
    for h in sorted(sets, key=merit, reverse=True)[:MOVES]:
        begun = _begun(evidence, h)
        if begun is None or evidence.hurried:
            continue
        progress(f"seeking other valleys of {h.name}")
        rest, whole = begun
        fits = [_from(evidence, whole, p) for p in _starts(evidence, rest, whole)]
        best = max((x for x in fits if x is not None), key=merit, default=h)
        if merit(best) > merit(h):
            out += [best, *lightened(evidence, best)]
    return merged(out)


def _from(evidence: Evidence, h: Hypothesis, p: Real) -> Hypothesis | None:
    """A set fitted from a point, its modes as they are nearest there; None where that leads to no
    structure."""
    with suppress(ModelError):
        setting = paired_at(h.fit.setting, p)
        return refitted(evidence, Seed(h.effects, setting, p), "sharp")
    return None


def in_place_of_springs(
    evidence: Evidence, h: Hypothesis, fixtures: Sequence[Effect]
) -> list[Hypothesis]:
    """A set whose supports are springs with one of the ``fixtures`` in the place of all of them,
    fitted from their stiffness and a mass that is not felt, likelier or not: from the rigid model a
    fit may lead to a fixture that is heavy instead of soft (another laboratory's m08)."""
    out: list[Hypothesis] = []
    for effect in {e.key: e for e in fixtures if _moves_and_turns(e)}.values():
        own = set(effect.place.nodes)
        springs = [
            k
            for k, e in enumerate(h.effects)
            if e.physics == SPRINGS and own.issuperset(e.place.nodes)
        ]
        bare = without(evidence, h, *springs) if springs else None
        whole = bare if bare is None else together(evidence, bare, [effect])
        if bare is None or whole is None or whole is bare:
            continue
        units = [q.unit_size for q in whole.fit.setting.model.parameters[-MOVES_AND_TURNS:]]
        sizes = _as_soft(evidence, h, springs, units)
        found = _from(evidence, whole, np.append(whole.fit.p[:-MOVES_AND_TURNS], sizes))
        out += [] if found is None else [found]
    return out


def _as_soft(
    evidence: Evidence, h: Hypothesis, springs: Sequence[int], units: Sequence[float]
) -> Real:
    """Compliances and masses, in their ``units``, of a fixture that is as stiff as springs are (in
    the mean of those that hold from moving, and from turning), its masses swinging far above."""
    omega, sizes = 2.0 * np.pi * ABOVE * evidence.band[1], np.zeros(MOVES_AND_TURNS)
    for at, turns in ((0, False), (2, True)):
        stiff = [
            h.values[k]["k"]
            for k in springs
            if (h.effects[k].place.dof not in TRANSLATIONS) == turns
        ]
        if stiff:
            k = float(np.exp(np.mean(np.log(stiff))))
            sizes[at : at + 2] = 1.0 / (k * units[at]), k / omega**2 / units[at + 1]
    return sizes


def rest_of(evidence: Evidence, h: Hypothesis, gone: Sequence[int]) -> Hypothesis | None:
    """A set by tables without some of its effects, as it is, its modes followed there; None where
    nothing is left, or that is no structure."""
    rest = without(evidence, h, *gone)
    if rest is None or not rest.effects:
        return None
    with suppress(ModelError):
        return Hypothesis(rest.effects, followed_at(rest.fit.setting, rest.fit.p))
    return None


def _begun(evidence: Evidence, h: Hypothesis) -> tuple[Hypothesis, Hypothesis] | None:
    """What stands beside the fixture of a set, as it is, and the same with that, last; None where
    it has none that moves and turns, or nothing stands beside it."""
    stands = [k for k, e in enumerate(h.effects) if _moves_and_turns(e)]
    rest = rest_of(evidence, h, stands) if len(stands) == 1 else None
    if rest is None:
        return None
    whole = together(evidence, rest, [h.effects[stands[0]]], h.sizes(stands[0]))
    return None if whole is rest else (rest, whole)


def _moves_and_turns(e: Effect) -> bool:
    return e.physics == FIXTURE and e.count == MOVES_AND_TURNS


def _starts(evidence: Evidence, rest: Hypothesis, h: Hypothesis) -> list[Real]:
    """Unknowns of a set, of its fixture (last) in each of the deepest valleys beside the rest."""
    try:
        where = scene_of(rest.fit, BASIS).held(len(evidence.model.parameters))
    except ModelError:
        return []
    model, p = h.fit.setting.model, h.fit.p[:-MOVES_AND_TURNS]
    units = [q.unit_size for q in model.parameters[-MOVES_AND_TURNS:]]
    moving, turning = (_ways(evidence.band, *units[k : k + 2]) for k in (0, 2))
    sizes = np.hstack([np.repeat(moving, len(turning), axis=0), np.tile(turning, (len(moving), 1))])
    stood = Stood.of(where, model, p, MOVES_AND_TURNS)
    k, m = Feet.of(model, len(where.many.shapes), p, MOVES_AND_TURNS).at(sizes)
    cuts = range(0, len(sizes), AT_A_TIME)
    left = [stood.left(where, k[i : i + AT_A_TIME], m[i : i + AT_A_TIME]) for i in cuts]
    return [np.append(p, x) for x in _deepest(sizes, np.concatenate(left))]


def _ways(band: tuple[float, float], soft: float, heavy: float) -> Real:
    """(ways, 2) compliances and masses, in their units, of springs tuned to each frequency (Hz);
    and none of both."""
    omega = 2.0 * np.pi * np.geomspace(BELOW * band[0], ABOVE * band[1], TUNINGS)
    a, w = (x.ravel() for x in np.meshgrid(COMPLIANCES, omega, indexing="ij"))
    return np.vstack(
        [np.zeros((1, 2)), np.column_stack([a, 1.0 / (soft * (a + 1.0 / RIGID) * w**2) / heavy])]
    )


def _deepest(sizes: Real, left: Real) -> list[Real]:
    """Those that leave least, each apart from all before it."""
    at, chosen = np.log(np.maximum(sizes, TINY)), list[int]()
    for k in np.argsort(left).tolist():
        if len(chosen) < DEEPEST and all(
            np.max(np.abs(at[k] - at[other])) > np.log(APART) for other in chosen
        ):
            chosen.append(k)
    return [sizes[k] for k in chosen]
