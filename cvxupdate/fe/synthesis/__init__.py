"""Responses of a model to unit forces: one front door, three ways through.

The receptance is H(s) = B (K + iD + sC + s²M)⁻¹ Fᵀ on points s = δ + iω of the right half-plane;
δ = 0 is the frequency response.

| way | what is solved | exact | damping |
|---|---|---|---|
| direct | one sparse factorisation for each point | yes | any |
| modal | a sum over modes and static corrections; what couples them by Woodbury's formula | whole \
models | any, cheap while its coupling has a low rank |
| reduced | the same basis, one dense system for each point | whole models | any |

`choose` takes "direct" for a few points, where no basis pays, and for everything too coupled for a
basis to be cheap; "modal" where the damping leaves the basis (nearly) uncoupled; else "reduced".
Whatever `responses` does on a truncated basis it holds to `ACCURACY` by direct solution at two
points, and goes direct where the basis misses it.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Any, Final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.damping import with_modal_damping
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.responses import damped
from cvxupdate.fe.synthesis.basis import WHOLE, Basis, Subspace
from cvxupdate.fe.synthesis.direct import DirectLines
from cvxupdate.fe.synthesis.modal import ModalSum
from cvxupdate.fe.synthesis.reduced import Galerkin

__all__ = [
    "DirectLines",
    "Galerkin",
    "ModalSum",
    "choose",
    "fields",
    "frequency_responses",
    "receptance",
    "responses",
]

Field = NDArray[Any]
Complex = NDArray[np.complex128]

ORDER: Final = {"displacement": 0, "velocity": 1, "acceleration": 2}
"""Powers of s by which a response of each quantity differs from a displacement."""
WAYS: Final = ("direct", "modal", "reduced")
FEW_POINTS: Final = 20
"""Points up to which one factorisation each costs no more than a basis: 10 to 20 on plates of
600 to 8000 DOFs (tests/benchmarks/test_synthesis.py)."""
COUPLED: Final = 0.3
"""Part of the basis up to which columns of coupling damping are taken by Woodbury's formula."""
DENSE: Final = 8.0
"""Times the model's DOFs that the square of the basis may come to before a dense system costs more
than a sparse one (ibid.): 126 DOFs, 1.3 against 0.25 ms a point; 576 DOFs, 0.1 against 1.3 ms."""
ACCURACY: Final = 1e-7
"""Of the norm of the responses: what a truncated basis may miss at the points that are checked."""
BLOCKS: Final = 5
"""Static corrections of ever higher order that are tried."""


def choose(points: int, size: int, basis: int, rank: int, direct: bool = True) -> str:
    """The way for that many ``points`` of a model with ``size`` DOFs, vectors in the ``basis`` and
    columns of coupling damping (``rank``); ``direct``: whether the direct one may be taken."""
    if direct and points <= FEW_POINTS:
        return "direct"
    if rank <= COUPLED * basis:
        return "modal"
    return "direct" if direct and basis**2 > DENSE * size else "reduced"


def responses(
    model: Model,
    s: ArrayLike,
    outputs: Index,
    inputs: Index,
    quantity: str = "displacement",
    p: Real | None = None,
    way: str | None = None,
) -> Field:
    """Responses (points, outputs, inputs) per unit force at ``s`` (points,) in rad/s, as
    displacements, velocities or accelerations.

    Parameters
    ----------
    outputs, inputs : places among the free DOFs, −1 for a DOF that is held (its response is 0).
    way : one of `WAYS`; None lets `choose` decide. Undamped displacements on the imaginary axis by
    the direct way are real.

    Raises
    ------
    InputError
        For a quantity that is no motion, or a way that is none.
    ModelError
        The model is a mechanism, or a point is a pole of it.
    """
    if quantity not in ORDER:
        raise InputError(f"responses: {quantity!r} is no motion; use one of {', '.join(ORDER)}")
    if way is not None and way not in WAYS:
        raise InputError(f"responses: {way!r} is no way; use one of {', '.join(WAYS)}")
    points: Complex = np.atleast_1d(np.asarray(s, dtype=np.complex128))
    outputs, inputs = np.asarray(outputs), np.asarray(inputs)
    seen_o, seen_i = outputs >= 0, inputs >= 0
    found = _receptances(model, points, outputs[seen_o], inputs[seen_i], p, way)
    H: Field = np.zeros((len(points), len(outputs), len(inputs)), dtype=found.dtype)
    H[np.ix_(np.arange(len(points)), np.flatnonzero(seen_o), np.flatnonzero(seen_i))] = found
    order = ORDER[quantity]
    return H if order == 0 else H * (points**order)[:, None, None]


def frequency_responses(
    model: Model,
    frequency: ArrayLike,
    outputs: Index,
    inputs: Index,
    quantity: str = "displacement",
    p: Real | None = None,
    way: str | None = None,
) -> Field:
    """`responses` at ``frequency`` (lines,) Hz."""
    f = np.atleast_1d(np.asarray(frequency, dtype=float))
    return responses(model, 2j * np.pi * f, outputs, inputs, quantity, p, way)


