"""Explanations of time histories with laws that depend on the level: what another level, a further
sensor or another drive would tell, by simulation.

Unlike linear effects these have no column that is the same at every size. So each explanation is
marched under what is to come, with its derivatives there, and what remains of another one's
prediction is what no refit of its own unknowns, on old and new rows together, takes up.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.apart.foretold import diverse
from cvxupdate.diagnose.apart.measurement import Measurement
from cvxupdate.diagnose.apart.worth import (
    gap_of,
    likelihoods,
    others_listed,
    separations_of,
    still_listed,
)
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.motion.apart import LOUDER
from cvxupdate.diagnose.motion.evidence import MotionEvidence
from cvxupdate.diagnose.motion.runs import Run
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError

SENSORS = 24  # places tried for a further sensor
DRIVES = 4  # and for another drive: each is one more march of every explanation


@dataclass(frozen=True)
class Rows:
    """Of each explanation what it foretells (explanations, rows) and its weighted derivatives, in
    deviations of the rows."""

    values: Real
    columns: tuple[Real, ...]

    def of(self, some: np.ndarray) -> Rows:
        """Some rows only."""
        return Rows(self.values[:, some], tuple(J[some] for J in self.columns))


@dataclass(frozen=True)
class Levels:
    """Fitted ``hypotheses`` on time histories, ``noise`` relative of what is to come (None: that of
    the recordings)."""

    evidence: MotionEvidence
    hypotheses: tuple[Hypothesis, ...]
    noise: float | None

    @cached_property
    def _known(self) -> Rows:
        found = [h.fit.point for h in self.hypotheses]
        weights = found[0].differences[1]
        values = np.array([weights * p.differences[0] for p in found])
        return Rows(values, tuple(weights[:, None] * p.jacobian() for p in found))

    @cached_property
    def _run(self) -> Run:
        """The loudest that was fitted, of equals the first."""
        names = dict.fromkeys(s.name for s in self._signals(None))
        return max((self.evidence.runs[n] for n in names), key=lambda r: r.level)

    def _signals(self, run: Run | None) -> tuple[Signal, ...]:
        """Of a run (None: of all), sharp."""
        every: tuple[Signal, ...] = self.evidence.stages[-1]
        return tuple(s for s in every if run is None or s.name == run.name)

    def found(self) -> list[Measurement]:
        """All that was tried."""
        run = self._run
        out = [*self._louder(run), *self._elsewhere(run)]
        return [m for m in out if m is not None]

    def _louder(self, run: Run) -> Iterator[Measurement | None]:
        for factor in LOUDER:
            if factor == 1.0:
                continue
            level = f"{run.level * factor:.3g}"
            says = f"the loudest run again with {factor:g} times its force (level {level})"
            rows = self._rows(run, self._signals(run), factor)
            yield self._told(rows, Measurement("level", says, (), factor=factor))

    def _elsewhere(self, run: Run) -> Iterator[Measurement | None]:
        """Another sensor under the loudest run's force, and that force at another place."""
        model, base = self.evidence.model, self.hypotheses[0].fit.point
        first = self._signals(run)[0]
        places = np.flatnonzero(model.dof_kind < 3)
        known = {x for s in self._signals(run) for x in s.sensors}
        some = [model.labels[i] for i in diverse(base.modes.shapes, places, SENSORS)]
        new = [x for x in some if x not in known]
        if new:
            rows = self._rows(run, [_heard(first, new)], 1.0)
            count = len(first.s)
            for k, x in enumerate(new):
                own = np.arange(2 * count * len(new)) % len(new) == k
                drive = ", ".join(run.inputs)
                says = f"the response at {x} to the same force at {drive}"
                bare = Measurement("response", says, (), x, run.inputs[0])
                yield None if rows is None else self._told(rows.of(own), bare)
        if len(run.inputs) != 1:
            return
        drives = [model.labels[i] for i in diverse(base.modes.shapes, places, DRIVES + 1)]
        for at in [d for d in drives if d not in run.inputs][:DRIVES]:
            moved = [replace(s, inputs=(at,)) for s in self._signals(run)]
            rows = self._rows(replace(run, inputs=(at,)), moved, 1.0)
            says = f"the same responses to the same force at {at}"
            yield self._told(rows, Measurement("response", says, (), "", at))

    def _rows(self, run: Run, signals: Sequence[Signal], factor: float) -> Rows | None:
        """What every explanation foretells of signals under ``factor`` times the force of a run;
        None where one is no structure there, or moves beyond all bounds."""
        louder = replace(run, force=factor * run.force)
        asked = [replace(s, U=factor * s.U) for s in signals]
        try:
            points = []
            for h in self.hypotheses:
                setting = h.fit.setting.on(asked)
                setting = replace(setting, runs={**setting.runs, run.name: louder})
                points.append(setting.evaluate(h.fit.p))
            seen = [p.modelled() for p in points]
            columns = [p.jacobian() for p in points]
        except CvxupdateError:
            return None
        values, weights = [], []
        for k, s in enumerate(asked):
            Y = np.array([found[k] for found in seen])
            weight = 1.0 / self._deviation(s, np.sqrt(np.mean(np.abs(Y) ** 2, axis=0)))
            weights.append(np.concatenate([weight.reshape(-1)] * 2))
            flat = Y.reshape(len(Y), -1)
            values.append(np.concatenate([flat.real, flat.imag], axis=1))
        w = np.concatenate(weights)
        return Rows(w * np.concatenate(values, axis=1), tuple(w[:, None] * J for J in columns))

    def _deviation(self, s: Signal, size: Real) -> Real:
        """Of each row of responses of a ``size``: noise of the recording, which is the same at any
        level, or a stated part of the response; and what a sound model may miss."""
        std = s.std if self.noise is None else self.noise * size
        there = replace(s, Y=size.astype(complex), std=np.broadcast_to(std, size.shape))
        return there.scale()

    def _told(self, rows: Rows | None, bare: Measurement) -> Measurement | None:
        """With its figures."""
        if rows is None:
            return None
        known, n = self._known, len(self.hypotheses)
        fits = [h.fit for h in self.hypotheses]
        best = min(fits, key=lambda f: f.misfit)
        count = float(known.values.shape[1] + rows.values.shape[1])
        channels = 1 if bare.sensor else sum(len(s.sensors) for s in self._signals(self._run))
        figures = min(count, best.independent + channels)
        gaps = np.zeros((n, n))
        for j, h in enumerate(self.hypotheses):
            J, K = known.columns[j], rows.columns[j]
            inner = J.T @ J + K.T @ K + np.diag(1.0 / h.fit.setting.scales**2)
            for i in range(n):
                old, new = (r.values[j] - r.values[i] for r in (known, rows))
                heard = J.T @ old + K.T @ new
                rest = float(old @ old + new @ new - heard @ np.linalg.solve(inner, heard))
                gaps[i, j] = gap_of(np.asarray(max(rest, 0.0)), count, best.misfit, figures)
        unknowns = np.array([float(h.unknowns) for h in self.hypotheses])
        misfits = np.array([f.misfit for f in fits])
        likely = likelihoods(misfits, unknowns, best.independent, best.misfit)
        left = others_listed(still_listed(gaps, unknowns, figures), likely)
        return replace(bare, separations=tuple(separations_of(gaps)), left=left)


def _heard(s: Signal, sensors: Sequence[str]) -> Signal:
    """The signal of other sensors, each with the median noise of those there are."""
    shape = (len(s.s), len(sensors), s.Y.shape[2])
    std = np.broadcast_to(np.median(s.std, axis=1, keepdims=True), shape)
    nothing = np.zeros(shape, dtype=np.complex128)
    return replace(s, sensors=tuple(sensors), Y=nothing, std=std, missed=None)
