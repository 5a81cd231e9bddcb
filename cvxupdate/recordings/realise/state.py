"""Real modes from M^-1 K: Ibrahim's two methods. ``poles`` (modes,) rad/s, ``shapes`` (modes,
channels) of viscous modes."""

from __future__ import annotations

import numpy as np
import scipy.linalg
from numpy.typing import NDArray
from scipy.optimize import linear_sum_assignment

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Complex, Real


def normal_modes_of(MinvK: Real, count: int) -> tuple[Real, Real]:
    """Natural frequencies (Hz) and real shapes (count, channels) of ``M^-1 K``, lowest first, the
    least complex solutions.

    Eigenvalues that are complex (M^-1 K from noisy data need not be symmetrisable) contribute their
    modulus and rotated real part.
    """
    values, vectors = np.linalg.eig(MinvK)
    keep = np.argsort(np.where(values.imag < -1e-9 * np.abs(values), np.inf, np.abs(values)))[
        :count
    ]
    v = vectors[:, keep].astype(np.complex128)
    v = v * np.exp(-0.5j * np.angle(np.sum(v**2, axis=0)))
    return np.asarray(np.sqrt(np.abs(values[keep])) / (2.0 * np.pi)), np.asarray(v.real.T)


def _basis(shapes: Complex, channels_kept: int) -> Real:
    """Orthonormal real basis of the subspace that the shapes span best, (channels,
    channels_kept)."""
    both = np.concatenate([shapes.real, shapes.imag]).T
    return np.asarray(np.linalg.svd(both, full_matrices=False)[0][:, :channels_kept])


def ibrahim_state(
    poles: Complex, shapes: Complex, *, step: float | None = None
) -> tuple[Real, Real]:
    """Ibrahim's first method (1983a; 2.17 to 2.21): the state matrix from free responses
    built of the identified modes.

    Displacement, velocity and acceleration of all modes together are formed at 2 m instants
    ``step`` apart (default a quarter of the shortest period), ``A = Ydot Y^-1``, and M^-1 K read
    from it. With more channels than modes the responses are projected on the real subspace that the
    shapes span best. Exact when the modes are complete (as many as channels); assumes viscous
    damping and, when incomplete, that the normal modes lie in that subspace (light damping).
    Returns frequencies (Hz) and shapes.

    Raises
    ------
    RecordingError
        When there are more modes than channels, or the modes are dependent.
    """
    m = poles.size
    if m > shapes.shape[1]:
        raise RecordingError(
            f"{m} modes but {shapes.shape[1]} channels: Ibrahim's method needs at least as "
            "many channels"
        )
    basis = _basis(shapes, m)
    q = (shapes @ basis).T
    dt = 0.25 * 2.0 * np.pi / float(np.max(np.abs(poles))) if step is None else step
    motion = np.exp(np.outer(poles, dt * np.arange(2 * m)))
    x, v, a = (2.0 * np.real(q @ (poles[:, None] ** k * motion)) for k in range(3))
    scale = float(np.mean(np.abs(poles)))
    Y = np.concatenate([x * scale, v])
    if np.linalg.cond(Y) > 1e13:
        raise RecordingError(
            "the modes are dependent: their free responses do not span the state space; drop "
            "a repeated mode"
        )
    A = np.linalg.solve(Y.T, a.T).T
    frequency, real = normal_modes_of(-A[:, :m] * scale, m)
    return frequency, np.asarray(real @ basis.T)


def ibrahim_fill(
    poles: Complex,
    shapes: Complex,
    analytical_frequency: Real,
    analytical_shapes: Real,
    *,
    analytical_damping: float = 0.0,
) -> tuple[Real, Real]:
    """Ibrahim's second method (1983b; 2.22, 2.23): ``[M^-1 K, M^-1 C]`` from measured modes
    filled up with the model's.

    Modes of the model that were not measured (``analytical_frequency`` Hz, ``analytical_shapes``
    (modes, channels), as many as make the set complete; rigid-body modes too) stand in for them.
    Assumes viscous damping, and that these modes are right and hardly coupled by damping with the
    measured ones. They are solutions themselves, and are left out by their shapes: returns
    frequencies (Hz) and shapes of the measured modes only.

    Raises
    ------
    RecordingError
        When measured and analytical modes together are not as many as the channels, or dependent.
    """
    n = shapes.shape[1]
    if poles.size + analytical_frequency.size != n:
        raise RecordingError(
            f"{poles.size} measured and {analytical_frequency.size} analytical modes do not "
            f"make {n}, the number of channels; give exactly the modes that are missing"
        )
    w = 2.0 * np.pi * analytical_frequency
    z = analytical_damping
    poles_all = np.concatenate([poles, w * complex(-z, np.sqrt(1.0 - z**2))])
    phi = np.concatenate([shapes, analytical_shapes.astype(np.complex128)]).T
    phi = phi / np.linalg.norm(phi, axis=0)
    # one row scale per mode: displacement in units of velocity, so that high modes do not drown the
    # low ones
    weight = 1.0 / np.maximum(np.abs(poles_all), np.min(np.abs(poles)))
    top = np.concatenate([phi, phi * poles_all]) * weight
    right = -phi * poles_all**2 * weight
    lhs = np.concatenate([top.real, top.imag], axis=1)
    rhs = np.concatenate([right.real, right.imag], axis=1)
    scale = np.concatenate([np.full(n, 1.0), np.full(n, 1.0 / float(np.median(np.abs(poles_all))))])
    scaled, _, rank, _ = scipy.linalg.lstsq((lhs * scale[:, None]).T, rhs.T, cond=1e-12)
    if rank < 2 * n - np.count_nonzero(poles_all == 0.0):
        raise RecordingError(
            "measured and analytical modes together are dependent at these channels: leave out a "
            "mode that was found twice, or channels that tell the same"
        )
    solution = scaled.T * scale
    frequency, real = normal_modes_of(solution[:, :n], n)
    left = rivals(analytical_shapes, real)
    return frequency[left], real[left]


def rivals(shapes: Complex | Real, others: Real) -> NDArray[np.int64]:
    """Which of ``others`` (modes, channels) are left, in their order, once each of ``shapes`` has
    taken its partner: the pairs with the largest MACs in sum."""
    one = shapes / np.linalg.norm(shapes, axis=1, keepdims=True)
    two = others / np.maximum(np.linalg.norm(others, axis=1, keepdims=True), 1e-300)
    taken = linear_sum_assignment(-(np.abs(one.conj() @ two.T) ** 2))[1]
    return np.setdiff1d(np.arange(len(others)), taken)
