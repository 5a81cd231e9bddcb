"""FRFs against FRFs: error norms, FRAC, FDAC (section 2.2.7).

H is (lines, responses, references), complex, both sets in one unit; lines with a NaN in an entry
are left out of it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.errors import InputError

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class FrfCorrelation:
    """``error`` and ``frac`` (responses, references), ``total`` over all; ``fdac`` (lines_a,
    lines_x, references) on ``lines`` Hz."""

    error: Real
    total: float
    frac: Real
    lines: Real
    fdac: Real

    def to_json(self) -> dict[str, Any]:
        """Lists and numbers for ``json.dumps``; an entry that was never measured becomes None."""

        def plain(values: Real) -> Any:
            entries = values.astype(object)
            entries[~np.isfinite(values)] = None
            return entries.tolist()

        return {
            "error": plain(self.error),
            "total": self.total,
            "frac": plain(self.frac),
            "lines": self.lines.tolist(),
            "fdac": plain(self.fdac),
        }


def frf_errors(H_a: Complex, H_x: Complex, reference: str = "measured") -> Real:
    """‖H_a − H_x‖ / ‖H_x‖ over the lines, for every response and reference: (responses,
    references).

    (2.14) divides by the model's norm (``reference = "model"``); the default divides by the
    measured one, as ``frf_error`` does in every result file. NaN for an entry without lines,
    infinite against a reference of zero. Raises `InputError` when the sets differ in shape.
    """
    a, x = _same(H_a, H_x)
    base = _base(a, x, reference)
    return _ratio(np.linalg.norm(a - x, axis=0), np.linalg.norm(base, axis=0))


def frf_error(H_a: Complex, H_x: Complex, reference: str = "measured") -> float:
    """The same over every line, response and reference at once: ‖H_a − H_x‖ / ‖H_x‖. 0 is perfect,
    1 as large as H_x."""
    a, x = _same(H_a, H_x)
    return float(
        _ratio(np.array(np.linalg.norm(a - x)), np.array(np.linalg.norm(_base(a, x, reference))))
    )


def frac(H_a: Complex, H_x: Complex) -> Real:
    """Frequency response assurance criterion |Σ_ω H_x* H_a|² / (Σ|H_a|² Σ|H_x|²), (responses,
    references), 0 to 1.

    Heylen & Lammens (1996): the shape of two FRFs over frequency, whatever their scale. NaN for an
    entry without lines.
    """
    a, x = _same(H_a, H_x)
    top = np.abs(np.sum(x.conj() * a, axis=0)) ** 2
    return np.minimum(
        _ratio(top, np.sum(np.abs(a) ** 2, axis=0) * np.sum(np.abs(x) ** 2, axis=0)), 1.0
    )


def fdac(H_a: Complex, H_x: Complex) -> Real:
    """Frequency domain assurance criterion over both frequency axes, (lines_a, lines_x, references)
    (2.15, Pascual 1996).

    |H_a(ω_a)_jᴴ H_x(ω_x)_j|² / (‖H_a(ω_a)_j‖² ‖H_x(ω_x)_j‖²), with the modulus squared and the
    conjugate that the print lacks: a MAC of response shapes. A ridge beside the diagonal says by
    how much each frequency is shifted.

    Parameters
    ----------
    H_a : (lines_a, responses, references). H_x : (lines_x, responses, references); the frequency
    lists may differ.
    Channels with NaN in either line are left out of the pair. Raises `InputError` when the channels
    differ.
    """
    a, x = _cube(H_a), _cube(H_x)
    if a.shape[1:] != x.shape[1:]:
        raise InputError(f"fdac: responses and references differ, {a.shape[1:]} and {x.shape[1:]}")
    out = np.empty((a.shape[0], x.shape[0], a.shape[2]))
    for j in range(a.shape[2]):
        seen_a, seen_x = np.isfinite(a[:, :, j]), np.isfinite(x[:, :, j])
        va, vx = (
            _unit_rows(np.where(seen_a, a[:, :, j], 0.0)),
            _unit_rows(np.where(seen_x, x[:, :, j], 0.0)),
        )
        norms = (np.abs(va) ** 2 @ seen_x.T.astype(np.float64)) * (
            seen_a.astype(np.float64) @ (np.abs(vx) ** 2).T
        )
        out[:, :, j] = np.minimum(_ratio(np.abs(va.conj() @ vx.T) ** 2, norms, empty=0.0), 1.0)
    return out


def frf_correlation(
    frequency: Real, H_a: Complex, H_x: Complex, lines: int = 400
) -> FrfCorrelation:
    """Everything the page shows of FRFs, at the same ``frequency`` (lines,) Hz; FDAC on at most
    ``lines`` of them."""
    a, _ = _same(H_a, H_x)
    if np.shape(frequency) != (a.shape[0],):
        raise InputError(
            f"frf_correlation: {np.size(frequency)} frequencies for {a.shape[0]} lines of H"
        )
    chosen = np.unique(np.linspace(0, a.shape[0] - 1, min(lines, a.shape[0])).round().astype(int))
    return FrfCorrelation(
        frf_errors(H_a, H_x),
        frf_error(H_a, H_x),
        frac(H_a, H_x),
        np.asarray(frequency)[chosen],
        fdac(_cube(H_a)[chosen], _cube(H_x)[chosen]),
    )


def _cube(H: Complex) -> Complex:
    out = np.asarray(H, dtype=np.complex128)
    if out.ndim != 3:
        raise InputError(f"H must be (lines, responses, references), got shape {out.shape}")
    return out


def _same(H_a: Complex, H_x: Complex) -> tuple[Complex, Complex]:
    a, x = _cube(H_a), _cube(H_x)
    if a.shape != x.shape:
        raise InputError(
            f"FRFs differ in shape: model {a.shape}, measured {x.shape}; compute the model at "
            "the measured lines and channels"
        )
    seen = np.isfinite(a) & np.isfinite(x)
    return np.where(seen, a, 0.0), np.where(seen, x, 0.0)


def _base(a: Complex, x: Complex, reference: str) -> Complex:
    if reference not in ("measured", "model"):
        raise InputError(f"frf errors: reference must be 'measured' or 'model', got {reference!r}")
    return x if reference == "measured" else a


def _unit_rows(v: Complex) -> Complex:
    peak = np.max(np.abs(v), axis=1, keepdims=True, initial=0.0)
    return np.asarray(v / np.where(peak > 0.0, peak, 1.0))


def _ratio(top: Real, bottom: Real, empty: float = np.nan) -> Real:
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(
            np.where((bottom == 0.0) & (top == 0.0), empty, top / bottom), dtype=np.float64
        )
