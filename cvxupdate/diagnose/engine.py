"""From recordings of responses to findings: ordinary fit, short list, refits, judgement on what was not fitted."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.fit import LEVELS, MASS_STD, STIFFNESS_STD, Fit, at_level, error_of, fit, prior_scales, setting_for
from cvxupdate.diagnose.mesh import NONE, MeshError
from cvxupdate.diagnose.residual import Fault, noise_errors
from cvxupdate.diagnose.screen import Score, delay_unit, screen
from cvxupdate.diagnose.signals import Signal, band_of, lines_of, smooth
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import has_property, select_parameters
from cvxupdate.physics import CATALOGUE
from cvxupdate.physics.attached_resonator import attach
from cvxupdate.physics.base import Candidate, Context, Wanted, reported
from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

PER_WORD, SHORT, RIVALS, FINAL = 3, 12, 4, 4  # kept: of a word at a level; refitted coarsely; after one that explains all; refitted to the end
DAMPING_WORDS = ("viscous_damper", "structural_damping", "mass_proportional_damping")
DAMPING_GAIN = 12.0  # drop of the damping ratios' squares that chance gives one parameter once in two thousand times (chi-square, one freedom)
CHARGE = 0.1  # relative decrease of the misfit that a further parameter must bring
BEHIND = 10.0  # times the best cost at a level: no use going on
EXPLAINED = 1.0  # weighted squares per row: a residual within noise and the allowance for discretisation (`signals.FLOOR`)
ORDINARY_LIMIT = 0.3


@dataclass(frozen=True)
class Trial:
    """A candidate refitted: errors on what was fitted and on what was not, figures found with deviations, and the fit itself."""

    candidate: Candidate
    fit: Fit
    error: float
    hold_out: float
    cost: float
    values: dict[str, float]
    deviations: dict[str, float]


@dataclass(frozen=True)
class Data:
    """Recordings at every level, and sharp ones for scoring."""

    fit: tuple[FrequencyResponse | TimeHistory, ...]
    hold_out: tuple[FrequencyResponse | TimeHistory, ...]
    levels: tuple[tuple[Signal, ...], ...]
    sharp: tuple[Signal, ...]
    sharp_hold_out: tuple[Signal, ...]
    top: float
    bottom: float
    mesh: MeshError = NONE


def prepare(recordings: Sequence[FrequencyResponse | TimeHistory]) -> Data:
    """Transform every recording once."""
    fit_ = tuple(r for r in recordings if r.origin.use == "fit")
    hold = tuple(r for r in recordings if r.origin.use != "fit")
    bands = [band_of(r) for r in fit_]
    lines, held = lines_of(fit_), lines_of(hold)
    return Data(fit_, hold, tuple(tuple(smooth(x, e) for x in lines) for e in LEVELS), tuple(smooth(x, 0.0) for x in lines),
                tuple(smooth(x, 0.0) for x in held),
                max(b[1] for b in bands), min(b[0] for b in bands))


def ordinary(model: Model) -> Model:
    """A stiffness and a mass p-value for every group: what drawing and laboratory always differ by."""
    wanted: list[Wanted] = []
    for of in ("stiffness", "mass"):
        groups: dict[str, list[int]] = {}
        for block in model.blocks:
            if has_property(block, of):
                for element, group in zip(block.ids.tolist(), block.groups, strict=True):
                    groups.setdefault(group or block.kind.name, []).append(element)
        wanted += [Wanted(f"{g}.{of}", of, tuple(dict.fromkeys(ids)), g, -ORDINARY_LIMIT, ORDINARY_LIMIT) for g, ids in groups.items()]
    return model.with_parameters(select_parameters(wanted, model))


@dataclass(frozen=True)
class Outcome:
    """All that the engine found, for the verdict: nominal, ordinary and best errors (fit, hold-out), noise, trials (best first), second effects."""

    nominal: tuple[float, float]
    ordinary: tuple[float, float]
    noise: tuple[float, float]
    base: Fit
    screened: tuple[Score, ...]
    trials: tuple[Trial, ...]


def explain(model: Model, original: Model, data: Data, supports: Sequence[tuple[int, str]], release: Callable[[int, str], Model],
            words: Sequence[str] | None, progress: Callable[[str], None] | None = None, earlier: Fit | None = None) -> Outcome:
    """Fit the ordinary model, screen every word at every place at each level, refit the short list.

    ``model`` is undamped and carries its ordinary (and earlier) parameters; ``original`` the model of the file, for its damping.
    """
    tell = progress or (lambda text: None)
    tell("fitting the ordinary parameters")
    setting = setting_for(model, original, data.levels[0], data.top, data.bottom, () if earlier is None else earlier.setting.faults, data.mesh)
    p = np.zeros(len(setting.columns)) if earlier is None else earlier.p
    nominal = (error_of(setting, p, data.sharp), error_of(setting, p, data.sharp_hold_out))
    m = model.matrices(model.zero())
    sensors = tuple(dict.fromkeys(label for s in data.sharp for label in s.sensors))
    context = Context(model, m.K, m.M, data.top, data.bottom, sensors, tuple(supports), release, float(np.median(setting.zeta)) if setting.damped else 0.005)
    points: list[Fit] = []
    for level in data.levels:
        points.append(fit(at_level(setting, level), p))
        p = points[-1].p
        if len(points) == len(data.levels) - 1 and points[-1].misfit > 10.0 * EXPLAINED:
            break  # nothing to sharpen: the ordinary model is far off
    base = points[-1]
    errors = (error_of(setting, p, data.sharp, base.point), error_of(setting, p, data.sharp_hold_out, base.point))
    noise = (noise_errors(data.sharp), noise_errors(data.sharp_hold_out))
    if base.misfit <= EXPLAINED:
        words = [w for w in DAMPING_WORDS if words is None or w in words] if base.damping_strain > DAMPING_GAIN else []
    if words is not None and not words:
        return Outcome(nominal, errors, noise, base, (), ())
    candidates = [c for word, make in CATALOGUE.items() if words is None or word in words for c in make(context)]
    best: dict[int, Score] = {}
    chosen: dict[str, Score] = {}
    for point in points[: len(data.levels) - 1]:
        tell(f"screening {len(candidates)} candidates")
        ranked = screen(point.point, candidates)
        for k, s in enumerate(ranked):
            if k not in best or s.share > best[k].share:
                best[k] = s
        for s in shortlist(ranked):
            if s.candidate.name not in chosen or s.share > chosen[s.candidate.name].share:
                chosen[s.candidate.name] = s
    pattern = base.misfit <= EXPLAINED  # then it is the pattern of damping that is at stake
    trials = refit(sorted(chosen.values(), key=lambda s: -s.share), original, data, points[0], tell)
    return Outcome(nominal, errors, noise, base, tuple(sorted(best.values(), key=lambda s: -s.share)[:40]),
                   tuple(sorted(trials, key=lambda t: t.fit.damping_strain) if pattern else trials))


def shortlist(ranked: Sequence[Score]) -> list[Score]:
    """The best of every word that comes near the best of all, at most `PER_WORD` of a word and `SHORT` in all."""
    order = sorted((s for s in ranked if s.share > 0.0), key=lambda s: -s.share)
    if not order:
        return []
    out: list[Score] = []
    count: dict[str, int] = {}
    seen: set[str] = set()
    for s in order:
        word = s.candidate.physics
        if s.share < 0.25 * order[0].share or len(out) >= SHORT:
            break
        if count.get(word, 0) < PER_WORD and s.candidate.name not in seen:
            count[word] = count.get(word, 0) + 1
            seen.add(s.candidate.name)
            out.append(s)
    return out


def refit(chosen: Sequence[Score], original: Model, data: Data, first: Fit, tell: Callable[[str], None]) -> list[Trial]:
    """Refit for real: coarse levels for the short list (few more once one explains the recordings), then the best to the end; best first."""
    coarse: list[tuple[float, Score, Fit]] = []
    more = len(chosen)
    bar: list[float] = []  # the best cost so far at each level: who is far behind at a level need not go on
    for number, s in enumerate(chosen[:SHORT]):
        if more <= 0:
            break
        tell(f"refitting {number + 1} of {min(len(chosen), SHORT)}: {s.candidate.name}")
        try:
            found = _fit_candidate(s, original, data, first, data.levels[:3], bar)
        except ModelError:
            continue
        more -= 1
        if found is None or _outside(s.candidate, found, data):
            continue
        coarse.append((found.cost + found.penalty, s, found))
        if found.misfit <= 4.0 * EXPLAINED:
            more = min(more, RIVALS)
    coarse.sort(key=lambda item: item[0])
    out = []
    for cost, s, found in coarse[:FINAL]:
        if cost > 30.0 * coarse[0][0]:
            break
        tell(f"sharpening {s.candidate.name}")
        last = found
        for level in data.levels[3:]:
            try:
                last = fit(at_level(last.setting, level), last.p, tolerance=1e-3)
            except ModelError:
                break
        out.append(_trial(s.candidate, last, data))
    return sorted(out, key=charged)


def _fit_candidate(s: Score, original: Model, data: Data, first: Fit, levels: Sequence[tuple[Signal, ...]], bar: list[float]) -> Fit | None:
    """The candidate fitted level by level; None when it fell far behind ``bar``, the best cost at each level so far."""
    c = s.candidate
    base = first.setting.model
    faults = first.setting.faults
    fresh = c.channel is not None and c.sensor is not None
    if c.channel is not None and c.sensor is not None:
        model, faults, guess = base, (*faults, Fault(c.channel, c.sensor, delay_unit(first.point))), s.p
    elif c.tuned is not None:
        row, frequency, zeta = c.tuned
        light = 1e-4 * max(base.total_mass(), 1e-9)
        model, guess = attach(base, row, frequency, float(np.clip(s.p[0], light, 0.2 * base.total_mass())), zeta), np.zeros(3)
    elif c.model is not None:
        model, guess = c.model, s.p
    else:
        raise ModelError("the candidate brings no model")
    setting = setting_for(model, original, levels[0], data.top, data.bottom, faults, data.mesh)
    n = len(base.parameters)
    start = np.zeros(len(setting.columns))
    start[:n] = first.p[:n]
    lower = np.array([q.lower for q in model.parameters[n:]])
    upper = np.array([q.upper for q in model.parameters[n:]])
    if first.setting.faults:
        known = len(first.setting.faults)
        at = len(start) - len(faults)
        start[at : at + known] = first.p[-known:]
    if fresh:
        start[-1] = guess[0]
    elif len(guess) == len(lower):
        start[n : n + len(guess)] = np.clip(guess, np.maximum(lower, -0.5), np.minimum(upper, 5.0))
    found: Fit | None = None
    for k, level in enumerate(levels):
        found = fit(at_level(setting, level), start if found is None else found.p, tolerance=1e-2, iterations=8)
        total = found.cost + found.penalty
        if len(bar) <= k:
            bar.append(total)
        elif k > 0 and total > BEHIND * bar[k]:
            return None
        bar[k] = min(bar[k], total)
    return found


def _outside(c: Candidate, found: Fit, data: Data) -> bool:
    """A hidden oscillator tuned beyond the recordings is a mass or a spring, which are words of their own."""
    if c.tuned is None:
        return False
    values, _ = figures(c, found)
    tuned = np.sqrt(max(values["k"], 0.0) / max(values["m"], 1e-12)) / (2.0 * np.pi)
    return not 0.8 * data.bottom <= tuned <= 1.1 * data.top


def charged(t: Trial) -> float:
    """Misfit with a charge for each parameter beyond the first: what it takes to be believed."""
    return t.fit.misfit * (1.0 + CHARGE * (t.candidate.extra - 1))


def _trial(c: Candidate, found: Fit, data: Data) -> Trial:
    setting, p = found.setting, found.p
    error = error_of(setting, p, data.sharp, found.point)
    hold = error_of(setting, p, data.sharp_hold_out, found.point)
    values, deviations = figures(c, found)
    return Trial(c, found, error, hold, found.cost + found.penalty, values, deviations)


def figures(c: Candidate, found: Fit) -> tuple[dict[str, float], dict[str, float]]:
    """The contract's parameters of a finding and their deviations (linearised, grown with the misfit)."""
    setting, p = found.setting, found.p
    A, _ = found.point.system().weighted()
    scales = prior_scales(setting)
    H = A.T @ A + np.diag(1.0 / scales**2)
    grow = max(1.0, found.cost / max(1, len(A) - len(p)))
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(H)), 0.0) * grow)
    n = len(setting.model.parameters)
    values: dict[str, float] = {}
    deviations: dict[str, float] = {}
    for name, k, how in c.report:
        at = len(p) - 1 if c.channel is not None else n - c.extra + k
        x, dx = float(p[at]), float(spread[at])
        if how == "gain":
            values[name], deviations[name] = 1.0 + x, dx
        elif how == "delay":
            unit = setting.faults[-1].unit
            values[name], deviations[name] = x * unit, dx * unit
        else:
            values[name], deviations[name] = reported(setting.model, setting.model.parameters[at], how, x, dx, c.offset)
    return values, deviations


