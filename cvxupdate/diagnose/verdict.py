"""The way through: is there a mismatch, do ordinary parameters explain it, which physics where, is
it enough, what cannot be told."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import asdict, replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.curves import responses_shown
from cvxupdate.diagnose.data import (
    Data,
    held_dofs,
    level_dependence,
    ordinary,
    prepare,
    release_from,
)
from cvxupdate.diagnose.effects import Trial, key_of, without
from cvxupdate.diagnose.engine import Outcome, explain, followed, group_finding, loose_groups
from cvxupdate.diagnose.export import of_fit
from cvxupdate.diagnose.finding import Diagnosis, Finding, capital, effect_of, finite, sentence_of
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.judge import (
    FAINT,
    SURE,
    Judged,
    claimed,
    confidence,
    credible,
    doubles,
    equivalents,
    explained,
    halves,
    judged,
    rivals,
    standing,
    verdict_of,
)
from cvxupdate.diagnose.mesh import mesh_error
from cvxupdate.diagnose.placebo import placebo
from cvxupdate.diagnose.refit import CLEAR
from cvxupdate.diagnose.stated import (
    fitted_errors,
    noise_of,
    nominal_errors,
    stated_fit,
    stated_metrics,
)
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics import CATALOGUE
from cvxupdate.recordings.types import FrequencyResponse, Recording, TimeHistory
from cvxupdate.spec import Spec

LEVEL_CHANGE, LEVEL_NOISE = (
    0.05,
    5.0,
    # relative change between drive levels, and how many times the noise, that make a structure
    # nonlinear
)


def diagnose_responses(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Diagnose FRFs and time histories.

    Raises
    ------
    InputError
        When there is nothing to fit.
    """
    begin = time.perf_counter()
    usable = tuple(r for r in recordings if isinstance(r, FrequencyResponse | TimeHistory))
    if not any(r.origin.use == "fit" for r in usable):
        raise InputError(f'{spec.path}: diagnose needs a recording with use = "fit". Add one.')
    data = prepare(usable)
    data = replace(data, mesh=mesh_error(spec, model, data.top))
    change = level_dependence(data)
    nonlinear = (
        change is not None and change[0] > LEVEL_CHANGE and change[0] > LEVEL_NOISE * change[1]
    )
    if not nonlinear and "shear_deformation" in (spec.diagnose.physics or CATALOGUE):
        data = replace(data, sheared=mesh_error(spec, model, data.top, sheared=True))
    supports = held_dofs(model, [(s.nodes, s.dofs) for s in spec.model.supports], spec.model.dofs)
    start = ordinary(undamped(model), scatter=spec.diagnose.scatter)
    outcome = explain(
        start,
        model,
        data,
        supports,
        release_from(spec),
        [] if nonlinear else spec.diagnose.physics,
        progress,
    )
    singles, doublets = judged(outcome, outcome.trials), judged(outcome, outcome.pairs)
    evidence = [
        *_level_evidence(change, nonlinear),
        *_mesh_evidence(data),
        *([] if nonlinear else _ordinary_evidence(outcome)),
    ]
    single = next(iter(s for s in singles[:1] if halves(s, outcome)), None)
    final, field = single, singles
    if (
        (single is None or single.excess > CLEAR)
        and doublets
        and doubles(doublets[0], single, outcome)
    ):
        final, field = doublets[0], _field(doublets[0], singles, doublets)
    if (
        not nonlinear
        and (final is None or not credible(final, outcome))
        and not explained(_base(outcome), outcome)
    ):
        wide = judged(outcome, [Trial((), followed(outcome))])[0]
        if _loose(wide) and explained(wide, outcome) and doubles(wide, None, outcome):
            final, field = wide, [wide]
    verdict, says, findings = _verdict(outcome, final, field, singles + doublets, nonlinear)
    if findings and final is not None:
        evidence += _finding_evidence(findings, final, single, field)
        sham = placebo(final, outcome)
        evidence += [] if sham is None else [sham.says]
    return _diagnosis(
        spec,
        verdict,
        says,
        findings,
        outcome,
        final if findings else None,
        singles,
        doublets,
        evidence,
        begin,
        recordings,
    )


def _field(final: Judged, singles: Sequence[Judged], doublets: Sequence[Judged]) -> list[Judged]:
    """Against whom a finding is judged: a pair against single effects too."""
    return [*doublets, *singles] if len(final.trial.effects) > 1 else list(singles)


def _base(outcome: Outcome) -> Judged:
    return Judged(Trial((), outcome.base), *outcome.ordinary)


