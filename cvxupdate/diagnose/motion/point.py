"""Output error of responses with internal forces: marched from rest, then carried to the sensors by
receptances. A residual for the trust-region loop.

The responses of the linear part to recorded and internal forces alike are those of
`cvxupdate.diagnose.responses.point`; so are the derivatives at given internal forces. What the
forces themselves do when an unknown moves is added by differences: every variant is one more column
of the same march.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.motion.guided import guided_motions, guided_rates
from cvxupdate.diagnose.motion.march import Variants, marched
from cvxupdate.diagnose.motion.rates import force_rates
from cvxupdate.diagnose.motion.runs import Run, heard_of
from cvxupdate.diagnose.nominal.mesh import MeshError
from cvxupdate.diagnose.responses.point import ResponsePoint, ResponseSetting
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.errors import ModelError
from cvxupdate.fe.internal import internal_forces
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import Response, respond, sensor_rows
from cvxupdate.forces import Laws
from cvxupdate.physics.fault import Fault
from cvxupdate.system import LinearSystem

CARRIED = 1.2  # of the sampling rate: modes above follow statically in the march


@dataclass(frozen=True)
class MotionSetting:
    """Like `ResponseSetting`, for a model with internal forces; ``runs`` by the names of the
    signals; ``guided``: forces along the motion that the sensors say."""

    linear: ResponseSetting
    runs: Mapping[str, Run]
    guided: bool = False

    @property
    def model(self) -> Model:
        """With its parameters."""
        return self.linear.model

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What is compared."""
        return self.linear.signals

    @property
    def zeta(self) -> Real:
        """Of the file, mode by mode."""
        return self.linear.zeta

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Of sensors."""
        return self.linear.faults

    @property
    def mesh(self) -> MeshError:
        """What its mesh does to frequencies."""
        return self.linear.mesh

    @property
    def top(self) -> float:
        """Of the band, Hz."""
        return self.linear.top

    @property
    def level(self) -> int:
        """Of smoothing."""
        return self.linear.level

    @property
    def damped(self) -> int:
        """Number of modes with a damping ratio of their own."""
        return self.linear.damped

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return self.linear.columns

    @property
    def scales(self) -> Real:
        """Prior standard deviations."""
        return self.linear.scales

    @property
    def reach(self) -> Real:
        """Of the unknowns that are no parameters of the model."""
        return self.linear.reach

    def noise_parts(self, point: MotionPoint) -> Real:
        """The part of each row's weighted square that noise alone makes."""
        return self.linear.noise_parts(point.before)

    def figures(self, point: MotionPoint) -> tuple[float, float]:
        """Those of the linear part: laws add no freedom to the discrepancy of a sound model."""
        return self.linear.figures(point.before)

    def damping_strain(self, p: Real) -> float:
        """Of the modes' own log damping ratios."""
        return self.linear.damping_strain(p)

    def on(self, signals: Sequence[Signal]) -> MotionSetting:
        """The same against other signals."""
        return replace(self, linear=replace(self.linear, signals=tuple(signals)))

    def evaluate(self, p: Real, before: MotionPoint | None = None) -> MotionPoint:
        """The responses at ``p``. ModelError where the model is no structure, or its springs soften
        until nothing holds it."""
        bare = self.linear.evaluate(p, None if before is None else before.before)
        point = MotionPoint(self, bare)
        laws = point.forces[0].size
        if laws and not all(np.isfinite(f).all() for f, _, _ in point.motions.values()):
            raise ModelError("the motion grows beyond all bounds under the recorded forces.")
        return point


