"""Every measure of the correlation page, computed from arrays, in one frozen object."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, fields, is_dataclass
from typing import Any

import numpy as np

from cvxupdate.correlate._shapes import Real, Shapes, same_dofs
from cvxupdate.correlate.balance import (
    ElementBalance,
    balance_map,
    element_balance,
    static_difference,
)
from cvxupdate.correlate.elements import ElementBatch
from cvxupdate.correlate.energy import EnergyComparison, energy_comparison, energy_map
from cvxupdate.correlate.frequency import frequency_errors, frequency_scatter
from cvxupdate.correlate.mac import comac, mac, mac_error, modal_scale_factor
from cvxupdate.correlate.orthogonality import (
    PseudoOrthogonality,
    cross_orthogonality,
    mass_orthogonality,
    pseudo_orthogonality,
    reduced_pseudo_orthogonality,
)
from cvxupdate.correlate.pairing import Pairing, pair_modes
from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction.transformation import Transformation


@dataclass(frozen=True)
class Correlation:
    """Model against measured modes at n sensors; P pairs, in the order of the measured modes.

    Always: ``pairing``; ``frequency_model``, ``frequency_measured`` (P,) Hz, ``frequency_std``
    likewise or None; ``frequency_error`` (P,) signed per cent of the measured,
    ``frequency_error_percent_mean`` and ``_max`` of their moduli, ``frequency_scatter`` per cent;
    ``mac`` (modes_a, modes_x), ``mac_mean``, ``mac_min``, ``mac_error`` per cent over the pairs;
    ``auto_mac_model`` and ``auto_mac_measured``: each set with itself as these sensors see it;
    ``scale_factor`` (P,), ``shapes_model`` and ``shapes_measured`` (n, P) on one scale and phase
    with a largest model entry of 1, for the 45° lines; ``comac`` (n,).

    Where a transformation with K and M was given (None otherwise), for the ``complete`` pairs
    without a gap: ``mass_orthogonality``, ``cross_orthogonality`` and, with the model's modes,
    ``pseudo_orthogonality``, moduli of complex products; ``pseudo_checks`` the four of (2.9) at the
    sensors, moduli; ``static_difference`` (pairs,) of Wada's forces (2.12); ``energy`` and
    ``balance`` (N,), the relative imbalance per DOF; with element matrices ``element_balance`` and
    ``element_energy``
    (elements,). ``notes`` say in words what could not be computed and why.
    """

    pairing: Pairing
    frequency_model: Real
    frequency_measured: Real
    frequency_std: Real | None
    frequency_error: Real
    frequency_error_percent_mean: float | None
    frequency_error_percent_max: float | None
    frequency_scatter: float | None
    mac: Real
    mac_mean: float | None
    mac_min: float | None
    mac_error: float | None
    auto_mac_model: Real
    auto_mac_measured: Real
    scale_factor: Shapes
    shapes_model: Shapes
    shapes_measured: Shapes
    comac: Real
    labels: tuple[str, ...]
    complete: tuple[int, ...] = ()
    mass_orthogonality: Real | None = None
    cross_orthogonality: Real | None = None
    pseudo_orthogonality: Real | None = None
    pseudo_checks: PseudoOrthogonality | None = None
    static_difference: Real | None = None
    energy: EnergyComparison | None = None
    balance: Real | None = None
    element_balance: ElementBalance | None = None
    element_energy: Real | None = None
    notes: tuple[str, ...] = ()

    def to_json(self) -> dict[str, Any]:
        """Numbers, strings, lists and dicts for ``json.dumps``: complex as [re, im], what is not
        finite as None."""
        out = _plain(self)
        return out if isinstance(out, dict) else {}


def correlation(
    f_a: Real,
    phi_a: Shapes,
    f_x: Real,
    phi_x: Shapes,
    *,
    std: Real | None = None,
    threshold: float = 0.5,
    frequency_weight: float = 0.5,
    pairing: Pairing | None = None,
    labels: Sequence[str] = (),
    K: Any = None,
    M: Any = None,
    transformation: Transformation | None = None,
    expansions: Sequence[Transformation] | None = None,
    elements: Sequence[ElementBatch] = (),
) -> Correlation:
    """Compare the model's modes at the sensors with the measured ones, by every measure the inputs
    allow.

    Parameters
    ----------
    f_a : (modes_a,) Hz, phi_a : (n, modes_a) of the model at the n sensors, mass-normalised.
    f_x, std : (modes_x,) Hz. phi_x : (n, modes_x), NaN where not measured.
    threshold, frequency_weight : of `pair_modes`; ``pairing`` replaces it. labels : n names of the
    sensors.
    K, M, transformation : of the full model and from the n sensors to it; they add orthogonality,
    energies and balance.
    expansions : one transformation per measured mode (such as ``dynamic`` at its frequency), which
    the force balance of
    elements then uses. elements : the model's element matrices.

    Raises
    ------
    InputError
        Arrays do not agree. A set without a single pair is no error: its measures are None and
        ``notes`` says so.
    """
    a, x = same_dofs(phi_a, phi_x)
    fa, fx = np.asarray(f_a, dtype=np.float64), np.asarray(f_x, dtype=np.float64)
    if labels and len(labels) != a.shape[0]:
        raise InputError(
            f"correlation: {len(labels)} labels for {a.shape[0]} sensors; give one each"
        )
    pairs = pair_modes(a, x, fa, fx, threshold, frequency_weight) if pairing is None else pairing
    base = _of_pairs(pairs, fa, a, fx, x, std, labels)
    if transformation is None or K is None or M is None or not len(pairs):
        return base
    pa, px = a[:, pairs.model], x[:, pairs.measured]
    return _with_matrices(base, pa, px, a, K, M, transformation, expansions, elements)


def _of_pairs(
    pairs: Pairing,
    fa: Real,
    a: Shapes,
    fx: Real,
    x: Shapes,
    std: Real | None,
    labels: Sequence[str],
) -> Correlation:
    """What frequencies and shapes at the sensors give, without K and M."""
    pa, px = a[:, pairs.model], x[:, pairs.measured]
    f_pa, f_px = fa[pairs.model], fx[pairs.measured]
    some = len(pairs) > 0
    errors = frequency_errors(f_pa, f_px) if some else np.zeros(0)
    scale = modal_scale_factor(pa, px) if some else np.zeros(0)
    shown_a, shown_x = _on_one_scale(pa, px, scale)
    return Correlation(
        pairing=pairs,
        frequency_model=f_pa,
        frequency_measured=f_px,
        frequency_std=None if std is None else np.asarray(std, dtype=np.float64)[pairs.measured],
        frequency_error=errors,
        frequency_error_percent_mean=float(np.mean(np.abs(errors))) if some else None,
        frequency_error_percent_max=float(np.max(np.abs(errors))) if some else None,
        frequency_scatter=frequency_scatter(f_pa, f_px) if some else None,
        mac=mac(a, x),
        mac_mean=float(np.mean(pairs.mac)) if some else None,
        mac_min=float(np.min(pairs.mac)) if some else None,
        mac_error=mac_error(pairs.mac) if some and bool(np.all(np.isfinite(pairs.mac))) else None,
        auto_mac_model=mac(a, a),
        auto_mac_measured=mac(x, x),
        scale_factor=scale,
        shapes_model=shown_a,
        shapes_measured=shown_x,
        comac=comac(pa, px) if some else np.full(a.shape[0], np.nan),
        labels=tuple(labels),
        notes=tuple(_unpaired_notes(pairs, fx)),
    )


def _with_matrices(
    base: Correlation,
    pa: Shapes,
    px: Shapes,
    all_a: Shapes,
    K: Any,
    M: Any,
    T: Transformation,
    expansions: Sequence[Transformation] | None,
    elements: Sequence[ElementBatch],
) -> Correlation:
    if T.masters.size != px.shape[0] or T.generalised:
        raise InputError(
            f"correlation: the transformation has {T.masters.size} masters, the shapes "
            f"{px.shape[0]} sensors; its masters must be the sensors, in their order"
        )
    notes = list(base.notes)
    keep = np.flatnonzero(~np.any(np.isnan(px), axis=0))
    if keep.size < px.shape[1]:
        gaps = [int(base.pairing.measured[k]) + 1 for k in range(px.shape[1]) if k not in keep]
        notes.append(
            f"Measured modes {gaps} have channels without a value: left out of orthogonality, "
            "energy and balance."
        )
    if keep.size == 0:
        return _replace(base, notes=tuple(notes))
    a, x, f = pa[:, keep], px[:, keep], base.frequency_measured[keep]
    reduced = T.reduce(M)
    full_a, full_x = T.expand(a), T.expand(x)
    # The measured shapes on the model's scale and phase: energies are then comparable, forces real
    # where modes are.
    full_x = full_x / base.scale_factor[keep]
    made: dict[str, Any] = {
        "mass_orthogonality": np.abs(mass_orthogonality(x, reduced)),
        "cross_orthogonality": np.abs(cross_orthogonality(a, reduced, x)),
        "energy": energy_comparison(K, M, full_a, full_x),
        "balance": balance_map(K, M, full_x, f),
        "static_difference": static_difference(K, full_a, full_x),
    }
    try:
        checks = pseudo_orthogonality(a, x / base.scale_factor[keep], reduced)
        made["pseudo_checks"] = PseudoOrthogonality(*(np.abs(v) for v in vars(checks).values()))
    except (InputError, ModelError) as error:
        notes.append(f"The pseudo-orthogonality checks (2.9) were left out ({error}).")
    try:
        made["pseudo_orthogonality"] = np.abs(
            reduced_pseudo_orthogonality(all_a, x / base.scale_factor[keep])
        )
    except (InputError, ModelError) as error:
        notes.append(f"The pseudo-orthogonality check was left out ({error}).")
    if elements:
        made["element_energy"] = energy_map(elements, full_a, full_x)
        own = T if expansions is None else [expansions[int(base.pairing.measured[k])] for k in keep]
        made["element_balance"] = element_balance(
            elements, K, M, x / base.scale_factor[keep], f, own
        )
    return _replace(base, complete=tuple(int(k) for k in keep), notes=tuple(notes), **made)


def _on_one_scale(a: Shapes, x: Shapes, scale: Shapes) -> tuple[Shapes, Shapes]:
    """Both shapes with the model's largest entry at 1: the measured divided by the scale factor, so
    it turns real too."""
    if a.shape[1] == 0:
        return a, x
    largest = np.nanargmax(np.abs(a), axis=0)
    peak = a[largest, np.arange(a.shape[1])]
    safe = np.where(scale == 0.0, 1.0, scale)
    return a / peak, x / safe / peak


def _unpaired_notes(pairs: Pairing, f_x: Real) -> list[str]:
    notes = [
        f"Measured mode {int(j) + 1} ({f_x[j]:.4g} Hz) has no partner in the model."
        for j in pairs.unpaired
    ]
    return (
        notes if len(pairs) else [*notes, "No mode could be paired: no shape measure was computed."]
    )


def _replace(base: Correlation, **changes: Any) -> Correlation:
    return Correlation(**{f.name: changes.get(f.name, getattr(base, f.name)) for f in fields(base)})


def _plain(value: Any) -> Any:
    if isinstance(value, np.ndarray):
        return [_plain(v) for v in value.tolist()]
    if isinstance(value, (list, tuple)):
        return [_plain(v) for v in value]
    if isinstance(value, complex):
        return [_plain(value.real), _plain(value.imag)]
    if isinstance(value, float):
        return value if np.isfinite(value) else None
    if is_dataclass(value):
        return {f.name: _plain(getattr(value, f.name)) for f in fields(value)}
    return value
