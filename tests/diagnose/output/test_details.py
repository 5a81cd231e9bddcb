"""What is said of a diagnosis beside its findings."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.judge.judge import judge
from cvxupdate.diagnose.output.diagnosis import details_of
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import CLEAR
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, supposed

BASE = PlainFit(100.0, errors=Errors(0.5, 0.5))


@pytest.mark.parametrize(
    ("misfit", "places", "several"),
    [(0.5 * CLEAR, 3, 3), (2.0 * CLEAR, 3, None), (0.5 * CLEAR, 1, None)],
)
def test_explanations_that_leave_nothing_and_are_not_told_apart_are_counted(
    misfit: float, places: int, several: int | None
) -> None:
    """What leaves nothing leaves nothing to a law that depends on the level."""
    fit = PlainFit(misfit, errors=Errors(0.01, 0.01))
    found = Found(singles=tuple(supposed(fit, effect(nodes=(n + 1,))) for n in range(places)))
    judgement = judge(PlainEvidence((BASE,)), found)  # type: ignore[arg-type]
    assert bool(judgement.findings) == (places == 1)
    assert details_of(judgement, found, ()).get("explained_by") == several
