"""The way through: is there a mismatch, do ordinary parameters explain it, which physics where, is it enough, what cannot be told."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.engine import DAMPING_GAIN, EXPLAINED, Data, Outcome, Trial, explain, held_dofs, level_dependence, loose_groups, ordinary, prepare
from cvxupdate.diagnose.finding import Diagnosis, Finding, sentence, where
from cvxupdate.diagnose.forward import undamped
from cvxupdate.diagnose.mesh import mesh_error
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.physics.base import Place
from cvxupdate.recordings.types import FrequencyResponse, Recording, TimeHistory
from cvxupdate.spec import Spec

HALVED = 0.5  # a finding must halve what was left, on what was fitted and on what was not
LEVEL_CHANGE, LEVEL_NOISE = 0.05, 5.0  # relative change between drive levels, and how many times the noise, that make a structure nonlinear
DAMPING = ("viscous_damper", "structural_damping", "mass_proportional_damping")
RIVAL = 2.0  # misfit within this factor of the best: the recordings do not separate the two
OPEN, UNEXPLAINED = 4.0, 0.1  # misfit per row, and response error, above which even the best model leaves the recordings unexplained
EFFECTS = 2
MESH_SHARE = 0.25  # of the mesh's shift that Richardson extrapolation on two meshes may miss
SURE = 0.4  # confidence below which a further effect is not claimed


def release_from(spec: Spec) -> Callable[[int, str], Model]:
    """Builds the ordinary undamped model without one support DOF."""

    def release(node: int, kind: str) -> Model:
        supports = []
        for s in spec.model.supports:
            nodes = [n.id for n in spec.model.nodes] if s.nodes == "all" else list(s.nodes)
            for n in nodes:
                kept = tuple(k for k in s.dofs if (n, k) != (node, kind))
                if kept:
                    supports.append(s.model_copy(update={"nodes": (n,), "dofs": kept}))
        freed = replace(spec, model=spec.model.model_copy(update={"supports": tuple(supports)}), update=None)
        return ordinary(undamped(build_model(freed)))

    return release


def diagnose_responses(spec: Spec, model: Model, recordings: Sequence[Recording], progress: Callable[[str], None] | None = None) -> Diagnosis:
    """Diagnose FRFs and time histories.

    Raises
    ------
    InputError
        When there is nothing to fit.
    """
    begin = time.perf_counter()
    usable = tuple(r for r in recordings if isinstance(r, FrequencyResponse | TimeHistory))
    if not any(r.origin.use == "fit" for r in usable):
        raise InputError(f"{spec.path}: diagnose needs a recording with use = \"fit\". Add one.")
    data = prepare(usable)
    data = replace(data, mesh=mesh_error(spec, model, data.top))
    words = spec.diagnose.physics
    supports = held_dofs(model, [(s.nodes, s.dofs) for s in spec.model.supports], spec.model.dofs)
    start = ordinary(undamped(model))
    evidence: list[str] = []
    change = level_dependence(data)
    nonlinear = change is not None and change[0] > LEVEL_CHANGE and change[0] > LEVEL_NOISE * change[1]
    if change is not None:
        evidence.append(f"Between drive levels the transfer functions change by {100 * change[0]:.2g} % (noise alone: {100 * change[1]:.2g} %): "
                        + ("the response depends on the level, so the structure is not linear." if nonlinear else "the structure is linear to that accuracy."))
    if nonlinear:
        outcome = explain(start, model, data, supports, release_from(spec), [], progress)
        says = ("Something in the structure depends on the vibration level (contact, friction, a stiffening spring): no linear change of the model can "
                "explain these recordings.")
        return _diagnosis(spec, "undetermined", says, (), outcome, (), data, evidence, begin)
    outcome = explain(start, model, data, supports, release_from(spec), words, progress)
    if data.mesh.worst(data.top) > 1e-3:
        evidence.append(f"The mesh alone shifts natural frequencies by up to {100 * data.mesh.worst(data.top):.2g} %; this was taken out.")
    evidence += _ordinary_evidence(outcome)
    accepted: list[Trial] = []
    current = outcome
    while current.trials and len(accepted) < EFFECTS:
        best = current.trials[0]
        if not _halves(best, current):
            break
        accepted.append(best)
        if best.fit.misfit <= 4.0 * EXPLAINED or len(accepted) == EFFECTS:
            break
        following = explain(best.fit.setting.model, model, data, supports, release_from(spec), words, progress, best.fit)
        if not following.trials or not _halves(following.trials[0], following) or _confidence(following.trials[0], following) < SURE:
            break
        current = following
    final = accepted[-1] if accepted else None
    loose = loose_groups(outcome.base)
    if final is None:
        if outcome.base.misfit <= 4.0 * EXPLAINED and loose:
            found = tuple(_group_finding(item, outcome) for item in loose[:3])
            return _diagnosis(spec, "parameter_error", found[0].says, found, outcome, (), data, evidence, begin)
        if outcome.base.misfit <= 4.0 * EXPLAINED or max(e for e in outcome.ordinary if np.isfinite(e)) <= mesh_allowance(outcome, data):
            says = "Nothing is missing: the model explains the recordings within noise and ordinary scatter of its parameters."
            return _diagnosis(spec, "consistent", says, (), outcome, (), data, evidence, begin)
        says = ("Something differs that none of the known kinds of physics explains at any single place; "
                f"what remains is {100 * outcome.ordinary[0]:.3g} % of the response.")
        return _diagnosis(spec, "undetermined", says, (), outcome, (), data, evidence, begin)
    if final.fit.misfit > OPEN * EXPLAINED and np.nanmax([final.hold_out, final.error]) > max(UNEXPLAINED, mesh_allowance(outcome, data)):
        left = float(np.nanmax([final.hold_out, final.error]))
        says = f"No single effect explains the recordings: {final.candidate.name} comes nearest, but leaves {100 * left:.3g} % of the response."
        return _diagnosis(spec, "undetermined", says, (), outcome, tuple(accepted), data, evidence, begin)
    findings = tuple(_finding(t, current if k == len(accepted) - 1 else outcome, final) for k, t in enumerate(accepted))
    evidence += _finding_evidence(outcome, accepted)
    whole_group = all(f.physics in ("stiffness_change", "mass_change") and f.place.groups for f in findings)
    verdict = "parameter_error" if whole_group else "missing_physics"
    return _diagnosis(spec, verdict, " ".join(f.says for f in findings), findings, outcome, tuple(accepted), data, evidence, begin)


def _halves(t: Trial, before: Outcome) -> bool:
    if t.candidate.physics in DAMPING and before.base.misfit <= EXPLAINED:  # the pattern of damping, not the misfit, is at stake
        drop = before.base.damping_strain - t.fit.damping_strain
        return drop > max(DAMPING_GAIN, HALVED * before.base.damping_strain) and t.fit.misfit <= 1.05 * before.base.misfit
    hold = not np.isfinite(t.hold_out) or t.hold_out <= HALVED * before.ordinary[1]
    return bool(t.fit.misfit <= HALVED * before.base.misfit and hold)


def _rivals(best: Trial, outcome: Outcome) -> list[Trial]:
    """Other trials that the recordings do not separate from the best."""
    if outcome.base.misfit <= EXPLAINED:
        return [t for t in outcome.trials if t is not best and t.fit.damping_strain <= best.fit.damping_strain + DAMPING_GAIN / 2]
    return [t for t in outcome.trials if t is not best and t.fit.misfit <= RIVAL * best.fit.misfit
            and (not np.isfinite(t.hold_out) or t.hold_out <= RIVAL * best.hold_out)]


def mesh_allowance(outcome: Outcome, data: Data) -> float:
    """Response error that the mesh may leave although its shift was taken out: a quarter of the shift, in half-power bandwidths (2 ζ f)."""
    if not outcome.base.setting.damped:
        return 0.0
    return float(min(0.3, MESH_SHARE * data.mesh.worst(data.top) / np.median(outcome.base.point.damping[outcome.base.point.owner])))


def overlapping(a: Place, b: Place) -> bool:
    """Whether two places share most of their elements, or a node."""
    if a.elements and b.elements:
        common = len(set(a.elements) & set(b.elements))
        return common >= 0.5 * len(set(a.elements) | set(b.elements))
    return bool(set(a.nodes) & set(b.nodes)) and a.dof == b.dof


def _confidence(best: Trial, outcome: Outcome) -> float:
    """How far ahead of the next thing that is something else: 1 − (misfit ratio), within 0.3 and 0.99, shared among rivals elsewhere."""
    if outcome.base.misfit <= EXPLAINED:
        return float(np.clip(1.0 - best.fit.damping_strain / outcome.base.damping_strain, 0.3, 0.95)) / (1.0 + 0.5 * len(_rivals(best, outcome)))
    others = [t for t in outcome.trials if t is not best and t not in _rivals(best, outcome)]
    reference = min([t.fit.misfit for t in others] + [outcome.base.misfit])
    share = 1.0 - best.fit.misfit / max(reference, 1e-12)
    elsewhere = [r for r in _rivals(best, outcome) if not overlapping(r.candidate.place, best.candidate.place)]
    return float(np.clip(share, 0.3, 0.99)) / (1.0 + 0.5 * len(elsewhere))


def _finding(t: Trial, outcome: Outcome, final: Trial) -> Finding:
    rivals = _rivals(t, outcome) if t in outcome.trials else []
    return Finding(t.candidate.physics, t.candidate.place, t.values, t.deviations, _confidence(t, outcome) if t in outcome.trials else 0.9,
                   tuple((r.candidate.physics, r.candidate.place) for r in rivals), sentence(t.candidate.physics, t.candidate.place, t.values))


def _group_finding(item: tuple[str, str, float, float], outcome: Outcome) -> Finding:
    name, of, p, sigmas = item
    q = next(q for q in outcome.base.setting.model.parameters if q.name == name)
    place = Place(elements=q.elements, groups=(q.group or name.rpartition(".")[0],))
    word = "stiffness_change" if of == "stiffness" else "mass_change"
    values = {"factor": 1.0 + p}
    return Finding(word, place, values, {"factor": abs(p) / sigmas}, float(np.clip(1.0 - 3.0 / sigmas**2, 0.5, 0.99)), (), sentence(word, place, values))


def _ordinary_evidence(o: Outcome) -> list[str]:
    out = [f"As modelled, the response error is {o.nominal[0]:.3g} on the fitted and {o.nominal[1]:.3g} on the held-out recordings "
           f"(noise alone: {o.noise[0]:.2g}).",
           f"With ordinary scatter of group stiffness, group mass and damping it is {o.ordinary[0]:.3g} and {o.ordinary[1]:.3g}; "
           f"weighted misfit {o.base.misfit:.3g} per row (1: noise and discretisation)."]
    loose = loose_groups(o.base)
    if loose:
        out.append("To get there the ordinary parameters would have to leave their usual scatter: "
                   + ", ".join(f"{n} {100 * p:+.1f} %" for n, _, p, _ in loose[:4]) + ".")
    return out


def _finding_evidence(o: Outcome, accepted: Sequence[Trial]) -> list[str]:
    out = []
    for t in accepted:
        out.append(f"{t.candidate.physics} at {where(t.candidate.place)} brings the error to {t.error:.3g} (fitted) and {t.hold_out:.3g} (held out).")
    for t in o.trials[1:4]:
        out.append(f"The same procedure with {t.candidate.physics} at {where(t.candidate.place)} leaves {t.error:.3g} and {t.hold_out:.3g}.")
    return out


def _diagnosis(spec: Spec, verdict: str, says: str, findings: tuple[Finding, ...], o: Outcome, accepted: Sequence[Trial], data: Data,
               evidence: Sequence[str], begin: float) -> Diagnosis:
    after = (accepted[-1].error, accepted[-1].hold_out) if accepted else o.ordinary
    fit: dict[str, dict[str, float | None]] = {}
    for key, k in (("fit", 0), ("hold_out", 1)):
        fit[key] = {"before": _number(o.nominal[k]), "ordinary": _number(o.ordinary[k]), "after": _number(after[k]), "noise": _number(o.noise[k])}
    candidates: list[dict[str, Any]] = [{"physics": t.candidate.physics, "location": t.candidate.place.to_json(), "score": _number(t.error),
                                         "hold_out_score": _number(t.hold_out), "misfit": _number(t.fit.misfit), "parameters": t.values} for t in o.trials]
    shown = {t.candidate.name for t in o.trials}
    candidates += [{"physics": s.candidate.physics, "location": s.candidate.place.to_json(), "score": None, "hold_out_score": None, "share": s.share}
                   for s in o.screened if s.candidate.name not in shown]
    metrics = {key: {"response_error" if any(isinstance(r, TimeHistory) for r in data.fit) else "frf_error": {"before": v["before"], "after": v["after"]}}
               for key, v in fit.items()}
    details = {"method": "smoothed output error, trust-region convex steps", "misfit": {"ordinary": o.base.misfit,
               "after": accepted[-1].fit.misfit if accepted else o.base.misfit}}
    return Diagnosis(spec.name, spec.title, str(spec.path), verdict, says, tuple(findings), tuple(candidates), fit, metrics, tuple(evidence),
                     time.perf_counter() - begin, details)


def _number(x: float) -> float | None:
    return float(x) if np.isfinite(x) else None
