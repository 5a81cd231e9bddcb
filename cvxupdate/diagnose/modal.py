"""Diagnosis from tables of modes: frequencies and, where measured, shapes; the pattern of damping
beside them."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from cvxupdate.diagnose.curves import modes_shown
from cvxupdate.diagnose.data import held_dofs, ordinary, release_from
from cvxupdate.diagnose.engine import EXPLAINED, group_finding, loose_groups
from cvxupdate.diagnose.export import of_modes
from cvxupdate.diagnose.finding import Diagnosis, Finding, finite
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.judge import (
    FAINT,
    HALVED,
    RIVAL,
    Competitor,
    Standing,
    claimed,
    confidence,
    equivalents,
    has,
    shown,
    size_of,
    standing_of,
    verdict_of,
)
from cvxupdate.diagnose.mesh import mesh_error
from cvxupdate.diagnose.modal_damping import DampingFound, damping_found
from cvxupdate.diagnose.modal_fit import error_of, fit_modes, metrics_of, prepared
from cvxupdate.diagnose.modal_search import ModalBench, ModalTrial, pairs, trials_beside
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.physics import effect_names
from cvxupdate.physics.effect import MODES
from cvxupdate.physics.place import capital
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.spec import Spec

# measured figures beyond the ordinary parameters from which on a second effect is sought: with
# fewer, two fit nearly anything
SPARE = 5
# of the misfit with ordinary parameters: what an effect may leave that does not explain the tables
CLEARLY = 0.1
UNEXPLAINED = (
    0.05  # error of the frequencies above which even the best model leaves the tables unexplained
)
EVIDENCE = 6.0  # drop of Bayes' information criterion that counts as strong (Kass and Raftery 1995)


@dataclass(frozen=True)
class ModalOutcome:
    """All that was tried: the model as it came and with ordinary parameters, trials of one effect
    and of two, best first."""

    bench: ModalBench
    nominal: ModalPoint
    base: ModalTrial
    singles: tuple[ModalTrial, ...]
    doublets: tuple[ModalTrial, ...]

    @property
    def everything(self) -> tuple[ModalTrial, ...]:
        """All that were refitted."""
        return (*self.singles, *self.doublets)


def diagnose_modes(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Diagnose tables of modes.

    Raises
    ------
    InputError
        When there is no table to fit.
    """
    begin = time.perf_counter()
    tell = progress or (lambda text: None)
    tables = [r for r in recordings if isinstance(r, ModeTable)]
    if not any(t.origin.use == "fit" for t in tables):
        raise InputError(f'{spec.path}: diagnose needs a recording with use = "fit". Add one.')
    start = ordinary(undamped(model), scatter=spec.diagnose.scatter)
    mesh = mesh_error(spec, model, max(float(t.frequency.max()) for t in tables))
    data = prepared(start, tables, mesh)
    words = tuple(
        w
        for w in effect_names(MODES)
        if spec.diagnose.physics is None or w in spec.diagnose.physics
    )
    supports = tuple(
        held_dofs(model, [(s.nodes, s.dofs) for s in spec.model.supports], spec.model.dofs)
    )
    o = _searched(ModalBench(data, words, supports, release_from(spec), tell), start)
    final, field = _final(o)
    findings = () if final is None else _findings(o, final, field)
    base = o.base if final is None or not findings else final
    damping = damping_found(
        spec, model, base.fit, [t for t in tables if t.origin.use == "fit"], data
    )
    told = (*findings, *damping.findings)
    verdict, says = _verdict(o, told)
    worst = mesh.worst(data.top)
    evidence = (
        [
            f"The mesh alone shifts natural frequencies by up to {100 * worst:.2g} %; this "
            "was taken out."
        ]
        if worst > 1e-3
        else []
    )
    evidence += [*_evidence(o, final if findings else None, findings), *damping.evidence]
    return _diagnosis(spec, o, base, told, verdict, says, damping, tuple(evidence), begin)


def _searched(bench: ModalBench, start: Model) -> ModalOutcome:
    """Ordinary parameters, then one effect, then two, as far as something is left to explain."""
    bench.tell("fitting the ordinary parameters")
    base = ModalTrial((), fit_modes(start, bench.data, start.zero()))
    nominal = base.fit.point.residual.evaluate(start.zero())
    singles = trials_beside(bench, base) if base.fit.misfit > EXPLAINED else []
    enough = (
        not singles
        or singles[0].fit.misfit <= EXPLAINED
        or base.fit.rows - len(start.parameters) < SPARE
    )
    return ModalOutcome(
        bench, nominal, base, tuple(singles), () if enough else tuple(pairs(bench, base, singles))
    )


