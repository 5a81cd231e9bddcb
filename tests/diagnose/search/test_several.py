"""Pairs that may stand in place of a larger set."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.search import several
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, supposed

A, B, C = (effect(nodes=(n,)) for n in (1, 2, 3))


@pytest.mark.parametrize(
    ("left", "times"),
    [
        pytest.param(9.0, 1, id="as near as it"),
        pytest.param(11.0, 0, id="left far behind"),
    ],
)
def test_pairs_that_are_left_far_behind_are_not_exchanged(
    monkeypatch: pytest.MonkeyPatch, left: float, times: int
) -> None:
    """A set of four that explained was sought to be said in two (the rigs' 4894): what leaves ten
    times as much was exchanged for a quarter of a minute."""
    evidence = PlainEvidence((PlainFit(100.0),))
    pair = supposed(PlainFit(left), A, B)
    asked = []

    def refit(pool, seeds):
        pool.found[pair.keys] = pair

    def to_exchange(*args):
        asked.append(args)

    monkeypatch.setattr(several.Pool, "refit", refit)
    monkeypatch.setattr(several.Pool, "clear", False)
    monkeypatch.setattr(several, "beside", lambda *args: [])
    monkeypatch.setattr(several, "_to_exchange", to_exchange)
    monkeypatch.setattr(several, "at_level", lambda evidence, h, level: h)
    monkeypatch.setattr(several, "raced", lambda evidence, sets, legs, progress: list(sets))
    instead = supposed(PlainFit(0.5), A, B, C)
    singles = [supposed(PlainFit(50.0), A)]
    found = several.pairs(evidence, singles, 1, print, instead)  # type: ignore[arg-type]
    assert found == [pair] and len(asked) == times
    several.pairs(evidence, singles, 1, print)  # type: ignore[arg-type]
    assert len(asked) == times + 1, "with nothing to stand in place of they are"
