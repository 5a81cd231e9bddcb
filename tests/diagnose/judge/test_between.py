"""What the material of a structure does not do between two tests of it."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.between import drawn, unheard_of
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.settings import STRONG
from tests.cases.chain import BAR, load
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    PlainModel,
    PlainSetting,
    case_of,
    effect,
    parameter,
    weighed,
)

LUMPS = """[[model.elements]]
type = "mass"
rows = [{ id = 21, nodes = [3], m = 0.2, group = "lumps" },
        { id = 22, nodes = [3], m = 0.1, mass_factor = 2.0, group = "lumps" }]
[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 31, nodes = [6], k = 1e6, group = "foot" }]
"""


@pytest.fixture(scope="module")
def bar(tmp_path_factory):
    """Elements 1 to 5 of steel, two lumps at node 3, a spring at node 6."""
    return load(tmp_path_factory.mktemp("bar"), BAR + LUMPS)[1]


def of(what, size: float, **figure):
    """A hypothesis of one effect with its first unknown; ``figure``: m with its deviation."""
    figures = SimpleNamespace(
        values={"m": figure.get("m", size), "factor": 1.0 + size},
        deviations={"m": figure.get("std", 0.01)},
    )
    return SimpleNamespace(effects=(what,), sizes=lambda k: [size], figures=(figures,))


@pytest.mark.parametrize("word, sign", [("stiffness_change", 1), ("thickness_change", 1)])
def test_material_grows_neither_stiffer_nor_thicker(bar, word, sign) -> None:
    there = effect(word, elements=(2, 3))
    assert unheard_of(of(there, 0.2 * sign), bar) == 1
    assert unheard_of(of(there, -0.2 * sign), bar) == 0, "cracked, worn thin"


def test_material_gets_no_lighter_by_itself(bar) -> None:
    there = effect("mass_change", elements=(2, 3))
    assert unheard_of(of(there, -0.2), bar) == 1
    assert unheard_of(of(there, 0.2), bar) == 0, "something was put on"
    assert unheard_of(of(there, 1.9), bar) == 0, "a pipe was filled"
    assert unheard_of(of(there, 2.1), bar) == 1, "that is a lump"


def test_what_has_no_mass_may_be_tightened(bar) -> None:
    assert unheard_of(of(effect("stiffness_change", elements=(31,)), 0.5), bar) == 0


def test_no_more_is_taken_off_than_is_there(bar) -> None:
    lump = effect("added_mass", nodes=(3,))
    assert drawn(bar, (3,)) == pytest.approx(0.4) and drawn(bar, (4,)) == 0.0
    assert unheard_of(of(lump, -1.0, m=-0.41), bar) == 0, "within its deviations"
    assert unheard_of(of(lump, -1.0, m=-0.5), bar) == 1
    assert unheard_of(of(lump, 1.0, m=0.5), bar) == 0, "put on"
    assert unheard_of(of(effect("added_mass", nodes=(4,)), -1.0, m=-0.1), bar) == 1


def test_of_groups_that_are_let_go_it_is_one_supposition(bar) -> None:
    own = (parameter("bar.stiffness", group="bar"), parameter("bar.mass", "mass", group="bar"))

    def let_go(*p: float):
        fit = PlainFit(1.0, p=np.array(p), deviations=np.full(2, 0.02))
        return SimpleNamespace(
            effects=(),
            fit=SimpleNamespace(
                setting=PlainSetting(PlainModel(own)), p=fit.p, deviations=fit.deviations
            ),
        )

    assert unheard_of(let_go(0.1, -0.1), bar) == 1
    assert unheard_of(let_go(0.03, 0.1), bar) == 0, "not told from nothing; heavier"
    assert unheard_of(let_go(-0.1, 0.0), bar) == 0


def test_beside_a_reference_only_and_no_more_than_strong_evidence(bar) -> None:
    setting = PlainSetting(PlainModel((parameter("it"),)))
    fit = PlainFit(1.0, p=np.array([0.2]), deviations=np.array([0.01]), setting=setting)
    w = weighed(fit, effect("stiffness_change", elements=(2,)))
    alone, beside = (case_of(PlainEvidence(file=file)) for file in (None, bar))
    assert log_odds(w, alone) - log_odds(w, beside) == pytest.approx(STRONG / 2.0)
