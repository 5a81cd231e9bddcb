"""Findings of what the evidence says beside its search: laws and patterns of damping ratios."""

from __future__ import annotations

from dataclasses import dataclass

from cvxupdate.diagnose.judge.alternatives import overlapping
from cvxupdate.diagnose.judge.confidence import Competitor, standing_of
from cvxupdate.diagnose.results import Damper, Finding, Further
from cvxupdate.diagnose.settings import DAMPING_GAIN, LAW
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
    name = effect.figures[0].name
    near = [d for d in others if d.strain <= best.strain + DAMPING_GAIN / 2.0]
    field = [
        Competitor(d.strain, overlapping(d.effect.place, effect.place, grown), d in near)
        for d in others
    ]
    size = abs(values[name]) / max(spread[name], 1e-12)
    finding = Finding(
        effect.physics,
        effect.place,
        effect.title,
        values,
        spread,
        spread,
        standing_of(best.strain, further.strain, field, size).confidence,
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
