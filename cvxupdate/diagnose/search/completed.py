"""What else a rig may do beside what brought a model to the tables of its reference.

A search ends with the first set that leaves no more than noise and tolerance, and what a rig does
in small measure (sensors that weigh, soft joints) stays in the shapes: a change is then sized by
shapes that are not the structure's. Of a reference nothing is claimed, so the likeliest model is
wanted, and all of it at once is a fit or two. Springs under supports in all directions come near a
fixture that has a mass of its own, and hide it from every step that takes one effect at a time: it
is tried in the place of all of them. Tables without a reference are completed likewise (`on_rigs`),
to compete with what comes near by itself.
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import FIXTURE, SPRINGS, Hypothesis, further
from cvxupdate.diagnose.nominal.wanted import by_theory, expected, usual
from cvxupdate.diagnose.priced import price
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import (
    lightened,
    likelier_with,
    on_a_rig,
    places_of,
    sharp_beside,
    widest,
)
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.search.several import room
from cvxupdate.diagnose.search.unlike import with_one_unlike
from cvxupdate.diagnose.search.valleys import in_other_valleys, in_place_of_springs, rest_of
from cvxupdate.diagnose.settings import EXPLAINED, HALVED, MOVES, STAYING, STRONG
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.effect import MODES, Effect

REST = "what else a rig does, beside what brings the model near"
FAINT = 1e-3  # of the size at which each is as soft as what it holds: fits begin where they are
TIE = 1e-3  # nats: mirror images of a symmetric structure, on every machine the same


def completed(
    evidence: Evidence, near: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Each of ``near``, likeliest first, with all else that a rig does everywhere, freed of what
    the evidence is better without, and the same on fixtures; best first."""
    out: list[Hypothesis] = []
    for h in [*near, *on_fixtures(evidence, near[:1], progress)]:
        if evidence.hurried:
            evidence.leave(REST)
            break
        progress(f"fitting what else a rig does beside {h.name}")
        others = further(widest(evidence.candidates(h.fit.setting.model)), h)
        out += [h, *likelier_with(evidence, h, [others], FAINT)]
    return merged(out)


