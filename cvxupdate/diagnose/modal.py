"""Diagnosis from tables of modes: frequencies and, where measured, shapes; the pattern of damping beside them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.convex import Bounds, SolverChoice, StepProblem, Tikhonov
from cvxupdate.diagnose.curves import modes_shown
from cvxupdate.diagnose.data import held_dofs, ordinary, release_from
from cvxupdate.diagnose.engine import DAMPING_GAIN
from cvxupdate.diagnose.export import of_modes
from cvxupdate.diagnose.finding import Diagnosis, Finding, capital, effect, effect_of, finite, sentence, sentence_of
from cvxupdate.diagnose.fit import FREE, MASS_STD, STIFFNESS_STD
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.judge import SURE, overlapping
from cvxupdate.diagnose.modal_damping import damping_trials, ratios_of
from cvxupdate.diagnose.modal_scan import BASIS, SIZES, scan, scene
from cvxupdate.diagnose.shortlist import DAMPING_WORDS
from cvxupdate.diagnose.signals import Real
from cvxupdate.errors import CvxupdateError, InputError, ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics import CATALOGUE
from cvxupdate.physics.base import Candidate, Context, Place, reported
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.modal import ModalPoint, ModalResidual, modal_residual
from cvxupdate.spec import Spec
from cvxupdate.update.trust_region import Options, iterate

FREQUENCY_FLOOR, SHAPE_FLOOR = 0.003, 0.02  # what the ordinary discretisation of a model may miss of a frequency (relative) and of a shape's entry
UNSTATED = 0.005  # relative deviation of a frequency where the table gives none: half a line in a hundred
# Words that frequencies and real shapes cannot tell (spin splits pairs of complex modes).
SILENT = ("gyroscopic", "attached_resonator", "viscous_damper", "structural_damping", "mass_proportional_damping", "sensor_fault")
SHORT, EFFECTS = 14, 2
CHANCE = 0.99
EVIDENCE = 6.0  # drop of Bayes' information criterion that counts as strong (Kass and Raftery 1995)


@dataclass(frozen=True)
class Tables:
    """Tables to fit; held-out ones with modes of their own; and held-out repeats of fitted modes: (table, mode, frequency measured again)."""

    fit: tuple[ModeTable, ...]
    hold: tuple[ModeTable, ...]
    again: tuple[tuple[int, int, float], ...]


@dataclass(frozen=True)
class ModalFit:
    """A model fitted to the tables; ``misfit`` is weighted squares per row, priors included."""

    model: Model
    point: ModalPoint
    misfit: float
    rows: int
    std: Real

    @property
    def enough(self) -> bool:
        """Whether noise, the allowance for discretisation and the priors alone would leave as much once in a hundred times (chi-square)."""
        from scipy.stats import chi2

        return bool(self.misfit * self.rows <= chi2.ppf(CHANCE, self.rows))


@dataclass(frozen=True)
class ModalTrial:
    """A candidate refitted."""

    candidate: Candidate
    fit: ModalFit
    error: float
    hold_out: float


def diagnose_modes(spec: Spec, model: Model, recordings: Sequence[Recording], progress: Callable[[str], None] | None = None) -> Diagnosis:
    """Diagnose tables of modes.

    Raises
    ------
    InputError
        When there is no table to fit.
    """
    begin = time.perf_counter()
    tell = progress or (lambda text: None)
    tables = [_widened(r) for r in recordings if isinstance(r, ModeTable)]
    fit = tuple(t for t in tables if t.origin.use == "fit")
    if not fit:
        raise InputError(f"{spec.path}: diagnose needs a recording with use = \"fit\". Add one.")
    data = Tables(fit, *_repeated(fit, [t for t in tables if t.origin.use != "fit"]))
    words = [w for w in CATALOGUE if w not in SILENT and (spec.diagnose.physics is None or w in spec.diagnose.physics)]
    supports = held_dofs(model, [(s.nodes, s.dofs) for s in spec.model.supports], spec.model.dofs)
    start = ordinary(undamped(model), wide=True)
    nominal = modal_residual(start, fit, data.hold, False).evaluate(start.zero())
    tell("fitting the ordinary parameters")
    base = first = _fit(start, data, start.zero())
    evidence: list[str] = []
    accepted: list[ModalTrial] = []
    stages: list[list[ModalTrial]] = []
    while len(accepted) < EFFECTS and base.misfit > 1.0:
        trials = _trials(base, data, words, supports, release_from(spec), tell)
        stages.append(trials)
        if not trials or not _better(trials[0], base, not accepted, _error(base.point, data, False)):
            break
        if accepted and _finding(trials[0], trials).confidence < SURE:
            evidence.append(f"A further improvement to {100 * trials[0].error:.3g} % (e.g. {effect_of(trials[0].candidate)}) "
                            "cannot be told from others elsewhere, so none is claimed.")
            break
        accepted.append(trials[0])
        base = trials[0].fit
    later = evidence
    (off, aside), left = (_error(nominal, data, fitted) for fitted in (True, False)), _error(first.point, data, True)
    evidence = [f"As modelled, the frequencies are off by {100 * off:.3g} % r.m.s. (fitted)"
                + (f" and {100 * aside:.3g} % (held out)." if np.isfinite(aside) else "."),
                f"With ordinary scatter of group stiffness and mass: {100 * left:.3g} %; weighted misfit {first.misfit:.3g} per row."]
    for t in accepted:
        evidence.append(f"{capital(effect_of(t.candidate))} brings it to {100 * t.error:.3g} % (fitted)"
                        + (f" and {100 * t.hold_out:.3g} % (held out)." if np.isfinite(t.hold_out) else "."))
    evidence += later
    findings = [_finding(t, stage) for t, stage in zip(accepted, stages, strict=False)]
    evidence += [f"These modes do not tell {effect(f.physics, f.place)} from " + ", ".join(effect(w, p) for w, p in f.equivalent[:6])
                 + (f" and {len(f.equivalent) - 6} more." if len(f.equivalent) > 6 else ".") for f in findings if f.equivalent]
    decay = _damping(fit, evidence)
    pattern, damped = ([], None) if decay else _damping_pattern(spec, model, base, data, evidence)
    findings += decay + pattern
    loose = [q for q, v in zip(first.model.parameters, first.point.p, strict=True)
             if q.group is not None and abs(v) > 3.5 * (MASS_STD if q.of == "mass" else STIFFNESS_STD)]
    if findings:
        groups_only = all(f.physics in ("stiffness_change", "mass_change") and f.place.groups for f in findings)
        verdict, says = ("parameter_error" if groups_only else "missing_physics"), " ".join(f.says for f in findings)
    elif first.enough and not loose:
        verdict, says = "consistent", "Nothing is missing: the model explains the measured modes within their deviations and ordinary scatter."
    elif first.enough:
        verdict, says = "parameter_error", "Ordinary parameters explain the modes, outside their usual scatter: " + ", ".join(q.name for q in loose[:4]) + "."
    else:
        verdict = "undetermined"
        says = "The modes differ from the model in a way that no single known kind of physics explains; shapes at more points, or FRFs, would tell more."
    last = accepted[-1].fit.point if accepted else first.point
    metrics = {"fit": _metrics(nominal, last, data, True), "hold_out": _metrics(nominal, last, data, False)}
    numbers = {key: {name: finite(_error(point, data, fitted)) for name, point in (("before", nominal), ("ordinary", first.point), ("after", last))}
               for key, fitted in (("fit", True), ("hold_out", False))}
    candidates: list[dict[str, Any]] = [
        {"physics": t.candidate.physics, "location": t.candidate.place.to_json(), "score": finite(t.error), "hold_out_score": finite(t.hold_out),
         "misfit": t.fit.misfit, "effect": k + 1, "parameters": _figures(t)[0]} for k, stage in enumerate(stages) for t in stage]
    updated = of_modes(spec, last, [says], decay[0].parameters["alpha"] if decay else None, damped) if findings else None
    return Diagnosis(spec.name, spec.title, str(spec.path), verdict, says, tuple(findings), tuple(candidates), numbers, metrics, tuple(evidence),
                     time.perf_counter() - begin, {"method": "eigenvalues and shapes, trust-region convex steps",
                                                   "misfit": {"ordinary": first.misfit, "after": base.misfit}}, updated, modes_shown(nominal, last))


def _widened(table: ModeTable) -> ModeTable:
    """Deviations with the allowance for discretisation added."""
    std = UNSTATED * table.frequency if table.relative_only else table.frequency_std
    wide = np.sqrt(std**2 + (FREQUENCY_FLOOR * table.frequency) ** 2)
    shape = table.shape_std
    if table.shapes is not None:
        known = np.full(table.shapes.shape, np.nan) if shape is None else np.broadcast_to(shape, table.shapes.shape)
        shape = np.sqrt(np.where(np.isfinite(known), known, 0.05) ** 2 + SHAPE_FLOOR**2)
    return replace(table, frequency_std=wide, shape_std=shape, relative_only=False)


def _scales(model: Model) -> Real:
    return np.array([FREE if q.group is None else MASS_STD if q.of == "mass" else STIFFNESS_STD for q in model.parameters])


def _repeated(fit: Sequence[ModeTable], hold: Sequence[ModeTable]) -> tuple[tuple[ModeTable, ...], tuple[tuple[int, int, float], ...]]:
    """Held-out modes that the fit does not have, as tables; and repeats of fitted ones (same ``mode``): (table, mode, frequency measured again)."""
    known = {int(pair): (k, i) for k, t in enumerate(fit) for i, pair in enumerate(t.pairs) if pair > 0}
    others: list[ModeTable] = []
    again: list[tuple[int, int, float]] = []
    for t in hold:
        repeat = np.array([int(pair) in known for pair in t.pairs], dtype=bool)
        again += [(*known[int(pair)], float(f)) for pair, f in zip(t.pairs[repeat], t.frequency[repeat], strict=True)]
        if not repeat.all():
            others.append(_part(t, ~repeat))
    return tuple(others), tuple(again)


def _part(t: ModeTable, keep: NDArray[np.bool_]) -> ModeTable:
    """Some modes of a table."""
    return replace(t, frequency=t.frequency[keep], frequency_std=t.frequency_std[keep], damping=t.damping[keep], damping_std=t.damping_std[keep],
                   pairs=t.pairs[keep], shapes=None if t.shapes is None else t.shapes[keep],
                   shape_std=None if t.shape_std is None else np.broadcast_to(t.shape_std, (len(keep), t.shape_std.shape[-1]))[keep])


def _fit(model: Model, data: Tables, start: Real, far: bool = False) -> ModalFit:
    residual: ModalResidual = modal_residual(model, data.fit, data.hold, any(t.shapes is not None for t in data.fit))
    residual = _walked(residual, start) if far else residual
    scales = _scales(model)
    bounds = Bounds(np.array([q.lower for q in model.parameters]), np.array([q.upper for q in model.parameters]))
    problem = StepProblem(regularisers=(Tikhonov(1.0, 0.0, scales),), constraints=(bounds,), columns=tuple(q.name for q in model.parameters))
    loop = iterate(residual, problem, SolverChoice(), Options(1e-4, 25, 0.3), start)
    values, weights, _ = loop.point.differences
    cost = float(np.sum((weights * values) ** 2) + np.sum((loop.point.p / scales) ** 2))
    system = loop.point.system()
    A, _ = system.weighted()
    grow = max(1.0, cost / max(1, len(values) - len(scales)))
    spread = np.sqrt(np.maximum(np.diag(np.linalg.pinv(A.T @ A + np.diag(1.0 / scales**2))), 0.0) * grow)
    return ModalFit(model, loop.point, cost / max(1, len(values)), len(values), spread)


def _walked(residual: ModalResidual, start: Real) -> ModalResidual:
    """Pairs modes at ``start``, where a fit begins far off, by following them there step by step: one large step may mistake them.

    Modes that veer change their shapes but not their order, so without measured shapes the order is the other way to pair them, and the better one counts.
    """
    point: ModalPoint | None = None
    for size in np.geomspace(1e-4, 1.0, SIZES):
        point = residual.evaluate(size * start, point)
    if point is None:
        return residual
    ways = [point] if residual.shapes else [point, replace(point, places=residual.start.places)]
    best = min(ways, key=lambda way: float(np.sum((way.differences[1] * way.differences[0]) ** 2)))
    return replace(residual, start=replace(residual.start, modes=best.modes, places=best.places))


def _trials(base: ModalFit, data: Tables, words: Sequence[str], supports: Sequence[tuple[int, str]],
            release: Callable[[int, str], Model], tell: Callable[[str], None]) -> list[ModalTrial]:
    model, fit = base.model, data.fit
    m = model.matrices(base.point.p)
    top = max(float(t.frequency.max()) for t in fit)
    context = Context(model, m.K, m.M, top, min(float(t.frequency.min()) for t in fit), (), tuple(supports), release, 0.005)
    candidates = [c for w in words for c in CATALOGUE[w](context)]
    tell(f"screening {len(candidates)} candidates")
    shares = _shares(base, candidates)
    usual = np.where([q.group is not None for q in model.parameters], 0.0, base.point.p)  # ordinary parameters that gave way for want of a word come back
    origin = base.point.residual.evaluate(usual, base.point)
    at = origin.matrices
    many = natural_modes(at.K, at.M, min(model.size, max(BASIS, len(origin.modes.eigenvalues))), rigid_body_modes(model, at.K, at.M))
    around = scene(origin, _scales(model), many)
    large: dict[int, float] = {}
    for k, (left, best) in scan(around, candidates).items():  # a derivative says little of a word that is large: its best size decides
        shares[k] = (1.0 - left / around.total if around.total > 0 else 0.0, np.array([best]))
        large[k] = best
    ranked = sorted(zip(shares, range(len(candidates)), strict=True), key=lambda item: -item[0][0])
    out: list[ModalTrial] = []
    count: dict[str, int] = {}
    tried = 0
    for (share, size), k in ranked:
        c = candidates[k]
        if tried >= SHORT or share < 0.25 * ranked[0][0][0]:
            break
        if count.get(c.physics, 0) >= 4 or c.model is None:
            continue
        count[c.physics] = count.get(c.physics, 0) + 1
        tried += 1
        tell(f"refitting {c.name}")
        n = len(model.parameters)
        guess = np.zeros(len(c.model.parameters))
        guess[:n] = usual if k in large else base.point.p
        low, high = (np.array([getattr(q, side) for q in c.model.parameters[n:]]) for side in ("lower", "upper"))
        guess[n:] = large[k] if k in large else np.clip(size if len(size) == c.extra else 0.0, np.maximum(low, -0.3), np.minimum(high, 1.0))
        try:
            found = _fit(c.model, data, guess, k in large)
        except CvxupdateError:
            continue
        out.append(ModalTrial(c, found, _error(found.point, data, True), _error(found.point, data, False)))
    return sorted(out, key=lambda t: t.fit.misfit * (1.0 + 0.1 * (t.candidate.extra - 1)))


def _shares(base: ModalFit, candidates: Sequence[Candidate]) -> list[tuple[float, Real]]:
    """(share of the weighted residual explained, first-order size) of every candidate, the ordinary parameters taken out."""
    point = base.point
    system = point.system()
    A, _ = system.weighted()
    values, weights, _ = point.differences
    scales = _scales(base.model)
    Q, _ = np.linalg.qr(np.vstack([A, np.diag(1.0 / scales)]))
    left = np.concatenate([-weights * values, -point.p / scales])
    left = left - Q @ (Q.T @ left)
    total = float(left @ left)
    K, M = point.matrices.K, point.matrices.M
    many = natural_modes(K, M, min(base.model.size, 120), rigid_body_modes(base.model, K, M))
    phi = np.vstack([many.shapes, np.zeros((1, many.shapes.shape[1]))])
    single: dict[tuple[str, int], Real] = {}
    out = []
    for c in candidates:
        parts = [single[(c.physics, e)] for e in c.members if (c.physics, e) in single] if len(c.members) > 1 and c.additive else []
        if parts and len(parts) == len(c.members):
            J = np.sum(parts, axis=0)[:, None]
        elif c.tangent and all(c.tangent):
            J = np.stack([_column(point, many.eigenvalues, phi, blocks) for blocks in c.tangent], axis=1)
        else:
            out.append((0.0, np.zeros(c.extra)))
            continue
        if len(c.members) == 1 and c.additive:
            single[(c.physics, c.members[0])] = J[:, 0]
        Jw = np.vstack([weights[:, None] * J, np.zeros((len(scales), J.shape[1]))])
        Jp = Jw - Q @ (Q.T @ Jw)
        norms = np.linalg.norm(Jp, axis=0)
        if np.any(norms <= 1e-9 * np.maximum(np.linalg.norm(Jw, axis=0), 1e-300)):
            out.append((0.0, np.zeros(c.extra)))
            continue
        best = np.linalg.lstsq(Jp / norms, left, rcond=1e-8)[0] / norms
        if c.sign > 0 and best[0] < 0.0:
            out.append((0.0, np.zeros(len(best))))
            continue
        rest = left - Jp @ best
        out.append(((1.0 - float(rest @ rest) / total) if total > 0 else 0.0, best))
    return out


def _column(point: ModalPoint, eigenvalues: Real, phi: Real, blocks: Sequence[Any]) -> Real:
    """Derivative of the rows of ``point.differences`` along one tangent: Fox and Kapoor's modal expansion over the modes at hand."""
    residual = point.residual
    places = [i for k in range(len(residual.fit)) for i in point.places[k].tolist() if i >= 0]
    shapes = np.vstack([point.modes.shapes, np.zeros((1, point.modes.shapes.shape[1]))])
    rows = [_rate(shapes, point.modes.eigenvalues[i], i, blocks) for i in places]
    if residual.shapes:
        for _, _, i, sensors, x, std in point._shape_rows():
            force = np.zeros(len(phi))
            lam = point.modes.eigenvalues[i]
            for b in blocks:
                local = shapes[b.dofs, i]
                push = np.zeros(b.dofs.shape)
                if b.K is not None:
                    push += np.einsum("eij,ej->ei", b.K, local)
                if b.M is not None:
                    push -= lam * np.einsum("eij,ej->ei", b.M, local)
                np.add.at(force, b.dofs, push)
            force[-1] = 0.0
            gap = lam - eigenvalues
            share = np.where(np.abs(gap) > 1e-6 * max(lam, 1.0), (phi.T @ force) / np.where(gap == 0.0, 1.0, gap), 0.0)
            d = phi[sensors] @ share
            w = 1.0 / std**2
            own = shapes[sensors, i]
            q = np.sum(w * own * x) / np.sum(w * own**2)
            rows += (q * d + own * (np.sum(w * (x - 2.0 * q * own) * d) / np.sum(w * own**2))).tolist()
    return np.array(rows)


