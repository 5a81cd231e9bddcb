"""What a rig does alike everywhere, all of it at once, for tables of modes.

Supports that all give way in each of their directions, joints that are all soft, sensors that all
weigh: each alone brings a model that lacks them all hardly nearer, so that steps from one to the
next miss them, and every effect at every place takes most of the time that a diagnosis has. All at
once they are one fit, freed then of what the evidence is better without.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig, together
from cvxupdate.diagnose.nominal.wanted import by_theory
from cvxupdate.diagnose.search.backward import backward, freed, merit
from cvxupdate.diagnose.search.beside import beside
from cvxupdate.diagnose.search.race import entered, merged, raced, refitted
from cvxupdate.diagnose.search.several import room
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS, PARTNERS, STAYING
from cvxupdate.diagnose.types import Evidence, Key, Progress
from cvxupdate.physics.effect import MODES, Effect
from cvxupdate.physics.shaker import MOST, at_drive

BEGUN = 0.1  # of the size at which each is as soft as what it holds: fits begin there
JOINTS = "joint_flexibility"
ARMATURE = ("added_mass", "grounding_spring")  # what a shaker brings: its mass and suspension


def alike_everywhere(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """Sets of what a rig does, each of its parts alike wherever it may stand; best first. Where all
    of it at once does not explain, sets are grown from it as long as the evidence grows."""
    found = at_once(evidence, progress)
    best = found[0] if found else Hypothesis((), evidence.bases[-1])
    while room(evidence, best) and not (evidence.clear(best.fit) or evidence.hurried):
        progress(f"seeking what a rig does everywhere beside {best.name}")
        near = sharp_beside(evidence, best, progress, wanted=of_classes)
        likeliest = max(near, key=merit, default=best)
        if merit(likeliest) <= merit(best):
            break
        found, best = [*near, *found], likeliest
    return sorted((h for h in merged(found) if h.effects), key=merit, reverse=True)


def on_a_rig(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """All that a rig does everywhere at once, freed of what it is better without; where that does
    not explain, what else does beside all of it, for its parts may show only then. Likeliest
    first."""
    found = at_once(evidence, progress)
    if not found or evidence.clear(found[0].fit):
        return found
    alike = [h for h in found if in_directions(h.effects) == in_directions(found[0].effects)]
    whole = max(alike, key=lambda h: (h.unknowns, merit(h)))
    if not room(evidence, whole) or evidence.hurried:
        return found
    progress("seeking beside all that a rig does everywhere")
    near = sharp_beside(evidence, whole, progress)
    return sorted(merged(found, near, _lightest(evidence, near)), key=merit, reverse=True)


def sharp_beside(
    evidence: Evidence,
    parent: Hypothesis,
    progress: Progress,
    most: int = PARTNERS,
    wanted: Callable[[Sequence[Effect]], Sequence[Effect]] = list,
) -> list[Hypothesis]:
    """The best ``most`` of what shows `beside` a parent, on the sharp recordings at once."""
    last = evidence.levels - 1
    seeds = beside(evidence, parent, level=last, wanted=wanted)
    return raced(evidence, entered(evidence, seeds, progress), ((last, most),), progress)


def _lightest(evidence: Evidence, sets: Sequence[Hypothesis]) -> list[Hypothesis]:
    """The likeliest sets without what they are likelier without, as far as any could then be the
    likeliest: what is freed explains no more, and saves no more than all of its unknowns cost."""
    out, best = list[Hypothesis](), -np.inf
    for h in sorted(sets, key=merit, reverse=True)[:STAYING]:
        best = max(best, merit(h))
        if h.fit.log_evidence > best:
            freer = lightened(evidence, h)
            out += freer
            best = max([best, *map(merit, freer)])
    return out


def at_once(evidence: Evidence, progress: Progress, again: bool = True) -> list[Hypothesis]:
    """All that a rig does everywhere, with and without the joints, which stand for much, freed of
    what the evidence is better without (``again``: fitted without each of its parts, where it does
    not explain); likeliest first. Nothing where a rig has no part."""
    progress("fitting all that a rig does everywhere at once")
    bare = Hypothesis((), evidence.bases[-1])
    tried = at_once_beside(evidence, by_theory(evidence, bare) or bare)
    if not tried:
        return []
    best = max(tried, key=merit)
    if again and not evidence.clear(best.fit) and len(best.effects) > 1:
        tried += backward(evidence, best, progress)[1]
    return sorted(merged(tried), key=merit, reverse=True)


def at_once_beside(evidence: Evidence, parent: Hypothesis) -> list[Hypothesis]:
    """A parent with all that a rig does everywhere, with each class of joints and with none, what
    acts in several directions in each by itself and in all alike; the likeliest of them freed of
    what the evidence is better without. Springs in six directions bend to what is missing besides,
    those with one number hardly do; and where ends of one group alone turn, every end would turn
    instead. In modes that were identified there is what stood at the drive."""
    known = evidence.candidates(evidence.model)
    brought = _brought(known) if evidence.told_by == MODES else []
    ways: dict[frozenset[Key], list[Effect]] = {}
    joints = [e for e in known if e.physics == JOINTS and e.type.rig]
    for rig in (widest(known), widest(known, directed=False)):
        own = [e for e in (*rig, *brought) if e.key not in parent.keys]
        rest = [e for e in own if e.physics != JOINTS]
        classes = joints if len(rest) < len(own) and evidence.told_by == MODES else []
        for way in (own, rest, *([*rest, e] for e in classes if e.key not in parent.keys)):
            ways.setdefault(frozenset(e.key for e in way), way)
    return likelier_with(evidence, parent, [way for way in ways.values() if way])


def _brought(known: Sequence[Effect]) -> list[Effect]:
    """What stands where the force came in: a mass, and of shakers, which are few, a spring."""
    masses, springs = ([e for e in known if e.physics == n and at_drive(e)] for n in ARMATURE)
    return [*masses, *(springs if len({e.place.nodes for e in springs}) <= MOST else [])]


def likelier_with(
    evidence: Evidence,
    parent: Hypothesis,
    ways: Sequence[Sequence[Effect]],
    begun: float = BEGUN,
) -> list[Hypothesis]:
    """A parent with the effects of each of several ``ways`` at once, fitted from sizes ``begun``
    (of tables, where they begin far off, by either pairing of the modes), and the likeliest of
    these without what it is likelier without."""
    wholes = [together(evidence, parent, way, begun) for way in ways]
    seeds = [h.onward for h in wholes if h.effects]
    if evidence.told_by == MODES:
        far = [h.onward for h in wholes if h.effects and h.fit.misfit > HOPELESS * EXPLAINED]
        seeds += [replace(seed, continued=True) for seed in far]
    fits = [refitted(evidence, seed, "sharp") for seed in seeds]
    found = sorted((h for h in fits if h is not None), key=merit, reverse=True)
    return [*found, *lightened(evidence, found[0])] if found else []


def lightened(evidence: Evidence, whole: Hypothesis) -> list[Hypothesis]:
    """A set without what it is likelier without, fitted again, as long as something goes."""
    out: list[Hypothesis] = []
    while True:
        lighter = freed(evidence, whole)
        if lighter.keys == whole.keys:
            return out
        found = refitted(evidence, lighter.onward, "sharp")
        if found is None:
            return out
        out.append(found)
        whole = found


def sharpened(evidence: Evidence, whole: Hypothesis, progress: Progress) -> list[Hypothesis]:
    """A set on the sharp recordings, and without what it is likelier without; the lightest last."""
    sharp = raced(evidence, [whole], ((evidence.levels - 1, 1),), progress)
    return [*sharp, *(lighter for h in sharp for lighter in lightened(evidence, h))]


def widest(candidates: Sequence[Effect], directed: bool = True) -> list[Effect]:
    """Of what a rig does with one unknown, by effect and direction the one at most places; not
    ``directed``: those that act alike in all directions instead, where there are such."""
    most: dict[tuple[str, str | None], Effect] = {}
    for e in candidates:
        if not e.type.rig or e.change is None or e.count != 1:
            continue
        key = (e.physics, e.place.dof)
        if key not in most or places_of(e) > places_of(most[key]):
            most[key] = e
    instead = {physics for physics, dof in most if (dof is not None) == directed}
    return [
        e
        for (physics, dof), e in most.items()
        if (dof is not None) == directed or physics not in instead
    ]


def in_directions(effects: Sequence[Effect]) -> bool:
    """Whether one of what a rig does at several places acts in a direction by itself."""
    return any(places_of(e) > 1 and e.place.dof is not None for e in effects if e.type.rig)


def of_classes(effects: Sequence[Effect]) -> list[Effect]:
    """Those that a rig does at all places of a kind, or at the only one that there is."""
    own = [e for e in effects if of_a_rig(e)]
    classes = {e.physics for e in own if places_of(e) > 1}
    return [e for e in own if places_of(e) > 1 or e.physics not in classes]


def places_of(e: Effect) -> int:
    """At how many nodes or elements an effect stands."""
    return max(len(e.place.nodes), len(e.place.elements))
