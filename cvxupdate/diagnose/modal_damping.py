"""The pattern of damping in tables of modes: a dashpot, a lossy group or one rate of decay raises
the ratios of just the modes that it moves.

To first order a mode keeps its shape, and a word adds φᵀCφ / 2ω + φᵀDφ / 2ω² to its damping ratio
(Ewins 2000, 2.7). The file's ratios scatter: all of them together, and each by itself
(`fit.COMMON_DAMPING_STD`, `fit.MODE_DAMPING_STD`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.data import release_from
from cvxupdate.diagnose.engine import DAMPING_GAIN
from cvxupdate.diagnose.finding import Finding
from cvxupdate.diagnose.fit import COMMON_DAMPING_STD, MODE_DAMPING_STD
from cvxupdate.diagnose.forward import file_damping
from cvxupdate.diagnose.judge import HALVED, Competitor, confidence, overlapping, standing_of
from cvxupdate.diagnose.modal_fit import ModalFit, Tables
from cvxupdate.diagnose.signals import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.physics import candidates_of, told
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import RATIOS, Effect, ModelChange
from cvxupdate.physics.place import Place
from cvxupdate.recordings.identify.decay import decay_rates
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint
from cvxupdate.spec import Spec

UNSTATED = 0.1  # relative deviation of a damping ratio where the table gives none
STEPS = 400  # sizes tried of each word, up to where it would take the whole of a mode's damping
FEWEST, MANY = 4, 6  # measured ratios below which there is no pattern, and no law of all modes
LUCK = 0.002  # how often the best of a word's places may do as well where nothing is


@dataclass(frozen=True)
class Ratios:
    """Measured damping ratios (modes,), their deviations, what the file gives, and the modes:
    shapes (N, modes), circular frequencies."""

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
        """Squares of the log ratios in units of their scatter, the common shift at its best, when
        ``added`` (sizes, modes) is taken off: (sizes,)."""
        u, w = np.log((self.measured - added) / self.file), 1.0 / self.spread**2
        common = (u * w).sum(axis=1) / (w.sum() + COMMON_DAMPING_STD**-2)
        return np.asarray(
            (w * (u - common[:, None]) ** 2).sum(axis=1) + (common / COMMON_DAMPING_STD) ** 2
        )

    def rate(self, c: ModelChange) -> Real:
        """What one unit of an effect's parameter adds to each ratio, (modes,)."""
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
    """A word that explains the pattern: its size in units of its parameter with deviation, and the
    strain that it leaves."""

    candidate: Effect
    size: float
    deviation: float
    strain: float


def ratios_of(point: ModalPoint, original: Model) -> Ratios | None:
    """The fitted tables' damping ratios beside the model's modes; None where there are too few."""
    found: list[tuple[float, float, int]] = []
    for table, places in zip(point.residual.fit, point.places, strict=False):
        for i, place in enumerate(places.tolist()):
            zeta, std = float(table.damping[i]), float(table.damping_std[i])
            if (
                place >= 0
                and np.isfinite(zeta)
                and zeta > 0.0
                and point.modes.eigenvalues[place] > 0.0
            ):
                found.append(
                    (zeta, std if np.isfinite(std) and std > 0.0 else UNSTATED * zeta, place)
                )
    if len(found) < FEWEST:
        return None
    at = np.array([place for _, _, place in found])
    omega = np.sqrt(point.modes.eigenvalues[at])
    given = file_damping(
        original,
        np.sqrt(np.maximum(point.modes.eigenvalues[point.modes.rigid :], 0.0)) / (2.0 * np.pi),
    )[at - point.modes.rigid]
    return Ratios(
        np.array([z for z, _, _ in found]),
        np.array([s for _, s, _ in found]),
        given,
        point.modes.shapes[:, at],
        omega,
    )


def needed_drop(places: int, modes: int) -> float:
    """Drop of the strain that luck gives the best of so many places (no more can differ than there
    are modes) once in `LUCK`: one-sided, one freedom."""
    from scipy.stats import chi2

    return float(chi2.isf(2.0 * LUCK / max(1, min(places, modes)), 1))


