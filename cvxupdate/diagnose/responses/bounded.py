"""A comparison that no line can dominate: how far a model is off, for one that is far off.

Weighted squares say how likely recordings are beside a model that is nearly right. Beside one that
lacks several things they are those of the few lines where its resonances stand on antiresonances of
the recording, off a hundredfold: what flattens these (a dashpot anywhere) scores above the truth.
|Ŷ − Y|² / (|Y|² + |Ŷ|² + 2 σ²) is between 0 and 2 on every line, and small only where both are
alike (a global amplitude criterion, line by line: Grafe 1998); so it guides the first steps, and
weighted squares judge.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.fit import Fit, stepped, taken
from cvxupdate.diagnose.responses.point import ResponsePoint, ResponseSetting
from cvxupdate.diagnose.responses.setting import counted, unstrayed
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.system import LinearSystem
from cvxupdate.update.trust_region import Options


@dataclass(frozen=True)
class Gap:
    """``measured`` and ``modelled`` rows (rows,), ``noise`` (rows,) their variance, ``weights``
    (2 rows,) of columns that come weighted; ``parts`` (signals,) how many rows each has."""

    measured: Complex
    modelled: Complex
    noise: Real
    weights: Real
    parts: tuple[int, ...]

    @classmethod
    def of(cls, point: ResponsePoint) -> Gap:
        """Between model and recordings at a point."""
        signals = point.setting.signals
        measured, modelled = (
            np.concatenate([v.reshape(-1) for v in values])
            for values in ([s.Y for s in signals], point.modelled())
        )
        noise = np.concatenate([s.std.reshape(-1) ** 2 for s in signals])
        weights = [np.tile(1.0 / s.scale().reshape(-1), 2) for s in signals]
        parts = tuple(s.Y.size for s in signals)
        return cls(measured, modelled, noise, np.concatenate(weights), parts)

    def complex_rows(self, J: Real) -> Complex:
        """Columns (2 rows, n), signal by signal real parts before imaginary ones, as (rows, n)."""
        out, at = np.empty((len(J) // 2, *J.shape[1:]), dtype=complex), 0
        for n in self.parts:
            own = out[at // 2 : at // 2 + n]
            own.real, own.imag = J[at : at + n], J[at + n : at + 2 * n]
            at += 2 * n
        return out

    def real_rows(self, rows: Complex) -> Real:
        """The reverse, of (rows,) or (rows, n)."""
        pieces = np.split(rows, np.cumsum(self.parts)[:-1])
        return np.concatenate([half for v in pieces for half in (v.real, v.imag)])

    def _whole(self, modelled: Complex) -> Real:
        """|Y|² + |Ŷ|² + 2 σ² of (rows, n)."""
        own = _squares(self.measured) + 2.0 * self.noise + np.finfo(float).tiny
        return np.asarray(own[:, None] + _squares(modelled))

    @property
    def total(self) -> float:
        """The sum over all rows as it is."""
        return float(self.remaining(np.zeros((len(self.weights), 1)))[0])

    def remaining(self, J: Real) -> Real:
        """The sums (n,) after each of the weighted changes J (2 rows, n) of the model."""
        return np.asarray(np.sum(self.moved(J) ** 2, axis=0))

    def moved(self, J: Real) -> Real:
        """The bounded differences (2 rows, n) after each of the weighted changes J (2 rows, n)."""
        moved = self.complex_rows(J / self.weights[:, None])
        moved += self.modelled[:, None]
        whole = self._whole(moved)
        moved -= self.measured[:, None]
        moved /= np.sqrt(whole)
        strange = ~np.isfinite(moved)
        moved[strange] = np.sqrt(2.0)
        return self.real_rows(moved)

    @property
    def mean(self) -> float:
        """Over all rows."""
        return self.total / max(1, len(self.measured))

    @property
    def values(self) -> Real:
        """(Ŷ − Y) / √(|Y|² + |Ŷ|² + 2 σ²), (2 rows,)."""
        whole = self._whole(self.modelled[:, None])[:, 0]
        return self.real_rows((self.modelled - self.measured) / np.sqrt(whole))

    def rates(self, J: Real) -> Real:
        """Derivatives (2 rows, n) of ``values`` from those of the model (2 rows, n)."""
        whole = self._whole(self.modelled[:, None])
        gap, dY = (self.modelled - self.measured)[:, None], self.complex_rows(J)
        growth = np.real(np.conj(self.modelled[:, None]) * dY) / whole
        return self.real_rows((dY - gap * growth) / np.sqrt(whole))


def _squares(z: Complex) -> Real:
    """|z|², without the square root."""
    return np.asarray(z.real**2 + z.imag**2)


@dataclass(frozen=True)
class BoundedPoint:
    """A point with its bounded comparison."""

    point: ResponsePoint

    @property
    def p(self) -> Real:
        """The unknowns."""
        return self.point.p

    @cached_property
    def gap(self) -> Gap:
        """Between model and recordings."""
        return Gap.of(self.point)

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """Bounded ones, all of one weight."""
        values = self.gap.values
        return values, np.ones(len(values)), ("",) * len(values)

    def system(self) -> LinearSystem:
        """Linearised at this point."""
        values, weights, labels = self.differences
        A = self.gap.rates(self.point.jacobian())
        return LinearSystem(A, A @ self.p - values, weights, self.point.setting.columns, labels)


@dataclass(frozen=True)
class Yielding:
    """What is left of a gap after changes of the model where its unknowns yield to each, to first
    order: ``basis`` (2 rows + unknowns, unknowns) spans what they can take up within their priors,
    ``held`` (unknowns,) is how far they are from these."""

    gap: Gap
    basis: Real
    held: Real

    @classmethod
    def of(cls, point: ResponsePoint) -> Yielding:
        """At a point."""
        bounded = BoundedPoint(point)
        scales = replace(point.setting, loose=True).scales
        A = np.vstack([bounded.gap.rates(point.jacobian()), np.diag(1.0 / scales)])
        return cls(bounded.gap, np.linalg.qr(A)[0], point.p / scales)

    @property
    def total(self) -> float:
        """The sum over all rows as it is."""
        return float(self.remaining(np.zeros((len(self.gap.weights), 1)))[0])

    def remaining(self, J: Real) -> Real:
        """The sums (n,) after each of the weighted changes J (2 rows, n) of the model."""
        values, rows = self.gap.moved(J), len(self.gap.weights)
        still = self.held @ self.basis[rows:]
        taken = self.basis[:rows].T @ values + still[:, None]
        whole = np.einsum("ij,ij->j", values, values) + float(self.held @ self.held)
        return np.asarray(whole - np.einsum("ij,ij->j", taken, taken))


@dataclass(frozen=True)
class Bounded:
    """A setting by its bounded comparison, for the trust-region loop."""

    setting: ResponseSetting

    def evaluate(self, p: Real, before: BoundedPoint | None = None) -> BoundedPoint:
        """ModelError where the model is no structure."""
        return BoundedPoint(self.setting.evaluate(p, None if before is None else before.point))


def approached(setting: ResponseSetting, start: Real, options: Options) -> tuple[Fit, float]:
    """Fitted by the bounded comparison (with the priors of the unknowns) from ``start``: the point
    as weighted squares see it, and the mean over rows of what is left (0 to 2).

    Raises
    ------
    ModelError
        When the model is no structure at ``start``.
    """
    setting, start = counted(setting, start)
    bounded, loose = Bounded(setting), replace(setting, loose=True)
    found = stepped(bounded, loose, start, options)
    usual = unstrayed(setting, found.p)
    if usual is not None and bounded.evaluate(usual, found).gap.total < found.gap.total:
        found = stepped(bounded, loose, usual, options)
    return taken(setting, found.point), found.gap.mean
