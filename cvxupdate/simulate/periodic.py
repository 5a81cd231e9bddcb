"""Periodic response by harmonic balance (Krack and Gross 2019, chapters 2 and 4).

The elements' motion is a Fourier series; the internal forces along it are taken in time and
transformed back (alternating frequency and time), laws with memory over two periods, of which the
second counts. Between harmonics only the laws couple: the structure is condensed exactly to its
elements, harmonic by harmonic, so unknowns are the elements' Fourier coefficients alone.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from cvxupdate.errors import ConvergenceError, InputError
from cvxupdate.forces import Laws, jenkins
from cvxupdate.forces.laws import Number, Real
from cvxupdate.simulate.system import System

HARMONICS = 7
MOST_ITERATIONS = 40
CLOSE = 1e-9
"""Of the largest coefficient: where Newton's iteration ends."""
STICK = 1e3
"""Stiffness of a slider that sticks, over that of the structure at its place: Coulomb's law has no
value at rest, and its harmonics are those of this Jenkins element to about 1/STICK."""
RISE = (0.02, 0.05, 0.1, 0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8, 0.9, 1.0)
"""Parts of the force through which a solution is led where the linear response is no start."""
STEP = 1e-30
Complex = np.ndarray


@dataclass(frozen=True)
class Periodic:
    """A periodic response, x(t) = Re Σ X_h e^{ihΩt}: ``frequency`` Ω/2π in Hz; ``x`` and ``force``
    of the elements (m, harmonics + 1), ``displacement`` of the outputs (o, harmonics + 1), complex,
    the mean first."""

    frequency: float
    x: Complex
    force: Complex
    displacement: Complex

    def at(self, phase: ArrayLike) -> Real:
        """Displacement (…, o) of the outputs at phases Ωt (…,)."""
        turns = np.exp(1j * np.multiply.outer(np.asarray(phase), np.arange(self.x.shape[1])))
        return np.asarray(np.real(turns @ self.displacement.T))


@dataclass(frozen=True)
class Equations:
    """R(X, Ω) = X − G_p p + G F(X): X (m, 2H + 1) in the order mean, cosines, sines, flattened.
    ``push`` (r, H + 1) complex amplitudes of the inputs."""

    system: System
    laws: Laws
    push: Complex
    harmonics: int
    samples: int

    @property
    def size(self) -> int:
        """Number of unknowns."""
        return self.system.laws.size * (2 * self.harmonics + 1)

    def structure(self, omega: float) -> list[tuple[Complex, Complex, Complex, Complex]]:
        """For each harmonic: displacement of elements and outputs to forces on elements, (m, m) and
        (o, m), and to the inputs, (m,) and (o,). At 0 Hz rigid-body motion has no periodic answer
        and is left out."""
        at, into, out = self.system.parts()
        found = []
        for h in range(self.harmonics + 1):
            w = h * omega
            Z = np.diag(self.system.omega**2 - w**2) + 1j * w * self.system.damping
            free = self.system.omega == 0.0 if h == 0 else np.zeros(len(Z), dtype=bool)
            Z[free, free] = 1.0
            answer = np.linalg.solve(Z, np.column_stack([at, into @ self.push[:, h]]))
            answer[free] = 0.0
            found.append(
                (
                    at.T @ answer[:, :-1],
                    out.T @ answer[:, :-1],
                    at.T @ answer[:, -1],
                    out.T @ answer[:, -1],
                )
            )
        return found

    def forces(self, X: Number, omega: complex) -> Number:
        """Fourier coefficients (…) of the internal forces, like X."""
        H, N = self.harmonics, self.samples
        waves, rates = _waves(H, N)
        path = waves @ X.reshape(-1, 2 * H + 1).T
        speed = omega * (rates @ X.reshape(-1, 2 * H + 1).T)
        force, _ = self.laws.trace(np.vstack([path, path]), np.vstack([speed, speed]))
        scale = np.full(2 * H + 1, 2.0 / N)
        scale[0] = 1.0 / N
        return np.asarray((scale[:, None] * (waves.T @ force[N:])).T).reshape(-1)

    def derivatives(self, X: Real, omega: float) -> tuple[Real, Real, Real]:
        """Forces, dF/dX (size, size; each law acts on its own motion) and dF/dΩ (size,), by the
        complex step."""
        m, n = self.system.laws.size, 2 * self.harmonics + 1
        dX = np.zeros((m, n, m, n))
        for c in range(n):
            step = np.zeros((m, n), dtype=complex)
            step[:, c] = 1j * STEP
            d = np.imag(self.forces(X + step.reshape(-1), omega)).reshape(m, n) / STEP
            dX[np.arange(m), :, np.arange(m), c] = d
        moved = self.forces(X.astype(complex), omega + 1j * STEP)
        return np.real(moved), dX.reshape(m * n, m * n), np.imag(moved) / STEP

    def residual(self, X: Real, omega: float) -> tuple[Real, Real, Real]:
        """R, dR/dX and dR/dΩ."""
        F, dF, faster = self.derivatives(X, omega)
        G, p = self._condensed(omega)
        step = 1e-6 * omega
        (G1, p1), (G0, p0) = self._condensed(omega + step), self._condensed(omega - step)
        slope = ((G1 - G0) @ F - (p1 - p0)) / (2.0 * step)
        return X - p + G @ F, np.eye(self.size) + G @ dF, slope + G @ faster

    def _condensed(self, omega: float) -> tuple[Real, Real]:
        """G (size, size) and G_p p (size,) in real numbers: X_h = a − i b of a cos + b sin."""
        m, H = self.system.laws.size, self.harmonics
        n = 2 * H + 1
        G, p = np.zeros((m, n, m, n)), np.zeros((m, n))
        for h, (own, _, driven, _) in enumerate(self.structure(omega)):
            c, s = h, H + h
            G[:, c, :, c], p[:, c] = own.real, driven.real
            if h:
                G[:, c, :, s], G[:, s, :, c] = own.imag, -own.imag
                G[:, s, :, s], p[:, s] = own.real, -driven.imag
        return G.reshape(m * n, m * n), p.reshape(-1)

    def response(self, X: Real, omega: float) -> Periodic:
        """The periodic response with these coefficients."""
        m, H = self.system.laws.size, self.harmonics
        x, f = (_complex(a.reshape(m, -1), H) for a in (X, np.real(self.forces(X, omega))))
        y = [driven - own @ f[:, h] for h, (_, own, _, driven) in enumerate(self.structure(omega))]
        return Periodic(omega / (2.0 * np.pi), x, f, np.stack(y, axis=1))


