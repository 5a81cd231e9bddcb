"""Periodic excitation: exactness without leakage, noise against distortion, odd against even, and
the silverbox."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify import identify_modes
from cvxupdate.recordings.periodic import (
    best_linear_approximation,
    detection_lines,
    frf_from_periods,
    period_spectra,
)
from cvxupdate.recordings.spectral import frf_from_time
from cvxupdate.recordings.types import Channel, Origin, TimeHistory

RATE, PERIOD = 512.0, 512
SISO = (Channel(1, "x", "force"), Channel(1, "x", "displacement"))


def multisine(lines: NDArray, seed: int, periods: int) -> NDArray:
    rng = np.random.default_rng(seed)
    spectrum = np.zeros(PERIOD // 2 + 1, dtype=complex)
    spectrum[lines] = np.exp(2j * np.pi * rng.random(lines.size)) * PERIOD / 2
    return np.tile(np.fft.irfft(spectrum), periods)


def steady(force: NDArray, cubic: float = 0.0, square: float = 0.0) -> NDArray:
    """Periodic response of a static non-linearity in front of a filter: Hammerstein, exactly
    periodic."""
    x = force + cubic * force**3 + square * force**2
    one = np.fft.rfft(x[:PERIOD])
    return np.tile(
        np.fft.irfft(one * transfer(np.arange(PERIOD // 2 + 1) * RATE / PERIOD)),
        force.size // PERIOD,
    )


def transfer(f: NDArray) -> NDArray:
    w, w0 = 2 * np.pi * f, 2 * np.pi * 60.0
    return np.asarray(1.0 / (w0**2 - w**2 + 2j * 0.02 * w0 * w)) * 1e4


def run(force: NDArray, y: NDArray, channels: tuple[Channel, ...] = SISO) -> TimeHistory:
    return TimeHistory(Origin("multisine", "test"), RATE, channels, np.column_stack([force, y]))


def test_periodic_average_is_exact_and_its_variance_is_the_noise() -> None:
    lines = np.arange(5, 200)
    force = multisine(lines, 0, 6)
    exact = frf_from_periods(run(force, steady(force)), PERIOD)
    assert exact.frequency == pytest.approx(lines * RATE / PERIOD)
    assert exact.H[:, 0, 0] == pytest.approx(transfer(exact.frequency), rel=1e-9)
    ratios = []
    for seed in range(20):
        rng = np.random.default_rng(seed)
        noisy = frf_from_periods(
            run(force, steady(force) + 0.05 * rng.standard_normal(force.size)), PERIOD
        )
        assert noisy.variance is not None
        ratios.append(np.abs(noisy.H - exact.H) ** 2 / noisy.variance)
    # five complex degrees of freedom: F(2, 10) has mean 10/8
    assert np.mean(ratios) == pytest.approx(1.25, abs=0.1)


def test_two_references_with_orthogonal_multisines() -> None:
    lines = np.arange(5, 200)
    a, b = multisine(lines, 1, 4), multisine(lines, 2, 4)
    channels = (Channel(1, "x", "force"), Channel(2, "x", "force"), Channel(1, "x", "displacement"))
    runs = [
        run(np.column_stack([a, s * b]), steady(a + 0.5 * s * b), channels) for s in (1.0, -1.0)
    ]
    bla = best_linear_approximation(runs, PERIOD)
    truth = transfer(bla.frf.frequency)
    assert bla.frf.H[:, 0, 0] == pytest.approx(truth, rel=1e-8)
    assert bla.frf.H[:, 0, 1] == pytest.approx(0.5 * truth, rel=1e-8)
    with pytest.raises(RecordingError, match="each realisation needs 2"):
        best_linear_approximation(runs[:1], PERIOD)


def test_variance_is_split_into_noise_and_distortion() -> None:
    lines, noise = np.arange(1, 160, 2), 0.02
    linear, cubic = [], []
    for seed in range(16):
        rng = np.random.default_rng(100 + seed)
        force = multisine(lines, seed, 5)
        e = noise * rng.standard_normal(force.size)
        linear.append(run(force, steady(force) + e))
        cubic.append(run(force, steady(force, cubic=3e-3) + e))
    clean, bent = (
        best_linear_approximation(linear, PERIOD),
        best_linear_approximation(cubic, PERIOD),
    )
    assert clean.realisations == 16 and clean.periods == 5
    assert np.sum(clean.distortion) < 0.5 * np.sum(16 * clean.noise)
    assert np.sum(bent.distortion) > 100.0 * np.sum(16 * bent.noise)
    # the noise is the same in both, and known: variance of a line of the mean over 5 x 16 periods,
    # over |U|² = 1/4
    assert np.mean(bent.noise) == pytest.approx(noise**2 / PERIOD / 80 * 4, rel=0.1)
    assert np.mean(bent.noise) == pytest.approx(np.mean(clean.noise), rel=0.01)
    # Bussgang: for a Gaussian input the approximation of f + c f³ is 1 + 3 c E f²
    gain = np.median(np.abs(bent.frf.H[10:-10, 0, 0] / transfer(bent.frf.frequency[10:-10])))
    assert gain == pytest.approx(1.0 + 3 * 3e-3 * lines.size / 2, rel=0.05)


@pytest.mark.parametrize(("cubic", "square", "where"), [(3e-3, 0.0, "odd"), (0.0, 3e-3, "even")])
def test_detection_lines_tell_odd_from_even(cubic: float, square: float, where: str) -> None:
    rng = np.random.default_rng(8)
    odd = np.arange(1, 160, 2)
    # one odd line in four is left out, at random: the odd detection lines
    lines = np.array(
        [group[k] for group in odd.reshape(-1, 4) for k in range(4) if k != rng.integers(4)]
    )
    runs = [
        run(u, steady(u, cubic, square) + 1e-4 * rng.standard_normal(u.size))
        for u in (multisine(lines, seed, 4) for seed in range(4))
    ]
    found = detection_lines(runs, PERIOD)
    other = "even" if where == "odd" else "odd"
    assert found.power(where)[0] > 300.0 * found.power(other)[0]
    assert found.power("excited")[0] > 10.0 * found.power(where)[0]
    quiet = found.level[found.kind == other] ** 2
    assert np.mean(quiet) == pytest.approx(np.mean(found.noise[found.kind == other] ** 2), rel=0.5)


def test_messages() -> None:
    force = multisine(np.arange(5, 20), 0, 1)
    with pytest.raises(RecordingError, match="no period"):
        period_spectra(force[:, None], PERIOD, 1)
    with pytest.raises(RecordingError, match="no periodic experiment"):
        best_linear_approximation([], PERIOD)


def silverbox() -> tuple[NDArray, NDArray]:
    scipy_io = pytest.importorskip("scipy.io")
    root = os.environ.get("CVXUPDATE_DATA")
    if not root or not (Path(root) / "silverbox" / "SNLS80mV.mat").is_file():
        pytest.skip(
            "CVXUPDATE_DATA/silverbox/SNLS80mV.mat is not there: the silverbox recordings "
            "are not tested"
        )
    data = scipy_io.loadmat(Path(root) / "silverbox" / "SNLS80mV.mat")
    return data["V1"].ravel(), data["V2"].ravel()


def silver(u: NDArray, y: NDArray, start: int, stop: int) -> TimeHistory:
    return TimeHistory(
        Origin("silverbox", "SNLS80mV.mat"), 1e7 / 2**14, SISO, np.column_stack([u, y])[start:stop]
    )


def test_silverbox_distortion_is_odd_not_even() -> None:
    u, y = silverbox()
    # ten odd random-phase multisines of 8192 samples, 8692 samples apart, steady from sample 40 980
    runs = [silver(u, y, 40_980 + 8692 * k, 40_980 + 8692 * k + 8192) for k in range(10)]
    odd_lines = np.arange(1, 2684, 2)
    bla = best_linear_approximation(runs, 8192, lines=odd_lines)
    lines = detection_lines(runs, 8192, lines=odd_lines)
    rate = runs[0].rate
    near = (bla.frf.frequency > 40.0) & (bla.frf.frequency < 110.0)
    number = np.rint(bla.frf.frequency[near] * 8192 / rate).astype(int)
    force = np.mean(
        [np.abs(period_spectra(r.data, 8192, 0)[0, number, 0]) ** 2 for r in runs], axis=0
    )
    odd = np.sqrt(np.mean(bla.distortion[near, 0, 0] * force))
    rows = (lines.frequency > 40.0) & (lines.frequency < 110.0) & (lines.kind == "even")
    even = np.sqrt(np.mean(lines.level[rows, 0] ** 2))
    # scatter over realisations at the odd lines 0.22 mV, response at the even lines 0.005 mV
    assert odd > 20.0 * even


def test_silverbox_resonance_rises_with_level() -> None:
    u, y = silverbox()
    found = []
    for start in range(0, 40_000, 10_000):
        modes = identify_modes(
            frf_from_time(silver(u, y, start, start + 10_000), method="lpm"), band=(20.0, 160.0)
        )
        assert modes.frequency.size == 1
        found.append(
            (modes.frequency[0], modes.frequency_std[0], float(np.std(y[start : start + 10_000])))
        )
    f, std, level = np.array(found).T
    assert np.all(np.diff(f) > 4.0 * np.hypot(std[1:], std[:-1]))
    # a cubic spring: the stiffness, so the square of the frequency, rises with the mean square of
    # the response
    slope, floor = np.polyfit(level**2, f**2, 1)
    assert slope > 0.0
    assert np.sqrt(floor) == pytest.approx(68.2, abs=0.3)
    assert np.max(np.abs(slope * level**2 + floor - f**2)) < 0.15 * (f[-1] ** 2 - f[0] ** 2)
