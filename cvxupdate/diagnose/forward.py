"""The response of a model with modal damping, and its derivatives, at points of the right half-plane."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.diagnose.signals import Complex, Real, Signal
from cvxupdate.errors import RecordingError
from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.modes import Modes, natural_modes

Index = NDArray[np.int64]


def undamped(model: Model) -> Model:
    """The model without its file damping (loss factor, Rayleigh): the diagnosis gives every mode its own; dashpots stay, and what stands beside modal
    damping in the file (a loss factor of some elements, a common decay rate)."""
    zero = set() if model.modal_damping else {"eta", "alpha", "beta"}
    blocks = tuple(replace(b, properties={k: np.zeros_like(v) if k in zero else v for k, v in b.properties.items()}) for b in model.blocks)
    return replace(model, blocks=blocks, modal_damping=())


def file_damping(model: Model, frequencies: Real) -> Real:
    """Fractions of critical that the problem file gives each mode; 0.005 where it gives none."""
    if model.modal_damping:
        zeta = np.array(model.modal_damping)
        return np.append(zeta, np.full(max(0, len(frequencies) - len(zeta)), zeta[-1]))[: len(frequencies)]
    eta, alpha, beta = (max((float(np.max(b.properties[k], initial=0.0)) for b in model.blocks), default=0.0) for k in ("eta", "alpha", "beta"))
    omega = np.maximum(2 * np.pi * frequencies, 1e-3)
    zeta = eta / 2 + alpha / (2 * omega) + beta * omega / 2
    return np.where(zeta > 0, zeta, 0.005)


@dataclass(frozen=True)
class Response:
    """Modal pieces of one signal: ``q`` (points, m, cases), ``a`` (points, sensors, m), ``Y`` model rows, ``drive`` sᵒ (points,)."""

    signal: Signal
    q: Complex
    a: Complex
    raw: Complex
    drive: Complex

    def rows(self, values: Complex) -> Complex:
        """From points to rows: the smoothing that the measurement went through."""
        mix = self.signal.mix
        return values if mix is None else (mix @ values.reshape(len(values), -1)).reshape(len(mix), *values.shape[1:])


def sensor_rows(model: Model, labels: Sequence[str]) -> Index:
    """Places of DOF labels; −1 for a DOF that a support holds.

    Raises
    ------
    RecordingError
        For a channel whose node the model does not have.
    """
    nodes = {f"n{i}" for i in model.node_ids.tolist()}
    for label in labels:
        if label.split(".")[0] not in nodes:
            raise RecordingError(f"channel {label} sits at a node that the model does not have.")
    return np.array([model.place.get(label, -1) for label in labels], dtype=np.int64)


def basis(K: sp.csc_array, M: sp.csc_array, top: float, rigid: Real) -> Modes:
    """Modes for synthesis: all of them for small models, else up to three times the band (``top`` in Hz)."""
    N = K.shape[0]
    if N <= 320:
        return natural_modes(K, M, N, rigid)
    count = 60
    while True:
        modes = natural_modes(K, M, count, rigid)
        if count >= N or modes.frequencies[-1] > 3.0 * top:
            return modes
        count *= 2


def respond(signal: Signal, modes: Modes, sensors: Index, inputs: Index, zeta: Real, C: Real | None, D: Real | None) -> Response:
    """Model response to a signal's drive.

    ``zeta`` (m,) modal damping; ``C`` and ``D`` (low, low) further viscous and hysteretic damping among the lowest modes, None where
    there is none.
    """
    s = signal.s
    phi = np.vstack([modes.shapes, np.zeros((1, modes.shapes.shape[1]))])
    ps, pb = phi[sensors], phi[inputs]
    lam = np.maximum(modes.eigenvalues, 0.0)
    d = s[:, None] ** 2 + 2.0 * zeta * np.sqrt(lam) * s[:, None] + lam
    force = pb.T @ signal.U
    q = force / d[:, :, None]
    a = ps[None] / d[:, None, :]
    low = 0 if C is None else len(C)
    if low and C is not None and D is not None:  # damping couples the modes of the band; above it they stay apart
        Z = s[:, None, None] * C + 1j * D
        Z[:, np.arange(low), np.arange(low)] += d[:, :low]
        q[:, :low] = np.linalg.solve(Z, force[:, :low])
        rhs = np.broadcast_to(ps[:, :low].T, (len(s), low, len(ps)))
        a[:, :, :low] = np.swapaxes(np.linalg.solve(np.swapaxes(Z, 1, 2), rhs), 1, 2)
    drive = s**signal.order
    raw = drive[:, None, None] * (ps @ q)
    return Response(signal, q, a, raw, drive)


@dataclass(frozen=True)
class Receptances:
    """Responses between sensors, drives and every DOF: ``left`` (points, sensors, N + 1), ``right`` (points, N + 1, cases); the last DOF is the ground."""

    left: Complex
    right: Complex


def receptances(response: Response, modes: Modes) -> Receptances:
    """From modal pieces to every DOF, two products of matrices."""
    phi = np.vstack([modes.shapes, np.zeros((1, modes.shapes.shape[1]))])
    points, sensors, m = response.a.shape
    left = _times(response.a.reshape(points * sensors, m), phi.T).reshape(points, sensors, len(phi))
    cases = response.q.shape[2]
    right = _times(np.swapaxes(response.q, 1, 2).reshape(points * cases, m), phi.T).reshape(points, cases, len(phi))
    return Receptances(left, np.swapaxes(right, 1, 2))


def _times(z: Complex, x: Real) -> Complex:
    """Complex times real, in real arithmetic."""
    return np.asarray(z.real @ x + 1j * (z.imag @ x))


MANY = 40  # DOFs of a derivative above which it goes through the band's modes instead of every DOF


def block_derivative(response: Response, modes: Modes, blocks: Sequence[DerivativeBlock], low: int, green: Receptances | None = None) -> Complex:
    """∂Y/∂p (points, sensors, cases) = −sᵒ aᵀ ∂Z q, from element blocks: Z = K + s² M + s C + i D.

    A change of a few DOFs is taken exactly, through the receptances at those DOFs (``green`` where they are at hand already); one of many DOFs (a whole
    group) through the lowest ``low`` modes, which carry it.
    """
    s = response.signal.s
    out = np.zeros(response.raw.shape, dtype=complex)
    phi = np.vstack([modes.shapes, np.zeros((1, modes.shapes.shape[1]))])
    for b in blocks:
        used, inverse = np.unique(b.dofs, return_inverse=True)
        inverse = inverse.reshape(b.dofs.shape)
        n = len(used)
        many = n > MANY and low < n
        if many:
            left, right = response.a[:, :, :low], response.q[:, :low]
        elif green is not None:
            left, right = green.left[:, :, used], green.right[:, used]
        else:
            points, sensors, m = response.a.shape
            left = _times(response.a.reshape(points * sensors, m), phi[used].T).reshape(points, sensors, n)
            right = phi[used] @ response.q
        for part, factor in ((b.K, np.ones_like(s)), (b.M, s**2), (b.C, s), (b.D, np.full_like(s, 1j))):
            if part is None:
                continue
            small = np.zeros((n, n))
            np.add.at(small, (inverse[:, :, None], inverse[:, None, :]), part)
            if many:
                small = phi[used, :low].T @ small @ phi[used, :low]
            out -= (factor * response.drive)[:, None, None] * (left @ (small @ right))
    return out
