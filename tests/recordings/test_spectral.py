"""FRFs from time histories: exact limits, bias of the estimators, variance, windows, streams,
quantities."""

from __future__ import annotations

import tracemalloc
from collections.abc import Iterator

import numpy as np
import pytest
import scipy.signal
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import convert
from cvxupdate.recordings.estimators import (
    multiple_coherence,
    ordinary_coherence,
    variance_from_coherence,
)
from cvxupdate.recordings.identify import identify_modes
from cvxupdate.recordings.local_polynomial import local_polynomial
from cvxupdate.recordings.output_spectra import output_spectra
from cvxupdate.recordings.spectra import spectra_from_chunks
from cvxupdate.recordings.spectral import (
    frf_from_impacts,
    frf_from_time,
    spectra_from_time,
    transmissibility,
)
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, TimeHistory
from cvxupdate.recordings.windows import effective_averages, find_impacts, window

RATE = 1024.0


class Plant:
    """Three masses, forces on the first and the last, exactly sampled (the discrete system is the
    truth)."""

    M = np.diag([1.0, 1.5, 0.8])
    K = np.array([[5.0, -2.0, 0.0], [-2.0, 4.0, -2.0], [0.0, -2.0, 3.0]]) * 1e5
    C = 2e-4 * K + 1.5 * M

    def __init__(self) -> None:
        n = 3
        A = np.block(
            [
                [np.zeros((n, n)), np.eye(n)],
                [-np.linalg.solve(self.M, self.K), -np.linalg.solve(self.M, self.C)],
            ]
        )
        B = np.vstack([np.zeros((n, n)), np.linalg.inv(self.M)])[:, [0, 2]]
        self.discrete = scipy.signal.cont2discrete(
            (A, B, np.hstack([np.eye(n), np.zeros((n, n))]), np.zeros((n, 2))), 1.0 / RATE, "foh"
        )

    def run(self, force: NDArray) -> NDArray:
        A, B, C, D, _ = self.discrete
        return np.asarray(scipy.signal.dlsim((A, B, C, D, 1.0 / RATE), force)[1])

    def frf(self, f: NDArray) -> NDArray:
        A, B, C, D, _ = self.discrete
        return np.array(
            [C @ np.linalg.solve(z * np.eye(6) - A, B) + D for z in np.exp(2j * np.pi * f / RATE)]
        )


PLANT = Plant()
CHANNELS = (
    Channel(1, "x", "force"),
    Channel(3, "x", "force"),
    *(Channel(k, "x", "displacement") for k in (1, 2, 3)),
)


def recording(data: NDArray, channels: tuple[Channel, ...] = CHANNELS) -> TimeHistory:
    return TimeHistory(Origin("run", "test"), RATE, channels, data)


def random_run(samples: int, noise: float, seed: int = 0) -> TimeHistory:
    rng = np.random.default_rng(seed)
    force = scipy.signal.lfilter(
        *scipy.signal.butter(4, 0.6), rng.standard_normal((samples, 2)), axis=0
    )
    y = PLANT.run(force)
    return recording(np.hstack([force, y + noise * y.std() * rng.standard_normal(y.shape)]))


def band(frf: FrequencyResponse, low: float = 20.0, high: float = 180.0) -> tuple[NDArray, NDArray]:
    keep = (frf.frequency > low) & (frf.frequency < high)
    return keep, PLANT.frf(frf.frequency[keep])


@pytest.mark.parametrize("method", ["h1", "h2", "hv"])
def test_two_references_are_separated(method: str) -> None:
    frf = frf_from_time(random_run(60_000, 0.01), method=method, block=8192)
    keep, truth = band(frf)
    assert frf.H.shape[1:] == (3, 2) and frf.quantity == "displacement"
    assert np.linalg.norm(frf.H[keep] - truth) < 0.04 * np.linalg.norm(truth)


def test_variance_of_h1_is_the_scatter_found_over_many_runs() -> None:
    estimates, variances = [], []
    for seed in range(40):
        frf = frf_from_time(random_run(8192, 0.3, seed), block=1024)
        keep, _ = band(frf, 30.0, 170.0)
        assert frf.variance is not None
        estimates.append(frf.H[keep])
        variances.append(frf.variance[keep])
    scatter = np.var(np.array(estimates), axis=0, ddof=1)
    assert np.median(scatter / np.mean(variances, axis=0)) == pytest.approx(1.0, abs=0.12)


