"""The projected residual: what nuisance parameters, with their priors, cannot take up, and how
much of it columns of effects explain.

Residual and columns are weighted and projected on the complement of what the nuisance parameters
explain; an effect's fraction is the part of the squared residual that its own best size removes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.types import Real, Score
from cvxupdate.physics.effect import Effect

NOTHING = 1e-12  # of a column: what is left of it then is rounding
CANCELLED = 1e-3  # of its members' lengths: below, a sum's length is not taken from products


@dataclass(frozen=True)
class Linearised:
    """Weighted derivatives ``A`` (rows, n) of nuisance parameters, which are at ``p`` with prior
    deviations ``scales`` (n,), and weighted residuals ``r`` (rows,), measured less modelled."""

    A: Real
    r: Real
    p: Real
    scales: Real


@dataclass(frozen=True)
class Projection:
    """``residual`` (rows + priors,) weighted and projected; ``basis`` orthonormal columns of what
    the nuisance parameters can take up; ``rows`` those of the recordings."""

    residual: Real
    basis: Real
    rows: int

    @classmethod
    def of(cls, at: Linearised, rows: NDArray[np.bool_] | None = None) -> Projection:
        """At a linearised point, of all rows or of some."""
        A, r = (at.A, at.r) if rows is None else (at.A[rows], at.r[rows])
        Q, _ = np.linalg.qr(np.vstack([A, np.diag(1.0 / at.scales)]))
        residual = np.concatenate([r, -at.p / at.scales])
        return cls(residual - Q @ (Q.T @ residual), Q, len(r))

    @property
    def total(self) -> float:
        """Squares of the projected residual."""
        return float(self.residual @ self.residual)

    def beside(self, J: Real) -> Projection:
        """With weighted columns (rows, n) more that are taken out."""
        Q, _ = np.linalg.qr(np.hstack([self.basis, self.freed(J)]))
        return Projection(self.residual - Q @ (Q.T @ self.residual), Q, self.rows)

    def freed(self, J: Real) -> Real:
        """Weighted columns (rows, n) projected, (rows + priors, n)."""
        padded = np.vstack([J, np.zeros((len(self.residual) - self.rows, J.shape[1]))])
        return np.asarray(padded - self.basis @ (self.basis[: self.rows].T @ J))

    def products(self, J: Real) -> tuple[Real, Real]:
        """Of weighted columns (rows, n), once projected, the products with the residual and with
        themselves, (n,) each; nothing where rounding is all that the projection leaves."""
        inside = self.basis[: self.rows].T @ J
        whole = np.einsum("ij,ij->j", J, J)
        length = whole - np.einsum("ij,ij->j", inside, inside)
        usable = length > CANCELLED**2 * whole
        along = np.where(usable, J.T @ self.residual[: self.rows], 0.0)
        return along, np.where(usable, length, 0.0)

    def remaining(self, J: Real) -> Real:
        """Squares that remain (n,) of each of the weighted changes J (rows, n) of the model."""
        inside = self.basis[: self.rows].T @ J
        length = np.einsum("ij,ij->j", J, J) - np.einsum("ij,ij->j", inside, inside)
        along = self.residual[: self.rows] @ J  # what is projected is at right angles to the basis
        return np.asarray(np.maximum(self.total - 2.0 * along + length, 0.0))

    def one(self, effects: Sequence[Effect], along: Real, length: Real, whole: Real) -> list[Score]:
        """Scores of effects with one column each: ``along`` the residual, ``length`` projected,
        ``whole`` before."""
        total = self.total
        usable = (length > NOTHING * np.maximum(whole, 1e-300)) & (total > 0.0)
        sizes = along / np.where(usable, length, 1.0) ** 2
        usable &= ~((np.array([e.sign for e in effects]) > 0) & (sizes < 0.0))
        return [
            Score(e, float(a * p / total) if good else 0.0, np.array([p if good else 0.0]))
            for e, a, p, good in zip(effects, along, sizes, usable, strict=True)
        ]

    def several(self, effect: Effect, J: Real, Jp: Real) -> Score:
        """Of an effect with several columns, J as they are and Jp projected."""
        nothing = Score(effect, 0.0, np.zeros(effect.count))
        length = norms(Jp)
        if self.total <= 0.0 or np.any(length <= NOTHING * np.maximum(norms(J), 1e-300)):
            return nothing
        best, *_ = np.linalg.lstsq(Jp / length, self.residual, rcond=1e-8)
        best = best / length
        if effect.sign > 0 and best[0] < 0.0:
            return nothing
        rest = self.residual - Jp @ best
        return Score(effect, 1.0 - float(rest @ rest) / self.total, best)

    def sets(
        self,
        effects: Sequence[Effect],
        sets: Mapping[int, Sequence[int]],
        kept: Mapping[int, tuple[Real, Real]],
    ) -> dict[int, Score]:
        """Of sets of elements, each the sum of its members' columns (``kept``: as they are, and
        projected); lengths from the members' products, by the sum itself where little is left."""
        numbers = [k for k, members in sets.items() if all(m in kept for m in members)]
        if not numbers:
            return {}
        place = {m: i for i, m in enumerate(kept)}
        J, Jp = (np.stack([pair[i] for pair in kept.values()], axis=1) for i in (0, 1))
        member = np.zeros((len(place), len(numbers)))
        for column, k in enumerate(numbers):
            member[[place[m] for m in sets[k]], column] = 1.0
        whole, length = (
            np.sqrt(np.maximum(np.einsum("ij,ij->j", member, (X.T @ X) @ member), 0.0))
            for X in (J, Jp)
        )
        faint = length <= CANCELLED * (norms(Jp) @ member)
        length[faint] = norms(Jp @ member[:, faint])
        along = (Jp.T @ self.residual) @ member
        return dict(
            zip(numbers, self.one([effects[k] for k in numbers], along, length, whole), strict=True)
        )


def norms(J: Real) -> Real:
    """Lengths of columns."""
    return np.asarray(np.sqrt(np.einsum("ij,ij->j", J, J)))
