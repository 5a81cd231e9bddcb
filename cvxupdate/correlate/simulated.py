"""The answer of a nonlinear model to the force of a time history, by simulation from rest."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.fe.internal import internal_forces
from cvxupdate.fe.model import Model
from cvxupdate.recordings.measured import MOTION, band_of
from cvxupdate.recordings.types import TimeHistory


def simulated(
    model: Model,
    history: TimeHistory,
    drives: NDArray[np.int64],
    senses: NDArray[np.int64],
    p: Real | None = None,
) -> TimeHistory:
    """``history`` with its motions as the model at ``p`` answers to its forces, from rest.

    ``drives`` and ``senses`` are the places among the free DOFs of its channels of force and of
    motion, −1 where a support holds.

    Raises
    ------
    ModelError
        The model is a mechanism.
    ConvergenceError
        The internal forces were not found in some step.
    """
    found, channels = internal_forces(model, p), history.channels
    forces = [i for i, c in enumerate(channels) if c.quantity == "force" and c.dof]
    motions = [i for i, c in enumerate(channels) if c.quantity in MOTION and c.dof]
    top = band_of(history)[1]
    from cvxupdate.simulate import reduced_system, simulate  # the compiler loads on use

    system = reduced_system(model, found.laws, found.directions, drives, senses, top, p)
    run = simulate(system, history.data[:, forces], history.rate)
    data = history.data.copy()
    for k, i in enumerate(motions):
        data[:, i] = getattr(run, channels[i].quantity)[:, k]
    return replace(history, data=data)
