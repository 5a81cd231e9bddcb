"""A mass or a spring in place of a hidden oscillator that a fit tuned beyond the recordings.

Beside something that is missing, too, a lump may look like a resonance; once the rest is there the
fit takes its tuning out of the band, and with it the set that is right would be lost.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from, without
from cvxupdate.diagnose.types import Evidence, Seed
from cvxupdate.physics.effect import HiddenOscillator

LUMP, SPRING = "added_mass", "grounding_spring"


def tenable(evidence: Evidence, h: Hypothesis) -> bool:
    """False where another effect says it better: a hidden oscillator tuned beyond the recordings
    (a mass or a spring), an exchange of channels in part."""
    return not _untenable(evidence, h)


def untuned(evidence: Evidence, h: Hypothesis) -> list[Seed]:
    """A fitted set with the one oscillator that is tuned above the recordings as a mass, below them
    as a spring to ground; nothing where other effects are not tenable either."""
    out = _untenable(evidence, h)
    if len(out) != 1 or not isinstance(h.effects[out[0]].action, HiddenOscillator):
        return []
    values, place = h.values[out[0]], h.effects[out[0]].place
    above = values["k"] > values["m"] * (2.0 * np.pi * evidence.band[1]) ** 2
    name = LUMP if above else SPRING
    if name not in evidence.names:
        return []
    rest = without(evidence, h, out[0])
    if rest is None:
        return []
    known = evidence.candidates(rest.fit.setting.model, [name])
    here = [e for e in known if e.place.nodes == place.nodes and e.place.dof in (None, place.dof)]
    fresh = [e for e in here if e.key not in rest.keys]
    sized = evidence.finite_size(rest.fit, rest.fit, rest.effects, fresh)
    return seeds_from(evidence, rest, sized.scores, rest.fit.setting.level)


def _untenable(evidence: Evidence, h: Hypothesis) -> Sequence[int]:
    wary = [k for k, e in enumerate(h.effects) if e.change is None]
    return [k for k in wary if not h.effects[k].tenable(h.values[k], *evidence.band)]
