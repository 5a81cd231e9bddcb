"""What a reader who is no analyst needs beside a diagnosis: what was not tried and why, what the
words mean."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis

GLOSSARY = (
    (
        "Error",
        "how far the model's answer lies from the measurement: 0 is perfect, 1 is an error as "
        "large as the signal itself; of natural frequencies the usual relative error",
    ),
    (
        "Held out",
        "measured, but kept away from the fit: it tests the finding, as a new measurement would",
    ),
    (
        "Usual scatter",
        "the few per cent by which stiffness, mass and damping of any structure differ from the "
        "drawing; allowed before anything is called a finding",
    ),
    (
        "Nuisance parameters",
        "stiffness and mass of each group of elements, and the damping: they are fitted beside "
        "every effect, within their usual scatter; let go far beyond it they are a rival of their "
        "own, wrong numbers of whole groups",
    ),
    (
        "Standard deviation",
        "the true value lies within one of them in two cases of three, within two in nineteen of "
        "twenty",
    ),
    (
        "Confidence",
        "the probability that the finding is of the right kind and at the right place, among "
        "everything that was tried and “nothing of these”",
    ),
    (
        "Cannot be told from",
        "another cause that would have left the same recordings; a sensor elsewhere could decide",
    ),
    (
        "Explained fraction",
        "the part of the mismatch that an effect could explain at best, looked at by itself",
    ),
    ("MAC", "likeness of two mode shapes: 1 the same shape, 0 nothing in common"),
    (
        "Phase",
        "how far the motion lags behind the force; it turns by 180° at a resonance",
    ),
)
"""(word, what it means)."""


def held_out(found: Diagnosis) -> bool:
    """Whether a recording was held out, so that there is a figure of what was not fitted."""
    return found.fit.get("hold_out", {}).get("before") is not None


def untested(found: Diagnosis) -> str:
    """A sentence where findings were not tested on anything; empty where they were, or where
    there are none."""
    if not found.findings or held_out(found):
        return ""
    return (
        "Nothing was held out, so what was found is untested on recordings that were not fitted. "
        'A further recording with use = "hold-out" would test it.'
    )


def not_tried(found: Diagnosis) -> Sequence[tuple[str, str]]:
    """(effect, reason) of every effect of the catalogue of which no place was tried."""
    beside = found.beside
    return () if beside is None else [(n.replace("_", " "), why) for n, why in beside.untried]


NOTHING_ELSE = "nothing else that was tried explains these recordings as well with as few unknowns."


def untold(found: Diagnosis) -> dict[str, Any]:
    """What cannot be told from the findings beside their equivalents: ``alone`` says that there is
    nothing, ``apart`` the same of one finding beside others, ``rivals`` share the confidence."""
    rivals = rivals_of(found)
    said = [f for f in found.findings if f.equivalent]
    alone = not said and not rivals
    return {
        "alone": NOTHING_ELSE.capitalize() if alone else "",
        "apart": "" if alone or not said else NOTHING_ELSE,
        "rivals": [line[:1].upper() + line[1:] for line in rivals],
    }


def rivals_of(found: Diagnosis) -> list[str]:
    """What else explains the recordings about as well, beside the equivalents of the findings."""
    return list(found.details.get("rivals", ()))


def too_little(found: Diagnosis) -> str:
    """Effects that were tried and explain too little to be listed, with what each explains at best;
    empty where there are none."""
    listed = {str(c.get("physics")) for c in found.candidates} | {f.physics for f in found.findings}
    rest = {n: v for n, v in found.details.get("tried", {}).items() if n not in listed}
    order = sorted(rest.items(), key=lambda item: -(item[1] or 0.0))
    return ", ".join(f"{name.replace('_', ' ')} ({_part(v)})" for name, v in order)


def _part(fraction: float | None) -> str:
    if fraction is None:
        return "too little to be refitted"
    return f"{100 * fraction:.0f} %" if fraction >= 0.01 else "less than 1 %"
