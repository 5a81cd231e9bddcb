"""Sets of effects grown from a model that is far off.

Where several things are missing at once no single effect explains much, and what scores best by
weighted squares is what flattens the few worst lines. A comparison that no line can dominate
(`Evidence.approach`) says which effects bring the whole nearer: sets are grown by it, several
abreast (a beam search), from the bare model and from one with all that a rig does; effects without
which a set is as near are dropped again. Weighted squares take over from where that ends.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import partial

import numpy as np

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.hypothesis import Hypothesis, silenced, without
from cvxupdate.diagnose.nominal.wanted import by_theory
from cvxupdate.diagnose.search.approach import Approach
from cvxupdate.diagnose.search.backward import backward
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.race import merged, raced
from cvxupdate.diagnose.search.reached import Reached, abreast, nearest_first
from cvxupdate.diagnose.search.several import Pool, room
from cvxupdate.diagnose.search.untuned import tenable
from cvxupdate.diagnose.search.zones import zone_seeds
from cvxupdate.diagnose.settings import (
    BEAM,
    BUDGET,
    EXPLAINED,
    FALLEN,
    FINE_SEVERAL,
    GROWING,
    HOPELESS,
    NEARER,
    NEAREST,
    OPEN,
    SEVERAL_LEVEL,
)
from cvxupdate.diagnose.types import Evidence, Key, Progress, Seed
from cvxupdate.errors import CvxupdateError
from cvxupdate.forked import Ahead, every

GROWN = "sets of effects for a model that is far off"
CARRIED = "the same by weighted squares"
RIVALS = "alternatives to what is in the best set"


def guided(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """The best sets of two effects and more that grow step by step, sharpened, best first; none of
    evidence without an approach. It takes a part of the time at most: what is sought by weighted
    squares has its turn, too."""
    growth = _growth(evidence, progress)
    return [] if growth is None else growth.finished()


def grown_near(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """The same before they are sharpened against rivals, which takes most of the time; best
    first."""
    growth = _growth(evidence, progress)
    return [] if growth is None else growth.brought()


def nearest_alone(evidence: Evidence, progress: Progress) -> list[Seed]:
    """The single effects that bring a model that is far off nearest, on the smoothest recordings,
    from where they do; none where nuisance parameters bring it near. What is gross moves resonances
    past one another, where weighted squares rank it behind what flattens a few lines."""
    far = evidence.bases[0].misfit > HOPELESS * EXPLAINED
    growth = _growth(evidence, progress) if far else None
    if growth is None:
        return []
    progress("seeking what brings the model nearer by itself")
    near = growth.nearer(growth.approach.beside(growth.bare, NEAREST), "first pass")
    singles = [r.hypothesis for r in near if len(r.hypothesis.effects) == 1][:BEAM]
    return [Seed(h.effects, evidence.at_level(h.fit.setting, 0), h.fit.p) for h in singles]


def brought_near(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """The same where nothing is to be claimed of it: of any number of effects, without rivals."""
    growth = _growth(evidence, progress)
    return [] if growth is None else growth.freed()


def _growth(evidence: Evidence, progress: Progress) -> _Growth | None:
    approach, budget = evidence.approach, Budget(GROWING * BUDGET, np.inf)
    if approach is None:
        return None
    return _Growth(evidence, approach, approach.begun(), progress, budget)


@dataclass(frozen=True)
class _Growth:
    evidence: Evidence
    approach: Approach
    bare: Hypothesis
    progress: Progress
    budget: Budget

    def found(self) -> list[Reached]:
        """The nearest sets, nearest first; a reference asks for them twice."""
        if GROWN not in self.approach.known:
            self.approach.known[GROWN] = self._found()
        return list(self.approach.known[GROWN])

    def _found(self) -> list[Reached]:
        front = self._begun()
        tried: set[frozenset[Key]] = set()
        while front and room(self.evidence, front[0].hypothesis):
            if self.evidence.hurried or self.budget.over():
                self.evidence.leave(GROWN)
                break
            near = [r for r in front if r.left <= FALLEN * front[0].left]
            fresh = [r for r in near if r.hypothesis.keys not in tried]
            tried.update(r.hypothesis.keys for r in fresh)
            grown = self._further(fresh)
            if not grown or grown[0].left > NEARER * front[0].left:
                break
            front = abreast([*grown, *front])
            carried = self._carried(front[:1])
            if carried and carried[0].fit.misfit <= EXPLAINED:
                return front[:1]
        return front

    def _begun(self) -> list[Reached]:
        """The bare model, that with all that a rig does, and on fixtures or cords with the rest of
        a rig, as far as these bring it nearer."""
        bare = self.bare
        self.progress("seeking what of a rig brings the model nearer")
        rigged = self.approach.rigged(bare)
        alike = self.approach.alike(bare)
        seeds = [h.onward for h in (bare, rigged, alike) if h is not None]
        nearer = self.nearer(self.approach.mounted(bare, BEAM), "first pass")[:BEAM]
        seeds += [r.hypothesis.onward for r in nearer]
        front = self._pruned(self._taken(seeds, "sharp"))
        others = self.approach.another_way(front[0].hypothesis) if front else []
        return nearest_first([*front, *self._taken(others, "sharp")])

    def _further(self, front: Sequence[Reached]) -> list[Reached]:
        """The nearest sets with one effect more than those of the front have, the nearest of these
        with all that a rig does beside them, too; nearest first."""
        plain, first = list[Reached](), set[frozenset[Key]]()
        parents, jobs = self._parents(front), self.evidence.jobs
        sought = every(lambda h: self.approach.beside(h, NEAREST), parents, jobs)
        for h, seeds in zip(parents, sought, strict=True):
            self.progress(f"seeking what brings {h.name} nearer")
            own = self.nearer(seeds, "first pass")
            first.update(r.hypothesis.keys for r in own[:1])  # what it stands on may show later
            plain = sorted([*plain, *own], key=lambda r: r.left)
        near, tried = nearest_first(plain)[:BEAM], {r.hypothesis.keys for r in plain}
        stretches = [s for r in near for s in zone_seeds(self.evidence, r.hypothesis, tried)]
        plain += self.nearer(stretches, "first pass")
        rigged = [s for r in nearest_first(plain)[:BEAM] for s in self._rigged(r.hypothesis)]
        entered = sorted([*plain, *self.nearer(rigged, "first pass")], key=lambda r: r.left)
        best = {r.hypothesis.keys for r in abreast(entered)} | first
        field = [r.hypothesis for r in entered if r.hypothesis.keys in best]
        return self._pruned(abreast(self._taken([h.onward for h in field], "sharp")))

    def _parents(self, front: Sequence[Reached]) -> list[Hypothesis]:
        """As they are, and with what theory wants as large as it says: among effects that are not
        all there yet that ends at nothing, and what it would go with is not seen beside that."""
        found = [r.hypothesis for r in front]
        wanted = (by_theory(self.evidence, h) for h in found)
        return [*found, *(h for h in wanted if h is not None)]

    def _rigged(self, h: Hypothesis) -> list[Seed]:
        try:
            found = self.approach.rigged(h)
        except CvxupdateError:
            return []
        return [] if found is None else [found.onward]

    def _taken(self, seeds: Sequence[Seed], effort: str) -> list[Reached]:
        """Seeds brought as near as they come, nearest first, each set once."""
        return nearest_first(self.nearer(seeds, effort))

    def nearer(self, seeds: Sequence[Seed], effort: str) -> list[Reached]:
        """Seeds brought as near as they come, nearest first; without those that are no
        structure."""
        found: list[Reached] = []
        with Ahead(partial(self._brought, effort), seeds, self.evidence.jobs) as fits:
            for _ in seeds:
                if found and self.evidence.hurried:
                    break
                r = fits.take()
                found += [r] if r is not None and tenable(self.evidence, r.hypothesis) else []
        return sorted(found, key=lambda r: r.left)

    def _brought(self, effort: str, seed: Seed) -> Reached | None:
        try:
            fit, left = self.approach.taken(seed, effort)
        except CvxupdateError:
            return None
        return Reached(Hypothesis(seed.effects, fit), left)

    def _pruned(self, sets: Sequence[Reached]) -> list[Reached]:
        """Each without the effects that hardly bring it nearer."""
        return nearest_first(every(self._sparse, sets, self.evidence.jobs))

    def _sparse(self, whole: Reached) -> Reached:
        """Without the effects that do little as it is, all at once; then, one by one, the one that
        does least where the others take its part when they are fitted again."""
        whole = self._busy(whole)
        while sought := self._sought(whole.hypothesis):
            h = whole.hypothesis
            least = min(sought, key=lambda k: self._left(h, (k,)))
            rest = without(self.evidence, h, least)
            again = [] if rest is None else self._taken([rest.onward], "sharp")
            if not again or NEARER * again[0].left > whole.left:
                break
            whole = again[0]
        return whole

    def _busy(self, whole: Reached) -> Reached:
        """Without the effects that do little as it is."""
        h = whole.hypothesis
        idle: tuple[int, ...] = ()
        for k in sorted(self._sought(h), key=lambda k: self._left(h, (k,))):
            if NEARER * self._left(h, (*idle, k)) > whole.left:
                break
            idle = (*idle, k)
        rest = without(self.evidence, h, *idle) if idle else None
        return whole if rest is None else Reached(rest, self.approach.left(rest))

    def _sought(self, h: Hypothesis) -> list[int]:
        """Numbers of the effects that a set was grown by: what theory wants stays, for it does
        little until the others are there."""
        return [k for k, e in enumerate(h.effects) if e.key not in self.bare.keys]

    def _left(self, h: Hypothesis, indices: tuple[int, ...]) -> float:
        """What is left without some effects, as it is."""
        fit = silenced(self.evidence, h, indices)
        rest = without(self.evidence, h, *indices) if fit is None else Hypothesis(h.effects, fit)
        return np.inf if rest is None else self.approach.left(rest)

    def _carried(self, sets: Sequence[Reached]) -> list[Hypothesis]:
        """Brought nearer level by level, then by weighted squares, beside the sharp recordings;
        best first."""
        found = list(sets)
        for level in range(SEVERAL_LEVEL + 1, self.evidence.levels):
            onward = [
                Seed(h.effects, self.evidence.at_level(h.fit.setting, level), h.fit.p)
                for h in (r.hypothesis for r in found)
            ]
            found = self._taken(onward, "sharp")
        return self._sharpened([r.hypothesis for r in found])

    def _sharpened(self, sets: Sequence[Hypothesis]) -> list[Hypothesis]:
        last = self.evidence.levels - 1
        return raced(self.evidence, sets, ((last, len(sets)),), self.progress)

    def brought(self) -> list[Hypothesis]:
        """The nearest sets by weighted squares, best first; asked for twice."""
        if CARRIED not in self.approach.known:
            own = [r for r in self.found() if r.hypothesis.effects]
            self.approach.known[CARRIED] = self._carried(own)
        return list(self.approach.known[CARRIED])

    def freed(self) -> list[Hypothesis]:
        """What was `brought` near, and the best of it without each of its effects, best first."""
        known = self.brought()
        fewer = backward(self.evidence, known[0], self.progress)[1] if known else []
        return merged(known, [h for h in fewer if h.effects])

    def finished(self) -> list[Hypothesis]:
        """What was `brought` near; the best of it also without each of its effects (backward), and
        where it explains with others in the place of each, against which it must stand."""
        known = self.brought()
        if not known:
            return []
        explains = known[0].fit.misfit <= OPEN * EXPLAINED
        kept, fewer = backward(self.evidence, known[0], self.progress)
        settled = {h.keys for h in (*known, *fewer)}
        pool = Pool(self.evidence, self.progress, {h.keys: h for h in known}, settled)
        for rest in kept if explains else ():
            if self.evidence.hurried:
                self.evidence.leave(RIVALS)
                break
            self.progress(f"seeking beside {rest.name} again")
            pool.refit(beside(self.evidence, rest))
        rivals = [h for h in pool.found.values() if len(h.effects) > 1 and h not in known]
        return merged(
            [h for h in known if len(h.effects) > 1],
            [h for h in fewer if len(h.effects) > 1],
            raced(self.evidence, rivals, FINE_SEVERAL, self.progress),
        )
