"""Nuisance parameters: what drawing and laboratory always differ by."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.settings import CREDIBLE, MASS_STD, STIFFNESS_STD, WIDE
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import has_property, select_parameters
from cvxupdate.physics.growth import Wanted


def with_nuisance(model: Model, wide: bool = False, scatter: float = 1.0) -> Model:
    """The model with a stiffness and a mass p-value for every group, within credible bounds
    (``wide``: far beyond). ``scatter``: part of the usual scatter, of a model that was calibrated
    on this very structure."""
    wanted: list[Wanted] = []
    for of, std in (("stiffness", STIFFNESS_STD), ("mass", MASS_STD)):
        limit = WIDE if wide else CREDIBLE * std * scatter
        groups: dict[str, list[int]] = {}
        for block in model.blocks:
            if has_property(block, of):
                for element, group in zip(block.ids.tolist(), block.groups, strict=True):
                    groups.setdefault(group or block.kind.name, []).append(element)
        wanted += [
            Wanted(f"{g}.{of}", of, tuple(dict.fromkeys(ids)), g, -limit, limit)
            for g, ids in groups.items()
        ]
    return model.with_parameters(select_parameters(wanted, model))


def scatter_of(q: Parameter) -> float:
    """Prior deviation of a group's p-value: `CREDIBLE` of them reach its bound, and it is at most
    the usual one."""
    return min(MASS_STD if q.of == "mass" else STIFFNESS_STD, q.upper / CREDIBLE)


def spread_of(A: Real, noise: Real, scales: Real, cost: float) -> tuple[Real, Real]:
    """Standard deviations of unknowns, linearised: (grown with the misfit, of noise alone).

    A (rows, n) weighted derivatives; ``noise`` (rows,) the part of each weighted square that noise
    makes; ``scales`` (n,) prior deviations; ``cost`` weighted squares. With H = AᵀA + S⁻² the
    first is from H⁻¹, the second from H⁻¹ Aᵀ N A H⁻¹.
    """
    inverse = np.linalg.pinv(A.T @ A + np.diag(1.0 / scales**2))
    grow = max(1.0, cost / max(1, len(A) - len(scales)))
    heard = inverse @ A.T
    both = np.diag(inverse) * grow, np.einsum("ij,j,ij->i", heard, noise, heard)
    wide, narrow = (np.sqrt(np.maximum(v, 0.0)) for v in both)
    return wide, narrow
