"""Periodic (multisine) excitation: leakage-free FRFs, the best linear approximation, and the split
of its variance.

J. Schoukens, R. Pintelon, T. Dobrowiecki; Pintelon & Schoukens, *System Identification*, 2nd ed.
(2012), sections 2.5 (periodic averages), 4.3 (robust and fast method: noise and non-linear
distortion, odd and even detection lines).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.channels import split_channels
from cvxupdate.recordings.types import Complex, FrequencyResponse, Real, TimeHistory


@dataclass(frozen=True)
class BestLinear:
    """Best linear approximation of a structure driven by periodic signals.

    Attributes
    ----------
    frf : its FRF at the excited lines with the total variance (noise and non-linear distortion), or
    the noise variance
        alone when there is one realisation.
    noise : (lines, responses, references) variance by noise of the averaged FRF; NaN with one
    period.
    distortion : same shape, variance of the stochastic non-linear distortion of *one* realisation;
    NaN with one
        realisation.
    realisations, periods : how many were used.
    """

    frf: FrequencyResponse
    noise: Real
    distortion: Real
    realisations: int
    periods: int


def period_spectra(data: Real, period: int, skip: int) -> Complex:
    """Spectra of the whole periods after the first ``skip`` of them, (periods, lines, channels), in
    the unit of the channel.

    Raises
    ------
    RecordingError
        When not one period is left.
    """
    count = data.shape[0] // period - skip
    if count < 1:
        raise RecordingError(
            f"{data.shape[0]} samples hold no period of {period} samples after skipping {skip}; "
            "give the right period, or skip fewer"
        )
    blocks = np.asarray(data[skip * period : (skip + count) * period], dtype=np.float64).reshape(
        count, period, -1
    )
    if not np.all(np.isfinite(blocks)):
        raise RecordingError(
            "NaN or infinite samples in the periodic record; repair or cut the drop-outs first"
        )
    return np.asarray(np.fft.rfft(blocks, axis=1) / period)


def excited_lines(
    spectra: Complex, references: Sequence[int], threshold: float = 0.03
) -> NDArray[np.int64]:
    """Lines (never 0 Hz) at which every reference exceeds ``threshold`` times its largest line, in
    the mean over periods."""
    level = np.abs(np.mean(spectra, axis=0))[:, list(references)]
    level[0] = 0.0
    return np.flatnonzero(np.all(level > threshold * level.max(axis=0), axis=1))


def best_linear_approximation(
    experiments: Sequence[TimeHistory],
    period: int,
    *,
    skip: int = 0,
    lines: NDArray[np.int64] | None = None,
    quantity: str | None = None,
) -> BestLinear:
    """The robust method: FRF without leakage from M realisations of P steady periods, with the
    variance split.

    Parameters
    ----------
    experiments : the realisations (independent random phases), each a whole number of periods; with
    n references each
        realisation consists of n consecutive experiments with independent (best: orthogonal)
        forces.
    period : samples. skip : periods thrown away at the start of each experiment (transient).
    lines : excited lines; default those found by `excited_lines` in the first experiment.

    Per realisation ``G = Y U^-1`` of the period averages. The noise variance is the scatter of ``y
    - G u`` over the periods; the total variance the scatter of G over the realisations; distortion
    = total - noise, times M for one realisation (P & S (4-38) ff.).

    Raises
    ------
    RecordingError
        When the experiments do not fit together, or there are fewer than the references ask for.
    """
    first, n = _alike(experiments, quantity)
    inputs, outputs, kind = split_channels(first.channels, quantity)
    spectra = [period_spectra(e.data, period, skip) for e in experiments]
    chosen = (
        excited_lines(spectra[0], inputs) if lines is None else np.asarray(lines, dtype=np.int64)
    )
    if chosen.size == 0:
        raise RecordingError("no excited line was found; give the lines, or check the period")
    realisations = len(experiments) // n
    every = [
        _realisation([s[:, chosen] for s in spectra[m * n : (m + 1) * n]], inputs, outputs)
        for m in range(realisations)
    ]
    H = np.mean([G for G, _ in every], axis=0)
    noise = np.sum([variance for _, variance in every], axis=0) / realisations**2
    if realisations > 1:
        total = np.var(np.array([G for G, _ in every]), axis=0, ddof=1) / realisations
        known = np.where(np.isfinite(noise), noise, 0.0)
        distortion = realisations * np.maximum(total - known, 0.0)
    else:
        total, distortion = noise, np.full(H.shape, np.nan)
    frf = FrequencyResponse(
        origin=first.origin,
        frequency=chosen * first.rate / period,
        H=H,
        quantity=kind,
        responses=tuple(first.channels[k] for k in outputs),
        references=tuple(first.channels[k] for k in inputs),
        variance=total if np.all(np.isfinite(total)) else None,
    )
    return BestLinear(frf, noise, distortion, realisations, min(s.shape[0] for s in spectra))


def _alike(experiments: Sequence[TimeHistory], quantity: str | None) -> tuple[TimeHistory, int]:
    """The first experiment and the number of references; raises `RecordingError` unless all have
    the same channels and rate, and are whole realisations."""
    if not experiments:
        raise RecordingError("no periodic experiment was given")
    first = experiments[0]
    n = len(split_channels(first.channels, quantity)[0])
    if len(experiments) % n or any(
        e.channels != first.channels or e.rate != first.rate for e in experiments
    ):
        raise RecordingError(
            f"{len(experiments)} experiments with {n} references: each realisation needs {n} "
            "experiments with the same channels and rate"
        )
    return first, n


def _realisation(
    group: Sequence[Complex], inputs: Sequence[int], outputs: Sequence[int]
) -> tuple[Complex, Real]:
    """G and its variance by noise from the period spectra (periods, lines, channels) of one
    experiment for each reference; NaN with one period."""
    U = np.stack([g[:, :, inputs].mean(axis=0) for g in group], axis=2)
    Y = np.stack([g[:, :, outputs].mean(axis=0) for g in group], axis=2)
    inverse = np.linalg.inv(U)
    G = Y @ inverse
    variance = np.zeros(G.shape)
    for e, g in enumerate(group):
        P = g.shape[0]
        rest = g[:, :, outputs] - np.einsum("foi,pfi->pfo", G, g[:, :, inputs])
        scatter = (
            np.sum(np.abs(rest - rest.mean(axis=0)) ** 2, axis=0) / (P * (P - 1))
            if P > 1
            else np.full(rest.shape[1:], np.nan)
        )
        variance += scatter[:, :, None] * np.abs(inverse[:, e, None, :]) ** 2
    return G, variance


def frf_from_periods(
    history: TimeHistory, period: int, *, skip: int = 0, quantity: str | None = None
) -> FrequencyResponse:
    """Leakage-free FRF of one periodic record with one reference: sample mean over the periods and
    its variance."""
    return best_linear_approximation([history], period, skip=skip, quantity=quantity).frf


@dataclass(frozen=True)
class Distortion:
    """Output level at excited and detection lines (Pintelon & Schoukens 4.3.2), r.m.s. per line, in
    the unit of the response.

    ``frequency`` (lines,) Hz in the excited band; ``level``, ``noise`` (lines, responses) the
    period average and its standard deviation (NaN with one period and one record); ``kind``
    (lines,) ``"excited"``, ``"odd"``, or ``"even"`` (not excited).
    """

    frequency: Real
    level: Real
    noise: Real
    kind: NDArray[np.str_]

    def power(self, kind: str) -> Real:
        """Mean square level of the lines of one kind, (responses,); NaN when there are none."""
        rows = self.level[self.kind == kind]
        return np.mean(rows**2, axis=0) if rows.size else np.full(self.level.shape[1], np.nan)


def detection_lines(
    experiments: Sequence[TimeHistory],
    period: int,
    *,
    skip: int = 0,
    lines: NDArray[np.int64] | None = None,
    quantity: str | None = None,
) -> Distortion:
    """Odd and even non-linear distortion read from the lines that are not excited, over one or more
    realisations.

    An odd non-linearity driven at odd lines answers at odd lines only, an even one at even lines
    only. What the force itself holds at a detection line (generator, shaker) is taken off with the
    FRF interpolated from the excited lines: one reference.

    Raises
    ------
    RecordingError
        When there is more than one reference, or no excited line.
    """
    inputs, outputs, _ = split_channels(experiments[0].channels, quantity)
    if len(inputs) != 1:
        raise RecordingError("detection lines are read with one reference at a time")
    bla = best_linear_approximation(experiments, period, skip=skip, lines=lines, quantity=quantity)
    rate = experiments[0].rate
    excited = np.rint(bla.frf.frequency * period / rate).astype(np.int64)
    inside = np.arange(excited[0], excited[-1] + 1)
    G = np.stack(
        [
            np.interp(inside, excited, g.real) + 1j * np.interp(inside, excited, g.imag)
            for g in bla.frf.H[:, :, 0].T
        ],
        axis=1,
    )
    is_excited = np.isin(inside, excited)
    power, noise = np.zeros((inside.size, len(outputs))), np.zeros((inside.size, len(outputs)))
    for e in experiments:
        s = period_spectra(e.data, period, skip)[:, inside]
        own = s[:, :, outputs] - np.where(is_excited, 0.0, 1.0)[:, None] * G * s[:, :, inputs]
        power += np.abs(own.mean(axis=0)) ** 2 / len(experiments)
        periods = s.shape[0]
        spread = (
            np.var(own, axis=0, ddof=1) / periods if periods > 1 else np.full(power.shape, np.nan)
        )
        noise += spread / len(experiments)
    kind = np.where(is_excited, "excited", np.where(inside % 2 == 1, "odd", "even"))
    return Distortion(inside * rate / period, np.sqrt(power), np.sqrt(noise), kind)
