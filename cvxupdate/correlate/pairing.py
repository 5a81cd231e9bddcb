"""Which model mode is which measured mode: optimal assignment, with or without shapes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cvxupdate.correlate._shapes import Real, Shapes
from cvxupdate.correlate.mac import mac
from cvxupdate.errors import InputError

Index = NDArray[np.intp]


@dataclass(frozen=True)
class Pairing:
    """Pairs of modes, in the order of the measured ones; indices count from 0.

    ``model[k]`` and ``measured[k]`` are one pair, ``mac[k]`` its MAC (NaN where it was paired by
    frequency alone). ``unpaired`` are the measured modes without a partner, ``unpaired_model`` the
    model's.
    """

    model: Index
    measured: Index
    mac: Real
    unpaired: Index
    unpaired_model: Index

    def __len__(self) -> int:
        """The number of pairs."""
        return int(self.model.size)


def pair_modes(
    phi_a: Shapes,
    phi_x: Shapes,
    f_a: Real | None = None,
    f_x: Real | None = None,
    threshold: float = 0.5,
    frequency_weight: float = 0.5,
) -> Pairing:
    """Pair model and measured modes so that the sum of their MACs is largest, each mode used once.

    Only pairs of MAC ≥ ``threshold`` may be formed. Where both frequencies are given, a pair's gain
    is MAC − ``frequency_weight`` · |ln(f_a / f_x)|: few sensors make distant modes look alike
    (spatial aliasing), the more so the further up the model's modes go, and of two nearly equal
    MACs the nearer frequency should win. A mode that a gross error has moved is off by some 30 % in
    frequency and some 0.15 in MAC, hence the weight of a half; 0 is MAC alone.

    Parameters
    ----------
    phi_a : (dofs, modes_a), phi_x : (dofs, modes_x), NaN where not measured. f_a, f_x : Hz, one per
    column.

    Raises
    ------
    InputError
        Shapes or frequencies do not agree, or threshold or weight lie outside [0, 1].
    """
    if not (0.0 <= threshold <= 1.0 and 0.0 <= frequency_weight <= 1.0):
        raise InputError(
            f"pair_modes: threshold {threshold} and frequency_weight {frequency_weight} "
            "must lie in [0, 1]"
        )
    macs = mac(phi_a, phi_x)
    gain = macs.copy()
    if f_a is not None and f_x is not None:
        fa, fx = _frequencies(f_a, "f_a", macs.shape[0]), _frequencies(f_x, "f_x", macs.shape[1])
        fa, fx = np.maximum(fa, np.finfo(float).tiny), np.maximum(fx, np.finfo(float).tiny)
        gain -= frequency_weight * np.abs(np.log(fa)[:, None] - np.log(fx)[None, :])
    # A pair that may be formed is always worth more than none: so the gain of an allowed pair is
    # kept positive.
    allowed = (macs >= threshold) & (macs > 0.0)
    gain = np.where(allowed, np.maximum(gain, 1e-9), 0.0)
    rows, columns = linear_sum_assignment(gain, maximize=True)
    kept = allowed[rows, columns]
    return _pairing(rows[kept], columns[kept], macs[rows[kept], columns[kept]], macs.shape)


def pair_frequencies(
    f_a: Real, f_x: Real, std: Real | None = None, limit: float = np.inf
) -> Pairing:
    """Pair by frequency alone, by optimal assignment: Σ ((f_a − f_x)/std)² least, whatever the
    order of the lists.

    Parameters
    ----------
    f_a : (modes_a,) Hz. f_x : (modes_x,) Hz. std : (modes_x,) Hz, the scale of each measured
    frequency; None weighs by
    f_x, that is relative errors. limit : pairs further apart than ``limit · std`` (or ``limit ·
    f_x``) are not formed.

    Returns
    -------
    Pairing with MAC NaN; every measured mode is paired when the model has enough modes and
    ``limit`` allows.
    Raises `InputError` on negative or non-finite frequencies, or deviations that are not positive.
    """
    fa, fx = _frequencies(f_a, "f_a", None), _frequencies(f_x, "f_x", None)
    scale = np.asarray(fx if std is None else std, dtype=np.float64)
    if scale.shape != fx.shape or np.any(~(scale > 0.0)) or np.any(np.isinf(scale)):
        raise InputError(
            "pair_frequencies: std must give one positive deviation in Hz per measured frequency"
        )
    distance = np.abs(fa[:, None] - fx[None, :]) / scale[None, :]
    allowed = distance <= limit
    # A forbidden pair costs more than all allowed pairs together, so as few as possible are forced,
    # and then dropped.
    cost = distance**2
    worst = float(np.sum(np.where(allowed, cost, 0.0))) + 1.0
    rows, columns = linear_sum_assignment(np.where(allowed, cost, worst))
    kept = allowed[rows, columns]
    return _pairing(rows[kept], columns[kept], np.full(int(kept.sum()), np.nan), distance.shape)


def _pairing(model: Index, measured: Index, macs: Real, shape: tuple[int, ...]) -> Pairing:
    order = np.argsort(measured)
    return Pairing(
        model[order],
        measured[order],
        macs[order],
        np.setdiff1d(np.arange(shape[1]), measured),
        np.setdiff1d(np.arange(shape[0]), model),
    )


def _frequencies(values: Real, name: str, count: int | None) -> Real:
    f = np.asarray(values, dtype=np.float64)
    if f.ndim != 1 or np.any(~np.isfinite(f)) or np.any(f < 0.0):
        raise InputError(
            f"{name}: frequencies must be a list of finite values in Hz, none negative"
        )
    if count is not None and f.size != count:
        raise InputError(
            f"{name}: {f.size} frequencies for {count} mode shapes; give one per column"
        )
    return f
