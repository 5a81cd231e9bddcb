"""A finite-element model as a `System`: its modes up to a multiple of the band, and static
corrections where forces act.

The elements' local flexibility lies mostly in modes far beyond the band; what they leave out is
added as residual attachment modes (Craig and Bampton 1968), one for each place where an element or
an input acts. Those answer statically in the band, so their own frequencies, where higher, are set
to `CAP` times the band: the answer stays, and steps need not follow what no recording shows.
"""

from __future__ import annotations

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from numpy.typing import ArrayLike

from cvxupdate.errors import ModelError
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.forces import Laws
from cvxupdate.forces.laws import Real
from cvxupdate.simulate.system import System, modal_system

BEYOND = 2.0
"""Modes are taken up to this many times the band: the rest answers statically to 1/3 at its end."""
CAP = 5.0
"""Of the band: static corrections with a higher frequency of their own get this one; at the band's
end they are then 4 % above their static answer, which is itself a small part of the whole."""
SAME = 1e-9
"""Of the largest static correction: below it is what the others say already."""
FIRST = 30
"""Modes asked for at first, then doubled."""


def reduced_system(
    model: Model,
    laws: Laws,
    directions: ArrayLike | sp.sparray,
    inputs: ArrayLike,
    outputs: ArrayLike,
    top: float,
    p: Real | None = None,
) -> System:
    """``model`` at ``p`` with ``laws`` along ``directions`` B (N, m); ``inputs`` (r,) and
    ``outputs`` (o,) are places among the free DOFs, −1 where a support holds (no input moves
    anything there, an output stays 0); ``top`` the end of the band in Hz.

    Structural damping, which has no meaning in time, becomes the viscous damping that takes as much
    energy at each natural frequency, η ω (Ewins 2000, section 2.4).

    Raises
    ------
    ModelError
        The model is a mechanism, or ``top`` is not above 0.
    """
    if not top > 0.0:
        raise ModelError(f"the band of a simulation must end above 0 Hz; got {top:g}.")
    if model.exact:
        raise ModelError(
            "a simulation in time needs K and M; exact_beam elements have none at all "
            "frequencies. Mesh them with beam3d."
        )
    m = model.matrices(p)
    B = sp.csc_array(directions).toarray()
    P, Y = (_units(model.size, np.asarray(a, dtype=np.int64)) for a in (inputs, outputs))
    modes = _modes(model, m, p, top)
    V, omega = _basis(model, m, modes, np.hstack([B, P]), top)
    damping = V.T @ (m.C @ V) + _structural(V, m, omega)
    if model.modal_damping:
        damping += np.diag(2.0 * _zeta(model, len(omega), modes.rigid) * omega)
    at = V.T @ np.hstack([B, P, Y])
    return modal_system(omega, (damping + damping.T) / 2.0, at, laws, P.shape[1])


def _units(size: int, places: np.ndarray) -> Real:
    out = np.zeros((size, len(places)))
    kept = np.flatnonzero(places >= 0)
    out[places[kept], kept] = 1.0
    return out


def _modes(model: Model, m: Matrices, p: Real | None, top: float) -> Modes:
    """Up to `BEYOND` times ``top``."""
    count = min(FIRST, model.size)
    while True:
        found = model_modes(model, count, model.zero() if p is None else p, m)
        short = len(found.eigenvalues) - found.rigid < count
        if count >= model.size or short or found.frequencies[-1] > BEYOND * top:
            break
        count = min(2 * count, model.size)
    kept = np.flatnonzero(found.frequencies <= BEYOND * top)
    last = max(int(kept[-1]) + 1 if len(kept) else 0, found.rigid + 1)
    return Modes(found.eigenvalues[:last], found.shapes[:, :last], found.rigid)


def _basis(model: Model, m: Matrices, modes: Modes, ports: Real, top: float) -> tuple[Real, Real]:
    """Mass-normalised vectors (N, n) and their frequencies (n,) in rad/s."""
    omega = np.sqrt(np.maximum(modes.eigenvalues, 0.0))
    omega[: modes.rigid] = 0.0
    used = ports[:, np.any(ports != 0.0, axis=0)]
    if modes.shapes.shape[1] >= model.size or not used.shape[1]:
        return modes.shapes, omega
    flexible = modes.flexible().eigenvalues
    shift = 0.05 * float(flexible[0]) if modes.rigid and len(flexible) else 0.0
    R = factored(sp.csc_array(m.K + shift * m.M), "the stiffness").solve(used)
    for _ in range(2):  # twice is enough (Kahan): what rounding leaves of the modes goes too
        R = R - modes.shapes @ (modes.shapes.T @ (m.M @ R))
    stiff = R.T @ (m.K @ R)
    lam, X = la.eigh((stiff + stiff.T) / 2.0)
    good = lam > SAME * lam.max(initial=0.0)
    R = R @ (X[:, good] / np.sqrt(lam[good]))  # RᵀKR = 1
    light, X = la.eigh(R.T @ (m.M @ R))
    own = 1.0 / np.sqrt(np.maximum(light, np.finfo(float).tiny))
    capped = np.minimum(own, CAP * 2.0 * np.pi * top)
    return np.hstack([modes.shapes, (R @ X) * capped]), np.concatenate([omega, capped])


def _structural(V: Real, m: Matrices, omega: Real) -> Real:
    """VᵀDV with entries over √(ω_i ω_j); nothing of rigid motion."""
    if not np.any(m.D.data):
        return np.zeros((len(omega), len(omega)))
    root = np.where(omega > 0.0, 1.0 / np.sqrt(np.where(omega > 0.0, omega, 1.0)), 0.0)
    return np.asarray(root[:, None] * (V.T @ (m.D @ V)) * root)


def _zeta(model: Model, count: int, rigid: int) -> Real:
    """Damping ratios of the vectors; the last one given counts for the rest."""
    given = model.modal_damping
    flexible = [given[min(i, len(given) - 1)] for i in range(count - rigid)]
    return np.array([0.0] * rigid + flexible)
