"""What is told of a search that its time has ended, on plain figures."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cvxupdate.diagnose.judge.parts import in_time
from tests.cases.plain_evidence import PlainEvidence, PlainFit, case_of, effect, rig, weighed

BASE = PlainFit(100.0, independent=20.0)
EFFECTS = (rig(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,)))


def told(parts, unfinished: bool) -> list[int]:
    evidence = replace(PlainEvidence(bases=(BASE,)), unfinished=unfinished)
    final = weighed(PlainFit(1.0, independent=20.0), *EFFECTS)
    return in_time(case_of(evidence), final, range(len(parts)), parts)


@pytest.mark.parametrize(
    "parts, first",
    [
        pytest.param((0.9, 0.07, 0.005), [0, 1], id="one stands out"),
        pytest.param((0.1, 0.25, 0.25), [0], id="none does"),
        pytest.param((0.9, 0.07), [0, 1], id="one was sought"),
    ],
)
def test_what_was_added_last_waits_for_its_exchange(parts, first) -> None:
    """A spring at one corner was told (0.5) beside the softer element that was concealed, for the
    time had ended the search (the laboratory's 4652)."""
    assert told(parts, unfinished=True) == first
    assert told(parts, unfinished=False) == list(range(len(parts)))