def test_local_polynomial_removes_leakage_and_the_start_from_rest() -> None:
    run = random_run(30_000, 0.0)
    frf = frf_from_time(run, method="lpm")
    keep, truth = band(frf)
    error = np.linalg.norm(frf.H[keep] - truth) / np.linalg.norm(truth)
    blocks = frf_from_time(run, block=4096)
    kept, coarse = band(blocks)
    assert error < 3e-4
    assert np.linalg.norm(blocks.H[kept] - coarse) / np.linalg.norm(coarse) > 50.0 * error
    noisy = local_polynomial(random_run(30_000, 0.05), band=(20.0, 180.0))
    assert noisy.variance is not None
    ratio = np.abs(noisy.H - PLANT.frf(noisy.frequency)) ** 2 / noisy.variance
    # eight residual degrees of freedom: F(2, 16) has mean 8/7
    assert np.mean(ratio) == pytest.approx(8.0 / 7.0, abs=0.12)


def test_modes_from_one_run_that_starts_from_rest() -> None:
    modes = identify_modes(
        frf_from_time(random_run(30_000, 0.02), method="lpm"), band=(20.0, 180.0)
    )
    A = PLANT.discrete[0]
    poles = np.log(np.linalg.eigvals(A).astype(complex)) * RATE
    poles = poles[poles.imag > 0]
    poles = poles[np.argsort(np.abs(poles))]
    assert np.all(
        np.abs(modes.frequency - np.abs(poles) / (2 * np.pi)) < 4.0 * modes.frequency_std + 1e-4
    )
    assert np.all(
        np.abs(modes.damping + poles.real / np.abs(poles)) < 4.0 * modes.damping_std + 1e-5
    )


def test_noise_on_the_force_biases_h1_down_and_h2_not() -> None:
    rng = np.random.default_rng(1)
    x = rng.standard_normal(400_000)
    data = np.stack([x + 0.5 * rng.standard_normal(x.size), 3.0 * x], axis=1)
    run = recording(data, (Channel(1, "x", "force"), Channel(1, "x", "velocity")))
    size = {
        m: float(np.mean(np.abs(frf_from_time(run, method=m, block=512).H)))
        for m in ("h1", "h2", "hv")
    }
    assert size["h1"] == pytest.approx(3.0 / 1.25, rel=0.01)
    assert size["h2"] == pytest.approx(3.0, rel=0.01)
    assert size["hv"] == pytest.approx(3.0 / np.sqrt(1.25), rel=0.01)


def test_hv_is_the_geometric_mean_for_one_reference() -> None:
    run = random_run(20_000, 0.2)
    one = recording(run.data[:, [0, 2]], (CHANNELS[0], CHANNELS[2]))
    h1, h2, hv = (frf_from_time(one, method=m, block=1024).H for m in ("h1", "h2", "hv"))
    assert hv == pytest.approx(np.sqrt(np.abs(h1 * h2)) * np.exp(1j * np.angle(h1)), rel=1e-8)


def test_coherences() -> None:
    spectra = spectra_from_time(random_run(60_000, 0.0), block=8192)
    keep = (spectra.frequency > 20.0) & (spectra.frequency < 180.0)
    multiple, ordinary = multiple_coherence(spectra)[keep], ordinary_coherence(spectra)[keep]
    assert np.median(multiple) > 0.999
    assert np.all(ordinary <= multiple[:, :, None] + 1e-9)
    # uncorrelated inputs: in the mean the ordinary coherences add up to the multiple one
    assert abs(float(np.mean(np.sum(ordinary, axis=2) - multiple))) < 0.08


