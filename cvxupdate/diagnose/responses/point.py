"""Output error of responses: model parameters, one damping ratio for each mode, sensor faults. A
residual for the trust-region loop."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.nominal.theory import ASIDE, GROUP
from cvxupdate.diagnose.responses.aside import with_rates
from cvxupdate.diagnose.responses.losses import Losses, own_strain, ratios_of
from cvxupdate.diagnose.responses.moving import NOTHING, Carried, driven, rates_at
from cvxupdate.diagnose.responses.priors import priors
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal, independent
from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.recent import recent
from cvxupdate.fe.synthesis.derivatives import Changes
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import (
    Driven,
    Receptances,
    Response,
    receptances,
)
from cvxupdate.fe.synthesis.shapes import Found, Shapes
from cvxupdate.physics.alike import OWN
from cvxupdate.physics.fault import Fault
from cvxupdate.system import LinearSystem

FARTHEST = 4.0  # of log damping ratios and faults
HALF = 0.5  # share of the loss that is hysteretic before anything is known of it


@dataclass(frozen=True)
class ResponseSetting:
    """What is fitted: model (undamped, its parameters: nuisance ones, then the effects'), signals,
    file damping by mode, band top (Hz), the ``shapes`` among which its modes are sought, faults,
    ``mesh`` what its mesh does to frequencies, ``level`` that of the signals; ``tuned``: damped
    modes have frequencies by themselves, too; ``mixed``: by displacement or by velocity modes lose
    energy (`cvxupdate.fe.synthesis.loss`); ``carried``: what goes with the drive.

    The unknowns are, in order: the model's parameters; z₀, by which the logarithm of every damping
    ratio moves together; where it is mixed how much more than half of the loss is hysteretic; z_r,
    each mode's own ratio; where modes are tuned t_r, those of frequencies; the faults.
    """

    model: Model
    signals: tuple[Signal, ...]
    zeta: Real
    top: float
    shapes: Shapes
    faults: tuple[Fault, ...] = ()
    mesh: MeshError = NONE
    level: int = 0
    tuned: bool = False
    mixed: bool = False
    carried: Carried = NOTHING
    loose: bool = False

    @property
    def damped(self) -> int:
        """How many modes have a damping ratio of their own."""
        return len(self.zeta)

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the unknowns."""
        return (
            *(q.name for q in self.model.parameters),
            "damping",
            *(["kind of loss"] if self.mixed else []),
            *(f"damping of mode {r + 1}" for r in range(self.damped)),
            *(f"frequency of mode {r + 1}" for r in range(self.damped if self.tuned else 0)),
            *(f.label for f in self.faults),
        )

    @property
    def scales(self) -> Real:
        """Prior standard deviations of the unknowns; effects and faults are free. What is known of
        a model counts as beside independent rows, if it is not let go."""
        own = (ASIDE, OWN) if self.loose else (ASIDE, GROUP, OWN)
        return priors(self, own, not self.loose)

    @property
    def reach(self) -> Real:
        """Wide for damping, frequencies and faults; a share is between none and all."""
        out = np.full(len(self.columns) - len(self.model.parameters), FARTHEST)
        if self.mixed:
            out[1] = HALF
        return out

    @property
    def ratios(self) -> slice:
        """The unknowns z_r."""
        first = len(self.model.parameters) + 1 + self.mixed
        return slice(first, first + self.damped)

    @cached_property
    def _mesh_rows(self) -> Index:
        return self.mesh.rows(self.model)

    def noise_parts(self, point: ResponsePoint) -> Real:
        """The part of each row's weighted square that noise alone makes, real and imaginary
        alike."""
        parts = [(s.std**2 / (2.0 * s.scale() ** 2)).reshape(-1) for s in self.signals]
        return np.concatenate([np.tile(part, 2) for part in parts])

    def figures(self, point: ResponsePoint) -> tuple[float, float]:
        """Of the modes in the band (`independent`): what the discrepancy of a sound model is made
        of; its own are the damping ratios."""
        f = point.modes.frequencies
        band = [s.s.imag / (2.0 * np.pi) for s in self.signals]
        low, high = min(b.min() for b in band), max(b.max() for b in band)
        modes = max(1, int(np.sum((f >= low) & (f <= high))))
        return independent(self.signals, modes)[0], float(modes)

    def damping_strain(self, p: Real) -> float:
        """That of `own_strain`."""
        return own_strain(p[self.ratios.start - 1 - self.mixed], p[self.ratios])

    def on(self, signals: Sequence[Signal]) -> ResponseSetting:
        """The same against other signals."""
        return replace(self, signals=tuple(signals))

    def evaluate(self, p: Real, before: ResponsePoint | None = None) -> ResponsePoint:
        """The responses at ``p``; modes keep their damping ratio when they cross. ModelError where
        the model is no structure, or has fewer modes than that."""
        n = len(self.model.parameters)
        found = self.shapes.modes(np.asarray(p[:n], dtype=float))
        modes = self.mesh.taken_out(self.model, found.modes, self._mesh_rows)
        if len(modes.eigenvalues) - modes.rigid < self.damped:
            raise ModelError("modes with a damping ratio of their own are none there.")
        if before is None:
            owner = np.arange(self.damped) + modes.rigid
        else:
            _, owner = linear_sum_assignment(self._likeness(before, found, p[:n]), maximize=True)
        if self.tuned:
            moved, at = modes.eigenvalues.copy(), self.ratios.stop
            moved[owner] *= np.exp(2.0 * np.asarray(p[at : at + self.damped]))
            modes = replace(modes, eigenvalues=moved)
        whole, found = np.asarray(p, dtype=float), replace(found, modes=modes)
        return ResponsePoint(self, whole, found, np.asarray(owner, dtype=np.int64))

    def _likeness(self, before: ResponsePoint, found: Found, p: Real) -> Real:
        """(φᵀ M φ′)² between the damped modes of another point and those found at ``p``."""
        own = before.owner
        if before.setting.shapes is self.shapes:
            carried = before.found.X[:, own].T @ (found.matrices["M"] @ found.X)
        else:
            M = self.model.matrices(p).M
            carried = before.modes.shapes[:, own].T @ (M @ found.modes.shapes)
        return np.asarray(carried**2)


@dataclass(frozen=True)
class ResponsePoint:
    """The responses at one vector of unknowns; ``owner`` (damped,) says which mode each damping
    ratio belongs to."""

    setting: ResponseSetting
    p: Real
    found: Found
    owner: np.ndarray

    @property
    def modes(self) -> Modes:
        """Those found there, the mesh's error taken out."""
        return self.found.modes

    @cached_property
    def loss(self) -> Loss:
        """How every mode loses energy."""
        s, n = self.setting, len(self.setting.model.parameters)
        ratios = ratios_of(s.zeta, self.p[n], self.p[s.ratios], self.modes, self.owner)
        return Loss(ratios, HALF + float(self.p[n + 1]) if s.mixed else 0.0)

    @property
    def damping(self) -> Real:
        """Damping ratio of every mode."""
        return self.loss.ratios

    @recent
    def responses(self) -> tuple[Response, ...]:
        """The model's answer to every signal, before sensor faults."""
        own, further = self.setting, self.further_damping()
        return tuple(driven(self, own.model, s, further, own.carried) for s in own.signals)

    @recent
    def derivatives(self) -> tuple[tuple[DerivativeBlock, ...], ...]:
        """Element blocks of every parameter of the model."""
        return self.setting.model.derivatives(self.p[: len(self.setting.model.parameters)])

    @recent
    def green(self) -> tuple[Receptances, ...]:
        """Responses of every DOF, signal by signal."""
        return tuple(receptances(r, self.modes) for r in self.responses)

    @property
    def low(self) -> int:
        """Number of modes that carry what happens in the band."""
        return max(8, int(np.sum(self.modes.frequencies < 2.5 * self.setting.top)))

    @property
    def near(self) -> int:
        """Number of modes that have pieces of their own."""
        return max(self.low, int(self.owner.max(initial=-1)) + 1)

    def further_damping(self) -> tuple[Real | None, Real | None]:
        """C and D of the model among the lowest modes (low, low); None where there is none."""
        C, D = (self.found.matrices[k] for k in "CD")
        if not any(np.any(A.data if sp.issparse(A) else A) for A in (C, D)):
            return None, None
        X = self.found.X[:, : self.low]
        return X.T @ (C @ X), X.T @ (D @ X)

    @property
    def fault_values(self) -> Real:
        """The unknowns of the sensor faults."""
        return self.p[len(self.p) - len(self.setting.faults) :]

    def faulty(self, signal: Driven, y: Complex, start: int = 0) -> Complex:
        """Responses ``y`` (points, sensors, cases) after the sensor faults from number ``start``
        on, one after the other."""
        for value, fault in list(zip(self.fault_values, self.setting.faults, strict=True))[start:]:
            y = fault.applied(float(value), signal.sensors, signal.s, y, signal.inputs)
        return y

    def fault_rate(self, number: int, signal: Driven, y: Complex) -> Complex:
        """Derivative of `faulty` with respect to the unknown of fault ``number``."""
        before = zip(self.fault_values[:number], self.setting.faults[:number], strict=True)
        for value, fault in before:
            y = fault.applied(float(value), signal.sensors, signal.s, y, signal.inputs)
        value, fault = float(self.fault_values[number]), self.setting.faults[number]
        rate = fault.rate(value, signal.sensors, signal.s, y, signal.inputs)
        return self.faulty(signal, rate, number + 1)

    def modelled(self) -> tuple[Complex, ...]:
        """Model rows (rows, sensors, cases) of every signal, sensor faults included."""
        return tuple(r.rows(self.faulty(r.signal, r.raw)) for r in self.responses)

    @cached_property
    def differences(self) -> tuple[Real, Real, tuple[str, ...]]:
        """(model − measured, weights, labels) by signal: real parts, then imaginary ones."""
        values, weights = [], []
        for signal, model in zip(self.setting.signals, self.modelled(), strict=True):
            gap, weight = (model - signal.Y).reshape(-1), 1.0 / signal.scale().reshape(-1)
            values += [gap.real, gap.imag]
            weights += [weight, weight]
        flat = np.concatenate(values)
        return flat, np.concatenate(weights), ("",) * len(flat)

    def jacobian(self) -> Real:
        """Derivative of `differences` with respect to every unknown, (rows, unknowns)."""
        lam, s = np.maximum(self.modes.eigenvalues, 0.0), self.setting
        p, X = self.p[: len(s.model.parameters)], self.found.X[:, : self.low]
        rates = s.shapes.derivatives(p, X)
        usual = Changes.of(rates, self.modes, self.low)
        losses = Losses(self.loss, lam, self.owner, s.mixed, s.tuned)
        parts, faulty = [], self.faulty if s.faults else None
        for r in self.responses:
            damped = losses.own(r, faulty)
            here = rates_at(s.model, p, r.signal, rates)
            change = usual if here is rates else Changes.of(here, self.modes, self.low)
            own = with_rates(s.model, self.modes, r, change.columns(r))
            columns = np.concatenate([own, losses.together(r)], axis=-1)
            if self.setting.faults:
                more = [self.fault_rate(k, r.signal, r.raw) for k in range(len(s.faults))]
                heard = (self.faulty(r.signal, c) for c in np.moveaxis(columns, -1, 0))
                columns = np.stack([*heard, *more], axis=-1)
            rows, at = r.rows(columns), s.ratios.start
            stacked = np.concatenate([rows[..., :at], damped, rows[..., at:]], axis=-1)
            flat = stacked.reshape(-1, stacked.shape[-1])
            parts += [flat.real, flat.imag]
        return np.vstack(parts)

    def system(self) -> LinearSystem:
        """Linearised at this point."""
        values, weights, labels = self.differences
        A = self.jacobian()
        return LinearSystem(A, A @ self.p - values, weights, self.setting.columns, labels)
