"""A convex lower bound of least squares that are bilinear: linear in parameters x that all terms
share, and linear in unknowns u of each term by itself.

‖a + A x + (B₀ + Σ xⱼ Bⱼ) u‖² is a quadratic form in the monomials (1, x) ⊗ (1, u). Their products
are replaced by free numbers y, the moments, of which only what holds for every point of the box is
kept: each moment matrix is positive semidefinite, and so is its product with every product of two
bounds. That is a semidefinite program (Lasserre 2001; sparse over the terms, which meet in x alone:
Waki et al. 2006; for modal dynamic residuals Li, Dong and Wang 2021). The bound is read off the
multipliers, put right by hand: every moment of a point in the box is at most 1 in size, so whatever
the solver left of its equations costs their sum and no more.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
import scipy.sparse.linalg as spl
from numpy.typing import NDArray

from ..system import Array
from .matrix_form import ConeProgram, Cones
from .solvers.clarabel import solve as clarabel
from .solvers.common import SolverChoice

TOLERANCE = 1e-9
TURNS = 10
"""Projections of the multipliers at most: what they leave has fallen tenfold by then, and ten cost
less than the program."""
Monomial = tuple[tuple[int, ...], int, tuple[int, ...]]
"""Places among x, the term, places among its u (term −1 where there is no u)."""
Polynomial = dict[Monomial, float]


@dataclass(frozen=True, eq=False)
class Term:
    """One term: ``triangle`` L (r, (1 + n)(1 + k)) with the residual L ((1, x) ⊗ (1, u)), the
    largest sizes ``most`` (k,) of u that are looked into, and further rows ``tight`` (h, as L)
    whose weights are so large that they are as good as equations."""

    triangle: Array
    most: Array
    tight: Array

    @property
    def unknowns(self) -> int:
        """k."""
        return len(self.most)


def term(
    constant: Array,
    linear: Array,
    free: Array,
    products: Array,
    most: Array,
    tight: NDArray[np.bool_] | None = None,
) -> Term:
    """‖constant + linear x + (free + Σ xⱼ productsⱼ) u‖²: (m,), (m, n), (m, k), (n, m, k), |u| ≤
    most (k,); ``tight`` (m,) rows of very large weight."""
    n = linear.shape[1]
    first = np.column_stack([constant, free])
    rest = [np.column_stack([linear[:, j], products[j]]) for j in range(n)]
    every = np.hstack([first, *rest])
    held = np.zeros(len(every), dtype=bool) if tight is None else tight
    soft = every[~held]
    if len(soft) > soft.shape[1]:
        soft = np.asarray(np.linalg.qr(soft, mode="r"), dtype=float)
    return Term(soft, most, every[held])


@dataclass(frozen=True, eq=False)
class Bounded:
    """What one box proves: ``lower`` of the sum of the terms there; ``mean`` (n,) the first moments
    and ``spread`` (n,) their variances, both in x, which say where the bound is loose."""

    lower: float
    mean: Array
    spread: Array


@dataclass(frozen=True, eq=False)
class Moments:
    """The semidefinite program of ``terms`` over n = ``size`` parameters, in x and u scaled to
    [−1, 1]: the same for every box but for its objective."""

    terms: tuple[Term, ...]
    size: int

    @cached_property
    def places(self) -> dict[Monomial, int]:
        """Where each moment stands in y."""
        found: dict[Monomial, int] = {}
        for k in range(len(self.terms)):
            basis = self._basis(k)
            for b in basis:
                for c in basis:
                    found.setdefault(_times(b, c), len(found))
        found.pop(ONE)
        return {m: i for i, m in enumerate(found)}

    @cached_property
    def cones(self) -> tuple[sp.csc_array, Array, Cones]:
        """(A, b, K): b − A y in K says what holds for every point of the box."""
        scalars: list[Polynomial] = []
        matrices: list[list[list[Polynomial]]] = []
        for k, term in enumerate(self.terms):
            matrices.append(_matrix(self._basis(k), {ONE: 1.0}))
            own = [ONE, *(((), k, (i,)) for i in range(term.unknowns))]
            inside = [{ONE: 1.0, ((), k, (i, i)): -1.0} for i in range(term.unknowns)]
            pairs = [
                _product(self._sides[a], self._sides[b])
                for a in range(2 * self.size)
                for b in range(a)
            ]
            matrices += [_matrix(own, pair) for pair in pairs]
            alone = [ONE, *(((j,), -1, ()) for j in range(self.size))]
            matrices += [_matrix(alone, limit) for limit in inside]
            scalars += [_product(pair, limit) for pair in pairs for limit in inside]
        rows = [*scalars]
        for m in matrices:
            rows += [
                {q: v * (1.0 if i == j else np.sqrt(2.0)) for q, v in m[i][j].items()}
                for j in range(len(m))
                for i in range(j + 1)
            ]
        at = [
            (r, self.places[q], -v)
            for r, row in enumerate(rows)
            for q, v in row.items()
            if q != ONE
        ]
        row, column, value = (np.array(x) for x in zip(*at, strict=True))
        A = sp.csc_array((value, (row, column)), shape=(len(rows), len(self.places)))
        b = np.array([row.get(ONE, 0.0) for row in rows])
        return A, b, Cones(nonneg=len(scalars), psd=tuple(len(m) for m in matrices))

    def bound(self, lower: Array, upper: Array, best: float) -> Bounded:
        """The bound over the box lower ≤ x ≤ upper, both (n,), for points with an objective of
        ``best`` at most."""
        middle, half = (lower + upper) / 2.0, (upper - lower) / 2.0
        changes = [self._change(t, middle, half) for t in self.terms]
        cost, constant = self._cost(changes)
        scale = float(np.abs(cost).max(initial=0.0)) or 1.0
        A, b, cones = self.cones
        more, limits = self._tight(changes, best)
        A = sp.csc_array(sp.vstack([more, A]))
        b = np.concatenate([limits, b])
        cones = Cones(nonneg=cones.nonneg + len(limits), psd=cones.psd)
        n = len(cost)
        program = ConeProgram(sp.csc_array((n, n)), cost / scale, A, b, cones)
        raw = clarabel(program, SolverChoice(tolerance=TOLERANCE))
        if not np.all(np.isfinite(raw.z)) or not np.all(np.isfinite(raw.x)):
            return Bounded(0.0, middle, half**2)
        proved = constant + scale * _proved(program, raw.z)
        one = np.array([raw.x[self.places[(j,), -1, ()]] for j in range(self.size)])
        two = np.array([raw.x[self.places[(j, j), -1, ()]] for j in range(self.size)])
        spread = np.maximum(two - one**2, 0.0) * half**2
        return Bounded(max(proved, 0.0), middle + half * np.clip(one, -1.0, 1.0), spread)

    def _change(self, term: Term, middle: Array, half: Array) -> Array:
        """(1, x) ⊗ (1, u) from the same of the scaled variables."""
        change = np.zeros((self.size + 1, self.size + 1))
        change[0, 0] = 1.0
        change[1:, 0], change[1:, 1:] = middle, np.diag(half)
        units = np.diag(np.concatenate([[1.0], term.most]))
        return np.asarray(np.kron(change, units), dtype=float)

    def _tight(self, changes: Sequence[Array], best: float) -> tuple[sp.csc_array, Array]:
        """Rows and limits of what tight rows r say: where the objective is ``best`` at most, |r| is
        its root at most, and so is the mean of r times any monomial of the basis."""
        at: list[tuple[int, int, float]] = []
        limits: list[float] = []
        for k, (term, change) in enumerate(zip(self.terms, changes, strict=True)):
            basis = self._basis(k)
            for row in term.tight @ change:
                size = float(np.linalg.norm(row)) or 1.0
                for b in basis:
                    mean = _product(dict(zip(basis, (row / size).tolist(), strict=True)), {b: 1.0})
                    constant = mean.pop(ONE, 0.0)
                    for sign in (1.0, -1.0):
                        at += [(len(limits), self.places[m], sign * v) for m, v in mean.items()]
                        limits.append(np.sqrt(best) / size - sign * constant)
        row_, column, value = np.array(at).T if at else np.zeros((3, 0))
        where = (row_.astype(int), column.astype(int))
        shape = (len(limits), len(self.places))
        return sp.csc_array((value, where), shape=shape), np.array(limits)

    def _cost(self, changes: Sequence[Array]) -> tuple[Array, float]:
        """(q (moments,), constant) of the objective in scaled variables."""
        q, constant = np.zeros(len(self.places)), 0.0
        for k, term in enumerate(self.terms):
            L = term.triangle @ changes[k]
            G, basis = L.T @ L, self._basis(k)
            for i, b in enumerate(basis):
                for j, c in enumerate(basis):
                    m = _times(b, c)
                    if m == ONE:
                        constant += G[i, j]
                    else:
                        q[self.places[m]] += G[i, j]
        return q, constant

    def _basis(self, k: int) -> list[Monomial]:
        """(1, x) ⊗ (1, u) of term ``k``."""
        xs: list[tuple[int, ...]] = [(), *((j,) for j in range(self.size))]
        us: list[tuple[int, ...]] = [(), *((i,) for i in range(self.terms[k].unknowns))]
        return [(x, k if u else -1, u) for x in xs for u in us]

    @cached_property
    def _sides(self) -> list[Polynomial]:
        """1 ± x, which are not negative."""
        return [{ONE: 1.0, ((j,), -1, ()): sign} for j in range(self.size) for sign in (1.0, -1.0)]


ONE: Monomial = ((), -1, ())


def _times(a: Monomial, b: Monomial) -> Monomial:
    return tuple(sorted(a[0] + b[0])), max(a[1], b[1]), tuple(sorted(a[2] + b[2]))


def _product(a: Polynomial, b: Polynomial) -> Polynomial:
    out: Polynomial = {}
    for m, v in a.items():
        for n, w in b.items():
            out[_times(m, n)] = out.get(_times(m, n), 0.0) + v * w
    return out


def _matrix(basis: Sequence[Monomial], factor: Polynomial) -> list[list[Polynomial]]:
    """factor · basis basisᵀ."""
    return [[_product({_times(a, b): 1.0}, factor) for b in basis] for a in basis]


def _proved(program: ConeProgram, z: Array) -> float:
    """The best bound of multipliers near ``z``: what they leave of the equations is taken out and
    what is then outside the cone cut off, in turns (alternating projections), while that gains.

    Costs span many decades beside weights that are as good as equations, so that what a solver
    leaves may be as large as the gap that is to be closed, in this box and in every part of it.
    """
    solve = spl.splu(sp.csc_array(program.A.T @ program.A)).solve
    best = -np.inf
    for _ in range(1 + TURNS):
        z = _within(z, program.cones)
        left = program.q + program.A.T @ z
        bound = float(-program.b @ z - np.abs(left).sum())
        if bound <= best:
            break
        best, z = bound, z - program.A @ solve(left)
    return best


def _within(z: Array, cones: Cones) -> Array:
    """The multipliers with what is outside the cone, by rounding, cut off."""
    out = z.copy()
    out[: cones.nonneg] = np.maximum(out[: cones.nonneg], 0.0)
    at = cones.nonneg
    for order in cones.psd:
        count = order * (order + 1) // 2
        i, j = np.tril_indices(order)[::-1]  # the upper triangle by columns
        scale = np.where(i == j, 1.0, np.sqrt(2.0))
        S = np.zeros((order, order))
        S[i, j] = S[j, i] = out[at : at + count] / scale
        values, V = np.linalg.eigh(S)
        S = (V * np.maximum(values, 0.0)) @ V.T
        out[at : at + count] = S[i, j] * scale
        at += count
    return out
