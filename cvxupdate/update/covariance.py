"""How well the recordings fix the parameters: deviations, and the combinations that they leave
open."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from scipy.special import chdtri

from cvxupdate.fe.parameters import Parameter
from cvxupdate.system import Array, LinearSystem
from cvxupdate.update.invisible import Invisible

# a residual counts as too large for the stated deviations where chance makes one so large less
# often than this
SURPRISE = 0.05


@dataclass(frozen=True)
class Combination:
    """A combination of parameters with the deviation ``std`` along it, in units of p; ``says`` puts
    it in words, ``direction`` (n,) is what p changes by for one unit of it."""

    coefficients: tuple[tuple[str, float], ...]
    std: float
    says: str
    direction: Array


@dataclass(frozen=True)
class Uncertainty:
    """``std`` (n,) of p (inf: not determined at all); ``noise`` the factor by which the residual
    exceeds the stated deviations; ``undetermined`` combinations, worst first; ``equations`` (real
    numbers) that the recordings gave for so many ``free`` directions, equalities taken off."""

    std: Array
    covariance: Array
    noise: float
    undetermined: tuple[Combination, ...]
    equations: int
    free: int


def uncertainty(
    system: LinearSystem,
    p: Array,
    parameters: Sequence[Parameter],
    equalities: Array,
    relative_only: bool,
    silent: Sequence[Invisible] = (),
) -> Uncertainty:
    """Linearised covariance (WA)⁺ (WA)⁺ᵀ s² at the solution.

    Where the residual is larger than the stated deviations allow (χ² test at 5 %), the deviations
    grow with it: s² = χ² / (m − rank), which is always taken where the deviations were only weights
    (``relative_only``); with no row to spare it cannot be told and is 1. Parameters tied by
    ``equalities`` (rows, n) move together. Bounds are left out: the deviation is that of the
    recordings alone. A combination counts as undetermined when its deviation exceeds half the width
    of its bounds (or 50 % where free). What no recording of any kind can see (``silent``) comes
    first, in its own words and not as some mixture of it.

    Source: Bard, *Nonlinear Parameter Estimation* (1974), ch. 7; Friswell and Mottershead (1995),
    8.2.
    """
    J, _ = system.weighted()
    Z = la.null_space(equalities) if len(equalities) else np.eye(len(parameters))
    width = _widths(parameters)
    basis = _scaled_basis(Z, width)
    inverse, directions = _inverse_singular(J @ (width[:, None] * basis))
    known = np.isfinite(inverse)
    s2, ratio = _scatter(system, p, int(known.sum()), relative_only)
    along = width[:, None] * (basis @ directions.T)  # p moved by one unit of each direction
    kept = along[:, known] * inverse[known]
    moves = np.abs(along) > 1e-8 * np.abs(along).max(initial=1.0)
    variance = s2 * np.sum(np.where(moves[:, known], kept, 0.0) ** 2, axis=1)
    open_ = [k for k in np.argsort(-inverse) if inverse[k] * np.sqrt(s2) > 0.5]
    named, rest = _silent_first(directions[~known], basis, width, silent)
    combos = (
        *(_named(s, parameters) for s in named),
        *(_combination(basis @ d, np.inf, parameters, width) for d in rest),
        *(
            _combination(basis @ directions[k], float(inverse[k] * np.sqrt(s2)), parameters, width)
            for k in open_
            if known[k]
        ),
    )
    return Uncertainty(
        np.where(np.any(moves[:, ~known], axis=1), np.inf, np.sqrt(variance)),
        s2 * kept @ kept.T,
        float(np.sqrt(ratio)),
        combos,
        system.count,
        basis.shape[1],
    )


def _silent_first(
    null: Array, basis: Array, width: Array, silent: Sequence[Invisible]
) -> tuple[list[Invisible], Array]:
    """The ``silent`` changes that lie in the null space (rows of ``null`` in the coordinates of
    ``basis``), and what is left of it beside them."""
    if not len(null) or not silent:
        return [], null
    S = np.array([s.direction / width for s in silent])
    S /= np.linalg.norm(S, axis=1, keepdims=True)
    inside = S @ basis
    seen = np.linalg.norm(S - inside @ null.T @ null @ basis.T, axis=1) > 1e-6
    named = [s for s, out in zip(silent, seen, strict=True) if not out]
    if not named:
        return [], null
    Q = la.orth(inside[~seen].T)
    left = null - (null @ Q) @ Q.T
    _, s, Vt = np.linalg.svd(left, full_matrices=False)
    return named, Vt[s > 1e-6]


def _named(silent: Invisible, parameters: Sequence[Parameter]) -> Combination:
    parts = silent.direction / np.linalg.norm(silent.direction)
    moved = np.flatnonzero(parts).tolist()
    coefficients = tuple((parameters[k].name, float(parts[k])) for k in moved)
    return Combination(coefficients, np.inf, silent.says, silent.direction)


def _widths(parameters: Sequence[Parameter]) -> Array:
    """The distance between the bounds of each parameter, 1 where it is free or held."""
    width = np.array([q.upper - q.lower for q in parameters])
    return np.where(np.isfinite(width) & (width > 0), width, 1.0)


def _inverse_singular(J: Array) -> tuple[Array, Array]:
    """Inverse singular values of J (rows, k), inf where J says nothing, and all k right singular
    vectors as rows."""
    try:
        _, s, Vt = np.linalg.svd(J, full_matrices=False)
    except np.linalg.LinAlgError:  # divide and conquer fails now and then where QR does not
        _, s, Vt = la.svd(J, full_matrices=False, lapack_driver="gesvd")
    directions = np.vstack([Vt, la.null_space(Vt).T]) if Vt.shape[0] < Vt.shape[1] else Vt
    inverse = np.full(len(directions), np.inf)
    known = np.flatnonzero(s > 1e-10 * s.max(initial=0.0))
    inverse[known] = 1.0 / s[known]
    return inverse, directions


def _scatter(system: LinearSystem, p: Array, rank: int, relative_only: bool) -> tuple[float, float]:
    """(s², χ² / (rows − rank)): the factor on the variance, and the ratio that it may come from."""
    freedom = system.count - rank
    chi2 = float(np.sum(system.residual(p) ** 2))
    ratio = chi2 / freedom if freedom > 0 else 1.0
    surprising = freedom > 0 and chi2 > chdtri(freedom, SURPRISE)
    return (ratio if relative_only or surprising else 1.0), ratio


def _scaled_basis(Z: Array, width: Array) -> Array:
    """An orthonormal basis of the admissible directions measured in widths of the bounds."""
    return (
        np.asarray(la.orth(Z / width[:, None])) if Z.shape[1] < Z.shape[0] else np.eye(Z.shape[0])
    )


def _combination(
    direction: Array, std: float, parameters: Sequence[Parameter], width: Array
) -> Combination:
    direction = direction * np.sign(direction[np.argmax(np.abs(direction))])
    order = np.argsort(-np.abs(direction))[:4]
    large = [k for k in order if abs(direction[k]) > 0.3] or list(
        order
    )  # many small parts: the largest stand for all
    up = [parameters[k].name for k in large if direction[k] > 0]
    down = [parameters[k].name for k in large if direction[k] < 0]
    if len(large) == 1:
        words = f"{up[0]} is not determined by these recordings"
    elif not down:
        words = (
            f"{_list(up)} move together: the recordings hardly see them rise or fall by the same "
            "fraction of their range"
        )
    else:
        words = (
            f"{_list(up)} and {_list(down)} trade against each other: when the first rises and "
            "the second falls, the recordings hardly change"
        )
    named = tuple((parameters[k].name, float(direction[k])) for k in large)
    return Combination(named, std, words, width * direction)


def _list(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