def damping_trials(
    ratios: Ratios, candidates: Sequence[Effect]
) -> tuple[float, list[DampingTrial]]:
    """(strain of the file's pattern, words that bring it down by more than chance, best first)."""
    before = float(ratios.strain(np.zeros((1, len(ratios.omega))))[0])
    rates = [(c, ratios.rate(c.change)) for c in candidates if c.change and c.change.tangent[0]]
    able = [(c, g) for c, g in rates if np.any(g > 0.0) and not np.any(g < -1e-12 * g.max())]
    words = [c.physics for c, _ in able]
    out = []
    for c, g in able:
        most = 0.999 * float(
            np.min(np.where(g > 0.0, ratios.measured / np.where(g > 0.0, g, 1.0), np.inf))
        )
        sizes = most * np.linspace(0.0, 1.0, STEPS + 1)
        strains = ratios.strain(sizes[:, None] * g)
        k = int(np.argmin(strains))
        if before - strains[k] > max(
            needed_drop(words.count(c.physics), len(ratios.omega)), HALVED * before
        ):
            inside = sizes[strains <= strains[k] + 1.0]
            out.append(
                DampingTrial(
                    c,
                    float(sizes[k]),
                    float(max(np.ptp(inside) / 2.0, most / STEPS)),
                    float(strains[k]),
                )
            )
    return before, sorted(out, key=lambda t: t.strain)


@dataclass(frozen=True)
class DampingFound:
    """What the damping ratios say: findings and evidence; for the updated model a rate of decay of
    all modes, or the model with a word and its parameters."""

    findings: tuple[Finding, ...] = ()
    evidence: tuple[str, ...] = ()
    alpha: float | None = None
    damped: tuple[Model, Real] | None = None


def damping_found(
    spec: Spec, model: Model, base: ModalFit, tables: Sequence[ModeTable], data: Tables
) -> DampingFound:
    """One rate of decay for all modes of a table, else a word that raises the damping of just the
    modes that it moves; ``model`` is the file's."""
    decay = _one_rate(tables)
    if decay.findings:
        return decay
    ratios = ratios_of(base.point, model)
    if ratios is None:
        return decay
    m = base.point.matrices
    context = SearchContext(
        base.model,
        m.K,
        m.M,
        data.top,
        data.bottom,
        (),
        (),
        release_from(spec),
        float(np.median(ratios.file)),
    )
    before, trials = damping_trials(ratios, candidates_of(context, spec.diagnose.physics, RATIOS))
    if not trials or trials[0].candidate.change is None:
        return decay
    best, c, grown = trials[0], trials[0].candidate, trials[0].candidate.change.model
    q = c.figures[0]
    value, deviation = q.value(grown, grown.parameters[-1], best.size, best.deviation)
    near = [t for t in trials[1:] if t.strain <= best.strain + DAMPING_GAIN / 2]
    field = [
        Competitor(t.strain, overlapping(t.candidate.place, c.place, grown), t in near)
        for t in trials[1:]
    ]
    sure = confidence(standing_of(best.strain, before, field, abs(value) / max(deviation, 1e-12)))
    says = (
        f"The damping ratios depart from the file's pattern (sum of squares {before:.3g} in "
        f"units of ordinary scatter, {len(ratios.omega)} modes); {c.title} brings it to "
        f"{best.strain:.3g}."
    )
    found = Finding(
        c.physics,
        c.place,
        {q.name: value},
        {q.name: deviation},
        sure,
        tuple((t.candidate.physics, t.candidate.place) for t in near[:12]),
        c.says({q.name: value}),
        c.title,
    )
    return DampingFound(
        (found,), (*decay.evidence, says), None, (grown, np.append(base.point.p, best.size))
    )


def _one_rate(tables: Sequence[ModeTable]) -> DampingFound:
    """Mass-proportional damping, or an exponential window in the measurement, where it is all the
    damping that there is."""
    evidence: list[str] = []
    for table in tables:
        if np.sum(np.isfinite(table.damping) & (table.damping > 0)) < MANY:
            continue
        try:
            rates = decay_rates(table)
        except CvxupdateError:
            continue
        evidence.append(rates.says)
        if rates.verdict == "constant decay rate":
            values, effect = {"alpha": rates.alpha}, told("mass_proportional_damping", Place())
            found = Finding(
                effect.physics,
                effect.place,
                values,
                {"alpha": rates.alpha_std},
                0.9,
                (),
                effect.says(values),
                effect.title,
            )
            return DampingFound((found,), tuple(evidence), rates.alpha)
    return DampingFound(evidence=tuple(evidence))