def _rate(shapes: Real, lam: float, i: int, blocks: Sequence[Any]) -> float:
    out = 0.0
    for b in blocks:
        local = shapes[b.dofs, i]
        if b.K is not None:
            out += float(np.einsum("ei,eij,ej->", local, b.K, local))
        if b.M is not None:
            out -= lam * float(np.einsum("ei,eij,ej->", local, b.M, local))
    return out


def _better(t: ModalTrial, base: ModalFit, first: bool, hold_before: float) -> bool:
    n = t.fit.rows
    gain = n * np.log(t.fit.misfit / base.misfit) + t.candidate.extra * np.log(n)
    hold = not np.isfinite(t.hold_out) or not np.isfinite(hold_before) or t.hold_out <= (0.5 if first else 1.0) * hold_before
    return bool(gain < -EVIDENCE and t.fit.misfit <= (0.5 if first else 0.7) * base.misfit and hold)


def _errors(point: ModalPoint, data: Tables, fitted: bool) -> list[float]:
    """Relative errors of the frequencies of the fitted or the held-out modes."""
    residual = point.residual
    errors: list[float] = []
    for k, table in enumerate(residual.tables):
        if (k < len(residual.fit)) == fitted:
            f = point.frequencies(k)
            errors += ((f - table.frequency) / table.frequency)[np.isfinite(f)].tolist()
    if not fitted:
        errors += [float(point.frequencies(k)[i] / measured - 1.0) for k, i, measured in data.again]
    return errors


