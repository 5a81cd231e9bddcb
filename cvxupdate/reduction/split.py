"""K and M split into master and slave DOFs, with every factorisation made so far: what all
reductions share."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.linalg import eigh
from scipy.sparse.linalg import ArpackError, LinearOperator, eigsh, splu

from cvxupdate.errors import ConvergenceError, InputError, ModelError

Index = NDArray[np.intp]
Array = NDArray[Any]
Real = NDArray[np.float64]

# Below this many slaves a dense eigenproblem is both quicker and safer than Lanczos.
_DENSE = 300


@dataclass(frozen=True)
class Partition:
    """The blocks of K and M over masters n and slaves s (2.47); make one with `partition`, pass it
    to every method.

    ``masters`` (n,) and ``slaves`` (s,) are rows of the full model; the blocks are sparse, in SI.
    ``kept`` is the cache: the factorisation of K_ss − λ M_ss per shift λ in (rad/s)², and the
    static map K_ss⁻¹ K_sn, each made once.
    """

    masters: Index
    slaves: Index
    K: Any
    M: Any
    K_ss: Any
    K_sn: Any
    M_ss: Any
    M_sn: Any
    kept: dict[Any, Any] = field(default_factory=dict, repr=False, compare=False)

    @property
    def size(self) -> int:
        """N, the number of DOFs of the full model."""
        return int(self.masters.size + self.slaves.size)

    def solve(self, rhs: Array, shift: float = 0.0) -> Array:
        """(K_ss − shift M_ss)⁻¹ rhs, (s,) or (s, columns); the factorisation is made at the first
        call for a shift.

        Raises `ModelError` when the matrix is singular: the slaves are a mechanism once the masters
        are held, or the shift is a natural frequency of the slaves.
        """
        if self.slaves.size == 0:
            return np.zeros_like(rhs)
        if shift not in self.kept:
            Z = self.K_ss - shift * self.M_ss if shift else self.K_ss
            self.kept[shift] = factorise(Z, self.slaves, shift)
        lu, kind = self.kept[shift]
        right = np.ascontiguousarray(rhs)
        if np.iscomplexobj(right) and kind != "c":
            return np.asarray(lu.solve(right.real.copy()) + 1j * lu.solve(right.imag.copy()))
        return np.asarray(
            lu.solve(right.astype(np.complex128 if kind == "c" else np.float64, copy=False))
        )

    def static_map(self) -> Array:
        """G = K_ss⁻¹ K_sn, (s, n): the slaves' static answer to the masters is −G x_n."""
        if "static" not in self.kept:
            self.kept["static"] = self.solve(self.K_sn.toarray())
        return np.asarray(self.kept["static"])

    def slave_modes(self, count: int) -> tuple[Real, Real]:
        """The lowest ``count`` modes with all masters held: λ (count,) in (rad/s)², mass-normalised
        shapes (s, count).

        Lanczos with shift and invert on the factorisation of K_ss that is kept. Raises `InputError`
        when there are fewer slaves than modes asked for, `ConvergenceError` when Lanczos stops
        short.
        """
        self.needs_mass("the slaves' modes")
        s = self.slaves.size
        if not 1 <= count <= s or np.iscomplexobj(self.K_ss.data):
            raise InputError(
                f"slave_modes: {count} modes asked for; there are {s} slaves, and K must be real"
            )
        key = ("modes", count)
        if key not in self.kept:
            self.kept[key] = self._slave_modes(count)
        return self.kept[key]

    def _slave_modes(self, count: int) -> tuple[Real, Real]:
        s = self.slaves.size
        if s <= _DENSE or count > s - 2:
            return dense_modes(self.K_ss.toarray(), self.M_ss.toarray(), count)
        try:
            inverse = LinearOperator((s, s), matvec=self.solve, dtype=np.float64)
            start = np.random.default_rng(0).standard_normal(
                s
            )  # fixed, so that a study gives the same bits twice
            value, shape = eigsh(
                self.K_ss, count, self.M_ss, sigma=0.0, OPinv=inverse, v0=start, tol=0.0
            )
        except ArpackError as error:
            raise ConvergenceError(
                f"slave_modes: Lanczos found fewer than {count} modes ({error}); "
                "ask for fewer modes"
            ) from error
        order = np.argsort(value)
        return value[order], shape[:, order]

    def needs_mass(self, what: str) -> None:
        """Raise `InputError` when the partition was made without a mass matrix."""
        if self.M is None:
            raise InputError(f"{what}: needs the mass matrix; pass M to partition(K, M, masters)")

    def place(self, at_masters: Array, at_slaves: Array) -> Array:
        """Rows of masters and slaves put back in the order of the full model: (N, columns)."""
        out = np.empty(
            (self.size, at_masters.shape[1]), dtype=np.result_type(at_masters, at_slaves)
        )
        out[self.masters], out[self.slaves] = at_masters, at_slaves
        return out


