"""Which effects count as a truth, and that the cases of an evaluation are not looked at."""

from __future__ import annotations

import pytest

from tests.cases.plain_evidence import effect
from validation.lost import has, main, says

SOFT = {
    "physics": "stiffness_change",
    "location": {"nodes": [], "elements": [3], "groups": []},
    "equivalent": [],
}
LUMP = {"physics": "added_mass", "location": {"nodes": [2], "elements": [], "groups": []}}


def test_an_effect_is_a_truth_by_its_word_and_place() -> None:
    assert says(effect("stiffness_change", elements=(3,)), SOFT)
    assert not says(effect("stiffness_change", elements=(4,)), SOFT)
    assert not says(effect("mass_change", elements=(3,)), SOFT)


def test_a_set_has_a_truth_when_it_has_each_effect_of_it() -> None:
    soft, lump = effect("stiffness_change", elements=(3,)), effect("added_mass", nodes=(2,))
    assert has([lump, effect("viscous_damper"), soft], [SOFT, LUMP])
    assert not has([soft], [SOFT, LUMP]) and has([], [])


@pytest.mark.parametrize("cases", [["1000"], ["3311"], ["--plates", "1003"], ["--rigs", "18001"]])
def test_an_evaluation_is_not_looked_at(
    cases: list[str], capsys: pytest.CaptureFixture[str]
) -> None:
    with pytest.raises(SystemExit):
        main(cases)
    assert "only totals are looked at" in capsys.readouterr().err


def test_a_case_is_watched(capsys: pytest.CaptureFixture[str]) -> None:
    """A chain on a rig: the truth fitted by hand beside what the search found of it."""
    main(["--rigs", "2747"])
    said = capsys.readouterr().out
    assert said.startswith("g2747 right") and "by hand: misfit" in said and "LOST" not in said
