"""What all likely hypotheses have in common, claimed: a finding that is right whatever the rest is,
where that is one effect of a size that is told."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.judge.confidence import standing
from cvxupdate.diagnose.judge.graded import Graded
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import LEAST_SIZE, STRONG
from cvxupdate.physics import effect_names
from cvxupdate.physics.effect import Effect


def claimed(judgement: Judgement) -> Judgement:
    """With its graded claim as the finding, of the likeliest hypothesis that has it, where nothing
    is claimed yet, what can be said names one effect, and every effect was tried that recordings of
    this kind can tell: of a few that were asked for, one is always the likeliest. Else as it is."""
    said, evidence = judgement.graded, judgement.case.evidence
    all_tried = set(effect_names(evidence.told_by)) <= set(evidence.names)
    if judgement.findings or said is None or not said.having or not all_tried:
        return judgement
    effects = [w.hypothesis.effects[k] for w, k, _ in said.having]
    lead = next((j for j, e in enumerate(effects) if _stands(e)), 0)
    found = _finding(said, effects, lead)
    if found is None:
        return judgement
    final = said.having[lead][0]
    case, field = judgement.case, (*judgement.several, *judgement.singles)
    stands = [standing(j, final, field, case) for j in range(len(final.hypothesis.effects))]
    return replace(judgement.claiming(final, [found], stands), field=field, graded=said)


def _stands(effect: Effect) -> bool:
    """Whether it has a place, and is not all over the structure."""
    return bool(effect.place.nodes or effect.place.elements)


def _finding(said: Graded, effects: Sequence[Effect], lead: int) -> Finding | None:
    """The one that leads, the likeliest that has a place, with the size that all likely hypotheses
    give it, and the other places against which there is no strong evidence; None where these have
    effects of several kinds (a mass is one, whether an accelerometer's or another's), or that size
    is within twice its deviation."""
    effect, (w, k, most) = effects[lead], said.having[lead]
    figures = w.hypothesis.figures[k]
    values, deviations = dict(figures.values), dict(figures.deviations)
    alike = {e.physics for e in effects}
    if said.figure is not None and (len(alike) == 1 or said.kind == "mass"):
        name, _, values[name], deviations[name] = said.figure
    elif len({e.key for e in effects}) > 1:
        return None
    first = effect.figures[0]
    size = values[first.name] - (first.nothing or 0.0)
    if abs(size) < LEAST_SIZE * deviations[first.name]:
        return None
    others: dict[object, tuple[Effect, float]] = {}
    for e, (_, _, p) in zip(effects, said.having, strict=True):
        if e.place != effect.place and _stands(e) and p > most * np.exp(-0.5 * STRONG):
            others.setdefault(e.key, (e, max(1.0, most / p)))
    return Finding.of(
        effect,
        values,
        deviations,
        said.probability,
        noise=figures.noise,
        explains=said.explains,
        equivalent=tuple(e for e, _ in others.values()),
        behind=tuple(b for _, b in others.values()),
    )
