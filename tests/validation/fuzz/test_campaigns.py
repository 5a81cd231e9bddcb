"""The campaigns of random input: every kind runs, counts go on, and what they found once."""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import cvxupdate
from cvxupdate.errors import InputError
from validation.fuzz import __main__ as fuzz


@pytest.mark.parametrize("kind", list(fuzz.KINDS))
def test_some_cases_of_every_kind(kind: str) -> None:
    assert [fuzz.failure(kind, n) for n in range(12)] == [None] * 12


FOUND = [
    ("readers", 19007),  # infinite values in a universal file, times its sign
    ("readers", 22683),  # among the lines whose peaks are sought
    ("problems", 8085),  # the spectrum of a record of a few samples
    ("problems", 17684),  # of one of 1e200 N
    ("problems", 10818),  # coordinates of 1e200 m
    ("arguments", 8202),  # a complex number as a node
    ("arguments", 16402),  # a record at 1e300 samples a second
    ("arguments", 17446),
]


@pytest.mark.parametrize(("kind", "number"), FOUND)
def test_what_the_campaigns_found_stays_mended(kind: str, number: int) -> None:
    assert fuzz.failure(kind, number) is None


def test_a_campaign_goes_on_and_keeps_its_failures(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(fuzz, "FOLDER", tmp_path)
    drawn: list[float] = []

    def case(rng: np.random.Generator) -> None:
        drawn.append(float(rng.random()))
        if len(drawn) == 3:
            raise ZeroDivisionError("found")

    monkeypatch.setitem(fuzz.KINDS, "units", case)
    assert fuzz.campaign("units", 2, time.monotonic() + 60)[0] == 2
    done, found = fuzz.campaign("units", 5, time.monotonic() + 60)
    assert done == 5 and len(drawn) == len(set(drawn)) == 5
    assert len(found) == 1 and found[0].startswith("units 2: ZeroDivisionError at ")
    assert "units 2: ZeroDivisionError" in (tmp_path / "failures.txt").read_text()


@pytest.mark.parametrize("supports", [3, True, 2.5, {1: np.empty(0)}, {1: np.zeros(3)}])
def test_supports_that_are_none(supports: object) -> None:
    """Found by the campaign: an int is not iterable, the truth of an empty array is ambiguous."""
    with pytest.raises(InputError, match="supports"):
        cvxupdate.Model({1: [0.0]}, [{"type": "mass", "nodes": [[1]], "m": 1}], supports=supports)


def test_a_type_that_is_no_word() -> None:
    with pytest.raises(InputError, match="type"):
        cvxupdate.Model({1: [0.0]}, [{"type": [], "nodes": [[1]], "m": 1}])