def _error(point: ModalPoint, data: Tables, fitted: bool) -> float:
    """R.m.s. relative error of the frequencies of the fitted or the held-out modes; NaN where there are none."""
    errors = _errors(point, data, fitted)
    return float(np.sqrt(np.mean(np.square(errors)))) if errors else float("nan")


def _metrics(before: ModalPoint, after: ModalPoint, data: Tables, fitted: bool) -> dict[str, Any]:
    pairs = [100.0 * np.abs(_errors(point, data, fitted)) for point in (before, after)]
    if not len(pairs[0]) or not len(pairs[1]):
        return {}
    return {"frequency_error_percent_mean": {"before": float(np.mean(pairs[0])), "after": float(np.mean(pairs[1]))},
            "frequency_error_percent_max": {"before": float(np.max(pairs[0])), "after": float(np.max(pairs[1]))}}


def _as_good(r: ModalTrial, t: ModalTrial) -> bool:
    """Whether the recordings do not separate ``r`` from ``t``: twice the misfit, or an information criterion that is not strongly against it."""
    worse = t.fit.rows * (r.fit.misfit - t.fit.misfit) + (r.candidate.extra - t.candidate.extra) * np.log(t.fit.rows)
    return bool(r.fit.misfit <= 2.0 * t.fit.misfit or worse <= EVIDENCE)


