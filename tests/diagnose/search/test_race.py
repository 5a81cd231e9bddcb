"""The race of hypotheses, on evidence whose fits are figures: who enters, who goes on, what is
begun again."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.race import _field, entered, merged, raced
from cvxupdate.diagnose.search.untuned import tenable
from cvxupdate.diagnose.settings import ABREAST, AGAIN, BEHIND, CLEAR, OPEN, PENALTY, TRIAGED
from cvxupdate.diagnose.types import Seed
from cvxupdate.errors import ModelError
from cvxupdate.physics.effect import EXCHANGED, TUNED, HiddenOscillator
from cvxupdate.physics.fault import Fault
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    PlainSetting,
    effect,
    fault,
    no_model,
    supposed,
)


@dataclass(frozen=True)
class Track(PlainEvidence):
    """A fit is the misfit that is written down for (node, level, begun from the nominal model); a
    fit that is not written down leads to no structure."""

    times: Mapping[Any, float] = field(default_factory=dict)
    efforts: list[Any] = field(default_factory=list)

    def fitted(self, seed: Seed, effort: str) -> PlainFit:
        nodes = tuple(n for e in seed.effects for n in e.place.nodes)
        again = bool(len(seed.start)) and not np.any(seed.start)
        key = (*nodes, seed.setting.level, *(("again",) if again else ()))
        self.efforts.append((key, effort))
        if key not in self.times:
            raise ModelError("no structure.")
        p = np.ones(len(seed.setting.columns))
        return PlainFit(self.times[key], setting=seed.setting, p=p, deviations=p)


def runner(node: int, misfit: float, count: int = 1) -> Hypothesis:
    return supposed(PlainFit(misfit), effect(nodes=(node,), count=count))


def silent(text: str) -> None:
    pass


def nodes(hypotheses) -> list[int]:
    return [h.effects[0].place.nodes[0] for h in hypotheses]


def test_so_many_go_on_and_near_equals_besides() -> None:
    close = [runner(k, 1.0 + 0.01 * k) for k in range(10)]
    assert nodes(_field(close, 3, BEHIND)) == [0, 1, 2, 3, 4, 5], "twice as many, but no more"
    apart = [runner(k, x) for k, x in enumerate((1.0, 2.0, 0.99 * ABREAST, 1.01 * ABREAST))]
    assert nodes(_field(apart, 2, BEHIND)) == [0, 1, 2]
    assert nodes(_field(apart, 4, BEHIND)) == [0, 1, 2, 3]


def test_who_falls_far_behind_does_not_go_on() -> None:
    field_ = [runner(0, 1.0), runner(1, BEHIND), runner(2, 1.01 * BEHIND)]
    assert nodes(_field(field_, 9, BEHIND)) == [0, 1]


def test_the_first_pass_leaves_fewer_behind_than_a_level() -> None:
    times = {(n, k): 1.0 for n in (0, 1, 2) for k in range(2)}
    apart = [runner(0, 1.0), runner(1, 2.0 * BEHIND), runner(2, 2.0 * TRIAGED)]
    first, later = (Track(times=times, levels=9) for _ in range(2))
    raced(first, apart, ((0, 4),), silent)  # type: ignore[arg-type]
    raced(later, apart, ((1, 4),), silent)  # type: ignore[arg-type]
    assert {key[0] for key, _ in first.efforts} == {0, 1}
    assert {key[0] for key, _ in later.efforts} == {0}


def test_further_unknowns_are_a_handicap() -> None:
    one, three = runner(1, 1.0), runner(2, 1.0, count=3)
    assert three.penalised == pytest.approx(one.penalised * (1.0 + 2.0 * PENALTY))
    assert one.penalised == 1.0
    pair = supposed(PlainFit(1.0), effect(nodes=(1,)), effect(nodes=(2,)))
    assert pair.penalised == 1.0, "none for the first unknown of an effect"


def seed(node: int, level: int = 0) -> Seed:
    return Seed((effect(nodes=(node,)),), PlainSetting(level=level), np.zeros(0))


BEGUN_TWICE = {(1, 0): 5.0, (1, 1): 3.0, (2, 0): 4.0}


def test_a_hypothesis_begun_twice_enters_from_both_places() -> None:
    """Where a level is to come that tells which is better."""
    track = Track(times=BEGUN_TWICE)
    found = entered(track, [seed(1), seed(2), seed(1, 1)], silent)  # type: ignore[arg-type]
    assert nodes(found) == [1, 2, 1] and [h.penalised for h in found] == [3.0, 4.0, 5.0]
    assert {effort for _, effort in track.efforts} == {"first pass"}


def test_of_a_hypothesis_begun_twice_the_best_enters_where_no_level_is_to_come() -> None:
    track = Track(times=BEGUN_TWICE, levels=1)
    found = entered(track, [seed(1), seed(2), seed(1, 1)], silent)  # type: ignore[arg-type]
    assert nodes(found) == [1, 2] and found[0].penalised == 3.0


def test_after_a_level_a_hypothesis_stays_in_its_best_place_only() -> None:
    """The one that was behind at first may be ahead then: a level is what tells."""

    @dataclass(frozen=True)
    class Turned(Track):
        def fitted(self, seed: Seed, effort: str) -> PlainFit:
            return replace(super().fitted(seed, effort), misfit=float(seed.start[0]))

    one, other = (
        supposed(PlainFit(misfit), effect(nodes=(1,)), size=size)
        for misfit, size in ((3.0, 2.0), (5.0, 1.0))
    )
    (found,) = raced(Turned(times={(1, 2): 0.0}), [one, other], ((2, 4),), silent)  # type: ignore[arg-type]
    assert found.fit.misfit == 1.0


def test_what_leads_to_no_structure_is_left_out() -> None:
    track = Track(times={(1, 0): 5.0})
    said: list[str] = []
    found = entered(track, [seed(7), seed(1)], said.append)  # type: ignore[arg-type]
    assert nodes(found) == [1] and said[0].startswith("refitting 1 of 2: ")


def test_when_time_is_over_the_best_three_go_on() -> None:
    """They are refitted to the end, so that the best has rivals to be weighed against."""
    times = {(k, 2): float(k) for k in range(1, 7)}
    track = Track(times=times, hurried=True)
    said: list[str] = []
    field = [runner(k, 1.0 + 0.1 * k) for k in range(1, 7)]
    assert nodes(raced(track, field, ((2, 6),), said.append)) == [1, 2, 3]  # type: ignore[arg-type]
    assert "time is over" in said[-1]


def test_what_is_not_tenable_neither_enters_nor_goes_on() -> None:
    """A fit took the exchange back: the channels are sound."""
    swap = fault("n1.x")
    swap = replace(swap, action=replace(swap.action, fault=Fault("n1.x", "swap", other="n2.x")))
    half = supposed(PlainFit(1.0), swap, size=-0.5)
    track = Track(times={(1, 0): 1.0, (1, 2): 1.0})
    begun = Seed((swap,), half.fit.setting, np.zeros(0))  # its fit ends at p = 1
    assert entered(track, [begun], silent) == []  # type: ignore[arg-type]
    assert raced(track, [half], ((2, 4),), silent) == []  # type: ignore[arg-type]


def test_a_race_goes_through_its_levels_and_those_that_there_are() -> None:
    """The order is that of the last level; a level that the evidence has not is not run."""
    times = {(1, 0): 2.0, (2, 0): 1.0, (1, 2): 0.1, (2, 2): 0.2, (1, 3): 0.1, (2, 3): 0.2}
    legs = ((0, 5), (2, 5), (3, 5))
    track = Track(times=times)
    assert nodes(raced(track, [runner(1, 9.0), runner(2, 8.0)], legs, silent)) == [1, 2]  # type: ignore[arg-type]
    assert [e for _, e in track.efforts] == ["coarse"] * 4 + ["sharp"] * 2, "sharp at the last"
    short = Track(times=times, levels=1)
    assert nodes(raced(short, [runner(1, 9.0), runner(2, 8.0)], legs, silent)) == [2, 1]  # type: ignore[arg-type]
    assert {e for _, e in short.efforts} == {"sharp"}
    assert raced(track, [], legs, silent) == []  # type: ignore[arg-type]
    assert raced(track, [runner(9, 1.0)], legs, silent) == [], "no structure"  # type: ignore[arg-type]


@pytest.mark.parametrize(
    ("here", "nominal", "wanted", "fits"),
    [
        (1.01 * CLEAR, 0.1, 0.1, 2),
        (1.01 * CLEAR, 5.0, 1.01 * CLEAR, 2),
        (1.01 * CLEAR, None, 1.01 * CLEAR, 2),
        (CLEAR, 0.1, CLEAR, 1),
    ],
    ids=["better from there", "worse from there", "no structure there", "clear already"],
)
def test_what_leaves_much_is_begun_again_from_the_nominal_model(
    here: float, nominal: float | None, wanted: float, fits: int
) -> None:
    times = {(1, AGAIN): here}
    times |= {} if nominal is None else {(1, AGAIN, "again"): nominal}
    track = Track(times=times, model=PlainSetting().model)  # type: ignore[arg-type]
    h = Hypothesis((effect(nodes=(1,)),), PlainFit(9.0, p=np.ones(1), setting=Damped()))  # type: ignore[arg-type]
    (found,) = raced(track, [h], ((AGAIN, 4),), silent)  # type: ignore[arg-type]
    assert found.fit.misfit == wanted and len(track.efforts) == fits


def test_what_falls_far_behind_a_good_one_is_not_begun_again() -> None:
    """Where the best still leaves much, everybody is: the next may be what is there."""

    def fits(best: float, other: float) -> int:
        times = {(1, AGAIN): best, (2, AGAIN): other}
        track = Track(times=times, model=PlainSetting().model)  # type: ignore[arg-type]
        field_ = [
            Hypothesis((effect(nodes=(n,)),), PlainFit(1.0, p=np.ones(1), setting=Damped()))  # type: ignore[arg-type]
            for n in (1, 2)
        ]
        raced(track, field_, ((AGAIN, 4),), silent)  # type: ignore[arg-type]
        return sum(key[0] == 2 for key, _ in track.efforts)

    assert fits(1.0, 1.01 * BEHIND) == 1
    assert fits(1.0, 0.99 * BEHIND) == 2
    assert fits(1.01 * OPEN, 2.0 * BEHIND * OPEN) == 2


@dataclass(frozen=True)
class Damped(PlainSetting):
    """One unknown, of damping, that a nominal start sets to zero."""

    @property
    def columns(self) -> tuple[str, ...]:
        return ("damping",)


def test_an_exchange_of_channels_is_tenable_in_full_only() -> None:
    swap = fault("n1.x")
    swap = replace(swap, action=replace(swap.action, fault=Fault("n1.x", "swap", other="n2.x")))
    for off, good in ((0.9 * EXCHANGED, True), (1.1 * EXCHANGED, False), (-1.1 * EXCHANGED, False)):
        h = supposed(PlainFit(1.0), swap, size=off)
        assert tenable(PlainEvidence(), h) == good  # type: ignore[arg-type]
    assert tenable(PlainEvidence(), supposed(PlainFit(1.0), fault("n1.x"), size=-2.0))  # type: ignore[arg-type]


@pytest.mark.parametrize(("frequency", "good"), [(1.01, True), (0.99, False)])
def test_a_hidden_oscillator_is_tuned_inside_the_band(frequency: float, good: bool) -> None:
    """Below it is a spring to nothing, above it a mass."""
    low, high = PlainEvidence().band
    action = HiddenOscillator(0, 10.0, 0.01, lambda *_: no_model(), 1.0)
    for tuned in (frequency * TUNED[0] * low, TUNED[1] * high / frequency):
        made = replace(effect(), action=action)
        values = {"m": 0.5, "k": 0.5 * (2 * np.pi * tuned) ** 2}
        assert made.tenable(values, low, high) == good


def test_merged_keeps_the_best_of_each() -> None:
    found = merged([runner(1, 3.0), runner(2, 2.0)], [runner(1, 1.0)])
    assert nodes(found) == [1, 2] and [h.penalised for h in found] == [1.0, 2.0]


def test_where_all_are_to_go_on_none_is_too_far_behind() -> None:
    apart = [runner(0, 1.0), runner(1, 2.0 * BEHIND), runner(2, 1000.0)]
    track = Track(times={(n, 1): 1.0 + n for n in range(3)})
    found = raced(track, apart, ((1, 4),), silent, behind=np.inf)  # type: ignore[arg-type]
    assert nodes(found) == [0, 1, 2]