def _verdict(
    outcome: Outcome,
    final: Judged | None,
    field: Sequence[Judged],
    everything: Sequence[Judged],
    nonlinear: bool,
) -> tuple[str, str, tuple[Finding, ...]]:
    if nonlinear:
        return (
            "undetermined",
            (
                "Something in the structure depends on the vibration level (contact, "
                "friction, a stiffening spring): no linear change of the model can explain "
                "these recordings."
            ),
            (),
        )
    findings: tuple[Finding, ...] = ()
    if final is not None and not final.trial.effects:
        findings = tuple(group_finding(*item) for item in _loose(final)[:3])
        return *verdict_of(findings), findings
    if final is not None and credible(final, outcome):
        findings = _findings(outcome, final, field)
        findings = tuple(
            f for f in findings if f.confidence >= (FAINT if explained(final, outcome) else SURE)
        )
    if findings:
        return *verdict_of(findings), findings
    if explained(_base(outcome), outcome):
        return (
            "consistent",
            "Nothing is missing: the model explains the recordings within noise and ordinary "
            "scatter of its parameters.",
            (),
        )
    if final is not None:
        best = min(everything, key=lambda t: t.misfit)
        left = float(np.nanmax([best.hold_out, best.error]))
        return (
            "undetermined",
            (
                f"No one or two effects explain the recordings: {_named(best)} comes nearest, "
                f"but leaves {100 * left:.3g} % of the response."
            ),
            (),
        )
    return (
        "undetermined",
        (
            "Something differs that none of the known kinds of physics explains at any one "
            f"or two places; what remains is {100 * outcome.ordinary[0]:.3g} % of the "
            "response."
        ),
        (),
    )


def _findings(outcome: Outcome, final: Judged, field: Sequence[Judged]) -> tuple[Finding, ...]:
    """The effects, strongest first; of two, one whose place the recordings cannot tell is not
    claimed."""
    near, found = rivals(final, field, outcome), final.trial.figures
    needed = _needed(outcome, final)
    out = []
    for k in sorted(range(len(found)), key=lambda k: -needed[k]):
        effect, (values, deviations) = final.trial.effects[k], found[k]
        c, sure = effect.candidate, confidence(standing(k, final, field, outcome))
        same = tuple(
            (o.candidate.physics, o.candidate.place)
            for o in equivalents(effect, final.trial, [r.trial for r in near])
        )
        out.append(
            Finding(c.physics, c.place, values, deviations, sure, same, sentence_of(c, values))
        )
    return claimed(out, outcome.base.misfit, final.misfit)


def _needed(outcome: Outcome, final: Judged) -> list[float]:
    """How large the misfit becomes when each effect is taken out and the rest stays."""
    if len(final.trial.effects) == 1:
        return [1.0]
    rests = [without(outcome.bench, final.trial, k) for k in range(len(final.trial.effects))]
    return [np.inf if rest is None else rest.fit.misfit for rest in rests]


def _loose(wide: Judged) -> list[tuple[Parameter, float, float]]:
    return loose_groups(wide.trial.fit.setting.model, wide.trial.fit.p)


def _level_evidence(change: tuple[float, float] | None, nonlinear: bool) -> list[str]:
    if change is None:
        return []
    return [
        f"Between drive levels the transfer functions change by {100 * change[0]:.2g} % "
        f"(noise alone: {100 * change[1]:.2g} %): "
        + (
            "the response depends on the level, so the structure is not linear."
            if nonlinear
            else "the structure is linear to that accuracy."
        )
    ]


def _mesh_evidence(data: Data) -> list[str]:
    worst = data.mesh.worst(data.top)
    return (
        [
            f"The mesh alone shifts natural frequencies by up to {100 * worst:.2g} %; this "
            "was taken out."
        ]
        if worst > 1e-3
        else []
    )


def _ordinary_evidence(o: Outcome) -> list[str]:
    out = [
        f"As modelled, its mesh error taken out, the model misses a channel on average by "
        f"{o.nominal[0]:.3g} of its response on the fitted and "
        f"{o.nominal[1]:.3g} on the held-out recordings (noise alone: {o.noise[0]:.2g}).",
        "With ordinary scatter of group stiffness, group mass and damping it is "
        f"{o.ordinary[0]:.3g} and {o.ordinary[1]:.3g}; weighted misfit {o.base.misfit:.3g} "
        "per row (1: noise and discretisation).",
    ]
    return out


def _named(t: Judged) -> str:
    return (
        " with ".join(effect_of(e.candidate) for e in t.trial.effects)
        or "letting the groups' parameters go far"
    )


