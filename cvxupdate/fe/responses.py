"""Frequency responses: the dynamic stiffness Z(ω) = K + iD + iωC − ω²M, factorised once a frequency, and the receptances Z⁻¹.

Undamped models stay real. Modal damping (Model.modal_damping) is carried by the C of `damping.modal_matrix`.
"""

from __future__ import annotations

from dataclasses import dataclass
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

    ``T`` (N, n) = [I; −Z_ss⁻¹ Z_sn], None where every DOF is measured; ``Z`` (n, n) the reduced dynamic stiffness T^T Z T; ``force`` (n, r) the
    unit forces carried to the measured DOFs; ``hidden`` (N, r) the motion of the others under forces of their own with the measured ones held.
    """

    T: Field | None
    Z: Field
    force: Field
    hidden: Field | None

    def field(self, x: Field) -> Field:
        """Motion (N, r) of the whole model when the measured DOFs move by ``x`` (n, r) and the unit forces act."""
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
    if not damped(m):
        return sp.csc_array(m.K - omega**2 * m.M)
    return sp.csc_array(m.K - omega**2 * m.M + 1j * (m.D + omega * m.C))


def factor_at(m: Matrices, frequency: float) -> Factor:
    """Factors of Z at ``frequency`` (Hz).

    Raises
    ------
    ModelError
        Where Z is singular: an undamped natural frequency, or 0 Hz of a free structure.
    """
    return factorise_at(dynamic_stiffness(m, 2.0 * np.pi * frequency), frequency, "a natural frequency of the model")


def factorise_at(Z: sp.csc_array, frequency: float, why: str) -> Factor:
    """`factorise`, with a message that names the frequency."""
    try:
        return factorise(Z, WHAT.format(frequency))
    except ModelError as error:
        raise ModelError(f"{WHAT.format(frequency)} is singular: {why}. Move the frequency, or give the model damping.") from error


def receptance(model: Model, frequency: ArrayLike, responses: Index, references: Index, p: ArrayLike | None = None) -> Field:
    """H (lines, responses, references) in m/N (rad/N·m …) at ``frequency`` (lines,) Hz; DOFs as places among the free ones.

    Raises
    ------
    ModelError
        At a singular frequency.
    """
    m = matrices_with_damping(model, p)
    out = []
    unit = np.zeros((model.size, len(references)), dtype=complex if damped(m) else float)
    unit[references, np.arange(len(references))] = 1.0
    for f in np.atleast_1d(np.asarray(frequency, dtype=float)):
        out.append(factor_at(m, float(f)).solve(unit)[responses])
    return np.array(out).reshape(-1, len(responses), len(references))


def condense(m: Matrices, frequency: float, measured: Index, references: Index) -> Condensed:
    """The model condensed to ``measured`` (n,) at ``frequency`` (Hz), with unit forces at ``references`` (r,).

    One factorisation, of Z_ss: the structure with its measured DOFs held.

    Raises
    ------
    ModelError
        Where Z_ss is singular: a natural frequency of the held structure (thesis 3.5.1).
    """
    Z = dynamic_stiffness(m, 2.0 * np.pi * frequency)
    size, n, r = Z.shape[0], len(measured), len(references)
    at = np.full(size, -1, dtype=np.int64)
    at[measured] = np.arange(n)
    force = np.zeros((n, r), dtype=Z.dtype)
    seen = at[references] >= 0
    force[at[references[seen]], np.flatnonzero(seen)] = 1.0
    if n == size:
        order = np.asarray(measured)
        return Condensed(_ordered(order, size), np.asarray(Z[order][:, order].toarray()), force, None)
    rest = np.flatnonzero(at < 0)
    columns = sp.csc_array(Z[:, measured])
    unseen = np.flatnonzero(~seen)
    load = np.zeros((len(rest), n + len(unseen)), dtype=Z.dtype)
    load[:, :n] = -columns[rest].toarray()
    load[np.searchsorted(rest, references[unseen]), n + np.arange(len(unseen))] = 1.0
    moved = factorise_at(sp.csc_array(Z[rest][:, rest]), frequency, "a natural frequency of the structure held at the measured DOFs").solve(load)
    T = np.zeros((size, n), dtype=Z.dtype)
    T[measured, np.arange(n)] = 1.0
    T[rest] = moved[:, :n]
    Zn = sp.csr_array(columns[measured])
    reduced = Zn.toarray() + columns[rest].T @ moved[:, :n]
    hidden = None
    if len(unseen):
        hidden = np.zeros((size, r), dtype=Z.dtype)
        hidden[np.ix_(rest, unseen)] = moved[:, n:]
        force[:, unseen] = -(columns[rest].T @ moved[:, n:])
    return Condensed(T, (reduced + reduced.T) / 2.0, force, hidden)


def _ordered(order: Index, size: int) -> Real | None:
    """None where the measured DOFs are all DOFs in their own order, else their permutation."""
    if np.array_equal(order, np.arange(size)):
        return None
    T = np.zeros((size, size))
    T[order, np.arange(size)] = 1.0
    return T


def held_frequencies(model: Model, measured: Index, count: int, p: Real | None = None) -> Real:
    """The lowest natural frequencies (Hz) of the structure held at its measured DOFs (thesis 3.29); empty where nothing is left to move.

    There the reduced dynamic stiffness is singular, and near them far from linear in the parameters.
    """
    from cvxupdate.fe.modes import natural_modes

    m = model.matrices(p)
    rest = np.setdiff1d(np.arange(model.size), measured)
    if not len(rest):
        return np.zeros(0)
    modes = natural_modes(sp.csc_array(m.K[rest][:, rest]), sp.csc_array(m.M[rest][:, rest]), min(count, len(rest)))
    return modes.frequencies
