"""What a comparison means, in sentences."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.report.numbers import count, fixed, number
from cvxupdate.report.words import Verdict

if TYPE_CHECKING:
    from cvxupdate.correlate.balance import ElementBalance
    from cvxupdate.correlate.result import Compared, ModePair, ShapeComparison

GOOD_ERROR, POOR_ERROR = 2.0, 10.0
"""Mean frequency error in per cent below which a model is good, and above which it is poor."""
GOOD_MAC, POOR_MAC = 0.9, 0.6
"""Lowest MAC, likewise."""
GOOD_FRF, POOR_FRF = 0.2, 0.7
"""Error of the frequency responses, likewise."""
TOO_MUCH = 0.5
"""Imbalance above which a place is a hint at most."""
MOST_OF_IT = 0.5
"""Explained fraction below which nothing is named where that much is out of balance."""
NO_MOVE = 1e-3
"""Imbalance below which nothing is wrong with the force balance."""


def compared_verdict(compared: Compared) -> Verdict:
    """One line that says how far model and recordings agree, and what to mind."""
    parts, marks = [], []
    for use, said in (("fit", "{} paired with the model's"), ("hold-out", "{} held out")):
        errors = [abs(m.error_percent) for m in compared.modes if m.use == use]
        if not errors:
            continue
        mean = float(np.mean(errors))
        parts.append(
            f"{said.format(count(len(errors), 'measured mode'))}: mean frequency "
            f"error {fixed(mean)} %, largest {fixed(max(errors))} %"
        )
        marks.append(_mark(mean, GOOD_ERROR, POOR_ERROR))
    macs = [m.mac for m in compared.modes if m.mac is not None]
    if macs:
        parts.append(f"MAC {fixed(min(macs))} to {fixed(max(macs))}")
        marks.append(_mark(1.0 - min(macs), 1.0 - GOOD_MAC, 1.0 - POOR_MAC))
    for metric, of in (("frf_error", "frequency responses"), ("response_error", "time histories")):
        for key, word in (("fit", f"error of the {of}"), ("hold_out", "of those held out")):
            pair = compared.fit.get(key, {}).get(metric)
            if pair is None:
                continue
            first = "" if parts or key != "fit" else " (1: as large as the responses)"
            parts.append(f"{word} {number(pair['before'], 3)}{first}")
            marks.append(_mark(pair["before"], GOOD_FRF, POOR_FRF))
    if not parts:
        parts.append("nothing of these recordings can be compared")
    headline = "; ".join(parts)
    tone = ("good", "fair", "bad")[max(marks, default=1)]
    return Verdict(
        tone,
        f"{headline[:1].upper()}{headline[1:]}.",
        tuple(swaps(compared.modes)) + tuple(_weak(compared)),
    )


def swaps(modes: tuple[ModePair, ...]) -> list[str]:
    """Sentences for measured modes whose order in the model is another one."""
    out = []
    for recording in dict.fromkeys(m.recording for m in modes):
        mine = sorted((m for m in modes if m.recording == recording), key=lambda m: m.measured)
        moved = sorted(mine, key=lambda m: m.mode)
        block: list[int] = []
        for k, (a, b) in enumerate(zip(mine, moved, strict=True)):
            block += [k] if a is not b else []
            done = {id(m) for m in mine[: k + 1]} == {id(m) for m in moved[: k + 1]}
            if done and block:
                here = [mine[i] for i in block]
                words = "are swapped" if len(here) == 2 else "come in another order"
                names = _join([f"{number(m.measured)} Hz" for m in here])
                out.append(
                    f"The modes measured at {names} {words} in the model: they are its modes "
                    f"{_join([str(m.mode) for m in here])}."
                )
                block = []
    return out


def _weak(compared: Compared) -> list[str]:
    out = []
    weak = [m for m in compared.modes if m.mac is not None and m.mac < POOR_MAC]
    if weak:
        out.append(
            f"The shapes of {_join([f'{number(m.measured)} Hz' for m in weak])} hardly "
            f"resemble the model's (MAC below {POOR_MAC}): look at them before anything is "
            "updated."
        )
    guessed = [m for m in compared.modes if m.by == "frequency"]
    if guessed and len(guessed) < 4:
        out.append(
            f"{_join([f'{number(m.measured)} Hz' for m in guessed])} "
            f"{'was' if len(guessed) == 1 else 'were'} paired by frequency alone."
        )
    elif guessed:
        out.append(
            f"{len(guessed)} modes were paired by frequency alone: close modes may be "
            "confused. Give shapes, or `mode` in the table."
        )
    return out


def balance_sentence(found: ShapeComparison) -> str:
    """What the force balance says: how much is out of balance, and whether one place explains
    it."""
    b = found.correlation.element_balance or found.groups
    if b is None:
        return ""
    if b.imbalance < NO_MOVE:
        return (
            "The measured shapes are in balance with the model's matrices: nothing is to be "
            "located."
        )
    who, names = (
        ("element", [f"e{i}" for i in found.element_ids.tolist()])
        if found.correlation.element_balance
        else ("group", list(found.group_names))
    )
    fraction, change, what = _first(b)
    best = int(np.argmax(fraction))
    level = fixed(100 * b.imbalance, 0 if b.imbalance > 0.1 else 2)
    text = (
        f"{level} % of the elastic forces of the measured shapes is out of balance (r.m.s. over "
        "the modes). "
    )
    too_much = b.imbalance > TOO_MUCH
    if too_much and (who == "group" or fraction[best] < MOST_OF_IT):
        # Taking away a group that holds most of the stiffness balances nearly anything.
        return (
            text + "With so much out of balance the fractions below locate nothing: noise in the "
            "shapes, or many faults at once, look like this."
        )
    if fraction[best] < 0.3:
        return (
            text
            + f"No single {who} explains more than {fixed(100 * float(fraction[best]), 0)} % of "
            "that: the cause is spread, or it is noise."
        )
    delta = f"{100 * float(change[best]):+.0f} %".replace("-", "−")
    rest = np.delete(fraction, best)
    runner = f"; the next explains {fixed(100 * float(rest.max()), 0)} %" if rest.size else ""
    limit = (
        " That is as low as it can go, so it is hardly the whole cause."
        if change[best] <= -0.999
        else ""
    )
    return text + (
        f"{names[best]} alone explains {fixed(100 * float(fraction[best]), 0)} % of that, by a "
        f"change of its {what} of {delta}{runner}.{limit}"
        + (
            " With so much out of balance that is a hint at most: noise in the shapes, or many "
            "faults at once, look like this too."
            if too_much
            else ""
        )
    )


def _first(b: ElementBalance) -> tuple[np.ndarray, np.ndarray, str]:
    """Explained fraction and change of what explains more at best: stiffness or mass."""
    if (
        b.mass is not None
        and b.mass_change is not None
        and float(b.mass.max(initial=0.0)) > float(b.stiffness.max(initial=0.0))
    ):
        return b.mass, b.mass_change, "mass"
    return b.stiffness, b.stiffness_change, "stiffness"


def _mark(value: float, good: float, poor: float) -> int:
    return 0 if value <= good else 1 if value <= poor else 2


def _join(words: list[str]) -> str:
    return words[0] if len(words) == 1 else ", ".join(words[:-1]) + " and " + words[-1]
