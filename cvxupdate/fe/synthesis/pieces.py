"""The modal pieces of responses at points of the right half-plane, each mode with its own damping
ratio: for whoever needs derivatives and thousands of small changes, not only the responses."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import RecordingError
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, natural_modes
from cvxupdate.fe.synthesis.high_modes import HighModes, high_modes
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.products import Complex, drawn, grounded, times
from cvxupdate.fe.terms import Real

FEW = 0.3  # of the modes: up to so many columns of damping are taken by Woodbury's formula
# of the largest eigenvalue, or entry: what is below, of a product with the modes, is rounding
RANK = 1e-12


class Driven(Protocol):
    """Points ``s`` (points,), what drives the structure there ``U`` (points, references, cases),
    and how responses to it become rows (`cvxupdate.diagnose.responses.signals.Signal`)."""

    @property
    def s(self) -> Complex:
        """1/s."""

    @property
    def U(self) -> Complex:
        """N."""

    @property
    def order(self) -> int:
        """Of differentiation."""

    @property
    def sensors(self) -> tuple[str, ...]:
        """Labels of the DOFs that respond."""

    @property
    def inputs(self) -> tuple[str, ...]:
        """Labels of the DOFs that are driven."""

    @property
    def single(self) -> bool:
        """Whether there is but one drive, in one case."""

    @property
    def plain(self) -> bool:
        """Whether each case is a unit of one drive, or there is but one."""

    @property
    def carry(self) -> Complex | Real | None:
        """Matrix (rows, points) from points to rows; None: points are rows."""


@dataclass(frozen=True)
class Response:
    """Modal pieces of one signal: ``q`` (modes, points, cases) and ``a`` (modes, points, sensors)
    of the modes near the band, the ``high`` ones above it, what the sensors do ``raw`` (points,
    sensors, cases), ``drive`` sᵒ (points,).

    Where there is but one drive in one case, everything at points is to a unit of it: the drive
    itself comes in with the `rows`. ``at`` (modes, sensors) are the shapes at the sensors,
    ``inverse`` (modes, points) is 1 over each mode's dynamic stiffness; ``coupled``: further
    damping couples them.
    """

    signal: Driven
    q: Complex
    a: Complex
    high: HighModes | None
    raw: Complex
    drive: Complex
    at: Real
    inverse: Complex
    coupled: bool

    @property
    def near(self) -> int:
        """Number of modes that have pieces of their own."""
        return len(self.q)

    def rows(self, values: Complex) -> Complex:
        """From points (points, …) to rows (rows, …): the smoothing that the measurement went
        through."""
        carry = self.signal.carry
        if carry is None:
            return (
                values * self.signal.U.reshape(-1, *(1,) * (values.ndim - 1))
                if self.signal.single
                else values
            )
        return times(carry, values)


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
    """Modes for synthesis: all of them for small models, else up to three times the band (``top``
    in Hz)."""
    N = K.shape[0]
    if N <= 320:
        return natural_modes(K, M, N, rigid)
    count = 60
    while True:
        modes = natural_modes(K, M, count, rigid)
        if count >= N or modes.frequencies[-1] > 3.0 * top:
            return modes
        count *= 2


def respond(
    signal: Driven,
    modes: Modes,
    sensors: Index,
    inputs: Index,
    loss: Loss,
    C: Real | None,
    D: Real | None,
    near: int = 0,
    aside: tuple[Real, Real] | None = None,
) -> Response:
    """Model response to a signal's drive.

    ``loss`` of its modes; ``C`` and ``D`` (low, low) further viscous and hysteretic damping
    among the lowest modes, None where there is none; at least the first ``near`` modes get pieces
    of their own; ``aside`` (modes, sensors) and (modes, inputs) is added to the shapes there.
    """
    s = signal.s
    phi = grounded(modes.shapes)
    ps, pb = phi[sensors].T, phi[inputs].T
    ps, pb = (ps, pb) if aside is None else (ps + aside[0], pb + aside[1])
    lam = np.maximum(modes.eigenvalues, 0.0)
    slow, stiff = loss.viscous(lam), loss.stiffness(lam)
    low = 0 if C is None else len(C)
    high = high_modes(s, None if signal.plain else signal.U, max(low, near), stiff, slow, ps, pb)
    n = len(lam) if high is None else high.first
    d = s**2 + slow[:n, None] * s + stiff[:n, None]
    inverse = 1.0 / d
    force = (
        np.broadcast_to(pb[:n, None, :].astype(complex), (n, len(s), pb.shape[1]))
        if signal.plain
        else drawn(pb[:n], signal.U)
    )
    q = inverse[:, :, None] * force
    a = inverse[:, :, None] * ps[:n, None, :]
    if low and C is not None and D is not None:
        # damping couples the modes of the band; above it they stay apart
        q[:low], a[:low] = _coupled(s, inverse[:low], C, D, force[:low], ps[:low])
    drive = s**signal.order
    raw = np.moveaxis(times(ps[:n].T, q), 0, 1)
    if high is not None:
        raw = raw + high.between(ps[high.first :], 1.0)
    return Response(signal, q, a, high, drive[:, None, None] * raw, drive, ps, inverse, bool(low))


def _coupled(
    s: Complex, inverse: Complex, C: Real, D: Real, force: Complex, ps: Real
) -> tuple[Complex, Complex]:
    """Z⁻¹ f (low, points, cases) and Z⁻ᵀ φ (low, points, sensors) with Z = diag(d) + s C + i D,
    ``inverse`` 1 / d (low, points).

    Few dashpots, few columns V: (Δ + V X Vᵀ)⁻¹ = Δ⁻¹ − Δ⁻¹ V (X⁻¹ + Vᵀ Δ⁻¹ V)⁻¹ Vᵀ Δ⁻¹ (Woodbury).
    """
    low, points = inverse.shape
    cases, sensors = force.shape[2], ps.shape[1]
    C, D = _even(C), _even(D)
    if np.array_equal(C, C.T) and np.array_equal(D, D.T):  # one system for both sides
        right = np.concatenate(
            [force, np.broadcast_to(ps[:, None, :], (low, points, sensors))], axis=2
        )
        few = (_columns(C), _columns(D))
        V = np.hstack([vectors for _, vectors in few])
        if V.shape[1] <= FEW * low:
            # X⁻¹ is s c and i d: the inverse is taken of the product, so that a vanishing one does
            # no harm
            X = np.concatenate(
                [s[:, None] * few[0][0], np.broadcast_to(1j * few[1][0], (points, len(few[1][0])))],
                axis=1,
            )
            alone = inverse[:, :, None] * right
            inner = np.moveaxis(times(V.T, inverse[:, :, None] * V[:, None, :]), 0, 1)
            core = np.linalg.solve(
                np.eye(V.shape[1]) + X[:, :, None] * inner,
                X[:, :, None] * np.moveaxis(times(V.T, alone), 0, 1),
            )
            both = alone - inverse[:, :, None] * times(V, np.moveaxis(core, 1, 0))
        else:
            both = np.moveaxis(
                np.linalg.solve(_dynamic(s, inverse, C, D), np.moveaxis(right, 0, 1)), 1, 0
            )
        return both[:, :, :cases], both[:, :, cases:]
    Z = _dynamic(s, inverse, C, D)
    left = np.broadcast_to(ps, (points, low, sensors)).astype(complex)
    return np.swapaxes(np.linalg.solve(Z, np.swapaxes(force, 0, 1)), 0, 1), np.swapaxes(
        np.linalg.solve(np.swapaxes(Z, 1, 2), left), 0, 1
    )


def _dynamic(s: Complex, inverse: Complex, C: Real, D: Real) -> Complex:
    Z = s[:, None, None] * C + 1j * D
    Z[:, np.arange(len(inverse)), np.arange(len(inverse))] += 1.0 / inverse.T
    return Z


def _even(A: Real) -> Real:
    """A matrix that is symmetric but for the rounding of products, symmetric; else as it is."""
    mean = (A + A.T) / 2.0
    odd = float(np.abs(A - mean).max(initial=0.0))
    return mean if odd <= RANK * float(np.abs(A).max(initial=0.0)) else A


def _columns(C: Real) -> tuple[Real, Real]:
    """Eigenvalues (r,) and vectors (n, r) of a symmetric matrix that are not rounding."""
    values, vectors = np.linalg.eigh(C)
    kept = np.abs(values) > RANK * np.abs(values).max(initial=0.0)
    return values[kept], vectors[:, kept]


@dataclass(frozen=True)
class Receptances:
    """Responses between sensors, drives and chosen DOFs: ``left`` (DOFs, points, sensors),
    ``right`` (DOFs, points, cases)."""

    left: Complex
    right: Complex


def receptances(response: Response, modes: Modes, dofs: Index | None = None) -> Receptances:
    """From modal pieces to ``dofs`` (−1: the ground; None: all of them, the ground last)."""
    phi = grounded(modes.shapes)
    phi = phi if dofs is None else phi[dofs]
    n = response.near
    left, right = times(phi[:, :n], response.a), times(phi[:, :n], response.q)
    if response.high is not None:
        left, right = (
            left + response.high.left(phi[:, n:]),
            right + response.high.right(phi[:, n:]),
        )
    return Receptances(left, right)