def loose_groups(base: Fit) -> list[tuple[str, str, float, float]]:
    """Ordinary parameters outside their credible band: (name, of, p, how many deviations)."""
    out = []
    for q, value in zip(base.setting.model.parameters, base.p, strict=False):
        std = MASS_STD if q.of == "mass" else STIFFNESS_STD
        if abs(value) > 3.5 * std:
            out.append((q.name, q.of, float(value), abs(float(value)) / std))
    return sorted(out, key=lambda item: -item[3])


def level_dependence(data: Data) -> tuple[float, float] | None:
    """How much the transfer function changes between drive levels: (relative change, the same in noise alone); None where no two levels compare.

    A record that starts from rest gives H(s) = Y(s) / U(s) at every s without averaging, so two runs of one linear structure agree to noise.
    """
    best: tuple[float, float] | None = None
    single = [s for s in data.sharp if s.U.shape[1] == 1 and s.U.shape[2] == 1 and s.level is not None]
    for i, a in enumerate(single):
        for b in single[i + 1 :]:
            if a.level == b.level or a.inputs != b.inputs or a.sensors != b.sensors:
                continue
            n = min(len(a.s), len(b.s))
            x, y = _transfer(a, n), _transfer(b, n)
            if x is None or y is None:
                continue
            size = np.sqrt(np.mean(np.abs(x[0]) ** 2))
            change = (float(np.sqrt(np.mean(np.abs(x[0] - y[0]) ** 2)) / size), float(np.sqrt(np.mean(x[1] ** 2 + y[1] ** 2)) / size))
            if best is None or change[0] > best[0]:
                best = change
    return best


def _transfer(signal: Signal, n: int) -> tuple[np.ndarray, np.ndarray] | None:
    """H1 under a kernel of a twentieth of the frequency, and its noise: (points, sensors) each."""
    f = signal.s.imag[:n] / (2 * np.pi)
    centres = np.geomspace(f[0] * 1.1, f[-1] / 1.1, 60)
    kernel = (0.05 * centres[:, None]) / ((centres[:, None] - f) ** 2 + (0.05 * centres[:, None]) ** 2)
    drive = signal.U[:n, 0, 0]
    mix = kernel * np.conj(drive) / (kernel @ np.abs(drive) ** 2)[:, None]
    return mix @ signal.Y[:n, :, 0], np.sqrt(np.abs(mix) ** 2 @ signal.std[:n, :, 0] ** 2)


def held_dofs(model: Model, supports: Sequence[tuple[Sequence[int] | str, Sequence[str]]], active: Sequence[str]) -> list[tuple[int, str]]:
    """(node, kind) of every held DOF of an active kind."""
    out = []
    for nodes, dofs in supports:
        for node in (model.node_ids.tolist() if nodes == "all" else nodes):
            out += [(int(node), d) for d in dofs if d in active]
    return out
