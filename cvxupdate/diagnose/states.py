"""The diagnosis of several states of one structure in one fit (`cvxupdate.diagnose.modes.states`):
what they have in common, and what each has for itself."""

from __future__ import annotations

import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.budget import Budget, most_sure
from cvxupdate.diagnose.gather import gathered, responses_of
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.kinds import departs, whole_within
from cvxupdate.diagnose.modes.moving import between, walked
from cvxupdate.diagnose.modes.states import (
    Kind,
    Shared,
    State,
    group_factors,
    hypotheses,
    kinds_of,
    nothing,
)
from cvxupdate.diagnose.output.diagnosis import Diagnosis, finite
from cvxupdate.diagnose.output.wording import by_themselves
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import (
    AT_BOUND,
    HALVED,
    LEAST_SIZE,
    STATED,
    STRONG,
)
from cvxupdate.diagnose.types import Progress
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.physics.place import capital
from cvxupdate.physics.units import quantity
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec

MOST = 12  # hypotheses that are listed
WALKED = 2  # of those that move, whose places are sought further with one structure for all


@dataclass(frozen=True)
class Ranked:
    """A hypothesis on all states with its kind of effect (None: nothing is missing) and its
    probability among all that were fitted."""

    kind: Kind | None
    shared: Shared
    probability: float


def states_diagnosis(
    spec: Spec,
    model: Model,
    states: Mapping[str, tuple[Spec, Sequence[Recording]]],
    tell: Progress,
    begin: float,
    budget: Budget,
) -> Diagnosis:
    """What several states of one structure lack in common; ``begin``: when it began.

    Raises
    ------
    InputError
        Where their recordings are no tables of modes.
    """
    parts = []
    for name, (its, recordings) in states.items():
        tell(f"state {name}")
        if any(r.origin.use == "fit" for r in responses_of(recordings)):
            raise InputError(
                f"{spec.path}: several states in one fit need tables of modes; state {name!r} has "
                'responses to fit. Call the healthy one state = "reference", or let '
                "`cvxupdate identify` make tables of them."
            )
        evidence = gathered(its, model, recordings, tell, budget=budget)
        if isinstance(evidence, ModesEvidence):
            parts.append(State(name, evidence))
    ranked = _ranked(parts, tell)
    best, base = ranked[0], next(r for r in ranked if r.kind is None)
    plain, kinds = base.shared.fit, max(p.evidence.tables.kinds for p in parts)
    odd = departs(plain, plain.point.points, kinds)
    explained = whole_within(plain) and not odd
    sure = not explained and best.kind is not None and best.probability >= STATED
    told = sure and _there(best.shared, base.shared)
    findings = _findings(parts, best, base, _near(ranked)) if told else ()
    verdict = "missing_physics" if findings else "consistent" if explained else "undetermined"
    last = best.shared if findings else base.shared
    return Diagnosis(
        problem=spec.name,
        title=spec.title,
        path=spec.shown,
        verdict=verdict,
        says=_says(findings, best, verdict, odd),
        findings=findings,
        candidates=tuple(_row(parts, r) for r in ranked[:MOST] if r.kind is not None),
        fit={
            key: {
                "before": _error(parts, None, key),
                "nuisance": _error(parts, base.shared, key),
                "after": _error(parts, last, key),
            }
            for key in ("fit", "hold_out")
        },
        metrics={},
        evidence=tuple(_lines(parts, ranked, base)),
        time=time.perf_counter() - begin,
        details={"method": "output error of the modes of all states, one structure for all"},
    )


def _ranked(parts: Sequence[State], tell: Progress) -> list[Ranked]:
    """All hypotheses, the likeliest first: weighted squares in units of the discrepancy that the
    best one leaves, and half of log rows for each unknown (Schwarz 1978). One that has an unknown
    for every row explains anything and is not looked at."""
    found: list[tuple[Kind | None, Shared]] = [(None, nothing(parts))]
    evidence = parts[0].evidence
    candidates = evidence.candidates(evidence.model)
    kinds = (*kinds_of(candidates, evidence.model), *group_factors(candidates))
    for number, kind in enumerate(kinds):
        if number and evidence.hurried:
            evidence.leave("kinds of effects", len(kinds) - number)
            break
        tell(f"all states: {kind.effects[0].type.noun}")
        found += [(kind, h) for h in hypotheses(parts, kind) if h.unknowns < h.fit.rows]
    moved = sorted(
        (k for k, (_, h) in enumerate(found) if h.moved), key=lambda k: found[k][1].fit.cost
    )
    for k in moved[:WALKED]:
        what, shared = found[k]
        if what is not None:
            found[k] = what, walked(parts, what, shared)
    rows = found[0][1].fit.rows
    level = max(1.0, min(h.fit.cost / (rows - h.unknowns) for _, h in found))
    logs = np.array([-0.5 * (h.fit.cost / level + h.unknowns * np.log(rows)) for _, h in found])
    weights = np.exp(logs - logs.max())
    weights /= weights.sum()
    return [
        Ranked(found[k][0], found[k][1], float(weights[k]))
        for k in np.argsort(-logs, kind="stable")
    ]


def _there(shared: Shared, base: Shared) -> bool:
    """Whether it halves what is left without it, and its sizes exceed what they may be off by and
    are not on a bound."""
    sizes, setting = shared.sizes, shared.fit.setting
    free = shared.fit.p[-(len(shared.effects) if shared.own else 1) :]
    upper = setting.upper[-len(free) :]
    return bool(
        shared.fit.cost <= HALVED * base.fit.cost
        and np.any(np.abs(sizes[:, 0]) > LEAST_SIZE * sizes[:, 1])
        and np.all(free < (1.0 - AT_BOUND) * upper)
    )


