"""Static condensation and what is built on it: Guyan, IRS, iterated IRS, Craig–Bampton."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.linalg import LinAlgError, eigh, solve

from cvxupdate.errors import ConvergenceError, ModelError
from cvxupdate.reduction.split import Array, Partition
from cvxupdate.reduction.transformation import Transformation


def guyan(split: Partition) -> Transformation:
    """Guyan (1965) static condensation and Irons expansion: x_s = −K_ss⁻¹ K_sn x_n (2.49, 2.60).

    The expanded shape has the least strain energy of all that agree with the masters. Raises
    `ModelError` when the slaves are a mechanism with the masters held.
    """
    return Transformation(
        split.place(np.eye(split.masters.size), -split.static_map()), split.masters, "Guyan"
    )


def irs(split: Partition) -> Transformation:
    """Improved reduced system (O'Callahan 1989): the slaves' inertia forces at the static answer
    (2.51, 2.52, 2.61).

    T₂ = T₁ + S M T₁ M_R⁻¹ K_R with the Guyan-reduced M_R, K_R. Raises `ModelError` when M_R is not
    positive definite: masters without mass, carrying none from the slaves.
    """
    split.needs_mass("IRS")
    first = guyan(split)
    return Transformation(_improve(split, first), split.masters, "IRS")


def iterated_irs(
    split: Partition, iterations: int = 500, tolerance: float = 1e-10, modes: int | None = None
) -> Transformation:
    """IRS repeated with its own reduced matrices (Friswell, Garvey & Penny 1995); converges to
    SEREP.

    Mode r of the n lowest converges like (λ_r/λ_{n+1})^k, so the last ones are slow: ``modes`` says
    how many must have converged (all n when None), in the relative change of their expanded shapes.

    Raises `ConvergenceError` when they have not within ``iterations``, `ModelError` as `irs` does.
    """
    split.needs_mass("iterated IRS")
    now, change = guyan(split), np.inf
    for _ in range(iterations):
        after = Transformation(_improve(split, now), split.masters, "iterated IRS")
        _, q = eigh(after.reduce(split.K), after.reduce(split.M))
        kept = q[:, :modes]
        difference = np.linalg.norm((after.matrix - now.matrix) @ kept, axis=0)
        change = float(np.max(difference / np.linalg.norm(after.matrix @ kept, axis=0)))
        now = after
        if change < tolerance:
            return now
    raise ConvergenceError(
        f"iterated IRS: the kept shapes still change by {change:.2g} after {iterations} iterations "
        f"(tolerance {tolerance:.2g}); keep fewer modes, or choose masters that see them better"
    )


def craig_bampton(split: Partition, modes: int) -> Transformation:
    """Static condensation besides the lowest ``modes`` fixed-interface modes of the slaves (Craig &
    Bampton 1968).

    The coordinates are the masters, then the modal ones. Raises `InputError` when there are fewer
    slaves than modes.
    """
    value = split.slave_modes(modes)[1]
    n = split.masters.size
    at_masters = np.hstack([np.eye(n), np.zeros((n, modes))])
    return Transformation(
        split.place(at_masters, np.hstack([-split.static_map(), value])),
        split.masters,
        "Craig–Bampton",
        generalised=modes,
    )


def _improve(split: Partition, now: Transformation) -> Array:
    """T₁ + S M T M_R⁻¹ K_R, one step of IRS from the transformation ``now``."""
    inertia: NDArray[np.float64] = np.asarray(split.M @ now.matrix)
    M_R, K_R = now.matrix.T @ inertia, now.reduce(split.K)
    try:
        stiffness_per_mass = solve(M_R, K_R, assume_a="pos")
    except LinAlgError as error:
        raise ModelError(
            "IRS: the reduced mass matrix is not positive definite; choose masters that move "
            "with mass"
        ) from error
    slaves = split.solve(inertia[split.slaves]) @ stiffness_per_mass - split.static_map()
    return split.place(np.eye(split.masters.size), slaves)