@given(st.floats(0.05, 0.999), st.floats(2.0, 500.0))
@settings(max_examples=30, deadline=None)
def test_variance_from_coherence_is_bendat_and_piersol(gamma: float, averages: float) -> None:
    H = np.array([[[2.0 - 1.0j]]])
    variance = variance_from_coherence(H, np.array([[gamma]]), averages)
    assert variance[0, 0, 0] == pytest.approx(5.0 * (1 - gamma) / (gamma * (averages - 1)))
    with pytest.raises(RecordingError, match="at least 2 averages; got 1"):
        variance_from_coherence(H, np.array([[gamma]]), 1.0)
    with pytest.raises(RecordingError, match="outside"):
        variance_from_coherence(H, np.array([[1.2]]), averages)


def test_effective_averages() -> None:
    hann = window("hann", 256)
    assert effective_averages(hann, 256, 17) == pytest.approx(17.0)
    # Welch 1967: a Hann window at half overlap loses a factor 1 + 2 / 36
    assert effective_averages(hann, 128, 2000) == pytest.approx(2000 / (1 + 2 / 36), rel=1e-3)
    with pytest.raises(RecordingError, match="hann"):
        window("haning", 8)


def test_impacts_with_force_and_exponential_window() -> None:
    rng = np.random.default_rng(3)
    block, hits, decay = 2048, 6, 6.0
    force = np.zeros((block * hits, 2))
    for k in range(hits):
        force[k * block + 40 : k * block + 46, 0] = np.hanning(8)[1:-1] * (
            1.0 + 0.1 * rng.standard_normal()
        )
    # each hit on a structure at rest
    y = np.concatenate([PLANT.run(force[k * block : (k + 1) * block]) for k in range(hits)])
    data = np.hstack(
        [
            force[:, :1] + 1e-4 * rng.standard_normal((block * hits, 1)),
            y + 1e-3 * y.std() * rng.standard_normal(y.shape),
        ]
    )
    run = recording(data, (CHANNELS[0], *CHANNELS[2:]))
    assert find_impacts(data[:, 0], block=1500, pretrigger=20).size == hits
    frf = frf_from_impacts(run, block=1500, pretrigger=20, force_width=0.02, decay=decay)
    modes = identify_modes(frf, band=(20.0, 180.0), added_decay=decay)
    raw = identify_modes(frf, band=(20.0, 180.0))
    poles = np.log(np.linalg.eigvals(PLANT.discrete[0]).astype(complex)) * RATE
    truth = np.sort_complex(1j * poles[poles.imag > 0]).imag[::-1]
    assert modes.frequency.size == 3
    assert np.sort(modes.poles.real) == pytest.approx(np.sort(truth), rel=0.03)
    assert raw.poles.real + decay == pytest.approx(modes.poles.real, rel=1e-9)
    with pytest.raises(RecordingError, match="no impact"):
        frf_from_impacts(run, block=20_000)


def test_exponential_window_is_exact_for_a_run_from_rest() -> None:
    run = random_run(6000, 0.0)
    decay = 4.0
    # both references in one record cannot be told apart by one block: keep one
    y = PLANT.run(np.column_stack([run.data[:, 0], np.zeros(6000)]))
    single = recording(np.column_stack([run.data[:, 0], y]), (CHANNELS[0], *CHANNELS[2:]))
    frf = frf_from_time(
        single, window="rectangular", block=6000, overlap=0.0, decay=decay, from_rest=True
    )
    f = frf.frequency[(frf.frequency > 30) & (frf.frequency < 170)]
    A, B, C, D, _ = PLANT.discrete
    z = np.exp((decay + 2j * np.pi * f) / RATE)
    shifted = np.array([C @ np.linalg.solve(v * np.eye(6) - A, B) + D for v in z])[:, :, :1]
    H = frf.H[(frf.frequency > 30) & (frf.frequency < 170)]
    # what is left is the tail cut off at the end, exp(-decay T) of it
    assert np.linalg.norm(H - shifted) / np.linalg.norm(shifted) < 1e-6
    assert frf.variance is None


