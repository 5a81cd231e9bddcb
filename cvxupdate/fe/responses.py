"""The dynamic stiffness Z(s) = K + iD + sC + s²M, its factors, and a model condensed exactly to its
measured DOFs. Responses of a model come from `fe.synthesis`.

Undamped models stay real. Modal damping (Model.modal_damping) is carried by the C of
`damping.modal_matrix`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.damping import with_modal_damping
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factor, factorise
from cvxupdate.fe.model import Matrices, Model

Field = NDArray[Any]  # real for an undamped model, else complex
WHAT = "the dynamic stiffness at {:.6g} Hz"


@dataclass(frozen=True)
class Condensed:
    """A model seen from its measured DOFs at one frequency, exactly (thesis 3.10–3.14).

    ``T`` (N, n) = [I; −Z_ss⁻¹ Z_sn], None where every DOF is measured; ``Z`` (n, n) the reduced
    dynamic stiffness T^T Z T; ``force`` (n, r) the unit forces carried to the measured DOFs;
    ``hidden`` (N, r) the motion of the others under forces of their own with the measured ones
    held.
    """

    T: Field | None
    Z: Field
    force: Field
    hidden: Field | None

    def field(self, x: Field) -> Field:
        """Motion (N, r) of the whole model when the measured DOFs move by ``x`` (n, r) and the unit
        forces act."""
        u = x if self.T is None else self.T @ x
        return u if self.hidden is None else u + self.hidden

    def carried(self, rows: Field) -> Field:
        """T @ rows, (N, k)."""
        return rows if self.T is None else np.asarray(self.T @ rows)


def matrices_with_damping(model: Model, p: ArrayLike | None = None) -> Matrices:
    """K, M, C, D at ``p``, modal damping included.

    Raises
    ------
    ModelError
        When modal damping is asked of a model too large for its full C.
    """
    m = model.matrices(p)
    return with_modal_damping(model, m) if model.modal_damping and any(model.modal_damping) else m


def damped(m: Matrices) -> bool:
    """Whether Z is complex."""
    return bool(np.any(m.C.data != 0.0) or np.any(m.D.data != 0.0))


def dynamic_stiffness(m: Matrices, omega: float) -> sp.csc_array:
    """Z(ω), real where the model is undamped; ``omega`` in rad/s."""
    return combined(m, 1j * omega, damped(m))


def factor_at(m: Matrices, frequency: float) -> Factor:
    """Factors of Z at ``frequency`` (Hz).

    Raises
    ------
    ModelError
        Where Z is singular: an undamped natural frequency, or 0 Hz of a free structure.
    """
    return factorise_at(
        dynamic_stiffness(m, 2.0 * np.pi * frequency), frequency, "a natural frequency of the model"
    )


def factorise_at(Z: sp.csc_array, frequency: float, why: str, ordered: bool = False) -> Factor:
    """`factorise`, with a message that names the frequency."""
    words = (
        f"{WHAT.format(frequency)} is singular: {why}. Move the frequency, or give the model "
        "damping."
    )
    try:
        factor = factorise(Z, WHAT.format(frequency), ordered=ordered)
    except ModelError as error:
        raise ModelError(words) from error
    if (
        frequency == 0.0 and Z.shape[0]
    ):  # a free structure: rounding may leave a pivot where theory has none
        pivots, size = np.abs(factor.lu.U.diagonal()), np.abs(Z.diagonal())
        if np.any(pivots < 1e-12 * size[np.argsort(factor.lu.perm_c)]):
            raise ModelError(words)
    return factor


@dataclass(frozen=True)
class Condenser:
    """What `condense` needs of one model, sensors and forces at every frequency: the blocks of K,
    M, C, D, cut once.

    ``measured`` (n,) and ``references`` (r,) are places among the free DOFs; ``blocks`` the (K, M,
    C, D) of the unmeasured DOFs ("ss"), between them and the measured ("sn"), and of the measured
    ("nn"); ``rest`` the unmeasured places.
    """

    size: int
    measured: Index
    references: Index
    rest: Index
    blocks: Mapping[str, Matrices]
    complex: bool

    def at(self, frequency: float) -> Condensed:
        """The model condensed at ``frequency`` (Hz): one factorisation, of Z_ss, the structure with
        its measured DOFs held.

        Raises
        ------
        ModelError
            Where Z_ss is singular: a natural frequency of the held structure (thesis 3.5.1).
        """
        s = 2j * np.pi * frequency
        n, r = len(self.measured), len(self.references)
        kind = complex if self.complex else float
        place = np.full(self.size, -1, dtype=np.int64)
        place[self.measured] = np.arange(n)
        seen = place[self.references] >= 0
        force = np.zeros((n, r), dtype=kind)
        force[place[self.references[seen]], np.flatnonzero(seen)] = 1.0
        Zn = combined(self.blocks["nn"], s, self.complex).toarray()
        if not len(self.rest):
            return Condensed(_ordered(self.measured, self.size), Zn, force, None)
        unseen = np.flatnonzero(~seen)
        columns = combined(self.blocks["sn"], s, self.complex)
        load = np.zeros((len(self.rest), n + len(unseen)), dtype=kind)
        load[:, :n] = -columns.toarray()
        load[np.searchsorted(self.rest, self.references[unseen]), n + np.arange(len(unseen))] = 1.0
        Zs = combined(self.blocks["ss"], s, self.complex)
        moved = factorise_at(
            Zs, frequency, "a natural frequency of the structure held at the measured DOFs"
        ).solve(load)
        T = np.zeros((self.size, n), dtype=kind)
        T[self.measured, np.arange(n)] = 1.0
        T[self.rest] = moved[:, :n]
        carried = columns.T @ moved
        reduced = Zn + carried[:, :n]
        hidden = None
        if len(unseen):
            hidden = np.zeros((self.size, r), dtype=kind)
            hidden[np.ix_(self.rest, unseen)] = moved[:, n:]
            force[:, unseen] = -carried[:, n:]
        return Condensed(T, (reduced + reduced.T) / 2.0, force, hidden)


def condenser(m: Matrices, measured: Index, references: Index) -> Condenser:
    """Cut K, M, C, D at the measured DOFs.

    Raises
    ------
    ModelError
        For a model with something that spins: what is reduced here and differentiated is symmetric.
    """
    if m.C.nnz and abs(m.C - m.C.T).max() > 1e-12 * abs(m.C).max():
        raise ModelError(
            "the model has gyroscopic elements: its frequency responses are not symmetric, "
            "which updating by force balance or receptance needs. Take them out for `run`, "
            "or use `diagnose` or `correlate`."
        )
    rest = np.setdiff1d(np.arange(m.K.shape[0]), measured)

    def cut(rows: Index, columns: Index) -> Matrices:
        K, M, C, D = (sp.csc_array(getattr(m, name)[:, columns][rows]) for name in "KMCD")
        return Matrices(K, M, C, D, m.beyond.cut(rows, columns) if m.beyond is not None else None)

    blocks = {"ss": cut(rest, rest), "sn": cut(rest, measured), "nn": cut(measured, measured)}
    return Condenser(
        m.K.shape[0], np.asarray(measured), np.asarray(references), rest, blocks, damped(m)
    )


def condense(m: Matrices, frequency: float, measured: Index, references: Index) -> Condensed:
    """`Condenser.at` for one frequency."""
    return condenser(m, measured, references).at(frequency)


def alike(m: Matrices) -> bool:
    """Whether K, M, C and D share one pattern."""
    return all(
        np.array_equal(m.K.indices, x.indices) and np.array_equal(m.K.indptr, x.indptr)
        for x in (m.M, m.C, m.D)
    )


def combined(m: Matrices, s: complex, as_complex: bool) -> sp.csc_array:
    """K + s²M, + sC + iD where ``as_complex``, and what exact members have beyond; the entries
    alone where all share one pattern."""
    if m.beyond is not None:
        Z = combined(replace(m, beyond=None), s, as_complex) + _part(m.beyond.at(s), as_complex)
        return sp.csc_array(Z)
    K, M = m.K, m.M
    square = s * s if as_complex else (s * s).real
    if not alike(m):
        Z = K + square * M
        return sp.csc_array(Z + (1j * m.D + s * m.C) if as_complex else Z)
    data = K.data + square * M.data
    if as_complex:
        data = data + (1j * m.D.data + s * m.C.data)
    return sp.csc_array((data, K.indices, K.indptr), shape=K.shape)


def _part(Z: sp.csc_array, as_complex: bool) -> sp.csc_array:
    return Z if as_complex else sp.csc_array(Z.real)


def _ordered(order: Index, size: int) -> Real | None:
    """None where the measured DOFs are all DOFs in their own order, else their permutation."""
    if np.array_equal(order, np.arange(size)):
        return None
    T = np.zeros((size, size))
    T[order, np.arange(size)] = 1.0
    return T


def held_frequencies(model: Model, measured: Index, count: int, p: Real | None = None) -> Real:
    """The lowest natural frequencies (Hz) of the structure held at its measured DOFs (thesis 3.29);
    empty where nothing is left to move.

    There the reduced dynamic stiffness is singular, and near them far from linear in the
    parameters.
    """
    from cvxupdate.fe.modes import natural_modes

    m = model.matrices(p)
    rest = np.setdiff1d(np.arange(model.size), measured)
    if not len(rest):
        return np.zeros(0)
    modes = natural_modes(
        sp.csc_array(m.K[rest][:, rest]), sp.csc_array(m.M[rest][:, rest]), min(count, len(rest))
    )
    return modes.frequencies
