"""The shapes among which the modes of a model are sought as its parameters move: every DOF, or a
space of few (`cvxupdate.fe.synthesis.space`)."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.modes import Modes, natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.fe.synthesis.derivatives import Among
from cvxupdate.fe.synthesis.pieces import basis
from cvxupdate.fe.terms import Real


@dataclass(frozen=True)
class Found:
    """``modes``, their coordinates ``X`` (r, m) among the shapes, and the ``matrices`` K, M, C and
    D (r, r) there."""

    modes: Modes
    X: Real = field(repr=False)
    matrices: Mapping[str, Real | sp.csc_array] = field(repr=False)


class Shapes(Protocol):
    """Where the modes of a model are sought."""

    @property
    def answered(self) -> tuple[int, ...]:
        """DOFs to a force at which they have the static answer, where they are not all modes."""

    def modes(self, p: Real) -> Found:
        """Those at ``p``. ModelError where the model is no structure."""

    def derivatives(self, p: Real, X: Real) -> Sequence[Sequence[DerivativeBlock | Among]]:
        """Of every parameter at ``p``; what moves many DOFs may be said among the modes with
        coordinates ``X`` (r, low)."""

    def lowest(self) -> Real:
        """Frequencies (Hz) of the flexible modes of today's model, up to 1.3 times the band at
        least."""


@dataclass(frozen=True)
class EveryDof:
    """Every DOF of a ``model``: its own modes, for a band up to ``top`` (Hz)."""

    model: Model = field(repr=False)
    top: float
    answered: tuple[int, ...] = ()

    def modes(self, p: Real) -> Found:
        """All of a small model, else up to three times the band."""
        m = self.model.matrices(p)
        modes = basis(m.K, m.M, self.top, rigid_body_modes(self.model, m.K, m.M))
        return Found(modes, modes.shapes, {"K": m.K, "M": m.M, "C": m.C, "D": m.D})

    def derivatives(self, p: Real, X: Real) -> tuple[tuple[DerivativeBlock, ...], ...]:
        """Element blocks."""
        return self.model.derivatives(p)

    def lowest(self) -> Real:
        """As many as the band needs."""
        m = self.model.matrices(self.model.zero())
        rigid = rigid_body_modes(self.model, m.K, m.M)
        count = min(self.model.size, 40)
        while True:
            f = natural_modes(m.K, m.M, count, rigid).flexible().frequencies
            if len(f) < count or f[-1] > 1.3 * self.top or count >= self.model.size:
                return np.asarray(f)
            count = min(2 * count, self.model.size)
