"""What a result means, in sentences."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import count, fixed, number, power

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated

METRICS = {
    "frequency_error_percent_mean": ("mean frequency error", "%"),
    "frequency_error_percent_max": ("largest frequency error", "%"),
    "mac_mean": ("mean MAC", ""),
    "mac_min": ("lowest MAC", ""),
    "frf_error": ("error of the frequency responses", ""),
    "response_error": ("error of the time responses", ""),
    "objective": ("objective of the fit", ""),
}
"""The contract's metrics in words, with their unit."""

INDEFINITE = 1e-10
"""Below minus this an eigenvalue of a matrix scaled to a unit diagonal is negative, and not only
rounded."""

TOGETHER = 0.95
"""|r| from which two parameters are said to be known only together: with the other known, the
deviation of each would be √(1 − r²), a third, of what it is."""

BETTER_HIGH = ("mac_mean", "mac_min")

CERTIFICATE = (
    ("primal_residual", "primal residual", "the constraints and definitions hold"),
    (
        "dual_residual",
        "dual residual",
        "stationarity: no direction lowers the objective except through a constraint",
    ),
    ("gap", "duality gap", "distance between the objective and a proven lower limit"),
    ("complementarity", "complementarity", "only constraints that hold with equality push"),
    ("primal_cone", "primal cone", "inequalities are kept"),
    ("dual_cone", "dual cone", "multipliers have the right sign"),
)
"""(key, name, what it says when it is nearly zero)."""


@dataclass(frozen=True)
class Verdict:
    """``tone`` good, fair or bad; a headline and the sentences below it."""

    tone: str
    headline: str
    sentences: tuple[str, ...]


def verdict(updated: Updated) -> Verdict:
    """One line that says what came of it, and what to mind."""
    minds = tuple(_minds(updated))
    if updated.status == "infeasible":
        return Verdict(
            "bad", "The constraints contradict one another; the model was not updated.", ()
        )
    gain = _gain(updated)
    if updated.status not in ("converged", "optimal"):
        return Verdict(
            "fair",
            f"Stopped before convergence. {gain}".strip(),
            (f"Why: {updated.reason}.", *minds),
        )
    doubtful = worse(updated) or updated.caveats or _doubts(updated)
    return Verdict("fair" if doubtful else "good", gain or "The update converged.", minds)


def worse(updated: Updated) -> tuple[str, ...]:
    """Metrics of the hold-out that got worse, by more than rounding."""
    out = []
    for key, pair in updated.fit.get("hold_out", {}).items():
        before, after = pair["before"], pair["after"]
        change = before - after if key in BETTER_HIGH else after - before
        if change > 1e-9 * max(1.0, abs(before)):
            out.append(key)
    return tuple(out)


def _gain(updated: Updated) -> str:
    metrics = updated.fit.get("fit", {})
    held = updated.fit.get("hold_out", {})
    n, h = sum(m.use == "fit" for m in updated.modes), sum(m.use != "fit" for m in updated.modes)
    key = next(
        (
            k
            for k in ("frequency_error_percent_mean", "frf_error", "response_error", "objective")
            if k in metrics
        ),
        None,
    )
    if key is None:
        return ""
    name, unit = METRICS[key]
    pair = metrics[key]
    over = f" over {count(n, 'fitted mode')}" if key.startswith("frequency") and n else ""
    text = (
        f"The {name}{over} went from {_amount(pair['before'], unit)} to "
        f"{_amount(pair['after'], unit)}"
    )
    if key in held:
        mode = held[key]
        who = (
            f"over {count(h, 'mode')} held out of the fit"
            if key.startswith("frequency") and h
            else "on the recordings held out of the fit"
        )
        text += (
            f", and {who} from {_amount(mode['before'], unit)} to {_amount(mode['after'], unit)}"
        )
    return text + "."


def _amount(value: float, unit: str) -> str:
    return f"{fixed(value)} %" if unit == "%" else number(value)


def _doubts(updated: Updated) -> tuple[str, ...]:
    return () if updated.judgement is None else updated.judgement.doubts


