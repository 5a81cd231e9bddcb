"""Factors of large real symmetric matrices by MKL Pardiso, where the extra ``fast`` is installed.

Only the library that pypardiso finds is taken from it (the path in PYPARDISO_MKL_RT, else mkl_rt
where the system or pip has put it): its own solver is for unsymmetric matrices, with twice the work
and no inertia.
"""

from __future__ import annotations

import ctypes
import weakref
from collections.abc import Callable
from functools import cache
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real

LARGE = 10_000
"""DOFs above which Pardiso factors what SuperLU would: below it both take milliseconds, and the
answers do not depend on what is installed."""

_INDEFINITE = -2  # mtype: real, symmetric, indefinite: L D Lᵀ with pivots of 1 × 1 and 2 × 2
_FACTORISE, _NUMBERS, _SOLVE, _RELEASE = 12, 22, 33, -1
_NESTED = 2  # iparm[1]: nested dissection
_PERTURBED = 13
"""iparm[9]: pivots below 1e-13 of the matrix, scaled to a unit diagonal, are replaced. Such factors
are not used at all (MKL's own 1e-8 would touch sound shells, whose rotations are that much
softer)."""


@cache
def library() -> Callable[..., None] | None:
    """MKL's ``pardiso``; None where the extra ``fast`` is not installed, or MKL not found."""
    try:
        from pypardiso import PyPardisoSolver

        found: Callable[..., None] = PyPardisoSolver().libmkl.pardiso
        return found
    except (ImportError, OSError, AttributeError):
        return None


class Perturbed(ModelError):
    """A pivot was too small to divide by: the matrix is singular, or needs pivots that Pardiso does
    not look for."""


class PardisoFactor:
    """A = S⁻¹ P L D Lᵀ Pᵀ S⁻¹ of a real symmetric A (N, N), S powers of two that make its diagonal
    about one. Solutions are refined by no iteration: without perturbed pivots they are as exact as
    SuperLU's.

    Raises
    ------
    Perturbed
        When pivots were perturbed, or Pardiso gave up: it is for SuperLU to say what A is.
    """

    def __init__(self, A: sp.csc_array, pardiso: Callable[..., None]) -> None:
        self._scale, self._data, self._at = _scaled(A)
        self._pt, self._iparm = np.zeros(64, dtype=np.int64), np.zeros(64, dtype=np.int32)
        self._iparm[[0, 1, 9, 20, 34]] = 1, _NESTED, _PERTURBED, 1, 1
        self._pardiso = pardiso
        # the memory is MKL's own, and given back with the object
        weakref.finalize(self, _release, pardiso, self._pt, self._iparm, A.shape[0])
        self._factorise(_FACTORISE)

    def taken_over(self, A: sp.csc_array) -> bool:
        """Whether A has this pattern: then these are its factors now, in the order and the memory
        that are there.

        Raises
        ------
        Perturbed
            As the class; these are of no use any more.
        """
        scale, data, at = _scaled(A)
        if not all(np.array_equal(a, b) for a, b in zip(at, self._at, strict=True)):
            return False
        self._scale, self._data = scale, data
        self._factorise(_NUMBERS)
        return True

    def solve(self, rhs: NDArray[Any]) -> Real:
        """A⁻¹ rhs, (N,) or (N, k), real or complex."""
        if np.iscomplexobj(rhs):
            return np.asarray(self.solve(rhs.real) + 1j * self.solve(rhs.imag))
        # columns one after the other, as Fortran wants them
        b = np.array(rhs.reshape(len(self._scale), -1).T * self._scale, dtype=float, order="C")
        x = np.zeros_like(b)
        error = self._call(_SOLVE, b, x)
        if error:
            raise ModelError(f"MKL Pardiso ended with error {error}. Uninstall the extra `fast`.")
        return np.ascontiguousarray((x * self._scale).T).reshape(np.shape(rhs))

    def negatives(self) -> int | None:
        """Number of negative eigenvalues of A, by Sylvester's law of inertia."""
        return int(self._iparm[22])

    def _factorise(self, phase: int) -> None:
        nothing = np.zeros((1, len(self._scale)))
        error = self._call(phase, nothing, nothing)
        if error or self._iparm[13]:
            raise Perturbed(
                f"Pardiso: error {error}, {self._iparm[13]} pivots too small to divide by."
            )

    def _call(self, phase: int, b: Real, x: Real) -> int:
        return _run(self._pardiso, self._pt, self._iparm, phase, self._data, self._at, b, x)


def _scaled(A: sp.csc_array) -> tuple[Real, Real, tuple[NDArray[np.int32], NDArray[np.int32]]]:
    """The scale S (N,) and the upper half of S A S by rows, which are the columns of the lower.

    Pardiso wants every entry of the diagonal stored. Stored zeros stay: nested dissection takes
    the DOFs of a node together, and finds a third less fill, where they have the same neighbours.
    """
    if not A.has_sorted_indices:
        A = A.sorted_indices()
    every = np.arange(A.shape[0], dtype=np.int32)
    columns = np.repeat(every, np.diff(A.indptr))
    missing = np.setdiff1d(every, columns[A.indices == columns], assume_unique=True)
    if len(missing):
        rows, columns = np.append(A.indices, missing), np.append(columns, missing)
        entries = np.append(A.data, np.zeros(len(missing)))
        return _scaled(sp.csc_array(sp.coo_array((entries, (rows, columns)), shape=A.shape)))
    diagonal = np.abs(A.diagonal())
    scale = np.exp2(-np.round(np.log2(np.where(diagonal > 0.0, diagonal, 1.0)) / 2.0))
    keep = A.indices >= columns
    rows, columns = A.indices[keep].astype(np.int32, copy=False), columns[keep]
    ends = np.cumsum(np.bincount(columns, minlength=len(every)), dtype=np.int32)
    data = A.data[keep] * scale[rows] * scale[columns]
    return scale, data, (np.append(np.zeros(1, np.int32), ends), rows)


def _run(
    pardiso: Callable[..., None],
    pt: NDArray[np.int64],
    iparm: NDArray[np.int32],
    phase: int,
    data: Real,
    at: tuple[NDArray[np.int32], NDArray[np.int32]],
    b: Real,
    x: Real,
) -> int:
    """One call; the error code."""
    integer, size = ctypes.POINTER(ctypes.c_int32), b.shape[1]
    error = ctypes.c_int32(0)

    def value(i: int) -> Any:
        return ctypes.byref(ctypes.c_int32(i))

    pardiso(
        pt.ctypes.data_as(ctypes.POINTER(ctypes.c_int64)),
        value(1),
        value(1),
        value(_INDEFINITE),
        value(phase),
        value(size),
        data.ctypes.data_as(ctypes.c_void_p),
        at[0].ctypes.data_as(integer),
        at[1].ctypes.data_as(integer),
        None,
        value(len(b)),
        iparm.ctypes.data_as(integer),
        value(0),
        b.ctypes.data_as(ctypes.c_void_p),
        x.ctypes.data_as(ctypes.c_void_p),
        ctypes.byref(error),
    )
    return int(error.value)


def _release(
    pardiso: Callable[..., None], pt: NDArray[np.int64], iparm: NDArray[np.int32], size: int
) -> None:
    none = np.zeros(1, dtype=np.int32)
    nothing = np.zeros((1, size))
    _run(pardiso, pt, iparm, _RELEASE, np.zeros(1), (none, none), nothing, nothing)
