"""Refits for real: hypotheses race from smooth recordings to sharp ones, and who falls far behind
does not go on."""

from __future__ import annotations

from collections.abc import Callable, Sequence

from cvxupdate.diagnose.effects import Bench, Hypothesis, Trial, as_drawn
from cvxupdate.diagnose.fit import Fit, at_level, fit
from cvxupdate.diagnose.shortlist import Key
from cvxupdate.errors import ModelError

CHARGE = 0.1  # relative decrease of the misfit that a further parameter must bring
BEHIND = 10.0  # times the best cost at a level: no use going on
NEAR = 3.0  # times the best: always goes on, up to twice the number that otherwise may
# weighted squares per row beyond noise (half a percent of the response): what leaves no more needs
# nothing else
CLEAR = 0.25
AGAIN = 1  # level at which a fit that leaves more is begun a second time, from the drawing
TRIAGE = 3  # iterations after which hypotheses are compared for the first time
Tell = Callable[[str], None]


def charged(t: Trial) -> float:
    """Misfit with a charge for each parameter beyond the first of each effect: what it takes to be
    believed."""
    return t.fit.misfit * (1.0 + CHARGE * (t.extra - len(t.effects)))


def entered(bench: Bench, hypotheses: Sequence[Hypothesis], tell: Tell) -> list[Trial]:
    """The first few iterations of hypotheses, at the level their settings have, best first; of one
    begun in several places the best.

    Those that lead to no structure are left out.
    """
    found: dict[frozenset[Key], Trial] = {}
    for number, h in enumerate(hypotheses):
        tell(f"refitting {number + 1} of {len(hypotheses)}: {h.name}")
        try:
            trial = kept(
                bench, Trial(h.effects, fit(h.setting, h.start, tolerance=1e-2, iterations=TRIAGE))
            )
        except ModelError:
            continue
        if trial is not None and (
            trial.keys not in found or charged(trial) < charged(found[trial.keys])
        ):
            found[trial.keys] = trial
    return sorted(found.values(), key=charged)


def raced(
    bench: Bench, trials: Sequence[Trial], levels: Sequence[int], places: Sequence[int], tell: Tell
) -> list[Trial]:
    """Fitted trials carried on through ``levels``; at most ``places[k]`` (or twice that of near
    equals) enter the k-th. Best first."""
    last = len(bench.data.levels) - 1
    runners = sorted(trials, key=charged)
    for level, most in zip(levels, places, strict=True):
        if not runners:
            break
        best = charged(runners[0])
        field = [
            t
            for k, t in enumerate(runners)
            if charged(t) <= BEHIND * best
            and (k < most or (k < 2 * most and charged(t) <= NEAR * best))
        ]
        arrived = []
        for number, t in enumerate(field):
            tell(f"sharpening {number + 1} of {len(field)}: {t.name}")
            try:
                setting = at_level(t.fit.setting, bench.data.levels[level])
                found = fit(
                    setting, t.fit.p, tolerance=1e-3 if level == last else 1e-2, iterations=12
                )
                if level == AGAIN and found.excess > CLEAR:
                    found = _again(bench, found)
            except ModelError:
                continue
            trial = kept(bench, Trial(t.effects, found))
            if trial is not None:
                arrived.append(trial)
        runners = sorted(arrived, key=charged)
    return runners


def _again(bench: Bench, found: Fit) -> Fit:
    """The better of a fit and of one begun from the drawing."""
    try:
        other = fit(
            found.setting, as_drawn(bench, found.setting, found.p), tolerance=1e-2, iterations=12
        )
    except ModelError:
        return found
    return min(found, other, key=lambda f: f.misfit)


def kept(bench: Bench, trial: Trial) -> Trial | None:
    """None for what another word says better: a hidden oscillator tuned beyond the recordings (a
    mass or a spring), an exchange of channels in part."""
    if any(e.candidate.change is None for e in trial.effects):
        for effect, (values, _) in zip(trial.effects, trial.figures, strict=True):
            if not effect.candidate.tenable(values, bench.data.bottom, bench.data.top):
                return None
    return trial
