"""The rows of an assigned mode made independent with unit variance, by sparse factors alone.

To first order (Pintelon and Schoukens 2012, ch. 9) the forces r = Z φ have the covariance G Gᴴ, G =
[Z S, c, F]: shape errors of deviations S, an error of the rate that acts along c, a floor F. Then
rᴴ (G Gᴴ)⁻¹ r is the least ‖y‖² with G y = r, and that is a small least-squares problem once a few
DOFs, at which the structure nearly vibrates freely, are held: Z of the held structure is regular
and sparse, the rest is (q + 1) columns.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import NDArray
from scipy.sparse.linalg import splu

from cvxupdate.errors import ConvergenceError, ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factor, factorise
from cvxupdate.fe.model import Matrices
from cvxupdate.residual.ceam_modes import AssignedMode, impedance

Array = NDArray[Any]
Index = NDArray[np.int64]
# of the row's own deviation, at the held DOFs: what is left where the deviations alone would be
# singular
FLOOR = 1e-6
HELD = 4
"""DOFs held at most: as many modes may lie near the assigned one (repeated modes come in pairs)."""
ACCURATE = 1e-9
"""Relative residual of a solve above which the factors are made again with pivoting."""
CHUNK = 128
"""Columns solved for at a time."""


@dataclass(frozen=True)
class Whitener:
    """r ↦ W r with Wᴴ W = (G Gᴴ)⁻¹, (N, k) → (N, k).

    ``held`` (q,) and ``free`` (N − q,) DOFs; ``factor`` of Z over the free ones (None where all are
    held), ``coupling`` Z_hf S_f (q, N − q) sparse, ``std`` (N,), ``floor`` (q,); ``reflectors`` and
    ``tau`` the Householder factors of the (q + 1) columns that w = (shape errors at the held DOFs,
    error of the rate) moves.
    """

    held: Index
    free: Index
    factor: Factor | None
    coupling: Any
    std: Real
    floor: Real
    reflectors: Array
    tau: Array

    @property
    def size(self) -> int:
        """Number of rows N."""
        return len(self.held) + len(self.free)

    def __call__(self, force: Array) -> Array:
        """W force, (N,) or (N, k), complex where Z is."""
        columns = force[:, None] if force.ndim == 1 else force
        out = np.empty(
            (self.size, columns.shape[1]), dtype=np.result_type(self.reflectors, columns), order="F"
        )
        for at in range(0, columns.shape[1], CHUNK):
            out[:, at : at + CHUNK] = self._rows(columns[:, at : at + CHUNK])
        return out[:, 0] if force.ndim == 1 else out

    def _rows(self, force: Array) -> Array:
        own = force.astype(self.reflectors.dtype)
        x = (
            own[self.free]
            if self.factor is None
            else self.factor.solve(own[self.free]) / self.std[self.free, None]
        )
        e = (own[self.held] - self.coupling @ x) / self.floor[:, None]
        stacked = np.asfortranarray(
            np.vstack([e, np.zeros((len(self.tau), own.shape[1]), dtype=x.dtype), x])
        )
        return _reflected(self.reflectors, self.tau, stacked)[len(self.tau) :]


def whitener(m: Matrices, mode: AssignedMode, full: Array) -> Whitener:
    """The whitener of ``mode`` for the model's matrices, ``full`` (N,) being its shape at all DOFs.

    An expanded entry is known no better than its own size: the model that expanded it is the one in
    doubt.

    Raises
    ------
    ConvergenceError
        When every deviation is 0, or rounding leaves the covariance singular.
    """
    Z = sp.csc_array(impedance(m, mode))
    N = Z.shape[0]
    moved = (2.0 * mode.s * (m.M @ full) + m.C @ full) * mode.s * mode.rate_std
    c = np.real(2.0 * mode.s**2 * (m.M @ full)) * mode.rate_std if mode.real else moved
    std = np.zeros(N)
    std[mode.at] = mode.std
    missing = np.setdiff1d(np.arange(N), mode.at)
    std[missing] = max(float(mode.std.max()), float(np.abs(full[missing]).max(initial=0.0)))
    if not np.any(std > 0.0):
        raise ConvergenceError(
            f"{mode.label}: the covariance of its equations is singular; give its shape a "
            "deviation above 0."
        )
    std = np.maximum(std, FLOOR * std.max())
    held = loose_dofs(Z, m, mode, full, std)
    free = np.setdiff1d(np.arange(N), held)
    rows = sp.csr_array(Z)[held]
    moving = np.column_stack([rows[:, held].toarray() * std[held], c[held]])
    side = np.column_stack([sp.csr_array(Z)[free][:, held].toarray() * std[held], c[free]])
    factor, x = _solved(Z[:, free][free], side, mode.label)
    B = x / std[free, None]
    coupling = sp.csr_array(rows[:, free] * std[free][None, :])
    floor = FLOOR * np.sqrt(np.asarray(abs(rows).power(2) @ std**2).ravel() + np.abs(c[held]) ** 2)
    if np.any(floor == 0.0):
        raise ConvergenceError(
            f"{mode.label}: the covariance of its equations is singular; give its shape a "
            "deviation above 0."
        )
    T = (moving - coupling @ B) / floor[:, None]
    # The stiff rows first: Householder's method is then accurate row by row (Cox and Higham 1998).
    stacked = np.asfortranarray(np.vstack([T, -np.eye(T.shape[1], dtype=T.dtype), B]))
    geqrf = la.get_lapack_funcs("geqrf", (stacked,))
    reflectors, tau, _, info = geqrf(stacked, overwrite_a=True)
    if info or not np.all(np.isfinite(tau)) or np.any(np.diag(reflectors)[: len(tau)] == 0.0):
        raise ConvergenceError(
            f"{mode.label}: the covariance of its equations is singular; give its shape a "
            "deviation above 0."
        )
    return Whitener(held, free, factor, coupling, std, floor, reflectors, tau)


def loose_dofs(Z: sp.csc_array, m: Matrices, mode: AssignedMode, full: Array, std: Real) -> Index:
    """DOFs to hold, so that Z of the rest is far from singular: where the motions nearest to free
    vibration at s are largest in their deviations.

    The motions come from two inverse iterations, started from the shape itself and random ones.
    """
    N = len(full)
    q = min(HELD, N)
    if q == N:
        return np.arange(N, dtype=np.int64)
    shift = (1e-7 * abs(mode.s) ** 2) * m.M
    if shift.nnz == 0 or not np.any(shift.data):
        shift = 1e-9 * sp.diags_array(np.abs(Z.diagonal()))
    near = factorise(sp.csc_array(Z + shift), f"{mode.label}: the dynamic stiffness")
    rng = np.random.default_rng(0)
    V = np.column_stack([full, rng.standard_normal((N, q - 1)) * np.abs(full).max()]).astype(
        Z.dtype
    )
    for _ in range(2):
        V = np.linalg.qr(near.solve(np.asarray(m.M @ V) if m.M.nnz else V))[0]
    _, _, order = la.qr((V / std[:, None]).conj().T, mode="economic", pivoting=True)
    return np.sort(order[:q]).astype(np.int64)


def _solved(Z: Any, side: Array, label: str) -> tuple[Factor | None, Array]:
    """Factors of Z, with pivoting where the solution without is poor, and the solution."""
    if Z.shape[0] == 0:
        return None, side
    size = abs(Z).sum(axis=1).max()
    for make in (_symmetric, _pivoted):
        try:
            factor = make(sp.csc_array(Z), label)
        except (ModelError, RuntimeError):
            continue
        x = factor.solve(side.astype(Z.dtype))
        left = np.abs(Z @ x - side).max(initial=0.0)
        if left <= ACCURATE * (size * np.abs(x).max(initial=0.0) + np.abs(side).max(initial=0.0)):
            return factor, x
    raise ConvergenceError(
        f"{label}: its equations cannot be weighed, the dynamic stiffness is singular in more "
        f"motions than {HELD}. Leave the mode out."
    )


def _symmetric(Z: sp.csc_array, label: str) -> Factor:
    return factorise(Z, label)


def _pivoted(Z: sp.csc_array, label: str) -> Factor:
    """Rows exchanged freely: safe, and several times the fill."""
    del label
    return Factor(splu(Z, permc_spec="COLAMD"))


def _reflected(reflectors: Array, tau: Array, columns: Array) -> Array:
    """Qᴴ columns."""
    name, trans = ("unmqr", "C") if np.iscomplexobj(reflectors) else ("ormqr", "T")
    apply = la.get_lapack_funcs(name, (reflectors,))
    work = apply("L", trans, reflectors, tau, columns, -1)[1]
    return np.asarray(
        apply("L", trans, reflectors, tau, columns, int(work[0].real), overwrite_c=True)[0]
    )


def parts(values: Array, real: bool) -> Real:
    """Real rows of an undamped mode; real rows, then imaginary ones (each with half the variance)
    of a complex one."""
    if real:
        return np.asarray(values.real)
    return np.asarray(np.sqrt(2.0) * np.concatenate([values.real, values.imag]))


def chunks(total: int) -> Iterator[slice]:
    """Slices of ``CHUNK`` columns."""
    for at in range(0, total, CHUNK):
        yield slice(at, min(at + CHUNK, total))
