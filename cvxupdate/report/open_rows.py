"""Combinations of parameters that the recordings leave open, for a page."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import count, number, signed

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated


def open_sentence(updated: Updated) -> str:
    """How many combinations the recordings determine, and what chose the others."""
    open_, told = len(updated.undetermined), updated.told
    text = ""
    if told:
        of = count(len(updated.parameters), "parameter")
        text = (
            f"The recordings give {count(told['equations'], 'real equation')} for "
            f"{count(told['free'], 'free combination')} of {of} and determine "
            f"{told['determined']} of them. "
        )
    if not open_:
        return text.strip()
    which = "Along the other one" if open_ == 1 else f"Along the other {open_}"
    brought = [c["prior"] for c in updated.undetermined if c.get("prior") is not None]
    if len(brought) == open_:
        low, high = (f"{100.0 * v:.3g}" for v in (min(brought), max(brought)))
        share = f"{low} %" if low == high else f"{low} to {high} %"
        return (
            f"{text}{which} the prior chose: of all values that fit equally well those nearest "
            f"to the model as it came, counted in its deviations. {share} of what is known there "
            "comes from the prior; other values would fit about as well."
        )
    kinds = list(dict.fromkeys(str(r["kind"]) for r in updated.regularisation))
    chose = f"the regularisation ({', '.join(kinds)})" if kinds else "no prior"
    rest = (
        "chose, within the bounds and other clauses."
        if kinds
        else "chose: their values rest on the bounds, the other clauses and the starting point."
    )
    return f"{text}{which} {chose} {rest}"


def open_rows(updated: Updated, most: int) -> list[dict[str, Any]]:
    """The first ``most``: the sentence, the deviation, the combination."""
    return [
        {
            "says": c["says"],
            "deviation": number(c["standard_deviation"], 3),
            "combination": ", ".join(
                f"{signed(v)} {name}" for name, v in c["coefficients"].items()
            ),
        }
        for c in updated.undetermined[:most]
    ]
