"""The pattern of damping in tables of modes: a dashpot, a lossy group or one rate of decay raises the ratios of just the modes that it moves.

To first order a mode keeps its shape, and a word adds φᵀCφ / 2ω + φᵀDφ / 2ω² to its damping ratio (Ewins 2000, 2.7). The file's ratios scatter: all of
them together, and each by itself (`fit.COMMON_DAMPING_STD`, `fit.MODE_DAMPING_STD`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.engine import DAMPING_GAIN
from cvxupdate.diagnose.fit import COMMON_DAMPING_STD, MODE_DAMPING_STD
from cvxupdate.diagnose.forward import file_damping
from cvxupdate.diagnose.signals import Real
from cvxupdate.fe.model import Model
from cvxupdate.physics.base import Candidate
from cvxupdate.residual.modal import ModalPoint

UNSTATED = 0.1  # relative deviation of a damping ratio where the table gives none
STEPS = 400  # sizes tried of each word, up to where it would take the whole of a mode's damping
HALVED = 0.5
FEWEST = 4  # measured ratios below which there is no pattern


@dataclass(frozen=True)
class Ratios:
    """Measured damping ratios (modes,), their deviations, what the file gives, and the modes: shapes (N, modes), circular frequencies."""

    measured: Real
    std: Real
    file: Real
    shapes: Real
    omega: Real

    @property
    def spread(self) -> Real:
        """Deviation of the logarithm of each ratio: ordinary scatter and measurement."""
        return np.sqrt(MODE_DAMPING_STD**2 + (self.std / self.measured) ** 2)

    def strain(self, added: Real) -> Real:
        """Squares of the log ratios in units of their scatter, the common shift at its best, when ``added`` (sizes, modes) is taken off: (sizes,)."""
        u, w = np.log((self.measured - added) / self.file), 1.0 / self.spread**2
        common = (u * w).sum(axis=1) / (w.sum() + COMMON_DAMPING_STD**-2)
        return np.asarray((w * (u - common[:, None]) ** 2).sum(axis=1) + (common / COMMON_DAMPING_STD) ** 2)

    def rate(self, c: Candidate) -> Real:
        """What one unit of a candidate's parameter adds to each ratio, (modes,)."""
        out = np.zeros(len(self.omega))
        phi = np.vstack([self.shapes, np.zeros((1, self.shapes.shape[1]))])
        for b in c.tangent[0]:
            local = phi[b.dofs]  # (elements, dofs, modes); −1 is the ground
            for part, by in ((b.C, 2.0 * self.omega), (b.D, 2.0 * self.omega**2)):
                if part is not None:
                    out += np.einsum("eim,eij,ejm->m", local, part, local, optimize=True) / by
        return out


@dataclass(frozen=True)
class DampingTrial:
    """A word that explains the pattern: its size in units of its parameter with deviation, and the strain that it leaves."""

    candidate: Candidate
    size: float
    deviation: float
    strain: float


def ratios_of(point: ModalPoint, original: Model) -> Ratios | None:
    """The fitted tables' damping ratios beside the model's modes; None where there are too few."""
    found: list[tuple[float, float, int]] = []
    for table, places in zip(point.residual.fit, point.places, strict=False):
        for i, place in enumerate(places.tolist()):
            zeta, std = float(table.damping[i]), float(table.damping_std[i])
            if place >= 0 and np.isfinite(zeta) and zeta > 0.0 and point.modes.eigenvalues[place] > 0.0:
                found.append((zeta, std if np.isfinite(std) and std > 0.0 else UNSTATED * zeta, place))
    if len(found) < FEWEST:
        return None
    at = np.array([place for _, _, place in found])
    omega = np.sqrt(point.modes.eigenvalues[at])
    given = file_damping(original, np.sqrt(np.maximum(point.modes.eigenvalues[point.modes.rigid:], 0.0)) / (2.0 * np.pi))[at - point.modes.rigid]
    return Ratios(np.array([z for z, _, _ in found]), np.array([s for _, s, _ in found]), given, point.modes.shapes[:, at], omega)


def damping_trials(ratios: Ratios, candidates: Sequence[Candidate]) -> tuple[float, list[DampingTrial]]:
    """(strain of the file's pattern, words that bring it down by more than chance, best first)."""
    before = float(ratios.strain(np.zeros((1, len(ratios.omega))))[0])
    out = []
    for c in candidates:
        if not c.tangent or not c.tangent[0]:
            continue
        g = ratios.rate(c)
        if not np.any(g > 0.0) or np.any(g < -1e-12 * g.max()):
            continue
        most = 0.999 * float(np.min(np.where(g > 0.0, ratios.measured / np.where(g > 0.0, g, 1.0), np.inf)))
        sizes = most * np.linspace(0.0, 1.0, STEPS + 1)
        strains = ratios.strain(sizes[:, None] * g)
        k = int(np.argmin(strains))
        if before - strains[k] > max(DAMPING_GAIN, HALVED * before):
            inside = sizes[strains <= strains[k] + 1.0]
            out.append(DampingTrial(c, float(sizes[k]), float(max(np.ptp(inside) / 2.0, most / STEPS)), float(strains[k])))
    return before, sorted(out, key=lambda t: t.strain)
