"""What further responses would tell explanations of responses apart: another sensor, another drive,
the same sensor once more, a known mass put on."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.apart.foretold import diverse, foretold, loaded
from cvxupdate.diagnose.apart.measurement import (
    Measurement,
    pairs_of,
    root_of_covariance,
    separation,
)
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.diagnose.settings import KNOWN_MASS
from cvxupdate.errors import CvxupdateError
from cvxupdate.physics.added_mass import translations

LINES = 60  # over the band; as many again lie on the flanks of its resonances
FLANKS = (-2.0, -1.0, -0.4, 0.4, 1.0, 2.0)  # half-power half-bandwidths from a resonance
DRIVES = 10  # places tried for a further drive
SENSORS = 200  # places tried for a further sensor
MASSES = 16  # places tried for a known mass
EVERYWHERE = 0.1  # part of the noise that is everywhere as large as on the average


@dataclass(frozen=True)
class Responses:
    """Fitted ``hypotheses`` on what was recorded, and responses to come with relative ``noise`` at
    ``lines`` (Hz)."""

    evidence: ResponseEvidence
    hypotheses: tuple[Hypothesis, ...]
    noise: float
    lines: Real

    @cached_property
    def _roots(self) -> list[Real]:
        """Of the covariance of every hypothesis' unknowns."""
        out = []
        for h in self.hypotheses:
            A, _ = h.fit.point.system().weighted()
            share = h.fit.independent / max(1, h.fit.rows)
            out.append(root_of_covariance(A, h.fit.setting.scales, share))
        return out

    @property
    def _order(self) -> int:
        """Of the motion that was measured, as what is to come."""
        return max((s.order for s in self.evidence.data.sharp), default=2)

    def measured(self) -> set[tuple[str, str]]:
        """Pairs (sensor, drive) that were, either way round."""
        d = self.evidence.data
        known = {(a, b) for s in (*d.sharp, *d.sharp_hold_out) for a in s.sensors for b in s.inputs}
        return known | {(b, a) for a, b in known}

    def signal(self, sensors: Sequence[str], drive: str) -> Signal:
        """Nothing yet measured of these."""
        s: Complex = np.asarray(2j * np.pi * self.lines, dtype=np.complex128)
        shape = (len(s), len(sensors), 1)
        return Signal(
            "planned",
            "fit",
            None,
            s,
            None,
            np.zeros(shape, dtype=np.complex128),
            np.ones((len(s), 1, 1), dtype=np.complex128),
            np.zeros(shape),
            self._order,
            tuple(sensors),
            (drive,),
        )

    def separations(
        self,
        points: Sequence[ResponsePoint],
        roots: Sequence[Real],
        sensors: Sequence[str],
        drive: str,
    ) -> list[tuple[float, ...]]:
        """(sensors, pairs) of the responses to a drive, each sensor by itself."""
        signal = self.signal(sensors, drive)
        seen = [foretold(p, signal) for p in points]
        return [
            tuple(
                separation(*self._rows((seen[i], seen[j]), (roots[i], roots[j]), k, points[i]))
                for i, j in pairs_of(len(points))
            )
            for k in range(len(sensors))
        ]

    def rows(self, sensors: Sequence[str], drive: str) -> list[list[tuple[Real, Real]]]:
        """(sensors, pairs) of the responses to a drive: gap and spread as `separation` takes them,
        each response by itself."""
        points, roots = self._points(), self._roots
        seen = [foretold(p, self.signal(sensors, drive)) for p in points]
        return [
            [
                self._rows((seen[i], seen[j]), (roots[i], roots[j]), k, points[i])
                for i, j in pairs_of(len(points))
            ]
            for k in range(len(sensors))
        ]

    def _rows(
        self,
        seen: tuple[tuple[Complex, Complex], tuple[Complex, Complex]],
        roots: tuple[Real, Real],
        k: int,
        point: ResponsePoint,
    ) -> tuple[Real, Real]:
        """Gap and spread of two predictions of one response, in deviations, each row counting as
        much as the response has independent figures."""
        (y, J), (z, I) = ((Y[:, k], D[:, k]) for Y, D in seen)
        size = np.sqrt((np.abs(y) ** 2 + np.abs(z) ** 2) / 2.0)
        around = np.sqrt(np.mean(size**2))
        if around <= 0.0:
            return np.zeros(1), np.zeros((1, len(roots[0].T) + len(roots[1].T)))
        std = self.noise * np.sqrt(size**2 + (EVERYWHERE * around) ** 2)
        lines = size[:, None, None]
        own = replace(self.signal(("",), ""), Y=lines.astype(np.complex128), std=std[:, None, None])
        weight = 1.0 / own.scale()[:, 0, 0]
        gap = weight * (y - z)
        spread = np.hstack([weight[:, None] * J @ roots[0], weight[:, None] * I @ roots[1]])
        rows = 2 * len(gap)
        share = min(1.0, float(point.setting.on([own]).independent(point)) / rows)
        root = np.sqrt(share)
        return (
            root * np.concatenate([gap.real, gap.imag]),
            root * np.vstack([spread.real, spread.imag]),
        )

    def found(self) -> list[Measurement]:
        """All that was tried."""
        return [*self._responses(), *self._repeats(), *self._masses()]

    def _points(self) -> list[ResponsePoint]:
        return [h.fit.point for h in self.hypotheses]

    def _responses(self) -> list[Measurement]:
        """A further sensor, or a further drive with the sensors there are."""
        model = self.evidence.model
        places = np.flatnonzero(model.dof_kind < 3)
        shapes = self.hypotheses[0].fit.point.modes.shapes
        some = diverse(shapes, places, SENSORS)
        driven = self.evidence.data.driven
        known = self.measured()
        further = [
            model.labels[i]
            for i in diverse(shapes, places, DRIVES)
            if model.labels[i] not in driven
        ]
        out = []
        for drive in (*driven, *further):
            sensors = [model.labels[i] for i in some]
            if drive in further:
                sensors = list(dict.fromkeys([*self.evidence.data.sensors, drive]))
            sensors = [x for x in sensors if x in model.place and (x, drive) not in known]
            if not sensors or drive not in model.place:
                continue
            told = self.separations(self._points(), self._roots, sensors, drive)
            for sensor, values in zip(sensors, told, strict=True):
                says = f"the response at {sensor} to a force at {drive}"
                out.append(Measurement("response", says, values, sensor, drive))
        return out

    def _repeats(self) -> list[Measurement]:
        """The same response once more with another transducer: no fault of the first is left."""
        if not any(h.fit.setting.faults for h in self.hypotheses):
            return []
        faulty = {x for h in self.hypotheses for f in h.fit.setting.faults for x in f.labels}
        points, roots = [], []
        for h, root in zip(self.hypotheses, self._roots, strict=True):
            p = h.fit.point
            n = len(p.p) - len(p.setting.faults)
            points.append(replace(p, setting=replace(p.setting, faults=()), p=p.p[:n]))
            roots.append(root[:n])
        out = []
        for s in self.evidence.data.sharp:
            for sensor in s.sensors:
                if sensor not in faulty and not faulty & set(s.inputs):
                    continue
                for drive in s.inputs:
                    told = self.separations(points, roots, (sensor,), drive)[0]
                    says = f"the response at {sensor} to a force at {drive} with other transducers"
                    out.append(Measurement("repeat", says, told, sensor, drive))
        return out

    def _masses(self) -> list[Measurement]:
        """A known mass at a node, the best of the responses that were measured taken again."""
        model = self.evidence.model
        whole = model.total_mass()
        nodes = translations(model)
        if whole <= 0.0 or not nodes:
            return []
        shapes = self.hypotheses[0].fit.point.modes.shapes
        moving = np.array(sorted(row for rows in nodes.values() for row in rows))
        at = {row: node for node, rows in nodes.items() for row in rows}
        chosen = dict.fromkeys(at[int(row)] for row in diverse(shapes, moving, 3 * MASSES))
        out = []
        for node in list(chosen)[:MASSES]:
            best = self._with_mass(node, KNOWN_MASS * whole)
            out += [] if best is None else [best]
        return out

    def _with_mass(self, node: int, mass: float) -> Measurement | None:
        try:
            heavy = [
                loaded(self.evidence, h, root, node, mass)
                for h, root in zip(self.hypotheses, self._roots, strict=True)
            ]
        except CvxupdateError:
            return None
        points, roots = [p for p, _ in heavy], [r for _, r in heavy]
        best: Measurement | None = None
        for drive in self.evidence.data.driven:
            sensors = [
                x
                for s in self.evidence.data.sharp
                if drive in s.inputs
                for x in s.sensors
                if x in self.evidence.model.place
            ]
            sensors = list(dict.fromkeys(sensors))
            if drive not in self.evidence.model.place or not sensors:
                continue
            told = self.separations(points, roots, sensors, drive)
            for sensor, values in zip(sensors, told, strict=True):
                says = (
                    f"the response at {sensor} to a force at {drive} with a known mass of "
                    f"{mass:.3g} kg at node {node}"
                )
                now = Measurement("mass", says, values, sensor, drive, node, mass)
                best = now if best is None or now.rank > best.rank else best
        return best


def responses_to_come(
    evidence: ResponseEvidence,
    hypotheses: Sequence[Hypothesis],
    noise: float,
    band: tuple[float, float] | None,
) -> Responses:
    """Lines over the ``band`` (Hz; None: that of the recordings), more of them about resonances."""
    low, high = evidence.band if band is None else band
    even = np.linspace(max(low, 1e-3 * high), high, LINES)
    near = []
    for h in hypotheses:
        point = h.fit.point
        f, zeta = point.modes.frequencies, point.damping
        inside = (f > even[0]) & (f < high)
        near += [f[inside] * (1.0 + x * zeta[inside]) for x in FLANKS]
    lines = np.unique(np.concatenate([even, *near]))
    return Responses(
        evidence, tuple(hypotheses), noise, lines[(lines >= even[0]) & (lines <= high)]
    )