@dataclass(frozen=True)
class MotionPoint:
    """The responses at one vector of unknowns; ``before`` is the linear part under the recorded
    forces alone."""

    setting: MotionSetting
    before: ResponsePoint

    @property
    def p(self) -> Real:
        """The unknowns."""
        return self.before.p

    @property
    def modes(self) -> Modes:
        """Of the linear part."""
        return self.before.modes

    @property
    def damping(self) -> Real:
        """Ratio of every mode."""
        return self.before.damping

    @property
    def loss(self) -> Loss:
        """Kind of loss of the linear part."""
        return self.before.loss

    @property
    def owner(self) -> np.ndarray:
        """Which mode each damping ratio belongs to."""
        return self.before.owner

    @property
    def fault_values(self) -> Real:
        """The unknowns of the sensor faults."""
        return self.before.fault_values

    @cached_property
    def forces(self) -> tuple[Laws, Real]:
        """Laws and directions of the internal forces."""
        found = internal_forces(self.setting.model, self.p[: len(self.setting.model.parameters)])
        return found.laws, np.asarray(found.directions.todense(), dtype=float)

    @cached_property
    def carried(self) -> int:
        """Modes that are marched."""
        top = CARRIED * max(run.rate for run in self.setting.runs.values())
        return max(1, int(np.sum(self.modes.frequencies <= top)))

    def variants(self, run: Run) -> Variants:
        """The model as it is, for a march over a run."""
        laws, B = self.forces
        drive, place = self.modes.shapes[self._inputs(run)].T, (B.T @ self.modes.shapes).T
        own = np.array([run_label >= 0 for run_label in self._inputs(run)])
        drive = drive * own
        n, lam = self.carried, np.maximum(self.modes.eigenvalues, 0.0)
        slow = 2.0 * self.damping * np.sqrt(lam) + self.further
        soft = 1.0 / np.maximum(lam[n:], 1e-30)
        beside = (place[n:] * soft[:, None]).T @ drive[n:]
        between = (place[n:] * soft[:, None]).T @ place[n:]
        return Variants(
            lam[None, :n],
            slow[None, :n],
            drive[None, :n],
            place[None, :n],
            beside,
            between,
            laws.kinds,
            np.asarray(laws.values, dtype=float)[None],
        )

    def _inputs(self, run: Run) -> np.ndarray:
        return sensor_rows(self.setting.model, run.inputs)

    @cached_property
    def further(self) -> Real:
        """Of dashpots: what they add to each mode's own damping."""
        C, X = self.before.found.matrices["C"], self.before.found.X
        if not abs(C).max():
            return np.zeros(len(self.modes.eigenvalues))
        return np.einsum("ir,ir->r", X, C @ X)

    @cached_property
    def motions(self) -> Mapping[str, tuple[Real, Real, Real]]:
        """Of every run the internal forces, motions and velocities (fine samples, places)."""
        if self.setting.guided:
            return guided_motions(self)
        out = {}
        for name, part in self.heard.items():
            run = self.setting.runs[name]
            f, x, v = marched(self.variants(run), run.begun(part), run.fine_rate)
            out[name] = (run.to_the_end(f[0]), run.to_the_end(x[0]), run.to_the_end(v[0]))
        return out

    @cached_property
    def heard(self) -> Mapping[str, float]:
        """Part of every run that is heard (0 to 1)."""
        return heard_of(self.setting.signals, self.setting.runs)

    def _ends(self) -> tuple[tuple[str, ...], Real]:
        """DOFs that internal forces act on, and how (DOFs, places)."""
        B = self.forces[1]
        rows = np.flatnonzero(np.any(B != 0.0, axis=1))
        return tuple(self.setting.model.labels[r] for r in rows), B[rows]

    @cached_property
    def linear(self) -> ResponsePoint:
        """The linear part under recorded and internal forces, as given ones."""
        if not self.forces[0].size:
            return self.before
        labels, B = self._ends()
        signals = []
        for s in self.setting.signals:
            f = self.motions[s.name][0]
            inner = -self.setting.runs[s.name].decaying(f, s.s) @ B.T
            U = np.concatenate([s.U, inner[:, :, None]], axis=1)
            signals.append(replace(s, U=U, inputs=(*s.inputs, *labels)))
        return replace(self.before, setting=replace(self.setting.linear, signals=tuple(signals)))

    def modelled(self) -> tuple[Complex, ...]:
        """Model rows of every signal."""
        return self.linear.modelled()

    def faulty(self, signal: Signal, y: Complex, start: int = 0) -> Complex:
        """Responses after the sensor faults."""
        return self.before.faulty(signal, y, start)

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels)."""
        return self.linear.differences

    def at_places(self, s: Signal, amounts: Complex) -> tuple[Response, Complex]:
        """Responses at the sensors to forces ``amounts`` (points, places, columns) of the internal
        kind: the pieces, and rows (rows, sensors, columns)."""
        labels, B = self._ends()
        U = -np.einsum("dk,skc->sdc", B, amounts)
        moved = replace(s, U=U, inputs=labels)
        sensors, inputs = (sensor_rows(self.setting.model, x) for x in (s.sensors, labels))
        C, D = self.before.further_damping()
        near = max(self.before.low, int(self.owner.max(initial=-1)) + 1)
        r = respond(moved, self.modes, sensors, inputs, Loss(self.damping), C, D, near)
        values = self.before.faulty(s, r.raw)
        return r, (values if s.mix is None else _mixed(s.mix, values))

    def jacobian(self) -> Real:
        """Derivative of `differences`: at given internal forces, and what moves these."""
        given = self.linear.jacobian()
        if not self.forces[0].size:
            return given
        unknowns, rates = (guided_rates if self.setting.guided else force_rates)(self)
        at = 0
        for s in self.setting.signals if len(unknowns) else ():  # none: laws of the file alone
            amounts = self.setting.runs[s.name].decaying(rates[s.name], s.s)
            _, rows = self.at_places(s, amounts)
            flat = rows.reshape(-1, len(unknowns))
            n = len(flat)
            given[at : at + n, unknowns] += flat.real
            given[at + n : at + 2 * n, unknowns] += flat.imag
            at += 2 * n
        return given

    def system(self) -> LinearSystem:
        """Linearised at this point."""
        values, weights, labels = self.differences
        A = self.jacobian()
        return LinearSystem(A, A @ self.p - values, weights, self.setting.columns, labels)


def _mixed(mix: Complex | Real, values: Complex) -> Complex:
    return np.asarray((mix @ values.reshape(len(values), -1)).reshape(len(mix), *values.shape[1:]))
