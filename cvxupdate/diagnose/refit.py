"""Refits for real: hypotheses race from smooth recordings to sharp ones, and who falls far behind does not go on."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.effects import Bench, Hypothesis, Trial
from cvxupdate.diagnose.fit import at_level, fit
from cvxupdate.diagnose.screen import left_over
from cvxupdate.errors import ModelError
from cvxupdate.physics.sensor_fault import EXCHANGED

CHARGE = 0.1  # relative decrease of the misfit that a further parameter must bring
BEHIND = 10.0  # times the best cost at a level: no use going on
NEAR = 3.0  # times the best: always goes on, up to twice the number that otherwise may
Tell = Callable[[str], None]


def charged(t: Trial) -> float:
    """Misfit with a charge for each parameter beyond the first of each effect: what it takes to be believed."""
    return t.fit.misfit * (1.0 + CHARGE * (t.extra - len(t.effects)))


SIZES = (-0.4, -0.2, -0.07, 0.07, 0.2, 0.6, 2.0)  # of a parameter, tried before a fit of what acts on a whole member


def scanned(hypothesis: Hypothesis) -> Hypothesis:
    """The same hypothesis with the best of several sizes to begin with: a large effect on a whole member has valleys of its own.

    Sizes are compared by what the ordinary unknowns could not take up, to first order; the response error itself jumps with every resonance passed.
    Only for words with one parameter, the last of the model's.
    """
    effect = hypothesis.effects[-1]
    if effect.columns != 1:
        return hypothesis
    at = len(hypothesis.setting.model.parameters) - 1
    bound = hypothesis.setting.model.parameters[at]
    best, least = hypothesis, np.inf
    for size in (float(hypothesis.start[at]), *(x for x in SIZES if bound.lower < x < bound.upper)):
        start = hypothesis.start.copy()
        start[at] = size
        try:
            left = left_over(hypothesis.setting.evaluate(start)).residual
        except ModelError:
            continue
        if float(left @ left) < least:
            best, least = replace(hypothesis, start=start), float(left @ left)
    return best


def entered(bench: Bench, hypothesis: Hypothesis, tell: Tell) -> Trial | None:
    """The first fit of a hypothesis, at the level its setting has; None where it leads to no structure."""
    tell(f"refitting {hypothesis.name}")
    try:
        return kept(bench, Trial(hypothesis.effects, fit(hypothesis.setting, hypothesis.start, tolerance=1e-2, iterations=8)))
    except ModelError:
        return None


def raced(bench: Bench, trials: Sequence[Trial], levels: Sequence[int], places: Sequence[int], tell: Tell) -> list[Trial]:
    """Fitted trials carried on through ``levels``; at most ``places[k]`` (or twice that of near equals) enter the k-th. Best first."""
    last = len(bench.data.levels) - 1
    runners = sorted(trials, key=charged)
    for level, most in zip(levels, places, strict=True):
        if not runners:
            break
        best = charged(runners[0])
        field = [t for k, t in enumerate(runners) if charged(t) <= BEHIND * best and (k < most or (k < 2 * most and charged(t) <= NEAR * best))]
        arrived = []
        for number, t in enumerate(field):
            tell(f"sharpening {number + 1} of {len(field)}: {t.name}")
            try:
                found = fit(at_level(t.fit.setting, bench.data.levels[level]), t.fit.p, tolerance=1e-3 if level == last else 1e-2, iterations=12)
            except ModelError:
                continue
            trial = kept(bench, Trial(t.effects, found))
            if trial is not None:
                arrived.append(trial)
        runners = sorted(arrived, key=charged)
    return runners


def kept(bench: Bench, trial: Trial) -> Trial | None:
    """None for what another word says better: a hidden oscillator tuned beyond the recordings (a mass or a spring), an exchange of channels in part."""
    if any(e.mass or e.candidate.sensor == "swap" for e in trial.effects):
        for effect, (values, _) in zip(trial.effects, trial.figures, strict=True):
            if effect.mass:
                tuned = np.sqrt(max(values["k"], 0.0) / max(values["m"], 1e-12)) / (2.0 * np.pi)
                if not 0.8 * bench.data.bottom <= tuned <= 1.1 * bench.data.top:
                    return None
            elif effect.candidate.sensor == "swap" and abs(values["gain"] - 1.0) > EXCHANGED:
                return None
    return trial
