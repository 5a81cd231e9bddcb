"""Membership of the cones of a cone program, measured: pure functions of arrays.

Each function gives the largest violation, 0 for a member, in the unit of the vector.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from ..system import Array
from .matrix_form import Cones


def blocks(v: Array, cones: Cones) -> Iterator[tuple[str, Array]]:
    """The pieces of a vector of cone rows, as (kind, piece), in order."""
    at = 0
    sizes = [("zero", cones.zero), ("nonneg", cones.nonneg), *(("soc", k) for k in cones.soc)]
    sizes += [("psd", k * (k + 1) // 2) for k in cones.psd] + [("exp", 3)] * cones.exp
    for kind, size in sizes:
        yield kind, v[at : at + size]
        at += size


def matrix_of(v: Array) -> Array:
    """The symmetric matrix of a scaled upper triangle by columns (off-diagonals times √2)."""
    order = round((np.sqrt(8 * v.size + 1) - 1) / 2)
    columns, rows = np.tril_indices(order)
    S = np.zeros((order, order))
    S[rows, columns] = S[columns, rows] = np.where(rows == columns, v, v / np.sqrt(2))
    return S


def _soc(v: Array) -> float:
    return float(np.linalg.norm(v[1:]) - v[0])


def _psd(v: Array) -> float:
    return -float(np.linalg.eigvalsh(matrix_of(v))[0])


def _exp(v: Array) -> float:
    x, y, z = v
    if y <= 0:
        return float(max(-y, x, -z))
    return float(y * np.exp(min(x / y, 700.0)) - z)


def _exp_dual(v: Array) -> float:
    u, w, z = v
    if u >= 0:
        return float(max(u, -w, -z))
    return float(-u * np.exp(min(w / u - 1.0, 700.0)) - z)


def primal_violation(s: Array, cones: Cones) -> float:
    """How far s is from K (zero, nonneg: largest entry; soc: ‖v‖ − t; psd: −λ_min; exp: y e^(x/y) −
    z)."""
    worst = 0.0
    for kind, v in blocks(s, cones):
        if v.size:
            measure = {
                "zero": lambda a: np.max(np.abs(a)),
                "nonneg": lambda a: -np.min(a),
                "soc": _soc,
                "psd": _psd,
                "exp": _exp,
            }
            worst = max(worst, float(measure[kind](v)))
    return worst


def dual_violation(z: Array, cones: Cones) -> float:
    """How far z is from K*: free on the zero cone, self-dual for nonneg, soc, psd; the dual
    exponential cone else."""
    worst = 0.0
    for kind, v in blocks(z, cones):
        if v.size and kind != "zero":
            measure = {"nonneg": lambda a: -np.min(a), "soc": _soc, "psd": _psd, "exp": _exp_dual}
            worst = max(worst, float(measure[kind](v)))
    return worst
