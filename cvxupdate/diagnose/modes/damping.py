"""The pattern of damping in tables of modes: a dashpot, a lossy group or one rate of decay raises
the ratios of just the modes that it moves.

To first order a mode keeps its shape, and an effect adds φᵀCφ / 2ω + φᵀDφ / 2ω² to its damping
ratio (Ewins 2000, 2.7). The file's ratios scatter: all of them together, and each by itself
(`settings.COMMON_DAMPING_STD`, `settings.MODE_DAMPING_STD`). Beside a reference state the ratios
measured there take their place, and what scatters is what a test repeated would
(`settings.COMMON_DAMPING_REPEATED`, `settings.DAMPING_REPEATED`). Where shapes were measured as
complex ones and are so beyond chance, their imaginary parts tell the places apart
(`cvxupdate.diagnose.modes.turned`).
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.complexity import by_chance
from cvxupdate.diagnose.modes.kinds import chance_of_one, chi_square
from cvxupdate.diagnose.modes.ratios import Ratios, ratios_of
from cvxupdate.diagnose.modes.tables import Tables
from cvxupdate.diagnose.modes.turned import Turned, turned_of
from cvxupdate.diagnose.results import Damper, Further
from cvxupdate.diagnose.settings import (
    COMMON_DAMPING_STD,
    HALVED,
    LAW_RATIOS,
    LAW_SCATTER,
    LUCK,
    MODE_DAMPING_STD,
    STATED,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.place import capital
from cvxupdate.recordings.identify.decay import decay_rates
from cvxupdate.recordings.quantiles import chi_square_above
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.modal import ModalPoint

Candidates = Callable[[float], Sequence[Effect]]
OF_ALL = (
    "The damping ratios follow a law of frequency that all modes share (proportional damping) with "
    "the usual scatter: another law than the file's, and nothing at any one place."
)
SHARES, LAWS = 7.0, 41  # logarithm of the largest share of a law's part, and shares tried of each
STEPS = 400  # sizes tried of each effect, up to `MOST` times the whole of a mode's damping
MOST = 1.5
HEAVY = 0.03  # added ratio from which a damper is looked at in all orders
STRONGEST = 8  # of the effects tried, so many


def needed_drop(places: int, modes: int) -> float:
    """Drop of the strain that luck gives the best of so many places (no more can differ than there
    are modes) once in `LUCK`: one-sided, one freedom."""
    return chi_square_above(2.0 * LUCK / max(1, min(places, modes)), 1)


def damping_trials(
    ratios: Ratios, candidates: Sequence[Effect], turned: Turned | None = None
) -> tuple[float, list[Damper]]:
    """(strain of the file's pattern, effects that lower it by more than chance, best first); where
    shapes are complex (``turned``), with the squares of their imaginary parts."""
    off = np.zeros(0) if turned is None else turned.off
    before = float(ratios.strain(np.zeros((1, len(ratios.omega))))[0] + off @ off)
    figures = len(ratios.omega) + len(off)
    rates = [(c, ratios.rate(c.change)) for c in candidates if c.change and c.change.tangent[0]]
    able = [(c, g) for c, g in rates if np.any(g > 0.0) and not np.any(g < -1e-12 * g.max())]
    names = [c.physics for c, _ in able]
    out = []
    for c, g in able:
        whole = np.where(g > 0.0, ratios.measured / np.where(g > 0.0, g, 1.0), np.inf)
        most = min(MOST * float(np.min(whole)), c.limits[1])
        sizes = most * np.linspace(0.0, 1.0, STEPS + 1)
        strains = ratios.strain(sizes[:, None] * g)
        x = np.zeros(0) if turned is None or c.change is None else turned.rate(c.change)
        strains += off @ off - 2.0 * sizes * (off @ x) + sizes**2 * (x @ x)
        k = int(np.argmin(strains))
        if sizes[k] >= c.limits[1]:
            continue  # it would rather be more than it can be
        if before - strains[k] > max(needed_drop(names.count(c.physics), figures), HALVED * before):
            inside = sizes[strains <= strains[k] + 1.0]
            out.append(
                Damper(
                    c,
                    float(sizes[k]),
                    float(max(np.ptp(inside) / 2.0, most / STEPS)),
                    float(strains[k]),
                    names.count(c.physics),
                    np.concatenate([g / (ratios.measured * ratios.spread), x]),
                )
            )
    out.sort(key=lambda t: t.strain)
    strong = [_strong(ratios, t) for t in out[:STRONGEST]] if turned is None else out[:STRONGEST]
    return before, sorted([*strong, *out[STRONGEST:]], key=lambda t: t.strain)


def _strong(ratios: Ratios, t: Damper) -> Damper:
    """A damper that is strong to the modes, at its best size in all orders."""
    change = t.effect.change
    if change is None or any(b.D is not None for b in change.tangent[0]):
        return t
    if t.size * float(np.max(ratios.rate(change))) < HEAVY:
        return t
    sizes = t.size * np.geomspace(0.5, 3.0, 61)
    sizes = sizes[sizes < t.effect.limits[1]]
    strains = ratios.strain(ratios.coupled(change, sizes))
    k = int(np.argmin(strains))
    inside = sizes[strains <= strains[k] + 1.0]
    wide = float(max(np.ptp(inside) / 2.0, sizes[k] * 0.03))
    return replace(t, size=float(sizes[k]), deviation=wide, strain=float(strains[k]))


def damping_laws(
    tables: Tables, point: ModalPoint, original: Model, effects: Candidates
) -> Further:
    """One rate of decay for all modes of a table, else effects that raise the damping of just the
    modes that they move; ``original`` is the file's model, ``effects(zeta)`` those of damping on
    the fitted one with a typical damping ratio. Beside a reference state a law of all damping that
    there is says nothing of what changed."""
    law = Further() if tables.before else _one_rate(tables.fit)
    ratios = ratios_of(point, original, tables.before)
    if ratios is None:
        return replace(law, alpha=None)
    if law.alpha is not None:
        law = replace(law, sure=law_odds(ratios))
        if law.sure >= STATED:
            return law
        law = replace(law, alpha=None)
    tried, own = effects(float(np.median(ratios.file))), len(ratios.omega)
    # a reference's shapes may be as complex, and are not known here
    turned = None if tables.before else turned_of(point, tables.measured)
    turned = None if turned is None or by_chance(turned.off) else turned
    strain, dampers = damping_trials(ratios, tried, turned)
    off = np.zeros(0) if turned is None else turned.off
    from_what = "those of the reference" if tables.before else "the file's pattern"
    most = chi_square(chance_of_one(tables.kinds), own)
    if not tables.before and strain - off @ off > most >= law_strain(ratios):
        most = np.inf
        law = law if dampers else replace(law, lines=(*law.lines, OF_ALL))
    return replace(
        law,
        strain=strain,
        modes=own,
        turned=(len(off), float(off @ off)),
        dampers=tuple(dampers),
        known=from_what,
        most=most,
    )


def law_strain(ratios: Ratios) -> float:
    """The same squares about the best law of frequency that all modes share: what goes with mass,
    with stiffness and with neither, ζ = α / 2ω + η / 2 + β ω / 2 (Caughey 1960), of any size."""
    omega = ratios.omega / np.exp(np.mean(np.log(ratios.omega)))
    shares = np.exp(np.linspace(-SHARES, SHARES, LAWS))
    low, high = (x.reshape(-1, 1) for x in np.meshgrid(shares, shares))
    u = np.log(ratios.measured) - np.log(low / omega + 1.0 + high * omega)
    w = 1.0 / ratios.spread**2
    u -= (u @ w / w.sum())[:, None]
    return float((u**2 @ w).min())


def law_odds(ratios: Ratios) -> float:
    """Probability that all damping is one rate of decay (ζ = α / 2ω), and not the file's pattern
    with its usual scatter, both as likely before: a few ratios follow many a law by chance."""
    noise = (ratios.std / ratios.measured) ** 2
    pattern = np.log(ratios.measured / ratios.file)
    rate = np.log(ratios.measured * ratios.omega)
    rate -= np.mean(np.log(ratios.file * ratios.omega))
    usual = _likelihood(pattern, noise + MODE_DAMPING_STD**2)
    odds = usual - _likelihood(rate, noise + LAW_SCATTER**2)
    return float(1.0 / (1.0 + np.exp(np.clip(odds, -500.0, 500.0))))


def _likelihood(u: Real, variance: Real) -> float:
    """Logarithm, of numbers that scatter with their variances and, all together, with
    `COMMON_DAMPING_STD`."""
    covariance = np.diag(variance) + COMMON_DAMPING_STD**2
    return -0.5 * float(u @ np.linalg.solve(covariance, u) + np.linalg.slogdet(covariance)[1])


def _one_rate(tables: Sequence[ModeTable]) -> Further:
    """Mass-proportional damping, or an exponential window in the measurement, where it is all the
    damping that there is."""
    lines: list[str] = []
    for table in tables:
        if np.sum(np.isfinite(table.damping) & (table.damping > 0)) < LAW_RATIOS:
            continue
        try:
            rates = decay_rates(table)
        except CvxupdateError:
            continue
        lines.append(f"{capital(rates.says)}.")
        if rates.verdict == "constant decay rate":
            return Further(tuple(lines), (rates.alpha, rates.alpha_std))
    return Further(tuple(lines))
