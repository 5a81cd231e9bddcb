"""A set of effects freed of those that its evidence is better without (backward elimination by
Bayes' information criterion; Hastie, Tibshirani and Friedman 2009, 3.3.2)."""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis, price, without
from cvxupdate.diagnose.search.plainer import plainer
from cvxupdate.diagnose.search.race import entered, raced
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.forked import every


def backward(
    evidence: Evidence,
    best: Hypothesis,
    progress: Progress,
) -> tuple[list[Hypothesis], list[Hypothesis]]:
    """One effect after the other goes, what is sought before what a rig does, as long as the
    evidence grows, or is said in fewer unknowns. What is left at the end without each effect, as it
    is; and all that was tried, sharpened."""
    tried: list[Hypothesis] = []
    last = evidence.levels - 1
    while True:
        order = sorted(range(len(best.effects)), key=lambda k: best.effects[k].type.rig)
        rests = [without(evidence, best, k) for k in order]
        kept = [r for r in rests if r is not None and r.effects]
        parts = entered(evidence, plainer(evidence, best), progress)
        fewer = raced(evidence, [*kept, *parts], ((last, len(kept) + len(parts)),), progress)
        tried += fewer
        likeliest = max(fewer, key=merit, default=best)
        done = evidence.hurried or len(likeliest.effects) < 2
        if done or merit(likeliest) <= merit(best):
            return kept, tried
        best = likeliest


def merit(h: Hypothesis) -> float:
    """Logarithm of the evidence, less what its unknowns cost."""
    return h.fit.log_evidence - price(h.unknowns, h.fit.independent)


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
