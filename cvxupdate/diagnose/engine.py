"""From recordings of responses to trials: ordinary fit, short list, refits of one effect and, where
one is not enough, of two."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np

from cvxupdate.diagnose.data import WIDE, Data
from cvxupdate.diagnose.effects import Bench, Trial
from cvxupdate.diagnose.finding import Finding
from cvxupdate.diagnose.fit import CREDIBLE, Fit, at_level, error_of, fit, scatter_of, setting_for
from cvxupdate.diagnose.pairs import beside, moved, pairs, planted_or_none, simpler
from cvxupdate.diagnose.refit import CLEAR, charged, entered, raced
from cvxupdate.diagnose.residual import noise_errors
from cvxupdate.diagnose.screen import Score, screen
from cvxupdate.diagnose.shortlist import Key, best_of, shortlist
from cvxupdate.diagnose.signals import Real
from cvxupdate.diagnose.stability import stability
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics import EFFECTS, effect_names, told
from cvxupdate.physics.place import Place

COARSE, FINE = (0, 1), (2, 3)  # levels at which the short list runs, and at which only the best do
PLACES, FINAL = (16, 8), (5, 4)
PARENTS, FEW = (
    4,
    2,
    # single effects beside which a second is sought; where the mesh alone may leave as much as the
    # best single effect  # how many enter each
)
# drop of the damping ratios' squares that chance gives one parameter once in two thousand times
# (chi-square, one freedom)
DAMPING_GAIN = 12.0
# weighted squares per row: a residual within noise and the allowance for discretisation
# (`signals.FLOOR`)
EXPLAINED = 1.0
# part of the half-samples that makes a candidate worth a refit whatever its share (Meinshausen and
# Bühlmann: 0.6 to 0.9)
STABLE = 0.7
OPEN = 4.0  # weighted squares per row above which a model leaves something open
FAR = 10.0  # the same, above which there is nothing to sharpen


@dataclass(frozen=True)
class Outcome:
    """All that the engine found, for the verdict: errors (fit, hold-out) as modelled and with
    ordinary parameters, noise, the ordinary fit, first-order shares, trials of one effect and of
    two (best first), how often half of the recordings chooses a candidate, and of every trial that
    was refitted at least once the share of the misfit that it left there."""

    bench: Bench
    nominal: tuple[float, float]
    ordinary: tuple[float, float]
    noise: tuple[float, float]
    base: Fit
    screened: tuple[Score, ...] = ()
    trials: tuple[Trial, ...] = ()
    pairs: tuple[Trial, ...] = ()
    stable: Mapping[Key, float] = field(default_factory=dict)
    entered: tuple[tuple[Trial, float], ...] = ()

    @property
    def pattern(self) -> bool:
        """Whether only the pattern of damping may be at stake: ordinary parameters explain the
        rest."""
        return self.base.misfit <= EXPLAINED

    def errors(self, t: Trial) -> tuple[float, float]:
        """Normalised response error of a trial on what was fitted and on what was held out."""
        data = self.bench.data
        return (
            error_of(t.fit.setting, t.fit.p, data.sharp, t.fit.point),
            error_of(t.fit.setting, t.fit.p, data.sharp_hold_out, t.fit.point),
        )


def explain(
    model: Model,
    original: Model,
    data: Data,
    supports: Sequence[tuple[int, str]],
    release: Callable[[int, str], Model],
    words: Sequence[str] | None,
    progress: Callable[[str], None] | None = None,
) -> Outcome:
    """Fit the ordinary model, screen every word at every place at each level, refit the short list;
    pairs where no single effect explains.

    ``model`` is undamped and carries its ordinary parameters; ``original`` the model of the file,
    for its damping.
    """
    tell = progress or (lambda text: None)
    tell("fitting the ordinary parameters")
    setting = setting_for(model, original, data.levels[0], data.top, data.bottom, (), data.mesh)
    sensors = tuple(dict.fromkeys(label for s in data.sharp for label in s.sensors))
    bench = Bench(
        original,
        model,
        data,
        tuple(supports),
        release,
        tuple(w for w in effect_names() if words is None or w in words),
        sensors,
        float(np.median(setting.zeta)) if setting.damped else 0.005,
    )
    p = np.zeros(len(setting.columns))
    nominal = (error_of(setting, p, data.sharp), error_of(setting, p, data.sharp_hold_out))
    points: list[Fit] = []
    for level in data.levels:
        points.append(fit(at_level(setting, level), p))
        p = points[-1].p
        if len(points) == len(data.levels) - 1 and points[-1].misfit > FAR * EXPLAINED:
            break  # nothing to sharpen: the ordinary model is far off
    base = points[-1]
    errors = (
        error_of(setting, p, data.sharp, base.point),
        error_of(setting, p, data.sharp_hold_out, base.point),
    )
    outcome = Outcome(
        bench, nominal, errors, (noise_errors(data.sharp), noise_errors(data.sharp_hold_out)), base
    )
    pattern = outcome.pattern
    damping = {t.name for t in EFFECTS if t.damping}
    wanted = [
        w
        for w in bench.words
        if not pattern or (w in damping and base.damping_strain > DAMPING_GAIN)
    ]
    if not wanted:
        return outcome
    candidates = bench.candidates(model, wanted)
    rankings = []
    for point in points[: len(data.levels) - 1]:
        tell(f"screening {len(candidates)} candidates")
        rankings.append(screen(point.point, candidates))
    screened = tuple(best_of(rankings))
    clearest = int(np.argmax([max((s.share for s in r), default=0.0) for r in rankings]))
    tell("resampling the recordings")
    stable = stability(points[clearest].point, rankings[clearest])
    start = Trial((), points[0])
    listed = best_of(
        [*(shortlist(r) for r in rankings), [s for s, often in stable if often >= STABLE]]
    )
    hypotheses = [
        *(planted_or_none(bench, start, score, data.levels[0]) for score in listed),
        *([] if pattern else beside(bench, start, level=0)),
    ]
    entries = entered(bench, [h for h in hypotheses if h is not None], tell)
    coarse = raced(bench, entries, COARSE, PLACES, tell)
    if not pattern and coarse and charged(coarse[0]) > OPEN * EXPLAINED:
        coarse = moved(bench, coarse, tell)
    singles = raced(bench, coarse, FINE, FINAL, tell)
    if pattern:
        singles.sort(key=lambda t: t.fit.damping_strain)
    enough = (
        pattern or base.misfit <= OPEN * EXPLAINED or (singles and singles[0].fit.excess <= CLEAR)
    )
    meshed = bool(singles) and outcome.errors(singles[0])[0] <= mesh_allowance(
        outcome, singles[0].fit.setting.model
    )  # what is left may be the mesh's
    double = [] if enough else pairs(bench, coarse, tell, FEW if meshed else PARENTS)
    if double:
        best: dict[frozenset[Key], Trial] = {}
        for t in sorted([*singles, *simpler(bench, double[0], tell)], key=charged):
            best.setdefault(t.keys, t)
        singles = list(best.values())
    return replace(
        outcome,
        screened=screened,
        trials=tuple(singles),
        pairs=tuple(double),
        stable={s.candidate.key: often for s, often in stable},
        entered=tuple((t, t.fit.misfit / points[0].misfit) for t in entries),
    )


def mesh_allowance(outcome: Outcome, model: Model) -> float:
    """Response error that the mesh may leave although its shift was taken out: what extrapolation
    may miss, in half-power bandwidths (2 ζ f).

    ``model`` is that of the hypothesis: beams that deform in shear have another mesh error.
    """
    if not outcome.base.setting.damped:
        return 0.0
    data = outcome.bench.data
    mesh = data.mesh_of(model)
    return float(
        min(
            0.3,
            mesh.missed(data.top) / np.median(outcome.base.point.damping[outcome.base.point.owner]),
        )
    )


def followed(outcome: Outcome) -> Fit:
    """The ordinary model with its parameters let go far beyond their usual scatter: is it a matter
    of wrong numbers in many groups?"""
    bench = outcome.bench
    model = bench.ordinary.with_parameters(
        [replace(q, lower=-WIDE, upper=WIDE) for q in bench.ordinary.parameters]
    )
    setting = bench.setting(model, bench.data.levels[0], ())
    p = np.zeros(len(setting.columns))
    for level in bench.data.levels:
        found = fit(at_level(setting, level), p)
        p = found.p
    return found


def loose_groups(model: Model, p: Real) -> list[tuple[Parameter, float, float]]:
    """Ordinary parameters outside their credible band: (parameter, p, how many deviations)."""
    out = []
    for q, value in zip(model.parameters, p, strict=False):
        if q.group is not None and abs(value) > CREDIBLE * scatter_of(q):
            out.append((q, float(value), abs(float(value)) / scatter_of(q)))
    return sorted(out, key=lambda item: -item[2])


def group_finding(q: Parameter, p: float, deviations: float) -> Finding:
    """One of `loose_groups` as a finding."""
    place = Place(elements=q.elements, groups=(q.group or q.name.rpartition(".")[0],))
    word = "stiffness_change" if q.of == "stiffness" else "mass_change"
    effect = told(word, place)
    values = {"factor": 1.0 + p}
    sure = float(np.clip(1.0 - 3.0 / deviations**2, 0.5, 0.99))
    return Finding(
        word,
        place,
        values,
        {"factor": abs(p) / deviations},
        sure,
        (),
        effect.says(values),
        effect.title,
    )