def test_stream_in_any_chunks_gives_the_same_spectra_and_little_memory() -> None:
    run = random_run(20_000, 0.1)
    whole = spectra_from_chunks([run.data], RATE, 2, block=512)
    rng = np.random.default_rng(0)
    cuts = np.sort(rng.choice(np.arange(1, 20_000), 40, replace=False))
    pieces = spectra_from_chunks(np.split(run.data, cuts), RATE, 2, block=512)
    assert pieces.Syx == pytest.approx(whole.Syx, rel=1e-9, abs=1e-9 * np.abs(whole.Syx).max())
    assert pieces.averages == whole.averages

    def chunks() -> Iterator[NDArray]:
        for seed in range(40):
            yield np.random.default_rng(seed).standard_normal((100_000, 5))

    seen: list[int] = []
    tracemalloc.start()
    long = spectra_from_chunks(
        chunks(), RATE, 2, block=4096, progress=lambda done, total: seen.append(done)
    )
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    # 160 MB of samples went through
    assert peak < 60e6 + 16 * 2049 * 20
    assert seen == sorted(seen) and seen[-1] == (4_000_000 - 4096) // 2048 + 1
    assert np.max(np.abs(long.Syx[5:])) < 0.2 * np.max(np.abs(long.Sxx))


def test_memory_mapped_history(tmp_path: object) -> None:
    run = random_run(8192, 0.1)
    path = f"{tmp_path}/run.npy"
    np.save(path, run.data)
    mapped = TimeHistory(run.origin, RATE, CHANNELS, np.load(path, mmap_mode="r"))
    assert pytest.approx(frf_from_time(run, block=1024).H) == frf_from_time(mapped, block=1024).H


def test_conversion_of_quantity() -> None:
    frf = frf_from_time(random_run(16_384, 0.1), block=1024)
    there = convert(frf, "acceleration")
    back = convert(there, "receptance")
    assert frf.variance is not None and there.variance is not None and back.variance is not None
    assert pytest.approx(-((2 * np.pi * frf.frequency[:, None, None]) ** 2) * frf.H) == there.H
    assert pytest.approx(frf.H) == back.H and back.variance == pytest.approx(frf.variance)
    # the relative deviation does not change
    assert there.variance / np.abs(there.H) ** 2 == pytest.approx(frf.variance / np.abs(frf.H) ** 2)
    assert {c.quantity for c in there.responses} == {"acceleration"}
    with pytest.raises(RecordingError, match="not a motion"):
        convert(frf, "strain")


def test_transmissibility_and_output_only() -> None:
    rng = np.random.default_rng(5)
    y = rng.standard_normal((50_000, 1))
    data = np.hstack([y, 2.0 * y, rng.standard_normal(y.shape)])
    run = recording(data, tuple(Channel(k, "x", "acceleration") for k in (1, 2, 3)))
    T = transmissibility(run, 0, block=1024)
    assert T.H[:, 0, 0] == pytest.approx(np.full(T.frequency.size, 2.0), rel=1e-9)
    assert T.references[0].quantity == "acceleration"
    density = output_spectra(run, block=1024)
    # Parseval: the one-sided densities add up to the mean squares
    power = np.sum(np.real(np.einsum("fii->fi", density.density)), axis=0) * RATE / 1024
    assert power == pytest.approx(np.mean(data**2, axis=0), rel=0.02)
    assert np.min(density.singular_values()) > -1e-12
    assert density.variance().shape == density.density.shape
    with pytest.raises(RecordingError, match="no force channel"):
        frf_from_time(run)


def test_messages() -> None:
    run = random_run(4096, 0.1)
    with pytest.raises(RecordingError, match="shorter block"):
        frf_from_time(run, block=8192)
    with pytest.raises(RecordingError, match="h1, h2, hv"):
        frf_from_time(run, method="h3", block=512)
    copied = recording(run.data[:, [0, 0, 2, 3, 4]])
    with pytest.raises(RecordingError, match="copies of one another"):
        frf_from_time(copied, block=512)
    broken = run.data.copy()
    broken[100, 3] = np.nan
    with pytest.raises(RecordingError, match="NaN"):
        frf_from_time(recording(broken), block=512)
    mixed = (*CHANNELS[:3], Channel(2, "x", "velocity"), Channel(3, "x", "acceleration"))
    with pytest.raises(RecordingError, match="several quantities"):
        frf_from_time(recording(run.data, mixed), block=512)
    assert frf_from_time(recording(run.data, mixed), block=512, quantity="velocity").H.shape[1] == 1
