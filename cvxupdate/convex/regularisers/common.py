"""What the regularisers share: the departure (p − reference)/scale, and their protocol."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Protocol

import numpy as np

from ...errors import InputError
from ...system import Array

RULES = ("l-curve", "gcv", "discrepancy")


class Regulariser(Protocol):
    """What every regulariser offers; ``weight`` multiplies ``expression`` and ``value``, which do
    not contain it."""

    @property
    def name(self) -> str:
        """The word of the problem file."""
        ...

    @property
    def keys(self) -> Mapping[str, Any]:
        """Keys of [regularisation] beside `kind` and `weight`: (type, pydantic Field) by name.

        The class has a class method ``from_spec(table, context)``, which makes the regulariser of
        one table.
        """
        ...

    @property
    def weight(self) -> float | str:
        """A number ≥ 0, or a rule: "l-curve", "gcv", "discrepancy" (see `choose_weight`)."""
        ...

    def expression(self, p: Any, columns: tuple[str, ...]) -> Any:
        """The penalty as a convex cvxpy expression of p (n,), without the weight."""
        ...

    def value(self, p: Array, columns: tuple[str, ...]) -> float:
        """The penalty at p (n,), without the weight."""
        ...

    def weight_range(self, WA: Array, Wb: Array, columns: tuple[str, ...]) -> tuple[float, float]:
        """Weights from "hardly any effect" to "nothing moves", for a sweep."""
        ...

    def degrees_of_freedom(
        self, WA: Array, p: Array, weight: float, active: Array, columns: tuple[str, ...]
    ) -> float:
        """Effective number of parameters at p with the active constraint rows ``active`` (k, n)."""
        ...


def check_weight(name: str, weight: float | str) -> None:
    """Raise InputError unless the weight is a number ≥ 0 or a rule."""
    if isinstance(weight, str):
        if weight not in RULES:
            raise InputError(
                f"{name}: weight {weight!r} is neither a number nor one of "
                f"{', '.join(map(repr, RULES))}."
            )
    elif not (np.isfinite(weight) and weight >= 0):
        raise InputError(f"{name}: weight {weight} must be a finite number, 0 or more.")


def reference_and_scale(
    name: str, reference: Array | float, scale: Array | float, n: int
) -> tuple[Array, Array]:
    """Both as arrays (n,); the scale must be positive."""
    try:
        ref = np.array(np.broadcast_to(np.asarray(reference, dtype=float), (n,)))
        size = np.array(np.broadcast_to(np.asarray(scale, dtype=float), (n,)))
    except ValueError:
        raise InputError(
            f"{name}: reference and scale must be one number or {n}, one for each parameter."
        ) from None
    if not (np.all(np.isfinite(ref)) and np.all(np.isfinite(size)) and np.all(size > 0)):
        raise InputError(f"{name}: the reference must be finite and the scale finite and above 0.")
    return ref, size


def null_space(C: Array, n: int) -> Array:
    """Orthonormal basis (n, n − rank) of the directions that leave C p unchanged."""
    if C.shape[0] == 0:
        return np.eye(n)
    _, s, Vt = np.linalg.svd(C, full_matrices=True)
    rank = int(np.sum(s > 1e-10 * s[0])) if s.size and s[0] > 0 else 0
    return np.asarray(Vt[rank:].T)


def influence_trace(WA: Array, root: Array, weight: float, active: Array) -> float:
    """Trace of the influence matrix within the active constraints, of a penalty ‖root p‖²."""
    Z = null_space(active, WA.shape[1])
    if Z.shape[1] == 0:
        return 0.0
    J, bend = WA @ Z, root @ Z
    return float(np.trace(np.linalg.solve(J.T @ J + weight * bend.T @ bend, J.T @ J)))


def free_count(moved: Any, active: Array) -> float:
    """Number of moved parameters (a mask) less the independent active constraints among them."""
    count = int(np.sum(moved))
    if count == 0 or active.shape[0] == 0:
        return float(count)
    return float(count - np.linalg.matrix_rank(active[:, moved]))
