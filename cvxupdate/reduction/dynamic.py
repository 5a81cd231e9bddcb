"""Condensation at one frequency: exact, Kidder's series, Petersmann's spectral form, Gysin's with
all rows."""

from __future__ import annotations

import numpy as np
from scipy.linalg import solve

from cvxupdate.errors import InputError
from cvxupdate.reduction.split import Array, Partition
from cvxupdate.reduction.transformation import Transformation


def dynamic(split: Partition, frequency: float) -> Transformation:
    """Dynamic condensation, exact at ``frequency`` in Hz: x_s = −Z_ss⁻¹ Z_sn x_n, Z = K − ω²M
    (2.53, 2.62).

    Raises `ModelError` when the frequency is a natural frequency of the slaves with the masters
    held.
    """
    shift = _shift(split, frequency)
    return _result(split, split.solve(_coupling(split, shift), shift), "dynamic", frequency)


def kidder(split: Partition, frequency: float, terms: int = 1) -> Transformation:
    """Kidder's (1973) series for `dynamic` in powers of ω², on the factorisation of K_ss alone
    (2.54, 2.55).

    x_s = [−G + Σ_{k=1}^{terms} ω^{2k} (K_ss⁻¹M_ss)^{k−1} K_ss⁻¹ (M_sn − M_ss G)] x_n with G =
    K_ss⁻¹K_sn; no terms is Guyan. Raises `InputError` when ω² reaches the lowest eigenvalue of the
    slaves, where the series diverges.
    """
    shift = _shift(split, frequency)
    if terms < 0:
        raise InputError(f"kidder: terms must not be negative, got {terms}")
    G = split.static_map()
    total = -G
    if terms and shift > 0.0 and split.slaves.size:
        lowest = float(split.slave_modes(1)[0][0])
        if shift >= lowest:
            raise InputError(
                f"kidder: the series diverges at {frequency:.6g} Hz, the slaves' lowest "
                f"natural frequency being {np.sqrt(lowest) / (2 * np.pi):.6g} Hz; use "
                "dynamic, or add masters"
            )
        term = split.solve(split.M_sn.toarray() - split.M_ss @ G) * shift
        total = total + term
        for _ in range(terms - 1):
            term = split.solve(split.M_ss @ term) * shift
            total = total + term
    return _result(split, -total, "Kidder", frequency)


def petersmann(
    split: Partition, frequency: float, modes: int, static: bool = True
) -> Transformation:
    """Petersmann's (1984) spectral form of `dynamic` from the lowest ``modes`` slave modes (2.56).

    With ``static`` the frequency-independent part −G is kept exact and only the rest, −Z_ss⁻¹
    ω²(M_ss G − M_sn), is expanded in modes, so that every truncation is exact at 0 Hz; without it
    the whole of Z_ss⁻¹ is truncated, as printed. Many frequencies cost one Lanczos run. Raises
    `InputError` at a slave natural frequency, or for more modes than slaves.
    """
    shift = _shift(split, frequency)
    value, shape = split.slave_modes(modes)
    gap = value - shift
    if np.any(np.abs(gap) <= 1e-12 * value):
        raise InputError(
            f"petersmann: {frequency:.6g} Hz is a natural frequency of the slaves; choose "
            "another one"
        )
    if not static:
        return _result(
            split,
            shape @ ((shape.T @ _coupling(split, shift)) / gap[:, None]),
            "Petersmann",
            frequency,
        )
    G = split.static_map()
    rest = shift * (split.M_ss @ G - split.M_sn.toarray())
    return _result(split, G + shape @ ((shape.T @ rest) / gap[:, None]), "Petersmann", frequency)


def gysin(split: Partition, frequency: float) -> Transformation:
    """Gysin's (1990) modified dynamic expansion: the slaves that balance *all* rows best in least
    squares (2.64).

    min ‖Z_:n x_n + Z_:s x_s‖. Instead of a pseudo-inverse of an N × s matrix, the slave rows'
    imbalance r = Z_ss x_s + Z_sn x_n is taken as the unknown: with G = Z_ss⁻¹Z_sn and the condensed
    D = Z_nn − Z_ns G the minimum is r = −Ḡ (I + GᵀḠ)⁻¹ D x_n, so that one factorisation of Z_ss and
    an n × n system do it, and no condition is squared. Raises `ModelError` as `dynamic` does.
    """
    shift = _shift(split, frequency)
    G = split.solve(_coupling(split, shift), shift)
    whole = split.place(np.eye(split.masters.size), -G)
    D = (split.K @ whole - shift * (split.M @ whole))[split.masters]
    imbalance = -G.conj() @ solve(np.eye(split.masters.size) + G.T @ G.conj(), D)
    return _result(split, G - split.solve(imbalance, shift), "Gysin", frequency)


def _result(split: Partition, G: Array, method: str, frequency: float) -> Transformation:
    return Transformation(
        split.place(np.eye(split.masters.size), -G), split.masters, method, frequency=frequency
    )


def _coupling(split: Partition, shift: float) -> Array:
    return np.asarray((split.K_sn - shift * split.M_sn).toarray())


def _shift(split: Partition, frequency: float) -> float:
    split.needs_mass("dynamic reduction")
    if not (np.isfinite(frequency) and frequency >= 0.0):
        raise InputError(
            f"dynamic reduction: the frequency must be finite and not negative, got {frequency} Hz"
        )
    return float((2.0 * np.pi * frequency) ** 2)
