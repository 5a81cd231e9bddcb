"""Natural frequencies against natural frequencies (section 2.2.1)."""

from __future__ import annotations

import numpy as np

from cvxupdate.correlate._shapes import Real
from cvxupdate.errors import InputError


def frequency_errors(f_a: Real, f_x: Real, reference: str = "measured") -> Real:
    """Signed error of every paired frequency in per cent of the reference; positive: the model is
    too stiff.

    (2.1) divides by the model's frequency (``reference = "model"``); the default divides by the
    measured one, as `frequency_error_percent_mean` does in every result file.

    Parameters
    ----------
    f_a, f_x : (modes,) Hz, paired. Raises `InputError` when they are not paired or a reference is
    not positive.
    """
    a, x = _paired(f_a, f_x)
    base = _reference(a, x, reference)
    return np.asarray(100.0 * (a - x) / base)


def frequency_scatter(f_a: Real, f_x: Real, reference: str = "measured") -> float:
    """Overall scatter in per cent, 100 √(Σ(f_a − f_x)² / Σ f²) with f the reference (2.2).
    Arguments as above."""
    a, x = _paired(f_a, f_x)
    base = _reference(a, x, reference)
    return float(100.0 * np.linalg.norm(a - x) / np.linalg.norm(base))


def _paired(f_a: Real, f_x: Real) -> tuple[Real, Real]:
    a, x = np.asarray(f_a, dtype=np.float64), np.asarray(f_x, dtype=np.float64)
    if (
        a.shape != x.shape
        or a.ndim != 1
        or a.size == 0
        or not np.all(np.isfinite(a) & np.isfinite(x))
    ):
        raise InputError(
            f"frequency errors: need paired lists of finite frequencies in Hz, got {a.shape} "
            f"and {x.shape}"
        )
    return a, x


def _reference(a: Real, x: Real, reference: str) -> Real:
    if reference not in ("measured", "model"):
        raise InputError(
            f"frequency errors: reference must be 'measured' or 'model', got {reference!r}"
        )
    base = x if reference == "measured" else a
    if np.any(base <= 0.0):
        raise InputError(
            "frequency errors: a reference frequency is not positive; leave rigid-body modes out"
        )
    return base
