"""Poles in the time domain from FRFs: the eigensystem realisation algorithm, and Ibrahim's method.

Both look at impulse responses of the band. The band is moved to 0 Hz (only poles of positive
frequency remain, and the samples are no denser than needed), tapered at its ends, and transformed;
lags near zero, which hold the taper's own transform and the residual terms, are left out. A
spectrum of finitely many lines folds the response's tail back on its start: a sum of the same
exponentials, so the poles are not biased by it.

Sources: J.-N. Juang, R. Pappa, J. Guid. Control Dyn. 8 (1985) 620; S. Ibrahim, E. Mikulcik, Shock
and Vibration Bulletin 47 (1977) 183, with the double least squares of S. Ibrahim (1986); it is
equations (2.18) to (2.21) of the thesis on measured responses.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify.plscf import PoleSet
from cvxupdate.recordings.types import Complex, Real

TIME_DOMAIN = ("realisation", "ibrahim")
TAPER = 0.1
"""Fraction of the band over which it fades at each end."""
SKIPPED = 24
"""First lags that are left out: the taper's own transform, which falls as its cube, is below a
thousandth there. With fewer, modes in the taper split."""
MOST_COLUMNS = 1200


def impulse_responses(frequency: Real, H: Complex) -> tuple[Complex, float]:
    """Impulse responses (lags, outputs, inputs) of the band moved to 0 Hz, and the time step (s).

    Raises
    ------
    RecordingError
        When the lines are not evenly spaced.
    """
    steps = np.diff(frequency)
    step = float(np.median(steps))
    if np.any(np.abs(steps - step) > 1e-3 * step):
        raise RecordingError(
            "the lines are not evenly spaced, so the FRFs have no impulse responses; use the "
            "method plscf"
        )
    n = frequency.size
    edge = max(1, round(TAPER * n))
    taper = np.ones(n)
    taper[:edge] = np.sin(0.5 * np.pi * (np.arange(edge) + 0.5) / edge) ** 2
    taper[-edge:] = taper[:edge][::-1]
    h = np.fft.ifft(H * taper[:, None, None], axis=0)
    return np.asarray(h[SKIPPED : max(SKIPPED + 2, n // 2)]), 1.0 / (n * step)


def _hankel(h: Complex, rows: int, columns: int, shift: int) -> Complex:
    """Blocks ``h[i + j + shift]``, (rows outputs, columns inputs)."""
    index = np.arange(rows)[:, None] + np.arange(columns)[None, :] + shift
    blocks = h[index]
    return np.asarray(blocks.transpose(0, 2, 1, 3).reshape(rows * h.shape[1], columns * h.shape[2]))


def _sizes(h: Complex, top: int) -> tuple[int, int]:
    """Block rows and columns for orders up to ``top``: twice as many rows as states, so that noise
    has somewhere to go, and all the columns there are."""
    lags, outputs, inputs = h.shape
    rows = min(max(2, -(-2 * top // outputs)), max(2, lags // 2))
    columns = min(lags - rows, max(MOST_COLUMNS // inputs, -(-top // inputs)))
    return rows, columns


def _era(h: Complex, orders: NDArray[np.int64]) -> list[tuple[int, Complex, Complex]]:
    rows, columns = _sizes(h, int(orders[-1]))
    U, s, Vh = np.linalg.svd(_hankel(h, rows, columns, 0), full_matrices=False)
    top = min(int(orders[-1]), int(np.count_nonzero(s > 1e-13 * s[0])))
    middle = np.conj(U[:, :top].T) @ _hankel(h, rows, columns, 1) @ np.conj(Vh[:top].T)
    root = np.sqrt(s[:top])
    found = []
    for order in orders[orders <= top]:
        n = int(order)
        A = middle[:n, :n] / np.outer(root[:n], root[:n])
        values, vectors = np.linalg.eig(A)
        B = root[:n, None] * Vh[:n, : h.shape[2]]
        found.append((n, values, np.linalg.solve(vectors, B)))
    return found


def _ibrahim(h: Complex, orders: NDArray[np.int64]) -> list[tuple[int, Complex, Complex]]:
    """The state matrix by double least squares, the mean of ``Y1 Y0^H (Y0 Y0^H)^-1`` and ``Y1 Y1^H
    (Y0 Y1^H)^-1``: what noise takes from one it adds to the other."""
    top = int(orders[-1])
    rows = min(-(-top // h.shape[1]), h.shape[0] // 2)
    columns = h.shape[0] - rows
    before, after = _hankel(h, rows, columns, 0), _hankel(h, rows, columns, 1)
    found = []
    for order in orders[orders <= before.shape[0]]:
        n = int(order)
        y, z = before[:n], after[:n]
        yy, zz, zy = y @ np.conj(y.T), z @ np.conj(z.T), z @ np.conj(y.T)
        scale = np.trace(yy).real / n
        ridge = 1e-14 * scale * np.eye(n)
        first = np.linalg.solve((yy + ridge).T, zy.T).T
        second = np.linalg.solve((np.conj(zy.T) + ridge).T, zz.T).T
        values, vectors = np.linalg.eig(0.5 * (first + second))
        start = np.linalg.lstsq(vectors, y[:, : h.shape[2]], rcond=None)[0]
        found.append((n, np.asarray(values), np.asarray(start, dtype=np.complex128)))
    return found


def time_domain_poles(
    frequency: Real, H: Complex, *, orders: NDArray[np.int64], method: str = "realisation"
) -> list[PoleSet]:
    """Stable poles in the band for every order; ``method`` "realisation" (ERA) or "ibrahim".

    ``frequency`` (lines,) Hz, evenly spaced; ``H`` (lines, outputs, inputs), any motion: a factor
    ``(i omega)^n`` changes residues only. An order is a number of poles in the band.

    Raises
    ------
    RecordingError
        When the lines are not evenly spaced, or there are too few.
    """
    h, step = impulse_responses(frequency, H / np.abs(H).max(initial=1e-300))
    if h.shape[0] < 8:
        raise RecordingError(
            f"{frequency.size} lines are too few for impulse responses; widen the band"
        )
    origin = 2.0 * np.pi * float(frequency[0])
    sets = []
    for order, values, participation in (_era if method == "realisation" else _ibrahim)(h, orders):
        with np.errstate(divide="ignore", invalid="ignore"):
            # the phase of a line beyond half the band is that of a positive frequency
            angle = np.mod(np.angle(values), 2.0 * np.pi)
            poles = (np.log(np.abs(values)) + 1j * angle) / step + 1j * origin
        keep = np.isfinite(poles) & (poles.real < 0.0) & (np.abs(values) > 1e-3)
        rank = np.argsort(poles[keep].imag)
        sets.append(PoleSet(order, poles[keep][rank], participation[keep][rank]))
    return sets
