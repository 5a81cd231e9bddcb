"""Faults of FRFs in time: a delay between channels, a response before the force."""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.quality.finding import ALPHA, Finding
from cvxupdate.recordings.quality.frf import CORRELATED, place
from cvxupdate.recordings.quantiles import normal_above
from cvxupdate.recordings.types import FrequencyResponse


def delays(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """Delay between the two members of a reciprocal pair: the slope of the phase of H_ij conj(H_ji)
    over frequency.

    Weighted least squares with the phase's deviation from the variances (half of the lines
    independent); the slope over its deviation is standard normal, and must turn the phase by 0.1
    rad over the band. Phases across *different* DOFs are no measure: damping alone bends them.
    """
    if frf.variance is None:
        return ()
    found = []
    for i, r in enumerate(frf.responses):
        for s, ref in enumerate(frf.references):
            mirror = [
                (k, m)
                for k, c in enumerate(frf.responses)
                for m, q in enumerate(frf.references)
                if place(c) == place(ref) and place(q) == place(r) and k > i
            ]
            if not mirror:
                continue
            k, m = mirror[0]
            a, b = frf.H[:, i, s], frf.H[:, k, m]
            tiny = np.finfo(float).tiny
            # a variance of zero is simulated, and rounding remains
            noise = np.maximum(
                0.5 * frf.variance[:, i, s] / np.maximum(np.abs(a) ** 2, tiny)
                + 0.5 * frf.variance[:, k, m] / np.maximum(np.abs(b) ** 2, tiny),
                1e-12,
            )
            use = (noise < 0.02) & (a != 0.0) & (b != 0.0)
            if np.count_nonzero(use) < 24:
                continue
            f, product = frf.frequency[use], (a * np.conj(b))[use]
            sign = np.sign(
                np.real(np.sum(product / np.abs(product)))
            )  # a reversed channel is `reciprocity`'s to report
            phase = np.angle(product * (sign if sign != 0.0 else 1.0))
            weight = 1.0 / noise[use]
            basis = 2.0 * np.pi * f
            tau = -float(np.sum(weight * basis * phase) / np.sum(weight * basis**2))
            deviation = float(np.sqrt(CORRELATED / np.sum(weight * basis**2)))
            threshold = normal_above(alpha / 2.0)
            if abs(tau) / deviation > threshold and 2.0 * np.pi * abs(tau) * (f[-1] - f[0]) > 0.1:
                first, second = (r, ref) if tau > 0.0 else (ref, r)
                found.append(
                    Finding(
                        "delay",
                        f"{r.label}/{ref.label}",
                        f"{first.label}/{second.label} lags behind "
                        f"{second.label}/{first.label} by {1e3 * abs(tau):.3g} ms: the "
                        f"response at {first.label} is late, or that at {second.label} early "
                        "(sampler, filter, amplifier).",
                        abs(tau) / deviation,
                        threshold,
                        abs(tau),
                    )
                )
    return tuple(found)


def causality(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """Response before the force: energy of the impulse response in the last quarter of its period
    against the first quarter.

    The band is tapered (Hann) and transformed; a causal, decaying response has most of the two
    quarters' energy in the first. An FRF whose sign of phase is reversed has it in the last. Two
    kinds of FRF have no direction of time to show, and half of the energy on either side: noise,
    and a structure that does not decay within 1/Δf (light damping, or none: its FRF is real). So a
    fault is more than 0.7, which a reversed response reaches once it falls by a quarter of its
    amplitude a half period, and more than noise gives with probability ``alpha`` (normal law of the
    fraction, half of the samples independent). Evenly spaced lines only.
    """
    found = []
    lines = len(frf.frequency)
    if lines < 64 or np.ptp(np.diff(frf.frequency)) > 1e-3 * np.mean(np.diff(frf.frequency)):
        return ()
    taper = np.hanning(lines + 2)[1:-1]
    response = np.abs(np.fft.ifft(frf.H * taper[:, None, None], axis=0)) ** 2
    quarter = lines // 4
    # the main lobe of the taper around t = 0 belongs to both sides
    first, last = response[3:quarter].sum(axis=0), response[-quarter:-2].sum(axis=0)
    fraction = last / np.maximum(first + last, np.finfo(float).tiny)
    # the fraction of n and n exponential variables has the variance 1 / (4 (2 n + 1))
    threshold = max(
        0.7,
        0.5
        + normal_above(alpha / frf.H[0].size)
        * 0.5
        / np.sqrt(2.0 * (quarter - 3) / CORRELATED + 1.0),
    )
    for s, ref in enumerate(frf.references):
        if not ref.dof:  # a spectrum has no direction of time
            continue
        bad = [r for r in range(len(frf.responses)) if fraction[r, s] > threshold]
        if bad:
            names = ", ".join(frf.responses[r].label for r in bad[:4]) + (
                " …" if len(bad) > 4 else ""
            )
            worst = float(fraction[bad, s].max())
            found.append(
                Finding(
                    "causality",
                    f"{names} / {ref.label}",
                    f"{names} answer before the force at {ref.label} ({100 * worst:.0f} % of "
                    "the energy): the phase has the opposite sign, or the force comes late. "
                    "Conjugate the FRF or correct the delay.",
                    worst,
                    threshold,
                    worst,
                )
            )
    return tuple(found)
