"""What unknowns cost."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.priced import price, unknowns_of
from cvxupdate.physics.alike import OWN
from tests.cases.plain_evidence import PlainFit, PlainModel, PlainSetting, effect, parameter


@dataclass(frozen=True)
class Told(PlainFit):
    """A third of each unknown is told."""

    def determined(self, some: Sequence[int]) -> float:
        return len(some) / 3.0


def fitted(*groups: str | None) -> Hypothesis:
    parameters = tuple(parameter(f"q{k}", group=g) for k, g in enumerate(groups))
    setting = PlainSetting(PlainModel(parameters))
    return Hypothesis((effect(),), Told(1.0, setting=setting, p=np.zeros(len(groups))))  # type: ignore[arg-type]


def test_an_unknown_costs_half_the_logarithm_of_the_figures() -> None:
    assert price(3, 20.0) == pytest.approx(1.5 * math.log(20.0))
    assert price(1, 1.0) == pytest.approx(0.5 * math.log(2.0)), "never for nothing"


def test_what_members_have_of_their_own_costs_as_much_as_is_told_of_it() -> None:
    """Other hypotheses have not what four feet differ by, while groups scatter in all of them."""
    assert unknowns_of(fitted("beams", None)) == 1.0
    assert unknowns_of(fitted("beams", None, OWN, OWN, OWN)) == pytest.approx(2.0)
