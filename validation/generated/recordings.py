"""Recordings of the structure on the bench: FRFs, runs from rest, tables of modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.generated.cases import Case, exchanged, faults, lowest
from validation.generated.drawings import Generator, between, figures
from validation.generated.laboratory import Modal

CODES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}


def frf(rng: Generator, m: Modal, case: Case, drive: tuple[int, str]) -> dict[str, np.ndarray]:
    """H1 accelerance and coherence from so many averages, line by line, under white excitation;
    noise on the responses."""
    low = 0.4 * lowest(m, case)
    zeta = float(np.min(m.damped()[1]))
    step = max(
        2.0 * zeta * low, case.top / 6000.0
    )  # low is 0.4 of the first frequency: 1.25 half-power bandwidths hold one line at worst
    f = np.arange(max(low, step), case.top, step).astype(np.float32).astype(float)
    H = m.accelerance(2j * np.pi * f, m.rows(case.sensors), m.rows([drive]))[:, :, 0][
        :, exchanged(case)
    ] * faults(case, 2j * np.pi * f)
    averages = int(rng.integers(10, 60))
    noise = case.noise * np.sqrt(np.mean(np.abs(H) ** 2)) * np.sqrt(averages)
    shape = (averages, len(f))
    X = (rng.standard_normal(shape) + 1j * rng.standard_normal(shape)) / np.sqrt(2.0)
    Sxx = np.sum(np.abs(X) ** 2, axis=0)
    out, coherence = np.empty(H.shape, dtype=np.complex64), np.empty(H.shape, dtype=np.float32)
    for s in range(H.shape[1]):
        Y = H[:, s] * X + noise * (
            rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
        ) / np.sqrt(2.0)
        Syx, Syy = np.sum(Y * np.conj(X), axis=0), np.sum(np.abs(Y) ** 2, axis=0)
        out[:, s], coherence[:, s] = Syx / Sxx, np.abs(Syx) ** 2 / (Sxx * Syy)
    return {
        "frequency": f.astype(np.float32),
        "H": out[:, :, None],
        "coherence": coherence[:, :, None],
        "response_node": np.array([n for n, _ in case.sensors]),
        "response_dof": np.array([CODES[d] for _, d in case.sensors]),
        "reference_node": np.array([drive[0]]),
        "reference_dof": np.array([CODES[drive[1]]]),
        "averages": np.array(averages),
    }


def history(
    rng: Generator, m: Modal, case: Case, drive: tuple[int, str]
) -> tuple[np.ndarray, float]:
    """(samples x channels, rate): a random force with smooth ends in the band, accelerations with
    noise and 16-bit steps."""
    rate = figures(2.56 * case.top, 4)
    first = lowest(m, case)
    need = 1.5 * rate / (case.design.eta * first)  # the record is as long as the slowest mode rings
    n = next((size for size in (4096, 6144, 8192, 12288) if size >= need), 16384)
    f = np.fft.rfftfreq(n, 1.0 / rate)
    inside = (f > 0.3 * first) & (f < case.top)
    force = np.fft.irfft(inside * np.exp(2j * np.pi * rng.random(len(f))), n)
    ramp = np.minimum(1.0, np.minimum(np.arange(n), np.arange(n)[::-1]) / (0.02 * n))
    force *= np.sin(0.5 * np.pi * ramp) ** 2
    force *= between(rng, 1.0, 20.0) / np.std(force)
    a = m.run(force, rate, m.rows(case.sensors), m.rows([drive])[0])[:, exchanged(case)]
    late = np.fft.irfft(np.fft.rfft(a, axis=0) * faults(case, 2j * np.pi * f), n, axis=0)
    data = np.column_stack([force, late])
    level = case.noise * np.sqrt(np.mean(a**2))
    data[:, 1:] += level * rng.standard_normal(a.shape)
    data[:, 0] += 0.1 * case.noise * np.std(force) * rng.standard_normal(n)
    steps = np.abs(data).max(axis=0) / 2**15
    return (np.round(data / steps) * steps).astype(np.float32), rate


def table(rng: Generator, m: Modal, case: Case) -> list[dict[str, Any]]:
    """The modes below the band's top: frequency, damping, shape at the sensors, with deviations."""
    frequency, zeta = m.damped()
    rows = []
    for r in np.flatnonzero((frequency < case.top) & (frequency > 0.9 * lowest(m, case))):
        shape = m.shapes[m.rows(case.sensors), r]
        shape = shape / shape[np.argmax(np.abs(shape))]
        spread = 5e-4 * rng.uniform(0.5, 2.0)
        rows.append(
            {
                "frequency": figures(frequency[r] * (1.0 + spread * rng.standard_normal()), 7),
                "frequency_std": figures(spread * frequency[r], 3),
                "damping": figures(zeta[r] * (1.0 + 0.05 * rng.standard_normal()), 4),
                "damping_std": figures(0.05 * zeta[r], 2),
                "shape": [round(float(x + case.noise * rng.standard_normal()), 4) for x in shape],
                "shape_std": figures(case.noise, 2),
            }
        )
    return rows