def _figures(t: ModalTrial) -> tuple[dict[str, float], dict[str, float]]:
    """The contract's parameters of a trial and their deviations."""
    c, n = t.candidate, len(t.fit.model.parameters)
    values: dict[str, float] = {}
    deviations: dict[str, float] = {}
    for name, k, how in c.report:
        at = n - c.extra + k
        x, dx = float(t.fit.point.p[at]), float(t.fit.std[at])
        values[name], deviations[name] = reported(t.fit.model, t.fit.model.parameters[at], how, x, dx, c.offset)
    return values, deviations


def _finding(t: ModalTrial, stage: Sequence[ModalTrial]) -> Finding:
    c, (values, deviations) = t.candidate, _figures(t)
    rivals = [r for r in stage if r is not t and _as_good(r, t)]
    others = [r.fit.misfit for r in stage if r is not t and r not in rivals]
    confidence = float(np.clip(1.0 - t.fit.misfit / min(others, default=10.0 * t.fit.misfit), 0.3, 0.99))
    confidence /= 1.0 + 0.5 * sum(not overlapping(r.candidate.place, c.place) for r in rivals)
    return Finding(c.physics, c.place, values, deviations, confidence, tuple((r.candidate.physics, r.candidate.place) for r in rivals),
                   sentence_of(c, values))