def _final(o: ModalOutcome) -> tuple[ModalTrial | None, Sequence[ModalTrial]]:
    """What is claimed, and against whom it is judged: one effect, two, or the groups' parameters
    let go far; None where nothing convinces."""
    single = next(
        (t for t in o.singles[:1] if _better(t, o.base, o) and _credible(t, o.base)), None
    )
    if (
        o.doublets
        and o.doublets[0].fit.explained
        and (single is None or not single.fit.explained)
        and _better(o.doublets[0], single or o.base, o)
    ):
        return o.doublets[0], o.everything
    if (single is None or not single.fit.explained) and not o.base.fit.explained:
        wide = ordinary(o.base.fit.model, wide=True)
        far = ModalTrial((), fit_modes(wide, o.bench.data, wide.zero(), wide=True))
        loose = loose_groups(wide, far.fit.point.p)
        if loose and far.fit.explained and _better(far, single or o.base, o, len(loose)):
            return far, [far]
    return single, o.singles


def _better(t: ModalTrial, before: ModalTrial, o: ModalOutcome, freed: int = 0) -> bool:
    """Whether a trial halves the misfit, for more than its parameters are worth (``freed`` ordinary
    ones among them), and shows on what was held out (or agrees with it within its deviations)."""
    n = t.fit.rows
    gain = n * np.log(t.fit.misfit / before.fit.misfit) + (t.extra + freed - before.extra) * np.log(
        n
    )
    noise = o.bench.data.noise
    held = t.hold_out <= noise or shown(
        t.hold_out, before.hold_out, error_of(o.nominal, False), noise
    )
    return bool(gain < -EVIDENCE and t.fit.misfit <= HALVED * before.fit.misfit and held)


def _credible(t: ModalTrial, base: ModalTrial) -> bool:
    """Whether one clear effect may stand although the model is not exact: it takes away nine tenths
    of the misfit."""
    near = bool(np.nanmax([t.error, t.hold_out]) <= UNEXPLAINED)
    return t.fit.explained or (near and t.fit.misfit <= CLEARLY * base.fit.misfit)


def _near(t: ModalTrial, best: ModalTrial) -> bool:
    """Whether the tables do not separate a trial from the best: a misfit near its, or an
    information criterion that is not strongly against it."""
    worse = t.fit.cost - best.fit.cost + (t.extra - best.extra) * np.log(best.fit.rows)
    return bool(t.fit.misfit <= RIVAL * best.fit.misfit or worse <= EVIDENCE)


def _standing(
    number: int, final: ModalTrial, field: Sequence[ModalTrial], o: ModalOutcome
) -> Standing:
    e, others = final.effects[number], [t for t in field if t is not final]
    competitors = [
        Competitor(t.fit.misfit, has(t, e, o.base.fit.model), _near(t, final)) for t in others
    ]
    return standing_of(
        final.fit.misfit, o.base.fit.misfit, competitors, size_of(e, *final.figures[number])
    )


def _findings(
    o: ModalOutcome, final: ModalTrial, field: Sequence[ModalTrial]
) -> tuple[Finding, ...]:
    """What is claimed of a trial, the surest effect first."""
    if not final.effects:
        return tuple(
            group_finding(*item) for item in loose_groups(final.fit.model, final.fit.point.p)[:3]
        )
    near = [t for t in field if t is not final and _near(t, final)]
    out = []
    for k, (e, (values, deviations)) in enumerate(zip(final.effects, final.figures, strict=True)):
        same = tuple((s.candidate.physics, s.candidate.place) for s in equivalents(e, final, near))
        sure = confidence(_standing(k, final, field, o))
        out.append(
            Finding(
                e.candidate.physics,
                e.candidate.place,
                values,
                deviations,
                sure,
                same,
                e.candidate.says(values),
                e.candidate.title,
            )
        )
    told = claimed(sorted(out, key=lambda f: -f.confidence), o.base.fit.misfit, final.fit.misfit)
    return tuple(f for f in told if final.fit.explained or f.confidence >= FAINT)


def _verdict(o: ModalOutcome, findings: Sequence[Finding]) -> tuple[str, str]:
    if findings:
        return verdict_of(findings)
    if o.base.fit.explained:
        return (
            "consistent",
            "Nothing is missing: the model explains the measured modes within their "
            "deviations and ordinary scatter.",
        )
    return "undetermined", (
        "The modes differ from the model in a way that no one or two known kinds of physics "
        "explain; shapes at more points, or FRFs, would tell more."
    )


