"""Faults of FRFs: reciprocity, polarity, passivity, coherence."""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.quality.finding import ALPHA, Finding
from cvxupdate.recordings.quantiles import chi_square_above, normal_above
from cvxupdate.recordings.types import Channel, Complex, FrequencyResponse, Real

_ORDER = {"displacement": 0, "velocity": 1, "acceleration": 2}
LOUD = 0.3  # of the median of |H|: below it a sensor's own noise is as good a reason
CORRELATED = 2.0  # neighbouring lines of a Hann spectrum: half of them are independent


def mobility(frf: FrequencyResponse) -> Complex:
    """H as mobility, velocity per newton; line 0 Hz gives 0."""
    omega = 2j * np.pi * frf.frequency
    factor = np.zeros_like(omega)
    factor[frf.frequency > 0.0] = omega[frf.frequency > 0.0] ** (1 - _ORDER.get(frf.quantity, 1))
    return np.asarray(frf.H * factor[:, None, None])


def place(channel: Channel) -> tuple[int, str]:
    """Node and DOF: what joins responses and references."""
    return channel.node, channel.dof


def factor_between(a: Complex, b: Complex, va: Real, vb: Real) -> tuple[complex, float, float]:
    """Complex g with b ≈ g a, the reduced misfit of b against a (1 when only noise parts them), and
    the relative difference.

    Weighted total least squares would gain nothing here: g is wanted to a per cent, and the noise
    is small or said to be so.
    """
    weight = 1.0 / np.maximum(
        va + vb, 1e-6 * (np.abs(a) ** 2 + np.abs(b) ** 2) + np.finfo(float).tiny
    )
    power, size = (
        float(np.sum(weight * np.abs(a) ** 2)),
        0.5 * float(np.sum(np.abs(a) ** 2 + np.abs(b) ** 2)),
    )
    g = (
        complex(np.sum(weight * np.conj(a) * b)) / power if power > 0.0 else 0j
    )  # a silent channel: no factor leads from it to b
    misfit = float(np.mean(weight * np.abs(a - b) ** 2))
    relative = float(np.sqrt(np.sum(np.abs(a - b) ** 2) / size)) if size > 0.0 else 0.0
    return g, misfit, relative