def _damping(fit: Sequence[ModeTable], evidence: list[str]) -> list[Finding]:
    """A rate of decay that all modes share: mass-proportional damping, or an exponential window in the measurement."""
    from cvxupdate.recordings.identify.decay import decay_rates

    for table in fit:
        known = np.isfinite(table.damping) & (table.damping > 0)
        if known.sum() < 6:
            continue
        try:
            rates = decay_rates(table)
        except (CvxupdateError, ModelError):
            continue
        evidence.append(rates.says)
        if rates.verdict == "constant decay rate":
            values = {"alpha": rates.alpha}
            return [Finding("mass_proportional_damping", Place(), values, {"alpha": rates.alpha_std}, 0.9, (),
                            sentence("mass_proportional_damping", Place(), values))]
    return []


def _damping_pattern(spec: Spec, model: Model, base: ModalFit, data: Tables, evidence: list[str]) -> tuple[list[Finding], tuple[Model, Real] | None]:
    """A word that raises the damping of just the modes that it moves, and the model with it."""
    words = [w for w in DAMPING_WORDS if spec.diagnose.physics is None or w in spec.diagnose.physics]
    ratios = ratios_of(base.point, model)
    if ratios is None or not words:
        return [], None
    m = base.point.matrices
    f = [x for t in data.fit for x in (float(t.frequency.min()), float(t.frequency.max()))]
    context = Context(base.model, m.K, m.M, max(f), min(f), (), (), release_from(spec), float(np.median(ratios.file)))
    before, trials = damping_trials(ratios, [c for w in words for c in CATALOGUE[w](context)])
    if not trials:
        return [], None
    best, near = trials[0], [t for t in trials[1:] if t.strain <= trials[0].strain + DAMPING_GAIN / 2]
    c = best.candidate
    name, _, how = c.report[0]
    if c.model is None:
        return [], None
    value, deviation = reported(c.model, c.model.parameters[-1], how, best.size, best.deviation, c.offset)
    evidence.append(f"The damping ratios depart from the file's pattern (sum of squares {before:.3g} in units of ordinary scatter, {len(ratios.omega)} modes); "
                    f"{effect_of(c)} brings it to {best.strain:.3g}.")
    sure = float(np.clip(1.0 - best.strain / before, 0.3, 0.95)) / (1.0 + 0.5 * len(near))
    return [Finding(c.physics, c.place, {name: value}, {name: deviation}, sure, tuple((t.candidate.physics, t.candidate.place) for t in near[:12]),
                    sentence_of(c, {name: value}))], (c.model, np.append(base.point.p, best.size))
