"""How accurate recordings must be (thesis chapter 5): the spectral radius (5.6), the bearable error
(5.12), the relative errors (5.15), and the characteristic log function (5.32), from the model
alone: before any updating."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.responses import condenser, damped, matrices_with_damping
from cvxupdate.residual.contraction import derivatives


@dataclass(frozen=True)
class Accuracy:
    """Per line, (f,): Frobenius norms over the measured DOFs.

    ``error`` log₁₀‖ε‖ and ``system`` log₁₀(‖ΔZ‖/‖Z + ΔZ‖²) of (5.12); ``log_function`` their
    difference (5.32), below 0 where the noise is borne; ``bearable`` the relative noise at which it
    is 0; ``radius`` an estimate of the spectral radius (5.6): the series converges below 1,
    which is necessary and not sufficient, for what it converges to must be small beside ‖ΔZ‖ (5.9);
    ``relative_error`` ‖ε‖/‖H_X − ε‖ and ``relative_model`` ‖ΔZ‖/‖Z + ΔZ‖ of (5.15).
    """

    frequency: Real
    error: Real
    system: Real
    bearable: Real
    radius: Real
    relative_error: Real
    relative_model: Real

    @property
    def log_function(self) -> Real:
        """log₁₀(‖ε‖ ‖Z + ΔZ‖² / ‖ΔZ‖), (5.32)."""
        return self.error - self.system


def accuracy(
    model: Model,
    frequency: Real,
    measured: Index,
    noise: float,
    change: Real | float = 0.05,
    rounds: int = 8,
) -> Accuracy:
    """The log function (5.32) of a test, with the spectral radius (5.6) and the norms (5.12, 5.15):
    the receptance matrix of the ``measured`` DOFs with relative r.m.s. ``noise`` on every entry.

    ``change``: the parameter error that is sought: p itself (n,) where it is known, or the
    deviation that every parameter may have (a number): then ‖ΔZ‖ is the root of the mean square
    over independent parameters. The spectral radius is the mean over ``rounds`` seeded draws.

    Raises
    ------
    ModelError
        Where a line meets a natural frequency of the structure held at the measured DOFs.
    """
    zero = model.zero()
    base = matrices_with_damping(model)
    d = derivatives(model, zero)
    rng = np.random.default_rng(0)
    known = np.ndim(change) > 0
    moved = matrices_with_damping(model, np.asarray(change)) if known else base
    here, there = (condenser(x, measured, measured[:1]) for x in (base, moved))
    rows = []
    for f in np.asarray(frequency, dtype=float).tolist():
        c = here.at(f)
        if known:
            Z = there.at(f).Z
            delta = float(np.linalg.norm(Z - c.Z))
        else:
            Z = c.Z
            blocks = d.between(
                2.0 * np.pi * f, c.carried(np.eye(len(measured))), c.carried(np.eye(len(measured)))
            )
            delta = float(change) * float(np.linalg.norm(blocks))
        H = np.linalg.inv(Z)
        norm, size = float(np.linalg.norm(Z)), float(np.linalg.norm(H))
        radius = (
            np.mean([_radius(Z, H, noise, rng, damped(base)) for _ in range(rounds)])
            if rounds
            else np.nan
        )
        rows.append(
            (
                np.log10(noise * size),
                np.log10(delta / norm**2),
                delta / norm**2 / size,
                radius,
                noise,
                delta / norm,
            )
        )
    error, system, bearable, radius_, relative, model_ = np.array(rows).T
    return Accuracy(
        np.asarray(frequency, dtype=float), error, system, bearable, radius_, relative, model_
    )


def _radius(Z: Real, H: Real, noise: float, rng: np.random.Generator, both: bool) -> float:
    draw = rng.standard_normal(H.shape) + (1j * rng.standard_normal(H.shape) if both else 0.0)
    eps = noise * H * draw / (np.sqrt(2.0) if both else 1.0)
    return float(np.abs(np.linalg.eigvals(Z @ eps)).max())