def _minds(updated: Updated) -> list[str]:
    out = [*updated.caveats, *_doubts(updated)]
    bad = worse(updated)
    if bad:
        names = " and ".join(METRICS.get(k, (k, ""))[0] for k in bad)
        out.append(
            f"The {names} of the hold-out got worse: the update follows what only the fitted "
            f"recordings contain. {_remedy(updated)}"
        )
    limits = [p.name for p in updated.parameters if p.at_bound]
    if limits:
        shown = ", ".join(limits[:6]) + (f" and {len(limits) - 6} more" if len(limits) > 6 else "")
        out.append(
            f"{shown} ended on a bound: the recordings ask for more than the bound allows, or "
            "the model lacks something else."
        )
    if updated.undetermined:
        out.append(
            f"{count(len(updated.undetermined), 'combination')} of parameters cannot be "
            "determined from these recordings; the report lists them."
        )
    together = together_sentence(updated)
    return [line for line in (*out, together, _untested(updated)) if line]


def _remedy(updated: Updated) -> str:
    """A direct method has no parameters to take out: it gives the model whatever the modes ask."""
    if updated.direct:
        return (
            "A direct method reproduces the fitted modes and promises nothing of others: take a "
            'parametric method (method = "sensitivity" or "rfm"), or fit more modes.'
        )
    return "Use fewer parameters or more data."


def _untested(updated: Updated) -> str:
    """A sentence where something was fitted and nothing held out; empty elsewhere."""
    if not updated.fit.get("fit") or updated.fit.get("hold_out"):
        return ""
    return (
        "Nothing was held out, so the update is untested on recordings that were not fitted. A "
        'further recording with use = "hold-out" would test it.'
    )


def together_sentence(updated: Updated) -> str:
    """Which parameters are known only together; empty where none are."""
    found = () if updated.correlations is None else updated.correlations.strongest
    close = [(a, b, r) for a, b, r in found if abs(r) >= TOGETHER]
    if not close:
        return ""
    a, b, r = close[0]
    others = f", and {count(len(close) - 1, 'pair')} more" if len(close) > 1 else ""
    kept = "difference" if r > 0.0 else "sum"
    return (
        f"{a} and {b} are known only together (correlation {fixed(r, 3)}{others}): the recordings "
        f"fix the {kept} of their changes, weighed by their deviations, far better than either."
    )


def certificate_sentence(updated: Updated) -> str:
    """What the certificate proves, in one or two sentences."""
    c: dict[str, Any] = updated.certificate
    if c.get("none"):
        return str(c["says"])
    if updated.status == "infeasible":
        proof = c.get("infeasibility")
        text = "No values of the parameters satisfy all clauses. "
        if proof:
            text += (
                "The proof is a weighting of the clauses that adds up to a contradiction "
                f"(Farkas' lemma): it separates by {power(proof['separation'])}, with errors "
                f"of {power(max(proof['stationarity'], proof['dual_cone']))} at most."
            )
        return text.strip()
    values = [
        c[key] for key, _, _ in CERTIFICATE if c.get(key) is not None and math.isfinite(c[key])
    ]
    if not values:
        return "The last step returned no point, so there is nothing to certify."
    worst = power(max(values)) if max(values) > 0 else "0"
    if c.get("optimal"):
        return (
            "The last convex step is solved: no admissible parameters lower its objective by "
            f"more than a relative {worst}. The figures were recomputed from the solver's "
            "answer, not taken from it."
        )
    return (
        "The last convex step was not solved to the accuracy required: the largest relative "
        f"residual is {worst}."
    )


def definite_sentence(updated: Updated) -> str:
    """Whether the updated matrices still belong to a structure; empty where it was not computed or
    nothing was updated."""
    mass, stiffness = (
        updated.model.get(f"{name}_eigenvalue_min") for name in ("mass", "stiffness")
    )
    if updated.status == "infeasible" or mass is None or stiffness is None:
        return ""
    bad = [
        f"the {name} matrix ({power(value)})"
        for name, value in (("mass", mass), ("stiffness", stiffness))
        if value < -INDEFINITE
    ]
    if bad:
        return (
            f"The updated model is no structure: {' and '.join(bad)} has a negative eigenvalue "
            "(scaled to a unit diagonal)."
        )
    rigid = (
        "it lets the structure move rigidly"
        if stiffness < INDEFINITE
        else "it is positive definite"
    )
    return (
        "The updated matrices are those of a structure: no eigenvalue of mass or stiffness is "
        f"negative; as to stiffness, {rigid}."
    )


def conflict_sentence(updated: Updated) -> str:
    """How to read the list of clauses in conflict."""
    if len(updated.conflict) == 1:
        return "This clause alone cannot hold:"
    return (
        f"These {len(updated.conflict)} clauses cannot hold together; without any one of them the "
        "rest can:"
    )