def equations(
    system: System, force: ArrayLike, harmonics: int = HARMONICS, samples: int | None = None
) -> Equations:
    """The equations of harmonic balance: ``force`` (r,) complex amplitudes at Ω, or (r, harmonics +
    1) of all harmonics with the mean first.

    Raises
    ------
    InputError
        Wrong shapes.
    """
    given = np.asarray(force, dtype=complex)
    r = system.drive.shape[1]
    push = np.zeros((r, harmonics + 1), dtype=complex)
    if harmonics < 1 or given.shape not in ((r,), push.shape):
        raise InputError(
            f"harmonic balance: the force must be ({r},) or ({r}, {harmonics + 1}), with 1 "
            f"harmonic or more; got {given.shape}."
        )
    if given.ndim == 1:
        push[:, 1] = given
    else:
        push = given
    points = samples or 2 ** int(np.ceil(np.log2(16 * (harmonics + 1))))
    return Equations(system, _sliders(system), push, harmonics, points)


def harmonic_balance(
    system: System,
    force: ArrayLike,
    frequency: float,
    harmonics: int = HARMONICS,
    start: Periodic | None = None,
    samples: int | None = None,
) -> Periodic:
    """The periodic response to a force at ``frequency`` (Hz), sought from ``start`` or from the
    linear response.

    Raises
    ------
    InputError
        Wrong shapes, or a frequency that is not above 0.
    ConvergenceError
        No solution was found from there: follow the branch by `follow`.
    """
    if not frequency > 0.0:
        raise InputError(f"harmonic balance: the frequency must be above 0 Hz; got {frequency:g}.")
    eq = equations(system, force, harmonics, samples)
    omega = 2.0 * np.pi * frequency
    if start is not None:
        X = _newton(eq, coefficients(start), omega)
    else:
        X = _newton(eq, first_guess(eq, omega), omega)
        X = _raised(eq, omega) if X is None else X
    if X is None:
        raise ConvergenceError(
            f"harmonic balance found no periodic response at {frequency:.6g} Hz from this start. "
            "Follow the branch from a frequency off the resonance, or take fewer harmonics."
        )
    return eq.response(X, omega)


def _newton(eq: Equations, X: Real, omega: float) -> Real | None:
    """A solution near X, or None."""
    for _ in range(MOST_ITERATIONS):
        R, J, _ = eq.residual(X, omega)
        step = np.linalg.solve(J, R)
        X = X - step
        if not np.all(np.isfinite(X)):
            return None
        if np.abs(step).max() <= CLOSE * np.abs(X).max():
            return X
    return None


def _raised(eq: Equations, omega: float) -> Real | None:
    """The solution that grows from rest with the force."""
    X: Real | None = None
    for part in RISE:
        weak = replace(eq, push=part * eq.push)
        X = _newton(weak, first_guess(weak, omega) if X is None else X, omega)
        if X is None:
            return None
    return X


def first_guess(eq: Equations, omega: float) -> Real:
    """The response without internal forces."""
    _, p = eq._condensed(omega)
    return p


def coefficients(response: Periodic) -> Real:
    """The unknowns of a response."""
    x = response.x
    return np.hstack([x.real, -x.imag[:, 1:]]).reshape(-1)


def _complex(a: Real, H: int) -> Complex:
    out = a[:, : H + 1].astype(complex)
    out[:, 1:] -= 1j * a[:, H + 1 :]
    return out


def _waves(H: int, N: int) -> tuple[Real, Real]:
    """Mean, cosines and sines at N phases (N, 2H + 1), and their derivatives by the phase."""
    angle = np.multiply.outer(2.0 * np.pi * np.arange(N) / N, np.arange(1, H + 1))
    c, s, h = np.cos(angle), np.sin(angle), np.arange(1, H + 1)
    return np.hstack([np.ones((N, 1)), c, s]), np.hstack([np.zeros((N, 1)), -h * s, h * c])


def _sliders(system: System) -> Laws:
    """The laws, Coulomb's as Jenkins elements that are stiff beside the structure."""
    hard = system.laws.set_valued
    if not np.any(hard):
        return system.laws
    at, _, _ = system.parts()
    held = np.where(system.omega > 0.0, system.omega, np.inf)
    soft = np.sum((at / held[:, None]) ** 2, axis=0)
    soft = np.where(soft > 0.0, soft, 1.0)
    stiff = jenkins(STICK / soft, np.real(system.laws.values[:, 0]))
    kinds = np.where(hard, stiff.kinds, system.laws.kinds)
    return Laws(kinds, np.where(hard[:, None], stiff.values, system.laws.values))
