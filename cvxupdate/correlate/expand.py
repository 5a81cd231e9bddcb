"""Which transformation expands the measured shapes, and which the force balance uses."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.balance import mode_imbalances
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes
from cvxupdate.reduction import Transformation, dynamic, guyan, partition, serep

Index = NDArray[np.int64]
NOISY = 0.5
"""Forces out of balance over elastic forces above which the shapes are taken to be noisy."""


def expansion(
    m: Matrices, flexible: Modes, sensors: Index, partner: Index, top: int
) -> tuple[Transformation | None, tuple[str, ...]]:
    """SEREP from the model's modes in the measured range, from the paired ones alone where the
    sensors are few, else Guyan; None with the reason where the sensors do not determine the model's
    motion at all."""
    for chosen in (np.arange(top), np.unique(partner)):
        if len(chosen) > len(sensors):
            continue
        try:
            return serep(flexible.shapes[:, chosen], sensors), ()
        except ModelError:
            continue
    try:
        return guyan(partition(m.K, m.M, sensors)), (
            "the sensors cannot distinguish the model's modes; shapes were expanded "
            "statically (Guyan).",
        )
    except ModelError:
        return None, (
            "the sensors cannot distinguish the model's modes, and do not hold it: no "
            "orthogonality, energies or force balance.",
        )


def balanced(
    m: Matrices, flexible: Modes, sensors: Index, x: Real, fx: Real
) -> tuple[list[Transformation] | None, tuple[str, ...]]:
    """The transformations that the force balance uses, one for each measured mode, with what to say
    about them.

    Dynamic expansion at each measured frequency balances every unmeasured DOF and is the sharpest,
    but it keeps the noise of the shapes, which stiffness turns into force. Where more than half of
    the elastic forces is out of balance, noise is likely: the shapes are then smoothed by SEREP,
    if that brings them nearer to balance. It does not where few modes must stand for many: a shape
    at a frequency above theirs is then thrown out of balance by the smoothing itself. What is said
    holds no figure: the one of the balance that is shown stands beside it.
    """
    try:
        split = partition(m.K, m.M, sensors)
        several = [dynamic(split, float(f)) for f in fx]
    except ModelError:
        return None, (
            "a measured frequency is a natural frequency of the structure held at its "
            "sensors: the force balance was left out.",
        )
    whole = np.flatnonzero(~np.any(np.isnan(x), axis=0))
    if not len(whole):
        return several, ()
    level = _level(m, x, fx, several, whole)
    if level <= NOISY:
        return several, ()
    said = (
        "more than half of the elastic forces of the measured shapes is out of balance: "
        "noise in the shapes does that, and so do large faults of the model"
    )
    count = smooth_modes(flexible, sensors)
    try:
        smooth = [serep(flexible.shapes[:, :count], sensors)] * len(fx)
    except ModelError:
        smooth = several
    if _level(m, x, fx, smooth, whole) < level:
        return smooth, (
            f"{said}. For the force balance the shapes were smoothed by SEREP on "
            f"{count} modes of the model.",
        )
    return several, (f"{said}, and the force balance is a hint at most.",)


def _level(m: Matrices, x: Real, fx: Real, several: list[Transformation], whole: Index) -> float:
    """Forces out of balance over elastic forces, r.m.s. over the modes without gaps."""
    forces = mode_imbalances(m.K, m.M, x[:, whole], fx[whole], [several[k] for k in whole.tolist()])
    return float(np.sqrt(np.mean([np.sum(np.abs(mode.force) ** 2) for mode in forces])))


def smooth_modes(flexible: Modes, sensors: Index) -> int:
    """Modes that smooth measured shapes: at most half as many as there are sensors."""
    return min(flexible.shapes.shape[1], len(sensors) // 2)


def balance_method(several: list[Transformation] | None, flexible: Modes, sensors: Index) -> str:
    """How the shapes of the force balance were expanded; "" where there is none."""
    if not several:
        return ""
    if several[0].frequency is not None:
        return "dynamic expansion at each measured frequency"
    return (
        f"{several[0].method} on {smooth_modes(flexible, sensors)} modes of the model, "
        "which smooths the shapes"
    )
