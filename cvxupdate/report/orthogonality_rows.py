"""Checks of orthogonality on the page of `correlate`: one row each."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

import numpy as np

from cvxupdate.report.numbers import fixed, number

if TYPE_CHECKING:
    from cvxupdate.correlate.result import ShapeComparison

GOAL = (0.9, 0.1)
"""Least diagonal and largest off-diagonal entry that Chu and DeBroy (1989) ask for."""


def orthogonality_rows(s: ShapeComparison) -> list[dict[str, str]]:
    """Every check that could be made, with its least diagonal and largest other entry."""
    c = s.correlation
    pairs = np.asarray(c.pairing.model)[list(c.complete)]
    rows = [
        ("measured with itself, φₓᵀ M φₓ (2.7)", c.mass_orthogonality),
        ("model with measured, φₐᵀ M φₓ (2.8)", c.cross_orthogonality),
    ]
    four = c.pseudo_checks
    if four is not None:
        rows += [
            ("pseudo-orthogonality, as measured (2.9, first)", four.raw),
            ("the same in the mass improved by the shapes (second)", four.raw_improved),
            ("pseudo-orthogonality, unit modal mass (third)", four.normalised),
            ("the same in the mass improved by the shapes (fourth)", four.normalised_improved),
        ]
    whole = c.pseudo_orthogonality
    if whole is not None:
        rows.append(("without a mass matrix (O'Callahan), every mode of the model", whole[pairs]))
    if s.reciprocal is not None:
        of = f"measured with the reciprocal vectors of {s.reciprocal.recording}, no model"
        rows.append((of, s.reciprocal.orthogonality))
    return [_row(name, np.asarray(v)) for name, v in rows if v is not None]


def _row(name: str, values: Any) -> dict[str, str]:
    own = np.eye(len(values), dtype=bool)
    least, most = float(values[own].min()), float(np.max(values, where=~own, initial=0.0))
    good = least >= GOAL[0] and most <= GOAL[1]
    return {
        "name": name,
        "least": fixed(least, 2) if least < 1e3 else number(least, 2),
        "most": fixed(most, 2) if most < 1e3 else number(most, 2),
        "good": "yes" if good else "no",
    }


def static_sentence(s: ShapeComparison) -> str:
    """Wada's static forces in words; empty where there are none."""
    off = s.correlation.static_difference
    if off is None or not len(off):
        return ""
    worst = int(np.argmax(off))
    f = s.correlation.frequency_measured[list(s.correlation.complete)]
    return (
        f"The static forces K φ of measured and model shapes (Wada, 2.12) differ by "
        f"{_part(float(np.median(off)))} on the median mode, at most by "
        f"{_part(float(off[worst]))} ({number(float(f[worst]), 4)} Hz)."
    )


def _part(value: float) -> str:
    """A ratio in per cent, from twice upwards as a multiple."""
    return f"{number(100.0 * value, 2)} %" if value < 2.0 else f"{number(value, 2)} times"
