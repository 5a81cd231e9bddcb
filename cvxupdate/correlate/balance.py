"""Force balance of measured shapes in the model, and the maps that say where it fails (2.12,
2.13)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from cvxupdate.correlate._shapes import Real, Shapes, as_columns, same_pairs
from cvxupdate.correlate.elements import ElementBatch, element_matrices
from cvxupdate.errors import InputError
from cvxupdate.reduction.transformation import Transformation


@dataclass(frozen=True)
class ElementBalance:
    """How much of the imbalance of all modes one element alone explains, (elements,), 0 to 1 (1:
    all of it).

    ``stiffness`` for a change of its stiffness, with ``stiffness_change`` the least-squares value
    of it (−0.3: 30 % softer than modelled, never below −1: an element has no less than nothing);
    ``mass`` and ``mass_change`` likewise, None without element mass matrices. ``imbalance`` is the
    size of what is to be explained, over the elastic forces, r.m.s. over the modes: at rounding
    level nothing is wrong and the explained fractions mean nothing.
    """

    imbalance: float
    stiffness: Real
    stiffness_change: Real
    mass: Real | None = None
    mass_change: Real | None = None


def static_balance(K: Any, phi_a: Shapes, phi_x: Shapes) -> tuple[Shapes, Shapes]:
    """Wada's (1980) static forces K φ_A and K φ_X of paired modes, each (N, modes), in N for φ in m
    (2.12).

    Their difference shows where the shapes differ in force rather than in displacement. Scale the
    pairs alike first.
    """
    a, x = same_pairs(phi_a, phi_x)
    return np.asarray(K @ a), np.asarray(K @ x)


def static_difference(K: Any, phi_a: Shapes, phi_x: Shapes) -> Real:
    """How far Wada's static forces of each pair differ, (modes,): ‖K φ_X − K φ_A‖ over ‖K φ_A‖ with
    every row over the root of its stiffness, so that forces and moments are comparable (2.12).

    Differences of displacement that cost much strain count here, which a MAC hardly sees. Arguments
    as `static_balance`.
    """
    of_a, of_x = static_balance(K, phi_a, phi_x)
    weight = 1.0 / np.sqrt(np.maximum(np.abs(K.diagonal()), np.finfo(float).tiny))[:, None]
    whole = np.linalg.norm(weight * of_a, axis=0)
    return np.asarray(
        np.linalg.norm(weight * (of_x - of_a), axis=0) / np.maximum(whole, np.finfo(float).tiny)
    )


def force_balance(K: Any, M: Any, phi_x: Shapes, f_x: Real) -> Shapes:
    """Fissette & Ibrahim's (1988) imbalance (K − ω_X² M) φ_X of each measured mode, (N, modes), N
    for φ in m (2.13).

    Zero where the model is right; nonzero only at the DOFs of what is wrong, when the shapes are
    complete.

    Parameters
    ----------
    K : (N, N) N/m, complex with hysteretic damping. M : (N, N). phi_x : (N, modes) complete or
    expanded.
    f_x : (modes,) Hz. Raises `InputError` when they do not agree.
    """
    phi, eigenvalue = _modes(phi_x, f_x, K.shape[0])
    return np.asarray(K @ phi - (M @ phi) * eigenvalue)


def balance_map(K: Any, M: Any, phi_x: Shapes, f_x: Real) -> Real:
    """Relative imbalance of every DOF over all modes, (N,): 0 in balance, 1 nothing balances.

    The forces at a DOF are compared with the sum of the moduli of what should balance there, |K||φ|
    + ω²|M||φ|, so forces and moments, stiff and soft places are on one scale. Arguments as
    `force_balance`.
    """
    phi, eigenvalue = _modes(phi_x, f_x, K.shape[0])
    size = np.abs(phi)
    acting = abs(K) @ size + (abs(M) @ size) * eigenvalue
    # Modes count alike; a DOF where nothing acts is kept from being judged by rounding.
    weight = 1.0 / np.max(acting, axis=0)
    force = np.sum((np.abs(force_balance(K, M, phi, f_x)) * weight) ** 2, axis=1)
    rough = abs(K) @ np.ones(size.shape[0])
    floor = 1e-9 * rough * float(np.max(size * weight))
    return np.asarray(
        np.sqrt(force / (np.sum((acting * weight) ** 2, axis=1) + floor**2 + np.finfo(float).tiny))
    )


def element_balance(
    batches: Sequence[ElementBatch],
    K: Any,
    M: Any,
    phi_x: Shapes,
    f_x: Real,
    transformation: Transformation | Sequence[Transformation] | None = None,
) -> ElementBalance:
    """Which single element explains the imbalance: the measured shapes complete, or at the sensors
    of a transformation.

    If element e is really (1 + δ) as stiff, then (K + δK_e − ω²M)φ_X = 0 and the imbalance is −δ
    K_e φ_X (for mass +δω² M_e φ_X). With sensors alone both sides are condensed by the
    transformation that expands: f = Tᵀ(K − ω²M)Tφ against Tᵀ K_e Tφ. The explained fraction is
    cos² of the angle between the two over all modes, every mode relative to its own elastic forces
    and every row relative to the root of its stiffness, which makes forces and moments comparable.

    Parameters
    ----------
    batches : the elements. K, M : (N, N). phi_x : (N, modes), or (n, modes) at the masters of
    ``transformation``, which is
    one for all modes or a list with one per mode (``dynamic`` at each f_x is the sharpest). f_x :
    (modes,) Hz.

    Raises
    ------
    InputError
        Shapes, frequencies or transformations do not agree.
    """
    sums = [_mode_sums(batches, mode) for mode in mode_imbalances(K, M, phi_x, f_x, transformation)]
    return explained(sums, any(b.M is None for b in batches))


@dataclass(frozen=True)
class ModeImbalance:
    """One mode of `element_balance`: the complete shape ``phi`` (N,), ``force`` the condensed
    imbalance with every row times ``scale`` (over the size of the elastic forces), ``eigenvalue``
    ω_X², ``T`` the transformation or None where the shape was measured complete."""

    phi: Shapes
    force: Shapes
    scale: Real
    eigenvalue: float
    T: Transformation | None


def mode_imbalances(
    K: Any,
    M: Any,
    phi_x: Shapes,
    f_x: Real,
    transformation: Transformation | Sequence[Transformation] | None = None,
) -> list[ModeImbalance]:
    """What is to be explained, mode by mode; arguments and errors as `element_balance`."""
    columns = as_columns(phi_x, "phi_x")
    several = _per_mode(transformation, columns.shape[1])
    rows = columns.shape[0] if several is None else K.shape[0]
    full = (
        columns
        if several is None
        else np.column_stack([T.expand(columns[:, r]) for r, T in enumerate(several)])
    )
    phi, eigenvalue = _modes(full, f_x, rows)
    imbalance = force_balance(K, M, phi, f_x)
    elastic = np.asarray(K @ phi)
    out = []
    diagonal = np.abs(K.diagonal())
    for r in range(phi.shape[1]):
        T = None if several is None else several[r]
        f = imbalance[:, r] if T is None else T.matrix.T @ imbalance[:, r]
        e = elastic[:, r] if T is None else T.matrix.T @ elastic[:, r]
        stiff = (
            diagonal if T is None else np.abs(np.einsum("ij,ij->j", T.matrix.conj(), K @ T.matrix))
        )
        scale = 1.0 / np.sqrt(np.where(stiff > 0.0, stiff, 1.0))
        size = float(np.linalg.norm(scale * e))
        if size > 0.0:
            out.append(
                ModeImbalance(phi[:, r], scale / size * f, scale / size, float(eigenvalue[r]), T)
            )
    if not out:
        raise InputError(
            "element_balance: no mode with elastic forces; rigid-body modes cannot be balanced"
        )
    return out


def explained(
    sums: Sequence[tuple[Real, Real, Real, Real, float]], stiffness_only: bool = False
) -> ElementBalance:
    """Explained fractions and changes from every mode's s·f and s·s for stiffness and mass
    signatures s, and f·f."""
    k_f, k_k, m_f, m_m = (np.sum(np.array([mode[i] for mode in sums]), axis=0) for i in range(4))
    total = float(sum(mode[4] for mode in sums))
    stiffness, k_change = _explained(k_f, k_k, total, highest=1.0)
    level = float(np.sqrt(total / len(sums)))
    if stiffness_only:
        return ElementBalance(level, stiffness, -k_change)
    mass, m_change = _explained(m_f, m_m, total, lowest=-1.0)
    return ElementBalance(level, stiffness, -k_change, mass, m_change)


def _explained(
    sf: Real, ss: Real, ff: float, lowest: float = -np.inf, highest: float = np.inf
) -> tuple[Real, Real]:
    """The factor c that leaves least of ‖f − c s‖², and the explained fraction 1 − ‖f − c s‖²/‖f‖²
    that it explains, from the sums over modes.

    c is held within what keeps the element from having less than nothing: unbounded the fraction is
    cos² of the angle.
    """
    factor = np.clip(np.divide(sf, ss, out=np.zeros_like(sf), where=ss > 0.0), lowest, highest)
    return np.clip(
        factor * (2.0 * sf - factor * ss) / max(ff, np.finfo(float).tiny), 0.0, 1.0
    ), factor


def _mode_sums(
    batches: Sequence[ElementBatch], mode: ModeImbalance
) -> tuple[Real, Real, Real, Real, float]:
    """One mode's s·f and s·s of every element, for stiffness and mass signatures s, and f·f."""
    out: list[list[Real]] = [[], [], [], []]
    scale, T = mode.scale, mode.T
    for batch in batches:
        u = batch.gather(mode.phi[:, None])[:, :, 0]
        held = batch.dofs >= 0
        for k, (name, factor) in enumerate((("K", 1.0), ("M", mode.eigenvalue))):
            if name == "M" and batch.M is None:
                force = np.zeros_like(u)
            else:
                force = factor * np.einsum("edf,ef->ed", element_matrices(batch, name), u)
            force = np.where(held, force, 0.0)
            if T is None:
                signature, against = (
                    force * np.where(held, scale[batch.dofs], 0.0),
                    mode.force[batch.dofs],
                )
            else:
                signature = np.einsum("edn,ed->en", T.matrix[batch.dofs], force) * scale
                against = np.broadcast_to(mode.force, signature.shape)
            out[2 * k].append(np.real(np.sum(signature.conj() * against, axis=1)))
            out[2 * k + 1].append(np.sum(np.abs(signature) ** 2, axis=1))
    k_f, k_k, m_f, m_m = (np.concatenate(part) for part in out)
    return k_f, k_k, m_f, m_m, float(np.sum(np.abs(mode.force) ** 2))


def _per_mode(
    transformation: Transformation | Sequence[Transformation] | None, modes: int
) -> list[Transformation] | None:
    if transformation is None:
        return None
    if isinstance(transformation, Transformation):
        return [transformation] * modes
    if len(transformation) != modes:
        raise InputError(
            f"element_balance: {len(transformation)} transformations for {modes} modes; give "
            "one, or one each"
        )
    return list(transformation)


def _modes(phi_x: Shapes, f_x: Real, rows: int) -> tuple[Shapes, Real]:
    phi = as_columns(phi_x, "phi_x")
    f = np.atleast_1d(np.asarray(f_x, dtype=np.float64))
    if phi.shape != (rows, f.size) or np.any(np.isnan(phi)) or not np.all(np.isfinite(f)):
        raise InputError(
            f"force balance: shapes {phi.shape} must be complete ({rows} DOFs) with one "
            f"frequency each, got {f.size} frequencies; expand incomplete shapes first "
            "(reduction)"
        )
    return phi, np.asarray((2.0 * np.pi * f) ** 2)