def _near(ranked: Sequence[Ranked]) -> list[Ranked]:
    """Those that these recordings do not tell from the likeliest."""
    least = ranked[0].probability * float(np.exp(-0.5 * STRONG))
    return [r for r in ranked[1:] if r.kind is not None and r.probability > least]


def _findings(
    parts: Sequence[State], best: Ranked, base: Ranked, near: Sequence[Ranked]
) -> tuple[Finding, ...]:
    kind, shared = best.kind, best.shared
    if kind is None:
        return ()
    explains = 1.0 - shared.fit.cost / base.shared.fit.cost
    order = {e.key: k for k, e in enumerate(kind.effects)}
    out = []
    for k, state in enumerate(parts):
        effect, unit = shared.effects[k], shared.units[k]
        p, spread = shared.sizes[k]
        name = effect.figures[0].name
        size = effect.figures[0].nothing
        figures = {name: unit * float(p) + (size or 0.0)}
        deviations = {name: unit * float(spread)}
        says = f"State {state.name}: {effect.says(figures)}"
        if shared.moved:
            nuisance = shared.fit.p[:-1]
            there = between(state, kind, order[effect.key], unit * float(p), nuisance)
            if there is not None:
                at, off = there
                off *= np.sqrt(max(1.0, shared.fit.cost / (shared.fit.rows - shared.unknowns)))
                runs = np.ptp(kind.xyz, axis=0) > 0.0  # coordinates in which the line runs
                place = {c: float(v) for c, v, r in zip("xyz", at, runs, strict=True) if r}
                figures |= place
                deviations |= dict.fromkeys(place, float(off))
                where = ", ".join(f"{c} {quantity(v, 'm')}" for c, v in place.items())
                says += f" Between the nodes it is at {where} (± {quantity(off, 'm')})."
        out.append(
            Finding(
                effect.physics,
                effect.place,
                effect.title,
                figures,
                deviations,
                deviations,
                min(best.probability, most_sure(parts[0].evidence.unfinished)),
                explains,
                tuple(r.shared.effects[k] for r in near),
                says,
            )
        )
        if not shared.moved and not shared.own:  # the same in all states
            break
    return tuple(out)


def _says(findings: Sequence[Finding], best: Ranked, verdict: str, odd: str) -> str:
    if verdict == "consistent":
        return "Nothing is missing: one model explains all states within noise and usual scatter."
    if not findings:
        none = "No effect that all states share, of one size or at one place, explains them."
        return f"{none} {by_themselves(odd)}".strip()
    shared = best.shared
    noun = shared.effects[0].type.noun
    head = (
        f"{capital(noun)} of one size explains all states; it stands elsewhere in each."
        if shared.moved
        else f"{capital(noun)} at one place explains all states; its size differs."
        if shared.own
        else f"{capital(noun)} that is the same in all states explains them."
    )
    return " ".join([head, *(f.says for f in findings)])


def _title(ranked: Ranked) -> str:
    shared = ranked.shared
    if ranked.kind is None:
        return "the usual scatter of the groups"
    noun = shared.effects[0].type.noun
    if shared.moved:
        return f"{noun} ({shared.effects[0].place.dof}) of one size that moves"
    return f"{shared.effects[0].title}, {'own sizes' if shared.own else 'one size'}"


def _lines(parts: Sequence[State], ranked: Sequence[Ranked], base: Ranked) -> list[str]:
    names = ", ".join(part.name for part in parts)
    out = [
        f"States in one fit: {names}. They share the structure with its scatter; effects are of "
        "one size at a place of each state, or at one place."
    ]
    for r in (base, *(r for r in ranked[:4] if r is not base)):
        left = _error(parts, r.shared, "fit")
        out.append(f"{capital(_title(r))} leaves {100 * (left or 0.0):.3g} % of the frequencies.")
    out += [f"These recordings do not tell it from {_title(r)}." for r in _near(ranked)]
    return [*out, *parts[0].evidence.budget.lines]


def _row(parts: Sequence[State], ranked: Ranked) -> dict[str, object]:
    shared = ranked.shared
    return {
        "physics": shared.effects[0].physics,
        "title": _title(ranked),
        "location": shared.effects[0].place.to_json(),
        "locations": {
            part.name: e.place.to_json() for part, e in zip(parts, shared.effects, strict=True)
        },
        "score": _error(parts, shared, "fit"),
        "hold_out_score": _error(parts, shared, "hold_out"),
        "misfit": shared.fit.misfit,
        "probability": ranked.probability,
    }


def _error(parts: Sequence[State], shared: Shared | None, key: str) -> float | None:
    """R.m.s. relative error of the frequencies of all states, each state as heavy as the others;
    None: of the file as it came."""
    errors = []
    for k, part in enumerate(parts):
        if shared is None:
            found = part.evidence.stated(part.nominal.fit)[0]
        else:
            setting = shared.fit.setting
            p = setting.maps[k] @ shared.fit.p
            found = part.evidence.errors(part.evidence.evaluated(setting.parts[k], p))
        errors.append(getattr(found, key))
    known = [e for e in errors if np.isfinite(e)]
    return finite(float(np.sqrt(np.mean(np.square(known))))) if known else None
