"""Derivatives of responses with respect to how modes lose energy: all together, of which kind, and
each by itself; and to frequencies of their own."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.settings import COMMON_DAMPING_STD, MODE_DAMPING_STD
from cvxupdate.fe.block import Index
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import Driven, Response

UNKNOWN = 0.005  # ratio of modes where none has one of its own
Faulty = Callable[[Driven, Complex], Complex]


def ratios_of(zeta: Real, common: float, own: Real, modes: Modes, owner: Index) -> Real:
    """Damping ratio of every mode (m,): the file's ``zeta`` (damped,) with the logarithms by which
    they move together and each by itself; of rigid motion none, of the others the median."""
    typical = float(np.median(zeta)) if len(zeta) else UNKNOWN
    out = np.full(len(modes.eigenvalues), typical * np.exp(min(common, 5.0)))
    out[owner] = zeta * np.exp(np.minimum(common + own, 6.0))
    out[: modes.rigid] = 0.0
    return out


def own_strain(common: float, own: Real) -> float:
    """Squares of the modes' log damping ratios (damped,) in units of their usual scatter, about
    what all of these have in common. That is not the fitted z₀ alone: modes above the band have no
    other unknown, and may draw it away from those in the band, which then all make up for it."""
    z = common + own
    mean = np.sum(z) / (len(z) + (MODE_DAMPING_STD / COMMON_DAMPING_STD) ** 2)
    return float(np.sum(((z - mean) / MODE_DAMPING_STD) ** 2))


@dataclass(frozen=True)
class Losses:
    """``loss`` of modes with eigenvalues ``lam`` (m,); ``owner`` (damped,): which of them have a
    ratio of their own; ``mixed``: of which kind it is, is unknown; ``tuned``: those modes have
    frequencies by themselves, too."""

    loss: Loss
    lam: Real
    owner: Index
    mixed: bool
    tuned: bool

    @property
    def _parts(self) -> tuple[Real, Real]:
        """2 ζ ω and 2 ζ λ of every mode: what goes with s and with i."""
        double = 2.0 * self.loss.ratios
        return double * np.sqrt(self.lam), double * self.lam

    def together(self, r: Response) -> Complex:
        """(points, sensors, cases, 1 or 2): with respect to z₀, and to the share that is
        hysteretic where that is unknown."""
        share, (slow, stiff) = self.loss.hysteretic, self._parts
        s = r.signal.s[:, None, None]
        viscous = -s * self._carried(r, slow)
        if not (share or self.mixed):
            return viscous[..., None]
        hysteretic = -1j * self._carried(r, stiff)
        common = (1.0 - share) * viscous + share * hysteretic
        both = [common, hysteretic - viscous] if self.mixed else [common]
        return np.stack(both, axis=-1)

    @staticmethod
    def _carried(r: Response, weights: Real) -> Complex:
        """sᵒ Σ a weight q over all modes, (points, sensors, cases)."""
        near, n = r.drive[:, None, None], r.near
        out = np.einsum("mps,mpc->psc", r.a, weights[:n, None, None] * r.q)
        if r.high is not None:
            out = out + r.high.between(r.at[n:], weights[n:], 2)
        return np.asarray(near * out)

    def own(self, r: Response, faulty: Faulty | None) -> Complex:
        """Rows (rows, sensors, cases, unknowns): with respect to each log ζ, and log ω where modes
        are tuned; ``faulty``: what sensors make of responses, None: they are sound."""
        if not len(self.owner):
            return np.zeros((*r.rows(r.raw).shape, 0), dtype=np.complex128)
        share, (slow, stiff) = self.loss.hysteretic, self._parts
        viscous = (1.0 - share) * slow[self.owner, None] * r.signal.s
        hysteretic = 1j * share * stiff[self.owner, None]
        rates = viscous + hysteretic
        if self.tuned:  # λ goes with ω², and so does what is lost with displacement
            whole = viscous + 2.0 * hysteretic + 2.0 * self.lam[self.owner, None]
            rates = np.vstack([rates, whole])
        own = np.resize(self.owner, len(rates))
        moved = -r.drive[:, None] * (rates[:, :, None] * r.q[own])  # (unknowns, points, cases)
        if r.coupled or faulty is not None:
            each = r.a[own][:, :, :, None] * moved[:, :, None, :]
            heard = each if faulty is None else [faulty(r.signal, e) for e in each]
            return r.rows(np.stack(list(heard), axis=-1))
        # (rows, cases, unknowns): every sensor sees it by its shape
        slim = r.rows(np.moveaxis(moved * r.inverse[own][:, :, None], 0, -1))
        return np.asarray(slim[:, None] * r.at[own].T[None, :, None, :])
