"""FRF estimators, coherence and variance from averaged cross spectra: pure functions of
`Spectra`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.spectra import Spectra
from cvxupdate.recordings.types import Complex, Real


def h1(spectra: Spectra) -> Complex:
    """``Syx Sxx^-1``: least squares, unbiased by noise on the responses (Bendat & Piersol 9.1)."""
    return np.asarray(
        np.conj(
            np.linalg.solve(spectra.Sxx, np.conj(spectra.Syx.transpose(0, 2, 1))).transpose(0, 2, 1)
        )
    )


def h2(spectra: Spectra) -> Complex:
    """Unbiased by noise on the forces. One reference: ``Syy / Sxy`` per response; several: ``Syy
    Sxy^+`` over all responses.

    Raises
    ------
    RecordingError
        When there are fewer responses than references.
    """
    Syx = spectra.Syx
    if Syx.shape[2] == 1:
        return np.asarray(spectra.power[:, :, None] / np.conj(Syx))
    if Syx.shape[1] < Syx.shape[2] or spectra.Syy.ndim != 3:
        raise RecordingError(
            "H2 with several references needs at least as many responses and the full response "
            "spectra; use h1 or hv"
        )
    gram = np.conj(Syx.transpose(0, 2, 1)) @ Syx
    right = spectra.Syy @ Syx
    return np.asarray(
        np.conj(np.linalg.solve(gram, np.conj(right.transpose(0, 2, 1))).transpose(0, 2, 1))
    )


def hv(spectra: Spectra) -> Complex:
    """Total least squares, response by response, every channel scaled to unit power at each line
    (Rocklin et al., IMAC 1985).

    Assumes the same signal-to-noise ratio on all channels. With one reference: the geometric mean
    of H1 and H2.
    """
    lines, responses, references = spectra.Syx.shape
    input_scale = np.sqrt(np.real(np.einsum("fii->fi", spectra.Sxx)))
    output_scale = np.sqrt(spectra.power)
    H = np.empty((lines, responses, references), dtype=np.complex128)
    joint = np.empty((lines, references + 1, references + 1), dtype=np.complex128)
    for i in range(responses):
        joint[:, :-1, :-1] = spectra.Sxx / (input_scale[:, :, None] * input_scale[:, None, :])
        joint[:, -1, :-1] = spectra.Syx[:, i] / (output_scale[:, i, None] * input_scale)
        joint[:, :-1, -1] = np.conj(joint[:, -1, :-1])
        joint[:, -1, -1] = 1.0
        smallest = np.linalg.eigh(joint)[1][:, :, 0]
        # v^H [x; y] = 0 in the mean, so y = -(conj(v_x) / conj(v_y)) x
        H[:, i] = (
            -np.conj(smallest[:, :-1] / smallest[:, -1:]) * output_scale[:, i, None] / input_scale
        )
    return H


ESTIMATORS: dict[str, Callable[[Spectra], Complex]] = {"h1": h1, "h2": h2, "hv": hv}


def ordinary_coherence(spectra: Spectra) -> Real:
    """Ordinary coherence of each response with each reference, (lines, responses, references), in
    [0, 1]."""
    inputs = np.real(np.einsum("fii->fi", spectra.Sxx))
    product = spectra.power[:, :, None] * inputs[:, None, :]
    return np.clip(np.abs(spectra.Syx) ** 2 / np.where(product > 0.0, product, np.inf), 0.0, 1.0)


def multiple_coherence(spectra: Spectra) -> Real:
    """Fraction of each response's power that all references explain linearly, (lines, responses),
    in [0, 1]."""
    explained = np.real(np.einsum("fij,fij->fi", h1(spectra), np.conj(spectra.Syx)))
    return np.clip(explained / np.where(spectra.power > 0.0, spectra.power, np.inf), 0.0, 1.0)


def frf_variance(spectra: Spectra) -> Real:
    """Variance E\\|H - EH\\|² of the H1 estimate, (lines, responses, references).

    ``S_vv,i (Sxx^-1)_jj / (n - references)`` with the residual spectrum ``S_vv = Syy (1 - multiple
    coherence)`` and n the effective number of averages (Pintelon & Schoukens, *System
    Identification*, 2nd ed., section 2.6; for one reference it is Bendat & Piersol's \\|H\\|² (1 -
    coherence) / (coherence (n - 1)), twice their amplitude variance). NaN when n is too small.
    """
    freedom = spectra.averages - spectra.Sxx.shape[1]
    inverse = np.real(np.einsum("fii->fi", np.linalg.inv(spectra.Sxx)))
    residual = spectra.power * (1.0 - multiple_coherence(spectra))
    scale = 1.0 / freedom if freedom > 0.5 else np.nan
    return np.asarray(residual[:, :, None] * inverse[:, None, :] * scale)


def variance_from_coherence(H: Complex, coherence: Real, averages: float) -> Real:
    """Variance E\\|H - EH\\|² from H, its coherence and the number of independent averages; same
    shape as H.

    ``|H|² (1 - coherence) / (coherence (averages - 1))``: Bendat & Piersol, 4th ed., table 9.6,
    both quadratures together. ``coherence`` (lines, responses) is spread over the references. A
    coherence of 0 gives an infinite variance.

    Raises
    ------
    RecordingError
        When averages is not above 1, or a coherence lies outside [0, 1].
    """
    if averages <= 1.0:
        raise RecordingError(f"Variance needs at least 2 averages; got {averages:g}.")
    if np.any((coherence < 0.0) | (coherence > 1.0)):
        raise RecordingError("coherence outside [0, 1]; check the data set that it was read from")
    spread = coherence if coherence.ndim == H.ndim else coherence[..., None] * np.ones(H.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        variance = np.abs(H) ** 2 * (1.0 - spread) / (spread * (averages - 1.0))
    return np.where(spread > 0.0, variance, np.inf)


def usable(Sxx: Complex) -> NDArray[np.bool_]:
    """Lines at which the references have power and are not copies of one another."""
    power = np.real(np.einsum("fii->fi", Sxx))
    alive = np.all(power > 1e-14 * power.max(axis=0, initial=0.0), axis=1)
    scale = np.sqrt(np.where(power > 0.0, power, 1.0))
    eigenvalues = np.linalg.eigvalsh(Sxx / (scale[:, :, None] * scale[:, None, :]))
    return np.asarray(alive & (eigenvalues[:, 0] > 1e-8))