def with_one_more(evidence: Evidence, best: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """What leaves half of what noise and tolerance make with one effect more, whatever it is, freed
    of what had stood in its place; best first. A lump at the exciter shows only beside the rest of
    a rig, of which another part may have taken what it does: a whole rig leaves a third."""
    little = best.fit.misfit <= HALVED * EXPLAINED
    return [] if little else _with_one_more(evidence, best, progress)


def _with_one_more(evidence: Evidence, best: Hypothesis, progress: Progress) -> list[Hypothesis]:
    if evidence.hurried or not room(evidence, best):
        return []
    progress(f"seeking one effect more beside {best.name}")
    found = sharp_beside(evidence, best, progress)
    if evidence.told_by == MODES:
        found = merged(found, reseated(evidence, found, progress))
    ranked = sorted(found, key=merit, reverse=True)[:MOVES]
    return merged(found, *(lightened(evidence, h) for h in ranked))


def reseated(
    evidence: Evidence, sets: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """The likeliest of sets by tables with another fixture in the place of theirs, beside the rest
    as it is: stiffness and mass of the first were fitted while something was missing, and a fixture
    has a valley for every tuning."""
    out: list[Hypothesis] = []
    for h in sorted(sets, key=merit, reverse=True)[:MOVES]:
        stands = [k for k, e in enumerate(h.effects) if e.physics == FIXTURE]
        rest = rest_of(evidence, h, stands) if stands else None
        if rest is not None:
            progress(f"seeking another fixture beside {rest.name}")
            out += sharp_beside(evidence, rest, progress, MOVES, under_all)
    return [*out, *in_other_valleys(evidence, merged(sets, out), progress)]


def in_its_place(evidence: Evidence, best: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """A set by tables with one thing that had to be sought: others in its place, beside the rest as
    it is. The rig beside which it was found was bent by what was missing, and showed another place
    nearest."""
    sought = [k for k, e in enumerate(best.effects) if not usual(evidence, e)]
    rest = rest_of(evidence, best, sought) if len(sought) == 1 else None
    if rest is None or evidence.hurried:
        return []
    progress(f"seeking in place of {best.effects[sought[0]].name}")
    return sharp_beside(evidence, rest, progress)


def beside_fixtures(
    evidence: Evidence, sets: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """One effect more beside the likeliest rig alone among ``sets`` that stands on a fixture, all
    of it that is as likely; nothing where that could not be strongly likelier than all of them, if
    it left noise alone, or already leave nothing else. Neither comes near alone: what was sought
    beside springs was sought beside another structure, and explains it in the tolerance of a model.
    """
    stood = [h for h in sets if expected(evidence, h) and _stands(h)]
    if not stood:
        return []
    least = max(map(merit, stood)) - STRONG / 2.0
    whole = max((h for h in stood if merit(h) >= least), key=lambda h: (h.unknowns, merit(h)))
    best = max(sets, key=merit)
    if best.fit.spent:
        return []
    likeliest = best.fit.noise_alone - price(whole.unknowns + 1, best.fit.independent)
    worth = likeliest > merit(best) + STRONG / 2.0
    return _with_one_more(evidence, whole, progress) if worth else []


def _stands(h: Hypothesis) -> bool:
    return any(e.physics == FIXTURE for e in h.effects)


def on_rigs(
    evidence: Evidence, known: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """All that a rig does at once, with one that is not like the others, the same beside the
    likeliest that are ``known``, fixtures from other valleys, and one effect more beside the
    likeliest that a rig does alone, those that are not told from it, the whole of it, and what
    theory wants, as far as they leave more than noise: what is left within the tolerance of any
    model may, in one that was fitted, be what is still missing. Best first."""
    found = on_a_rig(evidence, progress)
    found = merged(found, with_one_unlike(evidence, found, progress))
    found = merged(found, completed(evidence, _likeliest(merged(known, found)), progress))
    stood = [h for h in merged(known, found) if expected(evidence, h)]
    found = merged(found, in_other_valleys(evidence, stood, progress))
    found = merged(found, beside_fixtures(evidence, merged(known, found), progress))
    every = merged(known, found)
    rigs = [h for h in every if h.effects and expected(evidence, h) and evidence.clear(h.fit)]
    near = _likeliest(rigs)
    whole = sorted(rigs, key=lambda h: (h.unknowns, merit(h)))[-1:]
    theory = by_theory(evidence, Hypothesis((), evidence.bases[-1]))
    parents = merged(near, whole, [] if theory is None else [theory])
    open_ = (h for h in parents if not h.fit.spent)
    return merged(found, *(_with_one_more(evidence, h, progress) for h in open_))


def _likeliest(sets: Sequence[Hypothesis]) -> list[Hypothesis]:
    """And those that are not told from it, a tie as a whole, likeliest first."""
    ranked = sorted(sets, key=merit, reverse=True)
    least = max((merit(h) - STRONG / 2.0 for h in ranked[:1]), default=0.0)
    last = min(map(merit, ranked[:STAYING]), default=0.0) - TIE
    return [h for h in ranked if merit(h) >= max(least, last)]


def on_fixtures(
    evidence: Evidence, near: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """A fixture under all supports, alone and in place of the springs to ground of each of ``near``
    that has none, sought and as stiff as these are; likeliest first."""
    out: list[Hypothesis] = []
    stands = under_all(evidence.candidates(evidence.model, (FIXTURE,)))
    for h in near:
        out += in_place_of_springs(evidence, h, stands)
    for parent in _parents(evidence, near):
        if evidence.hurried:
            evidence.leave(REST)
            break
        progress(f"seeking a fixture beside {parent.name}")
        found = sharp_beside(evidence, parent, progress, MOVES, under_all)
        out += sorted(found, key=merit, reverse=True)[:MOVES]
    return out


def _parents(evidence: Evidence, near: Sequence[Hypothesis]) -> list[Hypothesis]:
    """Nothing but the nuisance parameters; and each of ``near`` without its springs, as it is: a
    fit would have the rest do what a fixture does."""
    out = [Hypothesis((), evidence.bases[-1])]
    for h in near:
        names = [e.physics for e in h.effects]
        springs = [k for k, name in enumerate(names) if name == SPRINGS]
        rest = rest_of(evidence, h, springs) if springs and FIXTURE not in names else None
        out += [] if rest is None else [rest]
    return out


def under_all(effects: Sequence[Effect]) -> list[Effect]:
    """Fixtures that stand under the most supports."""
    own = [e for e in effects if e.physics == FIXTURE]
    most = max(map(places_of, own), default=0)
    return [e for e in own if places_of(e) == most]
