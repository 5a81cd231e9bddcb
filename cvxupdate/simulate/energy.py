"""The balance of energy: the proof of a simulation that needs no other simulation."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from cvxupdate.forces.laws import Real
from cvxupdate.simulate.integrate import Simulated
from cvxupdate.simulate.system import System


@dataclass(frozen=True)
class Balance:
    """Over a record, J: ``supplied`` by the inputs, ``mechanical`` gain of the linear part,
    ``damped`` by C, ``elements`` work done on the nonlinear elements; ``error`` what is missing,
    over the largest of them."""

    supplied: float
    mechanical: float
    damped: float
    elements: float
    error: float


def energy_balance(system: System, force: ArrayLike, rate: float, run: Simulated) -> Balance:
    """The balance of a simulation whose states were kept, and that had no imposed motion.

    Powers are integrated over samples with their slopes (Euler and Maclaurin), so samples must
    resolve the motion.

    Raises
    ------
    ValueError
        The states were not kept.
    """
    if run.states is None:
        raise ValueError("energy_balance needs simulate(..., keep=True).")
    p, n = np.asarray(force, dtype=float), system.modes
    back = np.linalg.inv(system.entry)
    q, u = (run.states @ back[rows].T for rows in (slice(0, n), slice(n, None)))
    at, into, _ = system.parts()
    push = p @ into.T - run.force @ at.T
    a = push - u @ system.damping.T - q * system.omega**2
    energy = 0.5 * np.sum(u**2 + (q * system.omega) ** 2, axis=1)
    lost = np.einsum("ti,ij,tj->t", u, system.damping, u)
    faster = 2.0 * np.einsum("ti,ij,tj->t", u, system.damping, a)
    speed, gain = u @ into, a @ into
    damped = _integral(lost, faster, faster, rate)
    slope = np.diff(p, axis=0) * rate  # the input is straight from sample to sample
    begin = np.sum(p[:-1] * gain[:-1] + slope * speed[:-1], axis=1)
    end = np.sum(p[1:] * gain[1:] + slope * speed[1:], axis=1)
    power = np.sum(p * speed, axis=1)
    supplied = float(
        np.sum(power[1:] + power[:-1]) / (2.0 * rate) + np.sum(begin - end) / (12.0 * rate**2)
    )
    parts = (supplied, float(energy[-1] - energy[0]), damped, float(np.sum(run.work)))
    largest = max(float(energy.max()), *(abs(x) for x in parts))
    return Balance(*parts, abs(parts[0] - sum(parts[1:])) / largest)


def _integral(y: Real, begin: Real, end: Real, rate: float) -> float:
    """∫ y dt of samples with slopes."""
    plain = float(np.sum(y[1:] + y[:-1])) / (2.0 * rate)
    return plain + float(begin[0] - end[-1]) / (12.0 * rate**2)
