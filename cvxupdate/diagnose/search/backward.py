"""A set of effects freed of those that its evidence is better without (backward elimination by
Bayes' information criterion; Hastie, Tibshirani and Friedman 2009, 3.3.2)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, without
from cvxupdate.diagnose.priced import price, unknowns_of
from cvxupdate.diagnose.search.plainer import plainer
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.settings import BEHIND, EXPLAINED, OPEN, STRONG
from cvxupdate.diagnose.types import Evidence, Key, Progress
from cvxupdate.forked import every

FIRM = 10.0  # deviations: half their square is ten times what any unknown costs


def backward(
    evidence: Evidence,
    best: Hypothesis,
    progress: Progress,
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """One effect after the other goes, what is sought before what a rig does, as long as the
    evidence grows; then what is said in fewer unknowns. While a set explains, as long as there is
    no strong evidence against fewer: two effects that do little may go together where each by
    itself is worth its unknowns. What is left of the likeliest without each effect, as it is; and
    all that was tried, sharpened."""
    tried, kept, at = list[Hypothesis](), list[Hypothesis](), best
    walked: set[frozenset[Key]] = set()
    while True:
        order = sorted(range(len(at.effects)), key=lambda k: at.effects[k].type.rig)
        rests = [(k, r) for k in order if (r := without(evidence, at, k)) is not None and r.effects]
        if at is best or merit(at) > merit(best):
            best, kept = at, [r for _, r in rests]
        walked.add(at.keys)
        fewer = _fewer(evidence, at, rests, progress)
        if not any(merit(h) > merit(best) and h.keys not in walked for h in fewer):
            fewer = merged(fewer, _in_fewer_unknowns(evidence, at, progress))
        tried += fewer
        likeliest = max((h for h in fewer if h.keys not in walked), key=merit, default=at)
        forgiven = STRONG / 2.0 if likeliest.fit.misfit <= OPEN * EXPLAINED else 0.0
        done = evidence.hurried or len(likeliest.effects) < 2
        if done or likeliest is at or merit(likeliest) <= merit(best) - forgiven:
            return kept, tried
        at = likeliest


def _fewer(
    evidence: Evidence,
    whole: Hypothesis,
    rests: Sequence[tuple[int, Hypothesis]],
    progress: Progress,
) -> list[Hypothesis]:
    """A set without each of its effects (their numbers and the ``rests``), sharpened. Of a set that
    explains a rest whatever it leaves as it is, for beside light resonances what hardly moves them
    leaves a thousand times as much until the others are fitted again; but none without what is
    `firm`."""
    last = evidence.levels - 1
    if whole.fit.misfit > OPEN * EXPLAINED:
        return raced(evidence, [r for _, r in rests], ((last, len(rests)),), progress)
    loose = [r for k, r in rests if not firm(whole, k)]
    return raced(evidence, loose, ((last, len(loose)),), progress, behind=np.inf)


def _in_fewer_unknowns(
    evidence: Evidence, whole: Hypothesis, progress: Progress
) -> list[Hypothesis]:
    """What is `plainer`, sharpened, unless it falls far behind the ``whole``."""
    last = evidence.levels - 1
    parts = entered(evidence, plainer(evidence, whole), progress)
    near = [h for h in parts if h.penalised <= BEHIND * whole.penalised]
    return raced(evidence, near, ((last, len(near)),), progress)


def firm(h: Hypothesis, number: int) -> bool:
    """Whether the first unknown of a change of the model is so many deviations from nothing that no
    other takes its part: half their square is what the evidence would lose at least."""
    fit, e = h.fit, h.effects[number]
    first = len(fit.setting.model.parameters) - sum(x.columns for x in h.effects[number:])
    return e.change is not None and bool(abs(fit.p[first]) > FIRM * fit.deviations[first])


def merit(h: Hypothesis) -> float:
    """Logarithm of the evidence, less what its unknowns cost."""
    return h.fit.log_evidence - price(unknowns_of(h), h.fit.independent)


def freed(evidence: Evidence, whole: Hypothesis) -> Hypothesis:
    """A set without the effects that its evidence is better without as they are, those that do
    least first; one stays."""
    idle: list[int] = []
    best = whole
    while len(best.effects) > 1:
        left = [k for k in range(len(whole.effects)) if k not in idle]
        rests = every(lambda k: without(evidence, whole, *idle, k), left, evidence.jobs)
        found = [(r, k) for r, k in zip(rests, left, strict=True) if r is not None]
        likelier = [(merit(r), k, r) for r, k in found if merit(r) >= merit(best)]
        if not likelier:
            break
        _, k, best = max(likelier, key=lambda x: x[:2])
        idle.append(k)
    return best
