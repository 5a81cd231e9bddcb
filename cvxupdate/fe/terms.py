"""What element matrices are made of: arrays, and terms (geometry).

Below the elements, so that what they are built from (sections, triads, shape functions) needs none
of them.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Values = NDArray[Any]  # real, or complex while a derivative is taken


@dataclass(frozen=True)
class Term:
    """One geometric factor: ``matrix`` is "K", "M" or "C", ``coefficient`` names its scalar,
    ``values`` is (elements, d, d)."""

    matrix: str
    coefficient: str
    values: Real


def rotate(local: Real, triads: Real, blocks: int) -> Real:
    """Rotate local matrices (e, 3·blocks, 3·blocks) by triads (e, 3, 3) whose rows are the local
    axes: Rᵀ k R, block by block."""
    e = local.shape[0]
    split = local.reshape(e, blocks, 3, blocks, 3)
    return np.asarray(
        np.einsum("eki,eakbl,elj->eaibj", triads, split, triads, optimize=True).reshape(local.shape)
    )
