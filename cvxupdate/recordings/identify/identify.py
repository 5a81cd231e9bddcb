"""FRFs in, modes with standard deviations out."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import derivatives
from cvxupdate.recordings.identify.coarse import refine_coarsely
from cvxupdate.recordings.identify.criterion import parameters
from cvxupdate.recordings.identify.lsfd import LinearFit, Setting
from cvxupdate.recordings.identify.model import (
    Roots,
    check_damping,
    frequency_and_damping,
    pinned,
    pole_from_value,
    value_from_pole,
)
from cvxupdate.recordings.identify.noise import level_of, variance_of
from cvxupdate.recordings.identify.plscf import plscf
from cvxupdate.recordings.identify.pruning import on_several_lines, pruned
from cvxupdate.recordings.identify.pursuit import with_missed_modes
from cvxupdate.recordings.identify.realisation import TIME_DOMAIN, time_domain_poles
from cvxupdate.recordings.identify.refine import refine
from cvxupdate.recordings.identify.result import IdentifiedModes
from cvxupdate.recordings.identify.selection import select
from cvxupdate.recordings.identify.stabilisation import Criteria, Stabilisation, stabilisation
from cvxupdate.recordings.identify.uncertainty import (
    deviations,
    line_correlation,
    reduced_chi_square,
)
from cvxupdate.recordings.types import Complex, FrequencyResponse, Real

SILENT = 1e-24
"""Part of the largest power in a response's row below which an FRF is rounding (1e-12 of the
amplitude): that place does not move under that force."""


def _weights(H: Complex, variance: Real | None) -> Real:
    """One over the standard deviation of a real or imaginary part, (lines, outputs, inputs).

    Without a variance: one over the usual level of each FRF (`level_of`; scaled later by the
    misfit). A variance that came from few averages can be tiny by chance; it is not let fall below
    a tenth of its running median over eleven lines.
    """
    power = np.mean(np.abs(H) ** 2, axis=0)
    # a response that is silent under one reference and not under another does not couple with it:
    # the zero is a figure like any other, as sure as the row's. One that is silent under all says
    # nothing.
    alive = np.any(power > 0.0, axis=1, keepdims=True)
    coupled = power > SILENT * np.max(power, axis=1, keepdims=True)
    if variance is None:
        row = np.sum(np.where(coupled, power, 0.0), axis=1, keepdims=True) / np.maximum(
            np.sum(coupled, axis=1, keepdims=True), 1
        )
        level = level_of(np.abs(H) ** 2, np.sqrt(np.where(coupled, power, row)), coupled)
        return np.asarray(np.sqrt(2.0) / np.where(level > 0.0, level, np.inf))
    reach = np.clip(np.arange(H.shape[0])[:, None] + np.arange(-5, 6), 0, H.shape[0] - 1)
    finite = np.where(np.isfinite(variance), variance, np.nan)
    with np.errstate(all="ignore"):
        running = np.nanmedian(finite[reach], axis=1)
    floor = np.maximum(0.1 * running, 1e-16 * power)
    safe = np.maximum(
        np.where(np.isfinite(variance), variance, np.inf),
        np.where(np.isfinite(floor), floor, np.inf),
    )
    with np.errstate(all="ignore"), warnings.catch_warnings():
        warnings.simplefilter("ignore", RuntimeWarning)  # a row that is silent under all
        usual = np.nanmedian(np.where(coupled, safe, np.nan), axis=2, keepdims=True)
    safe = np.where(coupled | ~alive, safe, usual)
    known = alive & (safe > 0.0)
    return np.asarray(np.where(known, np.sqrt(2.0 / np.where(known, safe, 1.0)), 0.0))


def _reweighted(s: Setting, fit: LinearFit) -> Setting:
    """Unknown variance: that of each FRF from its own misfit."""
    variance = variance_of(fit.misfit, s.H - fit.misfit)
    return replace(s, weights=np.sqrt(2.0 / np.where(variance > 0.0, variance, np.inf)))


def _within(roots: Roots, band: tuple[float, float], max_damping: float) -> NDArray[np.bool_]:
    """Modes to report: inside the band, and no poles of a smooth background."""
    f, zeta = frequency_and_damping(roots.value, roots.damping)
    return np.asarray((f >= band[0]) & (f <= band[1]) & (zeta <= max_damping))


def identify_modes(
    frf: FrequencyResponse,
    band: tuple[float, float] | None = None,
    *,
    max_order: int = 60,
    damping: str = "viscous",
    residuals: tuple[int, int] = (1, 3),
    criteria: Criteria | None = None,
    iterations: int = 20,
    added_decay: float = 0.0,
    poles: str = "plscf",
) -> IdentifiedModes:
    """Modes of a set of FRFs, all references at once, with their standard deviations.

    pLSCF for all orders up to ``max_order`` → stabilisation diagram → clusters (`selection`) →
    shapes by LSFD → maximum-likelihood refinement weighted by the variance (`refine`) → modes that
    the diagram missed, found in the misfit or that lie just beyond the edges (`pursuit`) → modes
    that do not pay for their parameters dropped (Bayes' information criterion) → covariance
    (`uncertainty`).

    Parameters
    ----------
    frf : receptance, mobility or accelerance; without a variance the misfit takes its place.
    band : (lowest, highest) Hz to fit; default all lines above 0 Hz.
    damping : ``"viscous"`` or ``"hysteretic"``. residuals : of (lower, upper) residual terms.
    criteria : see `stabilisation.Criteria`. iterations : of the refinement; 0: the pLSCF poles.
    added_decay : 1/s of the exponential window on all channels; removed from the poles alone.
    poles : where those of the diagram come from: "plscf", "realisation" (ERA) or "ibrahim".

    The deviations count correlated lines once (`line_correlation`) and grow with the root of
    chi-square where the model misfits.

    Raises
    ------
    RecordingError
        When the damping model is unknown, the FRFs are not motions per force, a reference excites
        nothing, or the band holds too few lines.
    """
    check_damping(damping)
    c = criteria if criteria is not None else Criteria()
    s, known, top = _setting(frf, band, max_order, residuals)
    f = s.frequency
    orders = np.arange(2, top + 1)
    sets = (
        time_domain_poles(f, s.H, orders=orders, method=poles)
        if poles in TIME_DOMAIN
        else plscf(f, s.H, orders=orders, weights=_output_weights(s.weights))
    )
    edge = 0.1 * (f[-1] - f[0])
    diagram = stabilisation(sets, (max(f[0] - edge, 1e-6), f[-1] + edge), c)
    chosen = select(diagram, c)
    start = Roots(value_from_pole(chosen.value, damping), chosen.participation, damping)
    s, roots, fit = _refined(s, start, c, iterations, known)
    ends = (float(f.min()), float(f.max()))
    return _result(frf, s, roots, fit, diagram, ends, added_decay, known, c.max_damping)


def _setting(
    frf: FrequencyResponse,
    band: tuple[float, float] | None,
    max_order: int,
    residuals: tuple[int, int],
) -> tuple[Setting, bool, int]:
    """The lines to fit with their weights, whether a variance is known, and the highest order that
    they carry. Raises `RecordingError` as `identify_modes` does."""
    low, high = band if band is not None else (0.0, np.inf)
    inside = (frf.frequency >= low) & (frf.frequency <= high) & (frf.frequency > 0.0)
    f, H = frf.frequency[inside], np.asarray(frf.H[inside], dtype=np.complex128)
    top = min(max_order, 2 * f.size // (H.shape[2] + 1) - 1, f.size // 2)
    if top < 4:
        raise RecordingError(
            f"{frf.origin.name}: {f.size} lines between {low:g} and {high:g} Hz are too few to "
            "identify modes; widen the band or record with a finer resolution"
        )
    silent = [
        channel.label
        for channel, moved in zip(frf.references, np.any(H != 0.0, axis=(0, 1)), strict=True)
        if not moved
    ]
    if silent:
        raise RecordingError(
            f"{frf.origin.name}: all FRFs of the reference {', '.join(silent)} are zero "
            f"between {f[0]:g} and {f[-1]:g} Hz: nothing was excited there. Leave the "
            "reference out."
        )
    # a variance of zero everywhere (simulated FRFs) says no more than none
    variance = None if frf.variance is None else frf.variance[inside]
    if variance is not None and not np.any(np.isfinite(variance) & (variance > 0.0)):
        variance = None
    s = Setting(f, H, _weights(H, variance), derivatives(frf.quantity), residuals)
    return s, variance is not None, top


def _refined(
    s: Setting, start: Roots, c: Criteria, iterations: int, known: bool
) -> tuple[Setting, Roots, LinearFit]:
    """Maximum likelihood from the stable poles, missed modes added, needless ones dropped; without
    a known variance the misfit stands in for it."""
    roots, fit = refine(s, start, iterations=0)
    if not known:
        s = _reweighted(s, fit)
    roots, fit = pruned(s, *refine(s, roots, iterations=0), iterations=0)
    if iterations:
        roots, fit = refine_coarsely(s, roots, iterations=iterations)
        # before all modes are there, what is missing passes for noise, and good modes were dropped:
        # they come back here
        roots, fit = with_missed_modes(s, roots, fit, c, iterations=iterations)
    roots, fit = pruned(s, roots, fit, iterations)
    roots, fit = on_several_lines(s, roots, fit, iterations)
    roots, fit = refine(s, roots, iterations=iterations)
    if not known and iterations:
        s = _reweighted(s, fit)
        roots, fit = refine(s, roots, iterations=iterations)
    return s, roots, fit


def _output_weights(weights: Real) -> Real:
    """One weight per line and output: the harmonic mean of the variances over the references that
    say anything of it (motions that do not couple are zero under some); all but zero where none
    does."""
    says = weights > 0.0
    variance = np.where(says, 1.0 / np.where(says, weights, 1.0) ** 2, 0.0).sum(axis=2)
    count = says.sum(axis=2)
    return np.asarray(
        np.sqrt(np.where(count > 0, count / np.where(count > 0, variance, 1.0), 1e-300))
    )


def _result(
    frf: FrequencyResponse,
    s: Setting,
    roots: Roots,
    fit: LinearFit,
    diagram: Stabilisation,
    band: tuple[float, float],
    added_decay: float,
    known: bool,
    max_damping: float,
) -> IdentifiedModes:
    _, free = pinned(roots.participation)
    chi = reduced_chi_square(s, fit, parameters(s, roots.value.size)[1])
    correlation = line_correlation(s, fit)
    dev = deviations(s, roots, fit, free, correlation * (max(chi, 1.0) if known else chi))
    rank = np.argsort(frequency_and_damping(roots.value, roots.damping)[0])
    reported = _within(roots, band, max_damping)[rank]
    inside, outside = rank[reported], rank[~reported]
    top = np.argmax(np.abs(fit.shapes), axis=1)
    size = fit.shapes[np.arange(roots.value.size), top][:, None]
    shapes, participation = fit.shapes / size, roots.participation * size
    poles = pole_from_value(roots.value, roots.damping) + added_decay
    f, zeta = frequency_and_damping(value_from_pole(poles, roots.damping), roots.damping)
    return IdentifiedModes(
        origin=frf.origin,
        frequency=f[inside],
        frequency_std=dev.frequency[inside],
        damping=zeta[inside],
        damping_std=dev.damping[inside],
        poles=poles[inside],
        shapes=shapes[inside],
        shape_std=np.hypot(dev.shape_real, dev.shape_imag)[inside],
        shape_std_real=dev.shape_real[inside],
        shape_std_imag=dev.shape_imag[inside],
        participation=participation[inside],
        lower=fit.lower,
        upper=fit.upper,
        band=band,
        damping_model=roots.damping,
        quantity=frf.quantity,
        responses=frf.responses,
        references=frf.references,
        auxiliary=(poles[outside], shapes[outside], participation[outside]),
        stabilisation=diagram,
        chi_square=chi if known else float("nan"),
        line_correlation=correlation,
        rest=float(np.linalg.norm(fit.misfit)) / max(float(np.linalg.norm(s.H)), 1e-300),
        added_decay=added_decay,
    )
