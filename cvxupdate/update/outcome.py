"""What every method reports of its loop: parameters, certificate, history, the model."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import asdict
from typing import Any

import numpy as np

from cvxupdate.convex import LinearClause, Prior
from cvxupdate.fe.generic.reading import reading
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec
from cvxupdate.system import Array
from cvxupdate.update.covariance import Combination, Uncertainty
from cvxupdate.update.judgement import correlation_of
from cvxupdate.update.result import (
    AccuracyResult,
    Metrics,
    ModeResult,
    ParameterResult,
    Updated,
    clause_names,
)
from cvxupdate.update.trust_region import LoopResult, objective_at

AT_BOUND = 1e-6  # of the distance between the bounds
RELATIVE = (
    "The recordings state no deviations: their weights are relative, and the parameters' "
    "deviations come from the scatter of the residual."
)

UNCERTIFIED = (
    "There is nothing to certify: a classical solution minimises no objective under constraints. "
    "Bounds were not kept."
)


def updated(
    spec: Spec,
    model: Model,
    loop: LoopResult[Any],
    known: Uncertainty,
    relative: bool,
    begin: float,
    *,
    method: str,
    fit: dict[str, Metrics],
    notes: Sequence[str],
    modes: tuple[ModeResult, ...] = (),
    accuracy: tuple[AccuracyResult, ...] = (),
    facts: dict[str, Any] | None = None,
    starts: dict[str, Any] | None = None,
) -> Updated:
    """The outcome of a loop.

    Parameters
    ----------
    known : the uncertainty at the loop's end; relative : whether the deviations were weights only.
    begin : `time.perf_counter` at the start; facts : what else to say of the model, or of starts.
    """
    p, infeasible = loop.point.p, loop.status == "infeasible"
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=spec.shown,
        status=loop.status,
        reason=loop.reason,
        method=method,
        solver=solver_of(loop),
        iterations=len(loop.history),
        parameters=parameter_results(model, loop, known),
        fit=fit,
        certificate=certificate_of(loop),
        time=time.perf_counter() - begin,
        conflict=loop.step.conflict if infeasible else (),
        relaxation=tuple(r.says for r in loop.step.relaxation) if infeasible else (),
        modes=modes,
        history=tuple({**asdict(h), "ratio": finite(h.ratio)} for h in loop.history),
        undetermined=undetermined_of(known, loop),
        told=told_of(known),
        noise=None if relative else known.noise,
        active=loop.step.active,
        regularisation=regularisation_of(loop),
        model={"clauses": clause_names(loop.problem), **model_facts(model, p), **(facts or {})},
        notes=tuple(notes),
        accuracy=accuracy,
        starts=starts or {},
        families=family_results(model, p),
        classical=loop.classical,
        correlations=None if infeasible else correlation_of(known, model.parameters),
    )


def undetermined_of(known: Uncertainty, loop: LoopResult[Any]) -> tuple[dict[str, Any], ...]:
    """The combinations that the recordings leave open, as plain data; ``prior`` is the part of what
    is known along each that a prior about the nominal model brought, None without one."""
    return tuple(
        {
            "coefficients": dict(c.coefficients),
            "standard_deviation": finite(c.std),
            "says": c.says,
            "prior": _brought(c, loop),
        }
        for c in known.undetermined
    )


def _brought(c: Combination, loop: LoopResult[Any]) -> float | None:
    """Precision that the priors bring along a combination, of that with what the recordings say."""
    priors = [r for r in loop.problem.regularisers if isinstance(r, Prior) and not r.of_move]
    if not priors or any(isinstance(r.weight, str) for r in priors):
        return None
    names = loop.problem.columns
    precision = sum(float(r.weight) * r.value(c.direction, names) for r in priors)
    return precision / (precision + (0.0 if np.isinf(c.std) else c.std**-2.0))


def told_of(known: Uncertainty) -> dict[str, int]:
    """Real equations that the recordings gave, combinations of parameters that were free, and how
    many of those they determine."""
    return {
        "equations": known.equations,
        "free": known.free,
        "determined": known.free - len(known.undetermined),
    }


def solver_of(loop: LoopResult[Any]) -> str:
    """The solver of the convex steps, or the classical solution that took their place."""
    return loop.step.solver if loop.classical is None else loop.classical.solution


def outside(model: Model, loop: LoopResult[Any]) -> tuple[str, ...]:
    """A note on the parameters that a classical solution left outside their bounds."""
    if loop.classical is None:
        return ()
    p = loop.point.p
    names = [
        q.name
        for q, value in zip(model.parameters, p.tolist(), strict=True)
        if not q.lower <= value <= q.upper
    ]
    shown = ", ".join(names[:8]) + (f" and {len(names) - 8} more" if len(names) > 8 else "")
    return (f"Outside their bounds, which this solution does not know: {shown}.",) if names else ()


def family_results(model: Model, p: Array) -> tuple[dict[str, Any], ...]:
    """Every family of element matrices at ``p``, and what it means (`fe.generic.reading`)."""
    number = {q.name: i for i, q in enumerate(model.parameters)}
    found = [reading(use, p[[number[c] for c in use.columns]]) for use in model.families]
    return tuple({**asdict(r), "says": r.says} for r in found)


def objective_metric(
    loop: LoopResult[Any], start: Any | None = None, end: Any | None = None
) -> Metrics:
    """The objective at both ends of the loop (or at the given points); nothing while a weight is
    still a rule."""
    if any(isinstance(r.weight, str) for r in loop.problem.regularisers):
        return {}
    ends = loop.start if start is None else start, loop.point if end is None else end
    before, after = (objective_at(loop.problem, point) for point in ends)
    return {"objective": {"before": before, "after": after}}


def model_facts(model: Model, p: Array) -> dict[str, Any]:
    """Sizes of the model and its mass (kg) before and after. Entries of whole matrices are no
    elements."""
    blocks = [b for b in model.blocks if b.kind.name not in ("entry", "generic", "base")]
    return {
        "dofs": model.size,
        "elements": int(sum(len(set(b.ids.tolist())) for b in blocks)),
        "nodes": len(model.node_ids),
        "mass_before": model.total_mass(),
        "mass_after": model.total_mass(p),
    }


def parameter_results(
    model: Model, loop: LoopResult[Any], known: Uncertainty
) -> tuple[ParameterResult, ...]:
    """Parameters in SI units with their deviations and bounds."""
    p, out = loop.point.p, []
    for q, value, std, (low, high) in zip(
        model.parameters, p.tolist(), known.std.tolist(), _limits(model, loop), strict=True
    ):
        width = high - low if np.isfinite(high - low) else 1.0
        bound = (
            "lower"
            if value <= low + AT_BOUND * width
            else "upper"
            if value >= high - AT_BOUND * width
            else None
        )
        size = abs(q.unit_size)
        out.append(
            ParameterResult(
                q.name,
                q.of,
                q.elements[0] if len(q.elements) == 1 else None,
                q.elements,
                q.group,
                q.unit,
                q.physical(0.0),
                q.physical(value),
                finite(std * size),
                finite(q.physical(low)),
                finite(q.physical(high)),
                bound is not None,
                bound,
                value,
                finite(std),
            )
        )
    return tuple(out)


def _limits(model: Model, loop: LoopResult[Any]) -> list[tuple[float, float]]:
    """Bounds of each parameter: its own, and those of a family of element matrices whose class has
    one mode (`convex.constraints.generic`)."""
    own = {n: [q.lower, q.upper] for n, q in enumerate(model.parameters)}
    free = {n for n, q in enumerate(model.parameters) if q.of == "generic"}
    for clause in loop.problem.clauses:
        if not isinstance(clause, LinearClause) or not free.issuperset(clause.on):
            continue
        if len(clause.on) != 1 or len(clause.C) != 1 or clause.lower[0] == clause.upper[0]:
            continue
        ends = sorted(v / clause.C[0, 0] for v in (clause.lower[0], clause.upper[0]))
        pair = own[clause.on[0]]
        pair[:] = max(pair[0], ends[0]), min(pair[1], ends[1])
    return [(low, high) for low, high in own.values()]


def certificate_of(loop: LoopResult[Any]) -> dict[str, object]:
    """The certificate of the last step, as the contract names its parts."""
    if loop.classical is not None:
        return {"none": True, "says": UNCERTIFIED}
    c = loop.step.certificate
    out: dict[str, object] = dict(c.as_dict())
    out |= {
        "primal_residual": out.pop("primal"),
        "dual_residual": out.pop("dual"),
        "optimal": c.is_optimal(),
        "says": loop.step.says,
    }
    if loop.step.infeasibility is not None:
        out["infeasibility"] = asdict(loop.step.infeasibility)
    return out


def regularisation_of(loop: LoopResult[Any]) -> tuple[dict[str, object], ...]:
    """Each regulariser with its weight and how it was chosen."""
    out: list[dict[str, object]] = []
    for r in loop.problem.regularisers:
        chosen = loop.weight
        rule = chosen.rule if chosen is not None and r.weight == chosen.weight else None
        out.append(
            {
                "kind": r.name,
                "weight": r.weight,
                "rule": rule,
                "note": chosen.note if rule and chosen is not None else "",
            }
        )
    return tuple(out)


def finite(value: float) -> float | None:
    """The number, None where it is not finite."""
    return float(value) if np.isfinite(value) else None