def _receptances(
    model: Model, s: Complex, outputs: Index, inputs: Index, p: Real | None, way: str | None
) -> Field:
    m = model.matrices(p)
    if not len(s) or not len(outputs) or not len(inputs):
        return np.zeros((len(s), len(outputs), len(inputs)), dtype=complex)
    if model.exact:
        return _direct(model, m, s, outputs, inputs)  # no basis of modes is exact for them
    sparse = not _modal(model) or model.size <= WHOLE  # modal damping fills C
    if way == "direct" or (way is None and sparse and len(s) <= FEW_POINTS):
        return _direct(model, m, s, outputs, inputs)
    basis, enough = _basis(model, m, p, s, outputs, inputs)
    if way is None:
        way = "direct" if sparse and not enough else None
    way = way or choose(len(s), model.size, basis.size, basis.rank, sparse)
    if way == "direct":
        return _direct(model, m, s, outputs, inputs)
    made, basis = _made(model, basis, way)
    try:
        found = made.at(s, basis.V[outputs], basis.V[inputs])
    except np.linalg.LinAlgError:
        found = np.full((len(s), 1, 1), np.nan)
    if not np.all(np.isfinite(found)):
        raise ModelError(
            "a line meets a natural frequency of the undamped model, where its response has no "
            "bound. Move the line, or give the model damping."
        )
    return found


def fields(
    model: Model, s: Complex, places: Index, p: Real | None = None
) -> Callable[[Complex, Index], Complex] | None:
    """What gives the motions (rows, points, places) of the DOFs ``rows`` per unit force at
    ``places`` on some of the points ``s``, on one basis for all of them, as accurate as
    `ACCURACY` says at the places themselves; None where direct solutions are called for: few
    points, a small model, exact elements, no damping, or no basis that pays.

    Raises
    ------
    ModelError
        The model is a mechanism.
    """
    m = model.matrices(p)
    lossy = _modal(model) or damped(m)
    if model.exact or model.size <= WHOLE or len(s) <= FEW_POINTS or not lossy:
        return None
    basis, enough = _basis(model, m, p, s, places, places)
    way = choose(len(s), model.size, basis.size, basis.rank, not _modal(model))
    if way == "direct" or not enough:
        return None
    made, basis = _made(model, basis, way)

    def motions(points: Complex, rows: Index) -> Complex:
        return made.at(points, basis.V[rows], basis.V[places]).transpose(1, 0, 2)

    return motions


def _made(model: Model, basis: Basis, way: str) -> tuple[ModalSum | Galerkin, Basis]:
    """What sums over a basis, with the model's modal damping: 2ζ√(κμ) is lost with velocity, 2ζκ
    with displacement."""
    modal, share = _modal_loss(model, basis), model.hysteretic
    basis = replace(basis, loss=basis.loss + share * modal * _frequency(basis))
    return (ModalSum if way == "modal" else Galerkin).of(basis, (1.0 - share) * modal), basis


def _basis(
    model: Model, m: Matrices, p: Real | None, s: Complex, outputs: Index, inputs: Index
) -> tuple[Basis, bool]:
    """A basis for ``s``, and whether it is as accurate as `ACCURACY` says."""
    top = float(np.abs(s).max()) / (2.0 * np.pi)
    ports = np.unique(np.concatenate([outputs, inputs]))
    subspace = Subspace.of(model, m, p, top, ports)
    for blocks in range(1, BLOCKS + 1):
        basis = subspace.basis(blocks)
        enough = _misses(basis, m, s, outputs, inputs) <= ACCURACY
        if enough or subspace.complete:
            break
    return basis, enough


def receptance(
    model: Model, frequency: ArrayLike, outputs: Index, inputs: Index, p: Real | None = None
) -> Field:
    """Receptances (lines, outputs, inputs) at ``frequency`` (lines,) Hz by the direct way, real for
    an undamped model.

    Raises
    ------
    ModelError
        At a singular frequency.
    """
    return frequency_responses(model, frequency, outputs, inputs, p=p, way="direct")


def _modal(model: Model) -> bool:
    return any(z > 0.0 for z in model.modal_damping)


def _direct(model: Model, m: Matrices, s: Complex, outputs: Index, inputs: Index) -> Field:
    whole = with_modal_damping(model, m) if _modal(model) else m
    return DirectLines(whole, inputs).between(s, outputs)


def _misses(basis: Basis, m: Matrices, s: Complex, outputs: Index, inputs: Index) -> float:
    """What the basis misses of the direct responses at two points that stand off the resonances,
    of their norm, without modal damping (which is of the modes themselves)."""
    top = np.abs(s).max()
    test: Complex = top * np.array([0.1 + 1.0j, 0.1 + 0.6j])
    exact = DirectLines(m, inputs).between(test, outputs)
    none = np.zeros(basis.size)
    if basis.rank <= COUPLED * basis.size:
        mine = ModalSum.of(basis, none).at(test, basis.V[outputs], basis.V[inputs])
    else:
        mine = Galerkin.of(basis, none).at(test, basis.V[outputs], basis.V[inputs])
    size = float(np.linalg.norm(exact))
    return float(np.linalg.norm(mine - exact)) / size if size > 0.0 else 0.0


def _frequency(basis: Basis) -> Real:
    """√(κ/μ) of each vector; 0 of one without mass, which modal damping does not reach."""
    heavy = basis.mu > 0.0
    return np.where(heavy, np.sqrt(basis.kappa / np.where(heavy, basis.mu, 1.0)), 0.0)


def _modal_loss(model: Model, basis: Basis) -> Real:
    """The damping 2ζ√(κμ) of each vector by the model's modal damping, were it all viscous: its
    modes in order, the last ζ for the rest; none of a rigid-body mode."""
    if not _modal(model):
        return np.zeros(basis.size)
    zeta = np.array(model.modal_damping)
    number = np.cumsum(basis.kappa > 0.0) - 1
    return np.asarray(
        2.0 * zeta[np.clip(number, 0, len(zeta) - 1)] * np.sqrt(basis.kappa * basis.mu)
    )
