"""Arrays as programs give them, checked: numbers, finite, of the right shape."""

from __future__ import annotations

import importlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError

Numbers = NDArray[Any]


def numbers(given: Any, what: str, axes: int | tuple[int, ...], dtype: Any = float) -> Numbers:
    """An array with ``axes`` axes (or one of several counts), all of it finite numbers.

    Raises
    ------
    InputError
        Saying what is wrong with which argument.
    """
    try:
        raw = np.asarray(given)
        unreal = dtype is float and raw.dtype.kind == "c"
        lost = unreal and bool(np.any(raw.imag != 0.0))
        raw = raw.real if unreal else raw
        made = raw.astype(dtype) if raw.dtype.kind in "biufcO" else None
    except (TypeError, ValueError):
        made, lost = None, False
    if made is None:
        raise InputError(f"{what}: holds something that is not a number. Give an array of numbers.")
    if lost:
        raise InputError(f"{what}: is complex where real numbers are needed.")
    wanted = (axes,) if isinstance(axes, int) else axes
    if made.ndim not in wanted:
        raise InputError(
            f"{what}: has {made.ndim} axes, not {' or '.join(map(str, wanted))} "
            f"(shape {made.shape})."
        )
    if made.size == 0:
        raise InputError(f"{what}: is empty.")
    if not np.all(np.isfinite(made)):
        raise InputError(
            f"{what}: {int(np.sum(~np.isfinite(made)))} of {made.size} values are not finite. "
            "Leave them out, or repair them."
        )
    return made


def optional(name: str, why: str) -> Any:
    """A package that is not needed otherwise.

    Raises
    ------
    InputError
        When it is not installed, with the command that installs it.
    """
    try:
        return importlib.import_module(name)
    except ImportError:
        raise InputError(f"{why} needs {name}. Install it: pip install {name}.") from None
