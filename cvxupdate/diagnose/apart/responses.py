"""What further responses would tell of a question: another sensor, another drive, with their
products (`cvxupdate.diagnose.apart.worth`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.apart.foretold import diverse, foretold
from cvxupdate.diagnose.apart.questions import Question
from cvxupdate.diagnose.apart.worth import Products, Scale
from cvxupdate.diagnose.responses.columns import columns_of
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal

LINES = 60  # over the band; as many again lie on the flanks of its resonances
FLANKS = (-2.0, -1.0, -0.4, 0.4, 1.0, 2.0)  # half-power half-bandwidths from a resonance
DRIVES = 10  # places tried for a further drive
SENSORS = 80  # places tried for a further sensor
EVERYWHERE = 0.1  # part of a stated noise that is everywhere as large as on the average


@dataclass(frozen=True)
class Points:
    """What the explanations share, and each of them; ``places`` (unknowns,) where those of the
    ``base`` as it was fitted stand among its own (-1: nowhere; None: they are the same)."""

    base: ResponsePoint
    members: tuple[ResponsePoint, ...]
    places: NDArray[np.int64] | None = None

    def aligned(self, J: Complex) -> Complex:
        """Derivatives (lines, sensors, own unknowns) as those of the fitted base."""
        if self.places is None:
            return J
        out = J[:, :, np.maximum(self.places, 0)]
        out[:, :, self.places < 0] = 0.0
        return np.asarray(out)


@dataclass(frozen=True)
class Responses:
    """Responses to come at ``lines`` (Hz), ``count`` lines evenly over the band as a recording will
    have them; ``noise`` relative (None: that of the recordings there are)."""

    evidence: ResponseEvidence
    question: Question
    noise: float | None
    lines: Real
    count: int

    @cached_property
    def scale(self) -> Scale:
        """How what is left is weighed."""
        q, point = self.question, self.question.members[0].fit.point
        f, (low, high) = point.modes.frequencies, self.evidence.band
        modes = max(1, int(np.sum((f >= low) & (f <= high))))
        priors = 1.0 / q.base.setting.scales**2
        return Scale(modes, q.misfit, q.likely, q.unknowns, priors)

    @cached_property
    def known(self) -> Products:
        """Of the rows there are."""
        q, base = self.question, self.question.base
        values, weights, _ = base.differences
        A, _ = base.system().weighted()
        moved = [weights * (h.fit.point.differences[0] - values) for h in q.members]
        columns = np.column_stack([A, *moved, *self._sized(base)])
        channels = sum(s.Y.shape[1] * s.Y.shape[2] for s in base.setting.signals)
        return Products(columns.T @ columns, float(len(values)), channels)

    @cached_property
    def points(self) -> Points:
        """On the structure as it is."""
        return Points(self.question.base, tuple(h.fit.point for h in self.question.members))

    @property
    def _order(self) -> int:
        """Of the motion that was measured, as what is to come."""
        return max((s.order for s in self.evidence.data.sharp), default=2)

    @cached_property
    def _flat(self) -> float:
        """Noise of the recordings, a fraction of the r.m.s. response."""
        found = [
            np.sqrt(np.mean(s.std**2) / np.mean(np.abs(s.Y) ** 2))
            for s in self.evidence.data.sharp
            if np.any(s.Y)
        ]
        return float(np.median(found)) if found else 0.0

    def measured(self) -> set[tuple[str, str]]:
        """Pairs (sensor, drive) that were, either way round."""
        d = self.evidence.data
        known = {(a, b) for s in (*d.sharp, *d.sharp_hold_out) for a in s.sensors for b in s.inputs}
        return known | {(b, a) for a, b in known}

    def _sized(self, point: ResponsePoint) -> list[Real]:
        """Weighted columns of the rivals at their sizes."""
        rivals = self.question.rivals
        found = columns_of(point, [s.effect for s in rivals])
        rows = sum(2 * s.Y.size for s in point.setting.signals)
        return [
            np.zeros(rows) if J is None else J @ s.p for J, s in zip(found, rivals, strict=True)
        ]

    def signal(self, sensors: Sequence[str], drive: str) -> Signal:
        """Nothing yet measured of these."""
        s: Complex = np.asarray(2j * np.pi * self.lines, dtype=np.complex128)
        shape = (len(s), len(sensors), 1)
        nothing, unit = np.zeros(shape, dtype=np.complex128), np.ones((len(s), 1, 1), complex)
        return Signal(
            "planned", "fit", None, s, None, nothing, unit, np.zeros(shape), self._order,
            tuple(sensors), (drive,),
        )  # fmt: skip

    def _even(self) -> Real:
        """What each line stands for of a recording whose lines are even, a fraction."""
        ends = np.concatenate([self.lines[:1], 0.5 * (self.lines[1:] + self.lines[:-1])])
        width = np.diff(np.append(ends, self.lines[-1]))
        return np.asarray(width / width.sum())

    def products(self, points: Points, sensors: Sequence[str], drive: str) -> list[Products]:
        """Of the responses of ``sensors`` to a drive, each by itself; rivals have no column but on
        the structure as it is."""
        bare = self.signal(sensors, drive)
        y, J = foretold(points.base, bare)
        seen = [foretold(p, bare)[0] for p in points.members]
        size = np.sqrt(np.mean([np.abs(v) ** 2 for v in seen], axis=0))
        u = self._even()
        around = np.sqrt(np.einsum("l,ls->s", u, size**2))
        if self.noise is None:
            std = np.broadcast_to(self._flat * around, size.shape)
        else:
            std = self.noise * np.sqrt(size**2 + (EVERYWHERE * around) ** 2)
        signal = replace(bare, Y=size[:, :, None].astype(complex), std=std[:, :, None])
        weight = np.sqrt(self.count * u)[:, None] / signal.scale()[:, :, 0]
        moved = [
            weight[:, :, None] * points.aligned(J),
            *((weight * (v - y))[:, :, None] for v in seen),
        ]
        if points.places is None:
            moved += self._rivals(points.base, signal, np.sqrt(self.count * u))
        else:
            moved += [np.zeros((*y.shape, len(self.question.rivals)), dtype=np.complex128)]
        whole = np.where((around > 0.0)[None, :, None], np.concatenate(moved, axis=2), 0.0)
        columns = (np.vstack([c.real, c.imag]) for c in np.moveaxis(whole, 1, 0))
        return [Products(c.T @ c, 2.0 * self.count, 1) for c in columns]

    def _rivals(self, base: ResponsePoint, signal: Signal, even: Real) -> list[Complex]:
        """(lines, sensors, 1) of each, weighted."""
        there = ResponsePoint(base.setting.on([signal]), base.p, base.found, base.owner)
        shape = signal.Y.shape[:2]
        half = shape[0] * shape[1]
        rows = (np.asarray(c[:half] + 1j * c[half:]) for c in self._sized(there))
        return [(even[:, None] * r.reshape(shape))[:, :, None] for r in rows]

    def further(self) -> dict[tuple[str, str], Products]:
        """(sensor, drive) of every response that was not measured: a further sensor, or a further
        drive with the sensors there are."""
        model, known = self.evidence.model, self.measured()
        places = np.flatnonzero(model.dof_kind < 3)
        shapes = self.question.members[0].fit.point.modes.shapes
        some = [model.labels[i] for i in diverse(shapes, places, SENSORS)]
        driven = self.evidence.data.driven
        drives = [model.labels[i] for i in diverse(shapes, places, DRIVES)]
        out: dict[tuple[str, str], Products] = {}
        for drive in (*driven, *(d for d in drives if d not in driven)):
            own = some if drive in driven else [*self.evidence.data.sensors, drive]
            asked = [
                x
                for x in dict.fromkeys(own)
                if x in model.place and (x, drive) not in known and (drive, x) not in out
            ]
            if asked and drive in model.place:
                out |= {
                    (x, drive): found
                    for x, found in zip(
                        asked, self.products(self.points, asked, drive), strict=True
                    )
                }
        return out


def responses_to_come(
    evidence: ResponseEvidence,
    question: Question,
    noise: float | None,
    band: tuple[float, float] | None,
) -> Responses:
    """Lines over the ``band`` (Hz; None: that of the recordings), more of them about resonances."""
    low, high = evidence.band if band is None else band
    even = np.linspace(max(low, 1e-3 * high), high, LINES)
    near = []
    for point in (question.base, *(h.fit.point for h in question.members)):
        f, zeta = point.modes.frequencies, point.damping
        inside = (f > even[0]) & (f < high)
        near += [f[inside] * (1.0 + x * zeta[inside]) for x in FLANKS]
    lines = np.unique(np.concatenate([even, *near]))
    counts = [len(s.s) for s in question.base.setting.signals]
    count = int(np.median(counts)) if counts else LINES
    inside = (lines >= even[0]) & (lines <= high)
    return Responses(evidence, question, noise, lines[inside], count)


def total(parts: Sequence[Products], known: Products) -> Products:
    """Those that are known with further ones."""
    for part in parts:
        known = known + part
    return known
