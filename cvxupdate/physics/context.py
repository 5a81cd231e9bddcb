"""What effects are placed on."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.model import Model

Real = NDArray[np.float64]


@dataclass(frozen=True)
class SearchContext:
    """The structure that effects are placed on: the undamped model at p = 0, its matrices, the
    band's top and bottom (Hz), the labels of the channels that were measured and the DOFs that the
    file holds (``held``: node, kind); ``release(node, kind)`` builds the model without one support;
    ``zeta`` is a typical damping ratio; ``accelerometers`` those channels that measure
    accelerations; ``driven`` the labels of the DOFs where a force was measured, ``forces`` those of
    which the recordings tell the force's own gain, ``later`` those where only what is held out has
    such a force; ``apart``: of several drives each recording has one alone; ``own`` the numbers of
    the elements that no effect added (None: of all); ``undamped``: the recordings are of undamped
    modes."""

    model: Model
    K: sp.csc_array
    M: sp.csc_array
    top: float
    bottom: float
    sensors: tuple[str, ...]
    held: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    zeta: float
    accelerometers: tuple[str, ...] = ()
    driven: tuple[str, ...] = ()
    forces: tuple[str, ...] = ()
    later: tuple[str, ...] = ()
    apart: bool = False
    own: frozenset[int] | None = None
    undamped: bool = False

    @property
    def supports(self) -> tuple[tuple[int, str], ...]:
        """Of the held DOFs those that no effect has set free."""
        return tuple((n, k) for n, k in self.held if f"n{n}.{k}" not in self.model.place)

    def local(self, row: int) -> tuple[float, float]:
        """Diagonal stiffness and mass at a free DOF: the scale of what a support or lump there
        would have to be."""
        stiffness, mass = self._diagonals
        return float(stiffness[row]), float(mass[row])

    @cached_property
    def _diagonals(self) -> tuple[Real, Real]:
        return self.K.diagonal(), self.M.diagonal()
