"""Sets freed of what their evidence is better without, on plain figures."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search import backward as module
from cvxupdate.diagnose.search.backward import FIRM, backward, merit
from cvxupdate.diagnose.settings import STRONG
from cvxupdate.diagnose.types import Seed
from cvxupdate.errors import ModelError
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    PlainModel,
    PlainSetting,
    effect,
    parameter,
    rig,
    supposed,
)

A, B, C = rig(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,))


@dataclass(frozen=True)
class Fitted(PlainEvidence):
    """A fit leaves what is written down for the nodes of its effects."""

    ends: Mapping[tuple[int, ...], float] = field(default_factory=dict)
    asked: list[Any] = field(default_factory=list)

    def at_level(self, setting: PlainSetting, level: int) -> PlainSetting:
        return PlainSetting(setting.model, setting.faults, level)

    def fitted(self, seed: Seed, effort: str) -> PlainFit:
        nodes = tuple(sorted(n for e in seed.effects for n in e.place.nodes))
        self.asked.append(nodes)
        if nodes not in self.ends:
            raise ModelError("no structure.")
        return figures(self.ends[nodes], len(nodes), seed.setting)


def figures(misfit: float, count: int, setting: PlainSetting | None = None) -> PlainFit:
    model = PlainModel(tuple(parameter(f"p{k}") for k in range(count)))
    p = np.full(count, 0.5)
    return PlainFit(misfit, p=p, deviations=LOOSE + 0.0 * p, setting=setting or PlainSetting(model))


@pytest.fixture(autouse=True)
def taken_out(monkeypatch: pytest.MonkeyPatch) -> None:
    """A set without its first effect leaves, as it is, two hundred times as much as with it,
    without another ten times that and more."""

    def without(evidence: object, h: Hypothesis, *numbers: int) -> Hypothesis:
        rest = [e for k, e in enumerate(h.effects) if k not in numbers]
        fit = figures(200.0 * (1.0 + 9.0 * numbers[0]) * h.fit.misfit, len(rest))
        return supposed(fit, *rest, std=LOOSE)

    monkeypatch.setattr(module, "without", without)
    monkeypatch.setattr(module, "plainer", lambda evidence, whole: [])


def places(sets: list[Hypothesis]) -> list[tuple[int, ...]]:
    return [tuple(sorted(n for e in h.effects for n in e.place.nodes)) for h in sets]


LOOSE = 0.2  # deviation of sizes of a half


def test_of_a_set_that_explains_each_rest_is_fitted_whatever_it_leaves_as_it_is() -> None:
    """An oscillator of a few grams beside light resonances (the laboratory's 4108): as it is, the
    rest without it left ten times as much as that without another effect, and four hundred."""
    ends = {(1, 2): 0.5, (1, 3): 40.0, (2, 3): 40.0, (1,): 90.0, (2,): 90.0}
    whole = supposed(figures(0.5, 3), A, B, C, std=LOOSE)
    tried = backward(Fitted(ends=ends), whole, print)[1]  # type: ignore[arg-type]
    assert {(1, 2), (1, 3), (2, 3)} <= set(places(tried)) and places(tried)[0] == (1, 2)
    gross = Fitted(ends={k: 100.0 * v for k, v in ends.items()})
    backward(gross, supposed(figures(50.0, 3), A, B, C, std=LOOSE), print)  # type: ignore[arg-type]
    assert len(gross.asked) == 2, "what lies ten times behind does not go on"


def test_what_is_firm_is_not_tried() -> None:
    evidence = Fitted(ends={(1, 2): 0.9, (1, 3): 0.9, (2, 3): 0.9})
    whole = supposed(figures(0.5, 3), A, B, C, std=LOOSE)
    whole.fit.deviations[1] = 0.9 * 0.5 / FIRM
    kept, _ = backward(evidence, whole, print)  # type: ignore[arg-type]
    assert (1, 3) not in evidence.asked and (1, 2) in evidence.asked
    assert len(kept) == 3, "rivals are sought beside each rest all the same"


def test_two_that_go_together_are_found_where_each_is_worth_its_unknowns() -> None:
    """With either of two small things less likely than with both, and most likely with none."""
    whole = supposed(figures(0.50, 3), A, B, C, std=LOOSE)
    ends = {(1, 2): 0.60, (1, 3): 0.90, (2, 3): 9.0, (1,): 0.55, (2,): 9.0}
    less = supposed(figures(0.60, 2), A, B, std=LOOSE)
    assert merit(whole) - STRONG / 2.0 < merit(less) < merit(whole)
    _, tried = backward(Fitted(ends=ends), whole, print)  # type: ignore[arg-type]
    assert (1,) in places(tried)
    against = Fitted(ends={**ends, (1, 2): 0.95})
    assert (1,) not in places(backward(against, whole, print)[1])  # type: ignore[arg-type]


def test_the_same_in_fewer_unknowns_is_sought_where_no_fewer_effects_are_likelier(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """It takes as long as all the rest of a step, and of twelve effects seven go."""
    asked = []

    def plainer(evidence: object, whole: Hypothesis) -> list[Seed]:
        asked.append(places([whole])[0])
        return []

    monkeypatch.setattr(module, "plainer", plainer)
    whole = supposed(figures(0.5, 3), A, B, C, std=LOOSE)
    ends = {(1, 2): 0.45, (1, 3): 40.0, (2, 3): 40.0, (1,): 90.0, (2,): 90.0}
    backward(Fitted(ends=ends), whole, print)  # type: ignore[arg-type]
    assert asked == [(1, 2)]