def _finding_evidence(
    findings: Sequence[Finding], final: Judged, single: Judged | None, field: Sequence[Judged]
) -> list[str]:
    out = []
    if single is not None and final is not single:
        out.append(
            f"One effect alone, {_named(single)}, leaves {single.error:.3g} (fitted) and "
            f"{single.hold_out:.3g} (held out): not enough."
        )
    out.append(
        f"{capital(_named(final))} brings the error to {final.error:.3g} (fitted) and "
        f"{final.hold_out:.3g} (held out)."
    )
    silent = [
        e
        for e in final.trial.effects
        if (e.candidate.physics, e.candidate.place) not in {(f.physics, f.place) for f in findings}
    ]
    out += [
        f"{capital(effect_of(e.candidate))} is needed for the last of it, but others "
        "elsewhere would do as well: it is not claimed."
        for e in silent
    ]
    others = [t for t in field if t is not final]
    out += [
        f"The same procedure with {_named(t)} leaves {t.error:.3g} and {t.hold_out:.3g}."
        for t in others[:3]
    ]
    return out


def _diagnosis(
    spec: Spec,
    verdict: str,
    says: str,
    findings: tuple[Finding, ...],
    o: Outcome,
    final: Judged | None,
    singles: Sequence[Judged],
    doublets: Sequence[Judged],
    evidence: Sequence[str],
    begin: float,
    recordings: Sequence[Recording],
) -> Diagnosis:
    # the stated figures: one definition for every command (`stated`)
    data = o.bench.data
    responses = (*data.fit, *data.hold_out)
    before = nominal_errors(o.bench.original, responses)
    ordinary_ = fitted_errors(o.base, responses)
    after = ordinary_ if final is None else fitted_errors(final.trial.fit, responses)
    noise = (noise_of(data.sharp), noise_of(data.sharp_hold_out))
    fit = stated_fit(before, ordinary_, after, noise)
    metrics = stated_metrics(before, after)
    details: dict[str, Any] = {
        "method": "smoothed output error, trust-region convex steps",
        "misfit": {
            "ordinary": o.base.misfit,
            "after": final.misfit if final is not None else o.base.misfit,
        },
    }
    if final is not None and final.trial.effects:
        field = _field(final, singles, doublets)
        details["standing"] = [
            {"name": e.candidate.name, **asdict(standing(k, final, field, o))}
            for k, e in enumerate(final.trial.effects)
        ]
    found = o.base if final is None else final.trial.fit
    nominal = o.base.setting.evaluate(np.zeros(len(o.base.setting.columns)))
    shown = responses_shown(
        nominal,
        found.point,
        o.bench.data.sharp,
        o.bench.data.sharp_hold_out,
        [(s.candidate, s.share) for s in o.screened],
    )
    return Diagnosis(
        spec.name,
        spec.title,
        str(spec.path),
        verdict,
        says,
        findings,
        tuple(_candidates(o, singles, doublets)),
        fit,
        metrics,
        tuple(evidence),
        time.perf_counter() - begin,
        details,
        of_fit(spec, recordings, found, [says]) if findings else None,
        shown,
    )


def _candidates(
    o: Outcome, singles: Sequence[Judged], doublets: Sequence[Judged]
) -> list[dict[str, Any]]:
    """Refitted ones with their errors (pairs after single ones, each effect naming its partner),
    then what was only screened."""
    out: list[dict[str, Any]] = []
    for t in (*singles, *doublets):
        effects = list(zip(t.trial.effects, t.trial.figures, strict=True))
        for k, (effect, (values, _)) in enumerate(effects):
            row = {
                "physics": effect.candidate.physics,
                "location": effect.candidate.place.to_json(),
                "score": finite(t.error),
                "hold_out_score": finite(t.hold_out),
                "misfit": finite(t.misfit),
                "parameters": values,
                "stability": o.stable.get(effect.key),
            }
            if len(effects) > 1:
                row["beside"] = ", ".join(
                    other.candidate.name for i, (other, _) in enumerate(effects) if i != k
                )
            out.append(row)
    shown = {e.key for t in singles for e in t.trial.effects}
    out += [
        {
            "physics": s.candidate.physics,
            "location": s.candidate.place.to_json(),
            "score": None,
            "hold_out_score": None,
            "share": s.share,
            "stability": o.stable.get(key_of(s.candidate)),
        }
        for s in o.screened[:40]
        if key_of(s.candidate) not in shown
    ]
    return out
