"""Complex modes of a structure with a dashpot, in the space of its lowest real modes (Ewins 2000,
2.7): what the first order in damping leaves out where a dashpot is strong, for it couples modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.types import Real
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.effect import ModelChange
from cvxupdate.residual.modal import ModalPoint

BASIS = 60  # real modes in which complex ones are sought
ZETA = 0.005  # a typical damping ratio, of modes of which none is known


@dataclass(frozen=True)
class Coupled:
    """Of each real mode the complex one that is the most of it: |s| / ω − 1 (``shift``),
    −Re s / |s| (``zeta``), and what of others its real part has, relative r.m.s. (``turned``);
    (modes,)."""

    shift: Real
    zeta: Real
    turned: Real


@dataclass(frozen=True)
class RealModes:
    """Circular frequencies ``omega`` (n,) and mass-normalised ``shapes`` (N, n), lowest first, with
    damping ratios ``zeta`` (n,) of their own."""

    omega: Real
    shapes: Real
    zeta: Real

    @classmethod
    def of(cls, point: ModalPoint) -> RealModes:
        """The lowest of a fitted model."""
        model, m = point.residual.model, point.matrices
        count = min(model.size, max(BASIS, len(point.modes.eigenvalues)))
        found = natural_modes(m.K, m.M, count, rigid_body_modes(model, m.K, m.M))
        omega = np.sqrt(np.maximum(found.eigenvalues, 0.0))
        return cls(omega, found.shapes, np.full(len(omega), ZETA))

    def damping(self, change: ModelChange) -> Real:
        """One unit of the viscous damping of an effect between the modes, (n, n)."""
        phi = np.vstack([self.shapes, np.zeros((1, len(self.omega)))])
        out = np.zeros((len(self.omega), len(self.omega)))
        for b in change.tangent[0]:
            if b.C is not None:
                local = phi[b.dofs]
                out += np.einsum("eim,eij,ejn->mn", local, b.C, local, optimize=True)
        return out

    def with_damping(self, C: Real, used: int) -> Coupled:
        """The first ``used`` modes with damping ``C`` (n, n) beside their own."""
        n, omega = len(self.omega), self.omega
        whole = C + np.diag(2.0 * self.zeta * omega)
        s, q = np.linalg.eig(
            np.block([[np.zeros((n, n)), np.eye(n)], [-np.diag(omega**2), -whole]])
        )
        s, q = s[s.imag > 0.0], q[:n, s.imag > 0.0]
        q = q / np.linalg.norm(q, axis=0)
        out = Coupled(np.zeros(used), self.zeta[:used].copy(), np.zeros(used))
        for r in np.flatnonzero(omega[:used] > 0.0) if len(s) else ():
            k = int(np.argmax(np.abs(q[r])))
            own = q[:, k] / q[r, k]
            out.shift[r] = abs(s[k]) / omega[r] - 1.0
            out.zeta[r] = -s[k].real / abs(s[k])
            out.turned[r] = float(np.linalg.norm(np.delete(own.real, r)))
        return out
