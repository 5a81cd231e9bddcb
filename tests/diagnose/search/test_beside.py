"""A narrow resonance is looked for where it shows: on sharper recordings."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.search.beside import _swinging, narrow
from cvxupdate.diagnose.settings import EACH_SIZED, SEVERAL_LEVEL, SHORT
from cvxupdate.diagnose.types import Score
from cvxupdate.physics.effect import HiddenOscillator
from cvxupdate.physics.place import Place
from tests.cases.plain_evidence import effect

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


def test_oscillators_that_leave_nearly_as_little_are_all_refitted():
    """Nine places of a frame leave 1.095 to 1.108 % of a table before the rest is fitted again, the
    right one, sixth of them, strongly less than all others after (the laboratory's 4717)."""
    plain = effect("attached_resonator")
    swing = replace(plain, action=HiddenOscillator(0, 16.3, 0.0, None))  # type: ignore[arg-type]
    leaves = (0.01095, 0.01108, 0.0119, 0.0221, 0.03)
    scores = [
        Score(replace(swing, place=Place(nodes=(n,))), 1.0 - left, np.ones(1), exact=True)
        for n, left in enumerate(leaves)
    ]
    other = Score(effect("added_mass"), 0.995, np.ones(1), exact=True)
    assert _swinging([other, *reversed(scores)]) == scores[:3]
    many = [replace(scores[0], effect=replace(swing, place=Place(nodes=(n,)))) for n in range(40)]
    assert len(_swinging(many)) == SHORT and _swinging([other]) == []
