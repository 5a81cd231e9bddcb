"""Complex modes: damping at single places, or a delay, turns parts of a shape against the rest."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.settings import CHANCE, SHAPE_REPEATED, UNSTATED_SHAPE
from cvxupdate.diagnose.types import Real
from cvxupdate.physics.place import listed
from cvxupdate.recordings.phase import rotated
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.recordings.types import ModeTable

NAMED = 3  # modes in a sentence


def imaginary(table: ModeTable) -> Real:
    """Imaginary parts of the shapes, each turned to its best phase (Ahmadian and Gladwell 1995),
    over their deviations, (modes, channels): of identification, and `SHAPE_REPEATED` of the largest
    entry, which is 1. Proportional damping leaves none (Caughey 1960)."""
    if table.shapes is None or not np.iscomplexobj(table.shapes):
        return np.zeros((len(table.frequency), len(table.channels)))
    off = np.imag(rotated(table.shapes)) / deviations(table)
    return np.asarray(np.where(np.isfinite(off), off, 0.0))


def deviations(table: ModeTable) -> Real:
    """Of imaginary parts, (modes, channels)."""
    std = UNSTATED_SHAPE if table.shape_std is None else np.nan_to_num(table.shape_std)
    whole = np.broadcast_to(std, (len(table.frequency), len(table.channels)))
    return np.asarray(np.hypot(SHAPE_REPEATED, whole))


def by_chance(off: Real) -> bool:
    """Whether imaginary parts over their deviations, (n,), are no more than chance makes."""
    return float(off @ off) <= chi_square_above(1.0 - CHANCE, max(1, len(off)))


def complex_modes(tables: Sequence[ModeTable]) -> str:
    """Which modes are complex by more than chance, in words; empty where none are."""
    off = [imaginary(t) for t in tables]
    if by_chance(np.concatenate([np.zeros(0), *(x.reshape(-1) for x in off)])):
        return ""
    squares = np.concatenate([(x**2).sum(axis=1) for x in off])
    count = sum(x.size for x in off)
    frequencies = np.concatenate([t.frequency for t in tables])
    worst = sorted(np.argsort(-squares)[:NAMED].tolist(), key=lambda i: float(frequencies[i]))
    times = float(np.sqrt(squares.sum() / count))
    names = [f"{frequencies[i]:.4g} Hz" for i in worst]
    return (
        f"The shapes are complex by {times:.2g} times what identification and mounting leave, "
        f"r.m.s. (most at {listed(names)}): something takes out energy at a place."
    )
