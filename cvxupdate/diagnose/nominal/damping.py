"""The damping of the file, which the diagnosis takes mode by mode."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model

UNKNOWN = 0.005  # fraction of critical where the file gives none


def undamped(model: Model) -> Model:
    """The model without its file damping (loss factor, Rayleigh): the diagnosis gives every mode
    its own; dashpots stay, and what stands beside modal damping in the file (a loss factor of some
    elements, a common decay rate)."""
    zero = set() if model.modal_damping else {"eta", "alpha", "beta"}
    blocks = tuple(
        replace(
            b, properties={k: np.zeros_like(v) if k in zero else v for k, v in b.properties.items()}
        )
        for b in model.blocks
    )
    return replace(model, blocks=blocks, modal_damping=())


def file_damping(model: Model, frequencies: Real) -> Real:
    """Fractions of critical that the problem file gives modes (Hz); `UNKNOWN` where it gives
    none."""
    if model.modal_damping:
        given = np.array(model.modal_damping)
        tail = np.full(max(0, len(frequencies) - len(given)), given[-1])
        return np.append(given, tail)[: len(frequencies)]
    eta, alpha, beta = (
        max((float(np.max(b.properties[k], initial=0.0)) for b in model.blocks), default=0.0)
        for k in ("eta", "alpha", "beta")
    )
    omega = np.maximum(2.0 * np.pi * frequencies, 1e-3)
    zeta = eta / 2.0 + alpha / (2.0 * omega) + beta * omega / 2.0
    return np.where(zeta > 0.0, zeta, UNKNOWN)
