"""Recordings as a test laboratory hands them over: FRFs with coherence, tables of modes."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.rigs.cases import Case
from validation.rigs.drawing import Generator
from validation.rigs.response import Modal

CODES = {"x": 1, "y": 2, "z": 3, "rx": 4, "ry": 5, "rz": 6}
MAINS = 50.0  # Hz; its line stands in the responses
DAMPING = 0.1  # relative deviation of a damping in a table


def frf(
    rng: Generator, m: Modal, case: Case, drive: tuple[int, str], gain: float
) -> dict[str, NDArray[Any]]:
    """H1 accelerance and coherence from so many averages, line by line.

    The force falls with frequency, as a hammer's does; accelerometers are worse at low frequency;
    the mains add a line. Sensors are off by their gains, the force channel reads ``gain`` times the
    force.
    """
    slow = float(np.min(m.zeta[:8])) * max(case.low, 0.05 * case.top)
    step = float(np.clip(1.2 * slow, case.top / 2400.0, case.top / 700.0))
    f = np.arange(max(case.low, step), case.top, step).astype(np.float32).astype(float)
    H = m.accelerance(f, case.sensors, drive) * np.array(case.gains) / gain
    averages = int(rng.integers(5, 40))
    force = np.exp(-0.8 * (f / case.top) ** 2)
    level = np.sqrt(np.mean(np.abs(H) ** 2, axis=0))  # of each channel
    noise = case.noise * np.sqrt(averages) * level / force[:, None]
    noise *= np.sqrt(1.0 + 4.0 * case.low / f)[:, None]
    noise[np.abs(f - MAINS) < step] *= 5.0

    def white(*shape: int) -> NDArray[np.complex128]:
        parts = rng.standard_normal(shape) + 1j * rng.standard_normal(shape)
        return np.asarray(parts / np.sqrt(2.0))

    X = white(averages, len(f))
    Y = H.T[:, None, :] * X + noise.T[:, None, :] * white(H.shape[1], averages, len(f))
    Sxx = np.sum(np.abs(X) ** 2, axis=0)
    Syx, Syy = np.sum(Y * np.conj(X), axis=1), np.sum(np.abs(Y) ** 2, axis=1)
    return {
        "frequency": f.astype(np.float32),
        "H": (Syx / Sxx).T[:, :, None].astype(np.complex64),
        "coherence": (np.abs(Syx) ** 2 / (Sxx * Syy)).T[:, :, None].astype(np.float32),
        "response_node": np.array([n for n, _ in case.sensors]),
        "response_dof": np.array([CODES[d] for _, d in case.sensors]),
        "reference_node": np.array([drive[0]]),
        "reference_dof": np.array([CODES[drive[1]]]),
        "averages": np.array(averages),
    }


def table(rng: Generator, m: Modal, case: Case) -> list[dict[str, Any]]:
    """Modes in the band: frequency, damping and shape at the sensors, with the deviations that the
    identification states."""
    frequency, zeta, shapes = m.damped(case.sensors, case.top)
    shapes = shapes * np.array(case.gains)[:, None]
    rows = []
    for f, z, shape in zip(frequency, zeta, shapes.T, strict=True):
        if f < case.low:
            continue
        shape = shape / shape[np.argmax(np.abs(shape))]
        seen = shape + case.noise * rng.standard_normal(len(shape))
        rows.append(
            {
                "frequency": float(f"{f * (1.0 + case.spread * rng.standard_normal()):.7g}"),
                "frequency_std": float(f"{case.spread * f:.3g}"),
                "damping": float(f"{z * np.exp(DAMPING * rng.standard_normal()):.4g}"),
                "damping_std": float(f"{DAMPING * z:.2g}"),
                "shape": [round(float(x), 4) for x in seen],
                "shape_std": float(f"{case.noise:.2g}"),
            }
        )
    return rows
