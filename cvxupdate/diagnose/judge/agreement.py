"""Where two looks at the same recordings agree on an effect: its place, size, and need."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.hypothesis import Figures, Hypothesis
from cvxupdate.diagnose.judge.acceptance import Weighed
from cvxupdate.diagnose.results import Finding, in_words
from cvxupdate.diagnose.settings import HALVED
from cvxupdate.diagnose.types import Evidence
from cvxupdate.physics.effect import Effect


def needed(evidence: Evidence, rest: Hypothesis | None, final: Weighed) -> bool:
    """Whether the ``rest`` of the final hypothesis leaves twice as much, fitted or held out, or is
    no structure."""
    if rest is None or HALVED * rest.fit.excess >= final.fit.excess:
        return True
    return HALVED * evidence.errors(rest.fit).hold_out >= final.errors.hold_out  # NaN is not


def same(effect: Effect, finding: Finding) -> bool:
    """The same at one place, in whatever form."""
    return (effect.physics, effect.place) == (finding.physics, finding.place)


def as_large(finding: Finding, effect: Effect, figures: Figures) -> bool:
    """Whether its size on the responses is that by the modes, to within a half of it: else it is
    two things, or none."""
    name = effect.figures[0].name
    there, here = finding.parameters[name], figures.values[name]
    return abs(here - there) <= HALVED * max(abs(here), abs(there))


def both(finding: Finding, effect: Effect, figures: Figures) -> Finding:
    """A finding with figures halfway between the two looks, and half of what these differ by in
    their deviations: each errs in its own way. As the modes have it where the responses have it in
    another form (a stretch that ends within elements), whose figures are not the same."""
    if figures.values.keys() != finding.parameters.keys():
        return finding
    values, deviations = dict(finding.parameters), dict(finding.deviations)
    for name in values:
        apart = 0.5 * (figures.values[name] - values[name])
        values[name] += apart
        deviations[name] = float(np.hypot(deviations[name], apart))
    says = in_words(effect, values, deviations)
    return replace(finding, parameters=values, deviations=deviations, says=says)
