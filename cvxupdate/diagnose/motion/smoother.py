"""Motions at a place that no sensor need be at: the model's answer to the recorded forces, and
what the sensors say beyond it, as the answer to a force at that place (a smoother with one latent
force).

On each line of a padded transform the latent force p has a prior mean and a variance σ²(ω), taken
from what the sensors say beyond the model less their noise; where accelerometers hear only noise,
or what leaks from the ends of the record (the lowest lines), the variance goes on as it is above,
so that double integration of noise does no harm. With the force of a law as the mean the estimate
is that law's wherever sensors are blind, also at rest: contact on one side moves the mean position,
which no accelerometer says.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cvxupdate.diagnose.motion.runs import COLUMNS, PERIODS, Run
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.fe.synthesis.pieces import sensor_rows

HEARD = 4.0  # times the noise: what sensors say beyond the model is no chance
KERNEL_SPREAD = 100  # of all lines: over how many a spectrum is averaged
TAPER = 25  # part of the samples over which the end is let down


@dataclass(frozen=True)
class Beyond:
    """What one run says beyond a model: ``residual`` (lines, sensors), modal coordinates ``eta``
    (lines, modes) of the model's own motion, ``inverse`` (lines, modes), shapes at the sensors with
    their differentiation ``out`` (lines, sensors, 1) and ``at`` (sensors, modes), noise power of a
    line ``noise`` (sensors,)."""

    run: Run
    residual: Complex
    eta: Complex
    inverse: Complex
    drive: Complex
    at: Real
    noise: Real

    @classmethod
    def of(cls, point: Any, run: Run) -> Beyond:
        """At a `MotionPoint`, its internal forces as they are."""
        alone = cls.alone(point, run)
        laws, B = point.forces
        if not laws.size:
            return alone
        return alone.under(-run.coarse(point.motions[run.name][0]) @ (B.T @ point.modes.shapes))

    @classmethod
    def alone(cls, point: Any, run: Run) -> Beyond:
        """At the linear part of a point."""
        s, model = run.lines, point.setting.model
        phi = np.vstack([point.modes.shapes, np.zeros((1, point.modes.shapes.shape[1]))])
        sensors, inputs = (sensor_rows(model, x) for x in (run.sensors, run.inputs))
        lam = np.maximum(point.modes.eigenvalues, 0.0)
        slow = 2.0 * point.damping * np.sqrt(lam) + point.further
        d = s[:, None] ** 2 + slow * s[:, None] + lam
        inverse = np.where(np.abs(d) > 0.0, 1.0 / np.where(d == 0.0, 1.0, d), 0.0)
        eta = inverse * (run.spectra(run.force) @ phi[inputs])
        drive = s[:, None] ** np.array(run.orders)
        noise = run.noise**2 * run.samples
        bare = cls(run, eta, eta, inverse, drive, phi[sensors], noise)
        return replace(bare, residual=bare.left())

    def under(self, force: Complex) -> Beyond:
        """With further modal ``force`` (lines, modes)."""
        moved = replace(self, eta=self.eta + self.inverse * force)
        return replace(moved, residual=moved.left())

    def left(self) -> Complex:
        """Transform of what the sensors say less the model's own motion, the end let down."""
        run = self.run
        own = run.samples_of(self.drive * (self.eta @ self.at.T))
        end = max(2, run.samples // TAPER)
        fade = np.ones(run.samples)
        fade[-end:] = 0.5 * (1.0 + np.cos(np.pi * np.arange(end) / end))
        return run.spectra((run.motion - own) * fade[:, None])

    def smoother(self, shape: Real) -> Smoother:
        """For a latent force along a direction with modal shape ``shape`` (modes,)."""
        reach = self.drive * ((self.inverse * shape) @ self.at.T)
        power = np.abs(reach) ** 2 / self.noise  # of a unit force, in units of the noise
        said = np.abs(self.residual) ** 2 / self.noise
        width = max(5, len(said) // KERNEL_SPREAD)
        total, strength = _averaged(said.sum(axis=1), width), _averaged(power.sum(axis=1), width)
        sensors = self.at.shape[0]
        variance = np.maximum(total - sensors, 0.0) / np.maximum(strength, 1e-300)
        heard = np.flatnonzero(total > HEARD * sensors)
        slowest = int(np.ceil(PERIODS * self.run.padded / self.run.samples))
        first = max(int(heard[0]), slowest) if len(heard) else 0
        if first > 0:
            variance[:first] = np.median(variance[first : 3 * first + 1])
        whole = 1.0 + variance * power.sum(axis=1)
        gain = (variance / whole)[:, None] * np.conj(reach) / self.noise
        taken = np.sum(gain * reach, axis=1)
        said = np.sum(gain * self.residual, axis=1)
        return Smoother(self.run, self.eta @ shape, self.inverse @ shape**2, said, taken)


@dataclass(frozen=True)
class Smoother:
    """One place: the model's own motion ``own`` there (lines,), ``soft`` that by a unit force
    there, the force ``said`` by the sensors, and the part ``taken`` (0 to 1) that they know of
    it."""

    run: Run
    own: Complex
    soft: Complex
    said: Complex
    taken: Complex

    def motion(self) -> tuple[Real, Real]:
        """Motion and velocity at the place (fine samples,), the prior mean of the force none."""
        return self._fine(self.own + self.soft * self.said)

    def settled(self, force: Real, x: Real, v: Real) -> tuple[Real, Real]:
        """The same with a law's ``force`` along a motion so far as the mean. What the new motion
        changes in it is foretold by the spring and the dashpot that are nearest to the law
        (statistical linearisation; Roberts and Spanos 1990, chapter 3): taken as it is, a force
        that is stiffer than the structure would overshoot from round to round."""
        run = self.run
        stiff = _slope(force, x) + _slope(force, v) * run.lines
        blind = self.soft * (1.0 - self.taken)
        known = self.own + self.soft * self.said - blind * run.coarse(force)
        return self._fine((known + blind * stiff * run.coarse(x)) / (1.0 + blind * stiff))

    def _fine(self, q: Complex) -> tuple[Real, Real]:
        fine = self.run.samples_of(np.stack([q, self.run.lines * q], axis=1), COLUMNS)
        return fine[:, 0], fine[:, 1]


def _slope(force: Real, along: Real) -> float:
    """Of the straight line that is nearest to a force, none that drives."""
    size = float(along @ along)
    return max(0.0, float(force @ along) / size) if size > 0.0 else 0.0


def _averaged(values: Real, width: int) -> Real:
    return np.convolve(values, np.ones(width) / width, mode="same")
