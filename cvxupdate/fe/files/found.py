"""What a file of matrices holds, and how one triangle becomes a whole matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.errors import ModelError

Label = tuple[int, int]
"""Node and direction, 0 to 5 = x to rz."""
Index = NDArray[np.int64]
HELD = 1e30
"""Diagonal stiffness above which a program holds the DOF (Abaqus writes 1e36): no structure has
it."""


@dataclass(frozen=True)
class Found:
    """``matrices`` by name; ``labels`` of the rows of each that knows them; DOFs that are ``held``
    by a huge number on the diagonal and are not among the rows."""

    matrices: Mapping[str, sp.csr_array]
    labels: Mapping[str, tuple[Label, ...]] = field(default_factory=dict)
    held: frozenset[Label] = frozenset()


def mirrored(rows: Index, columns: Index, values: NDArray[Any], size: int) -> sp.csr_array:
    """A symmetric matrix of which each entry beside the diagonal may be given once or twice."""
    A = sp.coo_array((values, (rows, columns)), shape=(size, size)).tocsr()
    there = sp.coo_array((np.ones(len(rows)), (rows, columns)), shape=(size, size)).tocsr()
    there.data[:] = 1.0
    T = sp.csr_array(A.T)
    return sp.csr_array(A + (T - T.multiply(there)))


def of_labels(
    path: Path, ends: Sequence[Index], values: NDArray[Any], symmetric: bool
) -> tuple[sp.csr_array, tuple[Label, ...], frozenset[Label]]:
    """A matrix whose entries name node and direction (from 1) of both ends: (node, direction, node,
    direction), with its labels in order, and those that are held.

    Raises
    ------
    ModelError
        For a direction that is none of the six, or a node without a number.
    """
    i, p, j, q = ends
    wrong = np.flatnonzero((np.minimum(p, q) < 1) | (np.maximum(p, q) > 6))
    if wrong.size:
        bad = next(int(v) for v in (p[wrong[0]], q[wrong[0]]) if not 1 <= v <= 6)
        raise ModelError(
            f"{path}: entry {wrong[0] + 1} has the degree of freedom {bad}; 1 to 6 are known (x "
            "to rz). Export the structure without it."
        )
    if min(i.min(initial=0), j.min(initial=0)) < 0:
        raise ModelError(
            f"{path}: has nodes with negative numbers (internal degrees of freedom of the "
            "program). Export without them, or condense them."
        )
    a, b = i * 6 + p - 1, j * 6 + q - 1
    every, at = np.unique(np.concatenate([a, b]), return_inverse=True)
    rows, columns = at[: len(a)], at[len(a) :]
    if symmetric:
        A = mirrored(rows, columns, values, len(every))
    else:
        A = sp.csr_array(sp.coo_array((values, (rows, columns)), shape=(len(every),) * 2))
    stuck = np.abs(A.diagonal()) >= HELD
    keep = np.flatnonzero(~stuck)
    labels = [(int(k) // 6, int(k) % 6) for k in every]
    held = frozenset(label for label, s in zip(labels, stuck, strict=True) if s)
    return A[keep][:, keep], tuple(labels[k] for k in keep), held
