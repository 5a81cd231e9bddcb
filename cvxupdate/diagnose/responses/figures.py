"""What the page draws of responses."""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.responses.errors import on_signals
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.diagnose.shown import Curve, Shown, Spectrum, places
from cvxupdate.physics.effect import Effect

POINTS = 600  # of a curve at most: of each stretch its highest and its lowest
BINS = 120  # of a spectrum of what remains
HELD, FITTED = 3, 2  # curves of held-out and of fitted recordings at most
QUANTITIES = ("displacement", "velocity", "acceleration")


def responses_shown(
    before: ResponsePoint,
    after: ResponsePoint,
    fitted: Sequence[Signal],
    held: Sequence[Signal],
    scores: Sequence[tuple[Effect, float]] = (),
) -> Shown:
    """From the model as it was, the model as found (or as nuisance parameters leave it), sharp
    signals, and effects with their explained fractions.

    Raises
    ------
    ModelError
        When a model is no structure at its point.
    """
    curves: list[Curve] = []
    spectra: list[Spectrum] = []
    for signals, most in ((held, HELD), (fitted, FITTED)):
        if not signals:
            continue
        pairs = [on_signals(point, signals).modelled() for point in (before, after)]
        every = [c for k, s in enumerate(signals) for c in _curves(s, pairs[0][k], pairs[1][k])]
        curves += [c for _, c in sorted(every, key=lambda item: -item[0])[:most]]
        spectra += [s for s in [_spectrum(signals, *pairs)] if len(s.frequency)]
    return Shown(tuple(curves), tuple(spectra), (), *places(scores))


def _curves(signal: Signal, before: Complex, after: Complex) -> list[tuple[float, Curve]]:
    """(how much the error fell, curve) of every channel that stands above its noise."""
    out = []
    frequency = signal.s.imag / (2.0 * np.pi)
    single = signal.U.shape[1] == signal.U.shape[2] and bool(
        np.allclose(signal.U, np.eye(signal.U.shape[1]))
    )
    for i in np.flatnonzero(signal.audible()).tolist():
        for case in range(signal.Y.shape[2]):
            y, a, b = signal.Y[:, i, case], before[:, i, case], after[:, i, case]
            size = float(np.linalg.norm(y))
            if size == 0.0:
                continue
            keep = extremes(np.abs(y), POINTS)
            driven = (signal.inputs[case],) if single else signal.inputs
            curve = Curve(
                signal.name,
                signal.use,
                signal.sensors[i],
                driven,
                QUANTITIES[signal.order],
                single,
                frequency[keep],
                np.abs(y)[keep],
                np.abs(a)[keep],
                np.abs(b)[keep],
                signal.std[keep, i, case],
                (_degrees(y[keep]), _degrees(a[keep]), _degrees(b[keep])),
            )
            out.append((float(np.linalg.norm(a - y) - np.linalg.norm(b - y)) / size, curve))
    return out


def _degrees(values: Complex) -> Real:
    return np.asarray(np.degrees(np.angle(values)))


def extremes(values: Real, most: int) -> np.ndarray:
    """Places of at most ``most`` values: the largest and the smallest of each stretch, so that
    peaks and dips stay."""
    n = len(values)
    if n <= most:
        return np.arange(n)
    edges = np.linspace(0, n, most // 2 + 1).astype(np.int64)
    found = {
        int(a + pick(values[a:b]))
        for a, b in itertools.pairwise(edges)
        if b > a
        for pick in (np.argmax, np.argmin)
    }
    return np.array(sorted(found), dtype=np.int64)


def _spectrum(
    signals: Sequence[Signal], before: Sequence[Complex], after: Sequence[Complex]
) -> Spectrum:
    """R.m.s. over channels and lines in each bin."""
    f = [s.s.imag / (2.0 * np.pi) for s in signals]
    low, high = min(float(x.min()) for x in f), max(float(x.max()) for x in f)
    count = min(BINS, max(len(x) for x in f))
    edges = np.linspace(low, high * (1.0 + 1e-12), count + 1)
    sums, lines = np.zeros((3, count)), np.zeros(count)
    for signal, x, a, b in zip(signals, f, before, after, strict=True):
        size = np.sqrt(np.mean(np.abs(signal.Y) ** 2, axis=0))
        heard = signal.audible()[:, None] & (size > 0.0)
        where = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, count - 1)
        for k, gap in enumerate((np.abs(a - signal.Y), np.abs(b - signal.Y), signal.std)):
            relative = np.where(heard, gap / np.where(size > 0.0, size, 1.0), 0.0)
            np.add.at(sums[k], where, np.sum(relative**2, axis=(1, 2)))
        np.add.at(lines, where, float(heard.sum()))
    full = lines > 0
    left, right, noise = np.sqrt(sums[:, full] / lines[full])
    return Spectrum(signals[0].use, ((edges[:-1] + edges[1:]) / 2.0)[full], left, right, noise)
