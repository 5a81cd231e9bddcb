"""Findings of what the evidence says beside its search: laws and patterns of damping ratios."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.judge.alternatives import overlapping
from cvxupdate.diagnose.results import Damper, Finding, Further
from cvxupdate.diagnose.settings import LAW, MOST_SURE, STRONG
from cvxupdate.fe.model import Model
from cvxupdate.physics import told
from cvxupdate.physics.place import Place

MOST = 12  # equivalents listed


@dataclass(frozen=True)
class Pattern:
    """Findings, evidence, and the effect of damping with its size, for the updated model."""

    findings: tuple[Finding, ...] = ()
    lines: tuple[str, ...] = ()
    damped: tuple[Model, float] | None = None


def pattern_of(further: Further) -> Pattern:
    """One rate of decay where there is one, else the effect that explains the ratios best."""
    if further.alpha is not None:
        return Pattern((_law(*further.alpha),), further.lines)
    best = next(iter(further.dampers), None)
    if best is None or best.effect.change is None:
        return Pattern((), further.lines)
    return _damper(best, best.effect.change.model, further)


def _law(alpha: float, deviation: float) -> Finding:
    effect = told("mass_proportional_damping", Place())
    values, spread = {"alpha": alpha}, {"alpha": deviation}
    return Finding(
        effect.physics,
        effect.place,
        effect.title,
        values,
        spread,
        spread,
        LAW,
        1.0,
        (),
        effect.says(values),
    )


def _damper(best: Damper, grown: Model, further: Further) -> Pattern:
    effect, others = best.effect, further.dampers[1:]
    (values, spread) = effect.reported(grown, grown.parameters[-1:], [best.size], [best.deviation])
    near = [d for d in others if d.strain <= best.strain + STRONG]
    likely = np.exp(-0.5 * (np.array([d.strain for d in further.dampers]) - best.strain))
    nothing = np.sqrt(further.modes) * np.exp(-0.5 * (further.strain - best.strain))
    there = [
        d.effect.physics == effect.physics and overlapping(d.effect.place, effect.place, grown)
        for d in further.dampers
    ]
    finding = Finding(
        effect.physics,
        effect.place,
        effect.title,
        values,
        spread,
        spread,
        min(float(likely[there].sum() / (likely.sum() + nothing)), MOST_SURE),
        1.0 - best.strain / max(further.strain, 1e-300),
        tuple(d.effect for d in near[:MOST]),
        effect.says(values),
    )
    line = (
        f"The damping ratios depart from the file's pattern (sum of squares {further.strain:.3g} "
        f"in units of their usual scatter, {further.modes} modes); {effect.title} brings it to "
        f"{best.strain:.3g}."
    )
    return Pattern((finding,), (*further.lines, line), (grown, best.size))
