"""The pairing of measured modes in the making."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.shape_rows import Index, Who

# relative distance of frequencies in two tables that are one mode measured twice (between tests of
# one structure they differ by less)
AGAIN = 0.01
TELLING = 3  # pairs of which one may be odd


@dataclass(frozen=True)
class Book:
    """The pairing in the making: ``places`` among the flexible modes, ``taken`` by whom first,
    ``loose`` as in `cvxupdate.residual.pairing.Start`."""

    tables: Sequence[ModeTable]
    flexible: Modes
    places: list[Index]
    loose: list[NDArray[np.bool_]]
    taken: dict[int, Who]

    def free(self) -> Index:
        """Modes of the model that none was paired with."""
        return np.array(
            [i for i in range(len(self.flexible.eigenvalues)) if i not in self.taken],
            dtype=np.int64,
        )

    def pair(self, k: int, i: int, mode: int, loose: bool = False) -> None:
        """Mode ``i`` of table ``k`` is this one."""
        self.places[k][i], self.loose[k][i] = mode, loose
        self.taken.setdefault(mode, (k, i))

    @property
    def apart(self) -> list[float]:
        """By how much each paired mode of the model lies above its measured one, logarithms."""
        f = self.flexible.frequencies
        return [
            float(np.log(f[mode] / table.frequency[i]))
            for table, places in zip(self.tables, self.places, strict=True)
            for i, mode in enumerate(places.tolist())
            if mode >= 0
        ]

    @property
    def off(self) -> float:
        """The factor by which the model's frequencies are off as a whole, by the modes that are
        paired; 1 of so few that one odd pair would be the median."""
        return float(np.exp(np.median(self.apart))) if self.telling else 1.0

    @property
    def telling(self) -> bool:
        """Whether enough modes are paired to say how far the model is off as a whole."""
        return len(self.apart) >= TELLING

    def shared(self, k: int, i: int, mode: int) -> bool:
        """Whether mode ``i`` of table ``k`` may have a mode of the model that another table has
        already: that one says `mode` too, or it is the same again."""
        if mode in self.places[k]:
            return False
        other, j = self.taken[mode]
        f, g = self.tables[k].frequency[i], self.tables[other].frequency[j]
        return int(self.tables[other].pairs[j]) == mode + 1 or bool(abs(f - g) <= AGAIN * f)