def _named(t: ModalTrial) -> str:
    return (
        " with ".join(e.candidate.title for e in t.effects)
        or "letting the groups' parameters go far"
    )


def _errors(t: ModalTrial) -> str:
    return f"{100 * t.error:.3g} % (fitted)" + (
        f" and {100 * t.hold_out:.3g} % (held out)" if np.isfinite(t.hold_out) else ""
    )


def _evidence(o: ModalOutcome, final: ModalTrial | None, findings: Sequence[Finding]) -> list[str]:
    off, aside = (100 * error_of(o.nominal, fitted) for fitted in (True, False))
    out = [
        f"As modelled, the frequencies are off by {off:.3g} % r.m.s. (fitted)"
        + (f" and {aside:.3g} % (held out)." if np.isfinite(aside) else "."),
        f"With ordinary scatter of group stiffness and mass: {_errors(o.base)}; weighted "
        f"misfit {o.base.fit.misfit:.3g} per row.",
    ]
    if final is None:
        return out + [
            f"{capital(_named(t))} comes nearest: {_errors(t)}, not enough to claim it."
            for t in o.singles[:1]
        ]
    if len(final.effects) > 1:
        out.append(
            f"One effect alone, {_named(o.singles[0])}, leaves {_errors(o.singles[0])}: not enough."
        )
    out.append(f"{capital(_named(final))} brings it to {_errors(final)}.")
    known = {(f.physics, f.place) for f in findings}
    out += [
        f"{capital(e.candidate.title)} is needed for the last of it, but others "
        "elsewhere would do as well: it is not claimed."
        for e in final.effects
        if (e.candidate.physics, e.candidate.place) not in known
    ]
    out += [
        f"These modes do not tell {f.title} from "
        + ", ".join(f.alternatives[:6])
        + (f" and {len(f.equivalent) - 6} more." if len(f.equivalent) > 6 else ".")
        for f in findings
        if f.equivalent
    ]
    return out


def _diagnosis(
    spec: Spec,
    o: ModalOutcome,
    last: ModalTrial,
    findings: tuple[Finding, ...],
    verdict: str,
    says: str,
    damping: DampingFound,
    evidence: tuple[str, ...],
    begin: float,
) -> Diagnosis:
    points = {"before": o.nominal, "ordinary": o.base.fit.point, "after": last.fit.point}
    numbers = {
        key: {name: finite(error_of(point, fitted)) for name, point in points.items()}
        for key, fitted in (("fit", True), ("hold_out", False))
    }
    metrics = {
        "fit": metrics_of(o.nominal, last.fit.point, True),
        "hold_out": metrics_of(o.nominal, last.fit.point, False),
    }
    details: dict[str, Any] = {
        "method": "eigenvalues and shapes, trust-region convex steps",
        "misfit": {"ordinary": o.base.fit.misfit, "after": last.fit.misfit},
    }
    if last.effects:
        field = o.singles if len(last.effects) == 1 else o.everything
        details["standing"] = [
            {"name": e.candidate.name, **asdict(_standing(k, last, field, o))}
            for k, e in enumerate(last.effects)
        ]
    updated = (
        of_modes(spec, last.fit.point, [says], damping.alpha, damping.damped) if findings else None
    )
    return Diagnosis(
        spec.name,
        spec.title,
        str(spec.path),
        verdict,
        says,
        findings,
        tuple(_candidates(o)),
        numbers,
        metrics,
        evidence,
        time.perf_counter() - begin,
        details,
        updated,
        modes_shown(o.nominal, last.fit.point),
    )


def _candidates(o: ModalOutcome) -> list[dict[str, Any]]:
    """Refitted ones with their errors, pairs after single ones, each effect naming its partner."""
    out: list[dict[str, Any]] = []
    for t in o.everything:
        for e, (values, _) in zip(t.effects, t.figures, strict=True):
            row = {
                "physics": e.candidate.physics,
                "title": e.candidate.title,
                "location": e.candidate.place.to_json(),
                "score": finite(t.error),
                "hold_out_score": finite(t.hold_out),
                "misfit": finite(t.fit.misfit),
                "effect": len(t.effects),
                "parameters": values,
            }
            if len(t.effects) > 1:
                row["beside"] = ", ".join(
                    other.candidate.name for other in t.effects if other is not e
                )
            out.append(row)
    return out