def partition(K: Any, M: Any, masters: Index) -> Partition:
    """Split symmetric K and M, (N, N) sparse or dense, real or complex, by the rows ``masters``
    (n,), in that order.

    M may be None where only static condensation is wanted. Raises `InputError` for bad shapes or
    repeated or foreign masters, `ModelError` when K or M is not symmetric (a condensation by one
    factorisation then does not hold).
    """
    Kc = _symmetric(K, "K")
    Mc = None if M is None else _symmetric(M, "M")
    N = Kc.shape[0]
    if Mc is not None and Mc.shape != Kc.shape:
        raise InputError(f"partition: K is {Kc.shape}, M is {Mc.shape}; they must agree")
    n = master_rows(masters, N)
    s = np.setdiff1d(np.arange(N), n)
    below = Kc[s].tocsc()
    if Mc is None:
        return Partition(n, s, Kc, None, below[:, s], below[:, n], None, None)
    beneath = Mc[s].tocsc()
    return Partition(n, s, Kc, Mc, below[:, s], below[:, n], beneath[:, s], beneath[:, n])


def master_rows(masters: Index, size: int) -> Index:
    """``masters`` as an index array; raises `InputError` when empty, repeated or outside 0 … size −
    1."""
    n = np.atleast_1d(np.asarray(masters))
    if n.ndim != 1 or n.size == 0 or not np.issubdtype(n.dtype, np.integer):
        raise InputError(
            "masters: give the rows of the full model that are measured, a list of at least "
            "one integer"
        )
    if n.min() < 0 or n.max() >= size:
        raise InputError(f"masters: rows must lie in 0 … {size - 1}, got {n.min()} … {n.max()}")
    if np.unique(n).size != n.size:
        twice = sorted({int(i) for i in n if np.sum(n == i) > 1})
        raise InputError(
            f"masters: rows {twice} are given more than once; give each measured DOF once"
        )
    return n.astype(np.intp)


def factorise(Z: Any, rows: Index, shift: float) -> tuple[Any, str]:
    """Sparse LU of symmetric Z, with a test that it is not singular to working precision; raises
    `ModelError`."""
    where = (
        f"K_ss − λ M_ss at √λ/2π = {np.sqrt(abs(shift)) / (2 * np.pi):.6g} Hz" if shift else "K_ss"
    )
    remedy = (
        "choose a frequency that is not a natural frequency of the slaves"
        if shift
        else "the slaves are a mechanism when the masters are held: add masters or stiffness"
    )
    Z = Z.tocsc()
    try:
        # Symmetric mode orders for the pattern of Z + Zᵀ: less fill than the column ordering,
        # pivots near the diagonal.
        lu = splu(
            Z, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.01, options={"SymmetricMode": True}
        )
    except RuntimeError as error:
        raise ModelError(
            f"reduction: {where} is singular ({rows.size} slaves); {remedy}"
        ) from error
    # Two steps of inverse iteration on the matrix scaled to a unit diagonal estimate its smallest
    # eigenvalue.
    scale = np.sqrt(np.abs(Z.diagonal()))
    probe = np.random.default_rng(0).standard_normal(rows.size)
    for _ in range(2):
        right = (scale * probe / np.linalg.norm(probe)).astype(Z.dtype)
        probe = scale * lu.solve(right)
    if not np.linalg.norm(probe) < 1e14:
        raise ModelError(f"reduction: {where} is singular to working precision; {remedy}")
    return lu, "c" if np.issubdtype(Z.dtype, np.complexfloating) else "f"


def dense_modes(K: Real, M: Real, count: int) -> tuple[Real, Real]:
    """Lowest modes of a small dense pencil: λ (count,), mass-normalised shapes; M may be
    semi-definite.

    Massless directions have infinite frequency; with K positive definite they are the zero
    eigenvalues of M against K.
    """
    try:
        value, shape = eigh(K, M)
    except np.linalg.LinAlgError:
        inverse, shape = eigh(M, K)
        finite = inverse > 1e-14 * inverse.max()
        value, shape = (
            1.0 / inverse[finite][::-1],
            (shape[:, finite] / np.sqrt(inverse[finite]))[:, ::-1],
        )
    if value.size < count:
        raise InputError(
            f"slave_modes: only {value.size} slave modes have mass, {count} were asked for"
        )
    return value[:count], shape[:, :count]


def _symmetric(A: Any, name: str) -> Any:
    A = sparse.csc_matrix(A)
    if A.shape[0] != A.shape[1]:
        raise InputError(f"partition: {name} must be square, got {A.shape}")
    if not np.all(np.isfinite(A.data)):
        raise InputError(f"partition: {name} has entries that are not finite")
    if not np.issubdtype(A.dtype, np.inexact):
        A = A.astype(np.float64)
    largest = np.abs(A.data).max(initial=0.0)
    if np.abs((A - A.T).data).max(initial=0.0) > 1e-8 * largest:
        raise ModelError(
            f"partition: {name} is not symmetric; a gyroscopic or feedback term must be kept "
            "out of it"
        )
    return A
