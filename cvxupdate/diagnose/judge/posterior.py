"""How likely each hypothesis is beside all others that were fitted, "nothing" among them."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.alternatives import extent, has, nodes_at, nodes_of
from cvxupdate.diagnose.judge.between import unheard_of
from cvxupdate.diagnose.nominal.wanted import expected, foreseen
from cvxupdate.diagnose.priced import price, unknowns_of
from cvxupdate.diagnose.settings import GAIN_STD, REGION, STRONG
from cvxupdate.diagnose.types import Key, Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import FAINT


def log_odds(w: Weighed, case: Case) -> float:
    """Logarithm of the evidence for a hypothesis, up to what all have in common: the likelihood at
    its fit, less half the logarithm of the figures for each unknown (Bayes' information criterion;
    Kass and Raftery 1995), and the likelihood of what was held out, for which nothing was fitted.
    Where only the pattern of damping is at stake its strain is the likelihood, one figure a mode.
    That something sought is missing at all is one supposition, a rig alone, or one with the shear
    that theory wants, another: the first shares its probability among all the places where it may
    stand, which beside hundreds are bound to have one that fits the noise of a rig better (Scott
    and Berger 2010 on multiplicity). What theory foresees, with its size, is no unknown. Beside a
    reference what material does not do takes strong evidence (`unheard_of`), and so does a gain
    further off than they usually are (`_gains`)."""
    if case.damping_only:
        figures, fits = float(len(w.fit.p)), -0.5 * w.fit.damping_strain
    else:
        figures, fits = w.fit.independent, w.fit.log_evidence + w.held_out
    file, usual = case.evidence.file, expected(case.evidence, w.hypothesis)
    common = file is None or not w.hypothesis.effects  # to all tests, or nothing at all
    sought = bool(w.freed) or not (usual and common)
    odd = 0 if file is None else unheard_of(w.hypothesis, file)
    unknowns = unknowns_of(w.hypothesis) + w.freed - len(foreseen(case.evidence, w.hypothesis))
    fits -= price(unknowns, figures) + sought * float(np.log(case.places)) + odd * STRONG / 2
    return fits + _gains(w.hypothesis)


def _gains(h: Hypothesis) -> float:
    """Logarithm of how likely gains are before anything is measured, beside none that is off: they
    scatter by `GAIN_STD`, or one is off by a gross mistake, which strong evidence tells."""
    values = [
        abs(figures["gain"])
        for e, figures in zip(h.effects, h.values, strict=True)
        if e.fault is not None and e.fault.how in ("gain", "force")
    ]
    off = np.log(np.clip(values, FAINT, None)) / GAIN_STD
    return float(np.sum(np.maximum(-0.5 * off**2, -STRONG / 2.0)))


def field_of(final: Weighed, others: Sequence[Weighed], case: Case) -> list[Weighed]:
    """Everything that competes: the final hypothesis, the others, the nuisance parameters alone;
    each set of effects once."""
    out: dict[object, Weighed] = {(final.hypothesis.keys, final.freed): final}
    for w in (*others, case.base):
        out.setdefault((w.hypothesis.keys, w.freed), w)
    return list(out.values())


def weights(field: Sequence[Weighed], case: Case) -> Real:
    """Posterior probabilities of a field, (hypotheses,), one together."""
    logs = np.array([log_odds(w, case) for w in field])
    likely: Real = np.exp(logs - logs.max())
    return likely / likely.sum()


def beside_all(
    effect: Effect,
    final: Weighed,
    field: Sequence[Weighed],
    likely: Real,
    untold: Sequence[Effect] = (),
) -> tuple[list[Weighed], Real]:
    """A field with what was refitted in place of an effect of the final hypothesis beside all sets
    that have one of these, too, where nobody refitted it: as likely there against the others as
    beside the final one's, no likelier than what was refitted; and with what no recording tells
    from that effect (``untold``), as likely as it. Larger sets grow from one place, and are no
    evidence for it against others that are as good."""
    rest = final.hypothesis.keys - {effect.key}
    tried = {w.hypothesis.keys for w in field}
    instead = {
        e.key: (e, float(p))
        for w, p in zip(field, likely, strict=True)
        if rest < w.hypothesis.keys and len(w.hypothesis.effects) == len(rest) + 1
        for e in w.hypothesis.effects
        if e.key not in rest
    }
    mine = instead[effect.key][1]
    instead = {e.key: (e, mine) for e in untold} | instead
    more: dict[frozenset[Key], tuple[Weighed, float]] = {}
    for w, p in zip(field, likely, strict=True):
        there_too = w.hypothesis.keys & instead.keys()
        stands = max((instead[key][1] for key in there_too), default=0.0)
        for key in (k for k in there_too if instead[k][1] >= stands):  # not what it needs beside
            for other, at in instead.values():
                keys = w.hypothesis.keys - {key} | {other.key}
                there = p * min(1.0, at / max(instead[key][1], 1e-300))
                if keys in tried or other.key in w.hypothesis.keys:
                    continue
                if keys not in more or there > more[keys][1]:
                    more[keys] = _with(w, key, other), there
    found = np.array([*likely, *(p for _, p in more.values())])
    return [*field, *(w for w, _ in more.values())], found / found.sum()


def _with(w: Weighed, key: Key, other: Effect) -> Weighed:
    """With another effect in place of one of its own, not fitted."""
    effects = tuple(other if e.key == key else e for e in w.hypothesis.effects)
    return replace(w, hypothesis=replace(w.hypothesis, effects=effects))


def support(effect: Effect, field: Sequence[Weighed], likely: Real, model: Model) -> float:
    """The probability of those hypotheses that have an effect of this type where it stands."""
    there = [_same(w.hypothesis, effect, model) for w in field]
    return float(np.sum(likely[np.array(there, dtype=bool)]))


def support_near(effect: Effect, field: Sequence[Weighed], likely: Real, model: Model) -> float:
    """The same of those that have one of this type, in its direction, near by: at one of the places
    of a `REGION` about it, which the likeliest come into first. What it is may be known, and which
    of a few nodes it stands at, not. Nothing of channels, each of which reads for itself."""
    if effect.fault is not None:
        return 0.0
    known, own, near = set(model.node_ids.tolist()), nodes_at(effect, model), {effect.place}
    alike = [
        (float(p), e)
        for w, p in zip(field, likely, strict=True)
        for e in w.hypothesis.effects
        if (e.physics, e.place.dof) == (effect.physics, effect.place.dof)
    ]
    for _, e in sorted(alike, key=lambda pair: -pair[0]):
        at = nodes_at(e, model)
        if at and at <= known and extent(own | at, model) <= REGION:
            near.add(e.place)
            own = own | at
    there = [
        any(e.physics == effect.physics and e.place in near for e in w.hypothesis.effects)
        for w in field
    ]
    return float(np.sum(likely[np.array(there, dtype=bool)]))


def favoured(
    effect: Effect,
    places: Sequence[Place],
    field: Sequence[Weighed],
    likely: Real,
    model: Model,
    beside: Collection[Key],
) -> bool:
    """Whether something else at one of the places is strongly favoured over an effect: by the
    likeliest hypotheses that have each; not what stands ``beside`` the effect."""
    own = [_same(w.hypothesis, effect, model) for w in field]
    here = _there(places, field, model, beside)
    mine, best = (float(np.max(likely[np.array(x)], initial=0.0)) for x in (own, here))
    return mine < best * np.exp(-0.5 * STRONG)


def support_at(
    places: Sequence[Place],
    field: Sequence[Weighed],
    likely: Real,
    model: Model,
    beside: Collection[Key],
) -> float:
    """The probability of those hypotheses that have an effect of any type at one of the places, or
    around it; what stands ``beside`` it anyhow (an accelerometer at every node) says nothing of
    the place."""
    return float(np.sum(likely[np.array(_there(places, field, model, beside), dtype=bool)]))


def _there(
    places: Sequence[Place], field: Sequence[Weighed], model: Model, beside: Collection[Key]
) -> list[bool]:
    further = [[e for e in w.hypothesis.effects if e.key not in beside] for w in field]
    return [any(_covers(e.place, p, model) for e in some for p in places) for some in further]


def _covers(one: Place, other: Place, model: Model) -> bool:
    """Whether a place has all elements and nodes of another, and so is there too; a few elements
    have the nodes that they stand on."""
    if not (other.elements or other.nodes):
        return other == one
    if not set(other.elements) <= set(one.elements):
        return False
    if set(other.nodes) <= set(one.nodes):
        return True
    ends = nodes_of(model, one.elements)
    return set(other.nodes) <= ends and extent(ends, model) <= REGION


def _same(h: Hypothesis, effect: Effect, model: Model) -> bool:
    alike = tuple(e for e in h.effects if e.physics == effect.physics)
    return bool(alike) and has(Hypothesis(alike, h.fit), effect, model)


def rivals(final: Weighed, others: Sequence[Weighed], case: Case) -> list[Weighed]:
    """Other hypotheses against which the recordings are no strong evidence, likeliest first."""
    least = log_odds(final, case) - STRONG / 2.0
    near = [(log_odds(w, case), w) for w in others if w is not final]
    return [w for at, w in sorted(near, key=lambda pair: -pair[0]) if at >= least]