def reciprocity(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """H_ij against H_ji wherever both are there: the misfit over the variance is chi-square with
    two degrees of freedom a line.

    Half of the lines count as independent; the difference must also exceed 5 % of the FRFs
    (r.m.s.). The factor between them says a gain, a wrong sign (near -1), or a delay (its phase
    grows with frequency).
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
                if place(c) == place(ref) and place(q) == place(r) and (k, m) != (i, s)
            ]
            if not mirror or mirror[0][0] <= i:
                continue
            k, m = mirror[0]
            a, b = frf.H[:, i, s], frf.H[:, k, m]
            g, misfit, relative = factor_between(a, b, frf.variance[:, i, s], frf.variance[:, k, m])
            free = 2.0 * len(a) / CORRELATED
            threshold = chi_square_above(alpha, free) / free
            if misfit > threshold and relative > 0.05:
                pair = f"{r.label}/{ref.label} and {ref.label}/{r.label}"
                sign = (
                    " The sign differs: one of the four channels is reversed."
                    if g.real < -0.5 * abs(g)
                    else ""
                )
                gain = (
                    f" One is {abs(g):.3g} times the other: a gain is wrong."
                    if abs(np.log(max(abs(g), 1e-9))) > 0.05
                    else ""
                )
                found.append(
                    Finding(
                        "reciprocity",
                        pair,
                        f"{pair} differ by {100 * relative:.0f} % where they should be "
                        f"equal.{sign}{gain} Check gain, sign and delay of these channels.",
                        misfit,
                        threshold,
                        abs(g),
                    )
                )
    return tuple(found)


def drive_points(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """At a drive point the structure takes up power: Re(mobility) ≥ 0 at every line, whatever the
    structure.

    The sum of Re(mobility) over the lines, over its standard deviation, is standard normal where
    the mean is zero; a negative sum beyond the threshold says that force and response have opposite
    signs. Lines that are significantly negative while the sum is positive say a delay between the
    two.
    """
    if frf.variance is None:
        return ()
    mob = mobility(frf)
    found = []
    scale = np.abs(mob) / np.maximum(np.abs(frf.H), np.finfo(float).tiny)
    for i, r in enumerate(frf.responses):
        for s, ref in enumerate(frf.references):
            if place(r) != place(ref):
                continue
            y = np.real(mob[:, i, s])
            deviation = np.sqrt(frf.variance[:, i, s] / 2.0) * scale[:, i, s]
            total = float(np.sum(y)) / max(
                float(np.sqrt(CORRELATED * np.sum(deviation**2))), np.finfo(float).tiny
            )
            threshold = normal_above(alpha)
            fraction = float(np.sum(y)) / max(float(np.sum(np.abs(y))), np.finfo(float).tiny)
            if -total > threshold and fraction < -0.5:
                found.append(
                    Finding(
                        "polarity",
                        f"{r.label}/{ref.label}",
                        f"the drive point {r.label} gives power back ({-100 * fraction:.0f} % of "
                        "its lines by weight): force or response has the wrong sign. Set "
                        "sign = -1 on one of them.",
                        -total,
                        threshold,
                        -1.0,
                    )
                )
    return tuple(found)


def passivity(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """A drive point that gives power back at some lines only: force and response are not in time,
    or not quite at one place.

    Re(mobility) below zero at three lines in a row, each by more than a normal quantile of its
    deviation (Bonferroni over the lines), and by more than a tenth of the modulus.
    """
    if frf.variance is None or len(frf.frequency) < 8:
        return ()
    mob = mobility(frf)
    scale = np.abs(mob) / np.maximum(np.abs(frf.H), np.finfo(float).tiny)
    threshold = normal_above(alpha / len(frf.frequency))
    found = []
    for i, r in enumerate(frf.responses):
        for s, ref in enumerate(frf.references):
            if place(r) != place(ref):
                continue
            y = np.real(mob[:, i, s])
            if np.sum(y) < 0.0:
                continue  # the wrong sign, which `drive_points` reports
            deviation = np.sqrt(frf.variance[:, i, s] / 2.0) * scale[:, i, s]
            z = -y / np.maximum(deviation, np.finfo(float).tiny)
            bad = (z > threshold) & (-y > 0.1 * np.abs(mob[:, i, s]))
            run = bad[:-2] & bad[1:-1] & bad[2:]
            if np.any(run):
                k = int(np.flatnonzero(run)[0]) + 1
                turn = np.degrees(np.arcsin(min(float(-y[k] / np.abs(mob[k, i, s])), 1.0)))
                found.append(
                    Finding(
                        "passivity",
                        f"{r.label}/{ref.label}",
                        f"the drive point {r.label} gives power back at "
                        f"{np.count_nonzero(bad)} lines, by {turn:.0f}° of phase at "
                        f"{frf.frequency[k]:.4g} Hz: a delay between force and response, or "
                        "two places.",
                        float(z[k]),
                        threshold,
                        float(turn),
                    )
                )
    return tuple(found)


def coherence(frf: FrequencyResponse, alpha: float = ALPHA) -> tuple[Finding, ...]:
    """Lines of low coherence where the FRF is not small.

    Noise of the sensor alone gives (1 - γ²)/γ² = c / |H|² with c the same in a band; the logarithm
    of the ratio to that is compared with its own median and spread (1.4826 MAD) by a normal
    quantile with Bonferroni's correction, and γ² must be below 0.9 at three lines in a row where
    |H| is above its running median and above a third of the median of the whole band: no
    antiresonance, nor lines at the ends of the band where noise of the sensor is as large.
    """
    from scipy.ndimage import median_filter

    if frf.coherence is None or len(frf.frequency) < 64:
        return ()
    found = []
    for r, channel in enumerate(frf.responses):
        gamma = frf.coherence[:, r]
        if np.any(np.isnan(gamma)):
            continue
        gamma = np.clip(gamma, 1e-6, 1.0 - 1e-9)
        # the coherence kept is the least over the references, so the FRF must be large for each of
        # them
        squares = np.abs(frf.H[:, r, :]) ** 2
        size = np.sqrt(
            np.min(squares / np.maximum(np.mean(squares, axis=0), np.finfo(float).tiny), axis=1)
        )
        if not np.any(size > 0.0):
            continue
        level = median_filter(size, size=max(9, 2 * (len(size) // 16) + 1), mode="nearest")
        log = np.log((1.0 - gamma) / gamma * np.maximum(size, 1e-12 * size.max()) ** 2)
        local = median_filter(log, size=max(9, 2 * (len(size) // 16) + 1), mode="nearest")
        spread = 1.4826 * float(np.median(np.abs(log - local)))
        excess = (log - local) / max(spread, 1e-9)
        threshold = normal_above(alpha / len(log))
        loud = size > np.maximum(level, LOUD * np.median(size))
        low = (excess > threshold) & (gamma < 0.9) & loud
        run = low[:-2] & low[1:-1] & low[2:]
        if np.any(run):
            k = int(np.flatnonzero(run)[0]) + 1
            peak = size[k] > 3.0 * level[k]
            why = (
                "leakage or a non-linear structure" if peak else "another source, or a bad contact"
            )
            found.append(
                Finding(
                    "low coherence",
                    channel.label,
                    f"{channel.label}: the coherence falls to {gamma[k]:.2f} at "
                    f"{frf.frequency[k]:.4g} Hz, where the FRF is "
                    f"{'at a peak' if peak else 'not small'}: {why}.",
                    float(excess[k]),
                    threshold,
                    float(gamma[k]),
                )
            )
    return tuple(found)


def dropouts(frf: FrequencyResponse) -> tuple[Finding, ...]:
    """Lines that are exactly 0 between others that are not: an export without a number there.

    No measured value is 0 to the last bit but by chance, and computed ones are so at all lines or
    at none (a DOF that the excitation does not reach); edges of the band may have been cut.
    """
    found = []
    for r, channel in enumerate(frf.responses):
        zero = np.all(frf.H[:, r] == 0.0, axis=1)
        alive = np.flatnonzero(~zero)
        if not len(alive):
            continue
        inside = np.flatnonzero(zero[alive[0] : alive[-1]]) + alive[0]
        count = len(inside)
        if count:
            lines = "1 line" if count == 1 else f"{count} lines"
            found.append(
                Finding(
                    "drop-out",
                    channel.label,
                    f"{channel.label} is exactly 0 at {lines} between others that are not, the "
                    f"first at {frf.frequency[inside[0]]:.5g} Hz: the number is missing. Leave "
                    "it out (band), or export again.",
                    float(count),
                    0.0,
                    float(count),
                )
            )
    return tuple(found)
