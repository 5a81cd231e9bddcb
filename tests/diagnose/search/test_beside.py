"""A narrow resonance is looked for where it shows: on sharper recordings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.search.beside import narrow
from cvxupdate.diagnose.settings import EACH_SIZED, SEVERAL_LEVEL
from cvxupdate.physics.effect import HiddenOscillator

NODE, MASS, TUNING, ZETA = 2, 0.02, 31.0, 0.004  # kg, Hz


def quiet(_: str) -> None:
    """Progress that nobody reads."""


@dataclass(frozen=True)
class Hiding:
    """A structure with something of 20 g that swings on it."""

    lab: Any

    def receptance(self, frequency):
        """(lines, 4, 4)."""
        s = 2j * np.pi * np.asarray(frequency)
        omega = 2.0 * np.pi * TUNING
        soft = 2.0 * ZETA * omega * s + omega**2
        stiff = np.linalg.inv(self.lab.receptance(frequency))
        stiff[:, NODE - 1, NODE - 1] += MASS * s**2 * soft / (s**2 + soft)
        return np.linalg.inv(stiff)


@pytest.fixture(scope="module")
def evidence(chain, lab, measure):
    spec, model = chain
    real = Hiding(lab())
    recordings = (measure(real, 4, seed=21), measure(real, 1, "hold-out", seed=22))
    return gather.gathered(spec, model, recordings, quiet)


def test_what_is_narrow_is_sought_on_sharper_recordings(evidence):
    seeds = narrow(evidence)
    assert 0 < len(seeds) <= EACH_SIZED
    assert all(s.setting.level == SEVERAL_LEVEL and len(s.effects) == 1 for s in seeds)
    assert all(isinstance(s.effects[0].action, HiddenOscillator) for s in seeds)
    first = seeds[0].effects[0]
    assert first.place.nodes == (NODE,)
    assert first.action.frequency == pytest.approx(TUNING, rel=0.03)


def test_where_recordings_have_one_level_there_is_no_sharper_one(evidence):
    class Table:
        levels = 1

    assert narrow(Table()) == []
