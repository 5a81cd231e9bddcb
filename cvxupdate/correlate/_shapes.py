"""Checks that every measure of mode shapes shares."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError

Real = NDArray[np.float64]
Shapes = NDArray[Any]


def as_columns(phi: Shapes, name: str) -> Shapes:
    """``phi`` as a (dofs, modes) array, a single vector becoming one column; NaN marks a channel
    not measured.

    Raises `InputError` when it is not one- or two-dimensional, or an entry is infinite.
    """
    array = np.asarray(phi)
    if not (
        np.issubdtype(array.dtype, np.complexfloating) or np.issubdtype(array.dtype, np.floating)
    ):
        array = array.astype(np.float64)
    if array.ndim == 1:
        array = array[:, None]
    if array.ndim != 2:
        raise InputError(
            f"{name}: mode shapes must be (dofs, modes), not {array.shape}; give one column "
            "per mode"
        )
    if np.any(np.isinf(array)):
        raise InputError(
            f"{name}: mode shapes have infinite entries; mark a channel that was not measured "
            "by NaN"
        )
    return array


def same_dofs(phi_a: Shapes, phi_x: Shapes) -> tuple[Shapes, Shapes]:
    """Both sets as (dofs, modes); raises `InputError` when their numbers of DOFs differ."""
    a, x = as_columns(phi_a, "phi_a"), as_columns(phi_x, "phi_x")
    if a.shape[0] != x.shape[0]:
        raise InputError(
            f"mode shapes do not share their DOFs: phi_a has {a.shape[0]} rows, phi_x "
            f"{x.shape[0]}; restrict the model's shapes to the measured DOFs, or expand the "
            "measured ones"
        )
    return a, x


def same_pairs(phi_a: Shapes, phi_x: Shapes) -> tuple[Shapes, Shapes]:
    """Both sets as (dofs, modes) with equal shapes; raises `InputError` when the numbers of modes
    differ too."""
    a, x = same_dofs(phi_a, phi_x)
    if a.shape != x.shape:
        raise InputError(
            f"mode shapes are not paired: phi_a has {a.shape[1]} modes, phi_x {x.shape[1]}; "
            "pair them first (pair_modes) and pass the paired columns"
        )
    return a, x


def masked_pairs(a: Shapes, x: Shapes) -> tuple[Shapes, Shapes]:
    """Paired columns with both entries set to zero wherever either was not measured."""
    seen = ~(np.isnan(a) | np.isnan(x))
    return np.where(seen, a, 0.0), np.where(seen, x, 0.0)
