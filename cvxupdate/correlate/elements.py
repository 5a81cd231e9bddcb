"""Element matrices as batches, and the sums that energies and force balances take over them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real, Shapes
from cvxupdate.errors import InputError


@dataclass(frozen=True)
class ElementBatch:
    """e elements of one kind: ``dofs`` (e, d) rows of the model (−1 where supported), ``K`` (e, d,
    d), ``M`` likewise or None."""

    dofs: NDArray[np.int64]
    K: Real
    M: Real | None = None

    def __post_init__(self) -> None:
        e, d = self.dofs.shape
        if self.K.shape != (e, d, d) or (self.M is not None and self.M.shape != (e, d, d)):
            raise InputError(
                f"ElementBatch: {e} elements of {d} DOFs need matrices ({e}, {d}, {d}), got K "
                f"{self.K.shape}"
            )

    def gather(self, phi: Shapes) -> Shapes:
        """The elements' own displacements, (e, d, modes), zero at supported DOFs."""
        return np.asarray(np.where((self.dofs >= 0)[:, :, None], phi[self.dofs], 0.0))


def element_energies(batches: Sequence[ElementBatch], phi: Shapes, matrix: str = "K") -> Real:
    """½ φ_eᴴ K_e φ_e of every element and mode, (elements, modes), in the order of the batches; J
    for φ in m and K in N/m.

    ``matrix = "M"`` gives ½ φ_eᴴ M_e φ_e, the kinetic energy per ω². The sum over elements is that
    of the whole model. Raises `InputError` when a batch has no mass matrices or ``matrix`` is
    neither.
    """
    parts = []
    for batch in batches:
        u = batch.gather(phi)
        parts.append(
            0.5
            * np.real(np.einsum("edm,edf,efm->em", u.conj(), element_matrices(batch, matrix), u))
        )
    return np.concatenate(parts, axis=0)


def element_matrices(batch: ElementBatch, matrix: str) -> Real:
    """K or M of a batch by name; raises `InputError` when it is missing or not one of them."""
    if matrix == "K":
        return batch.K
    if matrix == "M" and batch.M is not None:
        return batch.M
    raise InputError(
        f"element matrices: {matrix!r} is not 'K' or 'M', or the batch has no mass matrices"
    )
