"""What a diagnosis shows beside its numbers: responses before and after, what remains against
noise, and where on the structure a cause may sit.

`responses_shown` and `modes_shown` make a `Shown` from the points that the verdict compares; it
travels in `Diagnosis.shown` to the page and is not part of diagnosis.json.
"""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.diagnose.residual import ResponsePoint
from cvxupdate.diagnose.signals import Complex, Real, Signal
from cvxupdate.physics.effect import Effect

if TYPE_CHECKING:
    from cvxupdate.residual.modal import ModalPoint

POINTS = 600  # of a curve at most: of each stretch its highest and its lowest
BINS = 120  # of a spectrum of what remains
HELD, FITTED = 3, 2  # curves of held-out and of fitted recordings at most
QUANTITIES = ("displacement", "velocity", "acceleration")


@dataclass(frozen=True)
class Curve:
    """One channel: magnitudes (n,) at ``frequency`` (Hz) as measured, modelled before and after,
    and its noise (one standard deviation).

    ``driven`` are the DOFs of the force (one for an FRF); ``per_force`` says that it is an FRF (SI
    per N), else the spectrum of the response (SI s).
    """

    recording: str
    use: str
    sensor: str
    driven: tuple[str, ...]
    quantity: str
    per_force: bool
    frequency: Real
    measured: Real
    before: Real
    after: Real
    noise: Real


@dataclass(frozen=True)
class Spectrum:
    """What remains of all channels of the recordings of one ``use``, each relative to its own
    r.m.s., in bins of ``frequency`` (Hz)."""

    use: str
    frequency: Real
    before: Real
    after: Real
    noise: Real


@dataclass(frozen=True)
class ModeError:
    """A measured mode (Hz) and the model's error before and after, as fractions; NaN where no mode
    of the model belongs to it."""

    frequency: float
    use: str
    before: float
    after: float


@dataclass(frozen=True)
class Shown:
    """Everything to be drawn; ``nodes`` and ``elements`` → the share of the mismatch that the best
    word there could explain, to first order."""

    curves: tuple[Curve, ...] = ()
    spectra: tuple[Spectrum, ...] = ()
    modes: tuple[ModeError, ...] = ()
    nodes: dict[int, float] = field(default_factory=dict)
    elements: dict[int, float] = field(default_factory=dict)


def responses_shown(
    before: ResponsePoint,
    after: ResponsePoint,
    fitted: Sequence[Signal],
    held: Sequence[Signal],
    shares: Iterable[tuple[Effect, float]] = (),
) -> Shown:
    """From the model as it was, the model as found (or as ordinary parameters leave it), sharp
    signals, and candidates with their shares.

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
        pairs = [_modelled(point, signals) for point in (before, after)]
        every = [c for k, s in enumerate(signals) for c in _curves(s, pairs[0][k], pairs[1][k])]
        curves += [c for _, c in sorted(every, key=lambda item: -item[0])[:most]]
        spectra += [s for s in [_spectrum(signals, *pairs)] if len(s.frequency)]
    return Shown(tuple(curves), tuple(spectra), (), *places(shares))


def modes_shown(
    before: ModalPoint, after: ModalPoint, shares: Iterable[tuple[Effect, float]] = ()
) -> Shown:
    """From the comparison with mode tables before and after; both have the same tables."""
    out = []
    for k, table in enumerate(after.residual.tables):
        f, g = (point.frequencies(k) for point in (before, after))
        out += [
            ModeError(float(x), table.origin.use, float(a / x - 1.0), float(b / x - 1.0))
            for x, a, b in zip(table.frequency, f, g, strict=True)
        ]
    return Shown((), (), tuple(out), *places(shares))


def places(shares: Iterable[tuple[Effect, float]]) -> tuple[dict[int, float], dict[int, float]]:
    """The best share at every node and at every element; a set of elements stands for its elements
    only where it is one element."""
    nodes: dict[int, float] = {}
    elements: dict[int, float] = {}
    for c, share in shares:
        if c.fault is not None or not np.isfinite(share) or share <= 0.0:
            continue
        target, ids = (
            (nodes, c.place.nodes)
            if c.place.nodes
            else (elements, c.place.elements if len(c.place.elements) == 1 else ())
        )
        for i in ids:
            target[i] = max(target.get(i, 0.0), float(share))
    return nodes, elements


def _modelled(point: ResponsePoint, signals: Sequence[Signal]) -> tuple[Complex, ...]:
    return replace(point.setting, signals=tuple(signals)).evaluate(point.p, point).modelled()


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
            )
            out.append((float(np.linalg.norm(a - y) - np.linalg.norm(b - y)) / size, curve))
    return out


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
