"""What the modes in responses tell of what the responses leave open, of plain figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge import by_modes as module
from cvxupdate.diagnose.judge.by_modes import ByModes
from cvxupdate.diagnose.judge.graded import Graded
from cvxupdate.diagnose.judge.judge import Judgement, judge
from cvxupdate.diagnose.judge.pattern import Pattern
from cvxupdate.diagnose.output.diagnosis import details_of
from cvxupdate.diagnose.output.wording import verdict_of
from cvxupdate.diagnose.results import Further, Gain
from cvxupdate.diagnose.search import grown
from cvxupdate.diagnose.search.grown import confirmed, leaves_much
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import CUT_SHORT
from cvxupdate.diagnose.types import Errors
from cvxupdate.physics.place import Place
from cvxupdate.physics.quantity import factor
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, supposed, weighed

A, B, C = effect(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,))
BASE = PlainFit(100.0, errors=Errors(0.9, 0.9))
GOOD = PlainFit(1.0, errors=Errors(0.001, float("nan")))
OPEN = PlainFit(20.0, errors=Errors(0.35, 0.3))  # too much for a claim by responses alone
EVIDENCE = PlainEvidence((BASE,), alone={(): BASE})  # type: ignore[dict-item]
MODES = PlainEvidence((replace(BASE, errors=Errors(0.1, float("nan"))),), told_by="modes")


def judged(evidence: PlainEvidence, *tried) -> Judgement:
    single = tuple(h for h in tried if len(h.effects) == 1)
    several = tuple(h for h in tried if len(h.effects) > 1)
    return judge(evidence, Found(singles=single, several=several))  # type: ignore[arg-type]


def by_modes(told: Judgement | None) -> ByModes:
    """A look that was taken."""
    look = ByModes(EVIDENCE, print)  # type: ignore[arg-type]
    look.__dict__["told"] = told
    return look


TOLD = judged(MODES, supposed(GOOD, A, size=0.3))
LEFT_OPEN = judged(EVIDENCE, supposed(OPEN, A), supposed(OPEN, B))


def test_what_the_modes_tell_and_the_responses_confirm_is_claimed() -> None:
    assert not LEFT_OPEN.findings, "a third of the response is left"
    look = by_modes(TOLD)
    found = look.instead(LEFT_OPEN)
    (finding,) = found.findings
    assert finding.parameters == {"factor": 1.4}, "1.3 by the modes, 1.5 by the responses"
    assert finding.deviations["factor"] == pytest.approx(np.hypot(0.01, 0.1))
    assert finding.confidence == TOLD.findings[0].confidence and "1.4" in finding.says
    assert found.last is found.final is LEFT_OPEN.singles[0], "the page is that of the responses"
    (line,) = look.lines(LEFT_OPEN, found)
    assert "told by the natural frequencies" in line and "0.001 of the response" in line


def left_without(monkeypatch: pytest.MonkeyPatch, *misfits: float) -> None:
    """What a set leaves without its first effect, its second and so on."""

    def rest(evidence: object, h: object, k: int) -> object:
        return supposed(replace(OPEN, misfit=misfits[k]))

    monkeypatch.setattr(module, "without", rest)


def test_what_the_responses_do_without_is_not_claimed(monkeypatch: pytest.MonkeyPatch) -> None:
    other = judged(MODES, supposed(GOOD, B, size=0.3))
    both = (*TOLD.findings, *other.findings), (*TOLD.standings, *other.standings)
    pair = weighed(GOOD, A, B)
    told = replace(TOLD, final=pair, several=(pair,), findings=both[0], standings=both[1])
    larger = judged(EVIDENCE, supposed(OPEN, A, B))
    left_without(monkeypatch, 60.0, 22.0)
    (finding,) = by_modes(told).instead(larger).findings
    assert finding.place == A.place
    left_without(monkeypatch, 30.0, 22.0)
    assert by_modes(told).instead(larger).findings == ()


def test_another_form_on_the_responses_leaves_the_figures_of_the_modes() -> None:
    two = effect(count=2).action
    wider = replace(A, action=two, figures=(*A.figures, factor("soft_first", 1)))
    found = by_modes(TOLD).instead(judged(EVIDENCE, supposed(OPEN, wider)))
    assert found.findings[0].parameters == {"factor": 1.3}
    assert found.findings[0].says == TOLD.findings[0].says


def test_what_stands_beside_it_on_the_responses_has_a_standing_of_its_own(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    left_without(monkeypatch, 12.0, 80.0)
    larger = supposed(replace(OPEN, misfit=10.0), C, A)
    found = by_modes(TOLD).instead(judged(EVIDENCE, larger))
    assert found.final is not None and found.final.hypothesis is larger
    assert found.standings[1] == TOLD.standings[0] and found.standings[0] != TOLD.standings[0]
    rows = details_of(found, Found(), ())["standing"]
    assert [r["name"] for r in rows] == [C.name, A.name] and len(found.findings) == 1


HIGH = replace(OPEN, errors=Errors(0.3, 0.8))


@pytest.mark.parametrize(
    ("told", "responses"),
    [
        pytest.param(None, LEFT_OPEN, id="no such look"),
        pytest.param(judged(MODES), LEFT_OPEN, id="they tell nothing"),
        pytest.param(TOLD, judged(EVIDENCE, supposed(OPEN, B)), id="not on the responses"),
        pytest.param(TOLD, judged(EVIDENCE, supposed(OPEN, A, size=2.0)), id="another size"),
        pytest.param(TOLD, judged(EVIDENCE, supposed(HIGH, A)), id="what was held out says no"),
        pytest.param(
            TOLD,
            judged(EVIDENCE, supposed(replace(OPEN, misfit=60.0), A)),
            id="the responses are not halved",
        ),
    ],
)
def test_nothing_is_claimed_by_the_modes_alone(told, responses) -> None:
    look = by_modes(told)
    found = look.instead(responses)
    assert (
        not found.findings and found.last is found.case.base and look.lines(responses, found) == []
    )


def test_where_time_ended_the_search_it_is_no_surer_than_that() -> None:
    look = ByModes(replace(EVIDENCE, unfinished=True), print)  # type: ignore[arg-type]
    look.__dict__["told"] = TOLD
    assert look.instead(LEFT_OPEN).findings[0].confidence == CUT_SHORT
    hasty = by_modes(judged(replace(MODES, unfinished=True), supposed(GOOD, A, size=0.3)))
    assert hasty.instead(LEFT_OPEN).findings[0].confidence == CUT_SHORT and not hasty.sure
    assert not confirmed(EVIDENCE, supposed(OPEN, A), hasty)  # type: ignore[arg-type]


def test_what_the_responses_tell_stands() -> None:
    found = judged(EVIDENCE, supposed(replace(GOOD, errors=Errors(0.01, 0.01)), B))
    assert by_modes(TOLD).instead(found) is found and found.findings


def test_responses_that_are_explained_ask_for_no_other_look() -> None:
    explained = judged(PlainEvidence((replace(BASE, misfit=2.0),)))
    look = ByModes(EVIDENCE, print)  # type: ignore[arg-type]
    assert look.instead(explained) is explained
    assert "told" not in look.__dict__ or look.told is None
    assert look.lines(explained, explained) == []


def test_where_the_time_is_over_nothing_is_looked_at() -> None:
    class Late(PlainEvidence):
        def by_modes(self, fewest: int = 0) -> None:
            raise AssertionError("nobody has time for it")

    look = ByModes(Late((BASE,), hurried=True), print)  # type: ignore[arg-type]
    assert look.told is None and look.instead(LEFT_OPEN).findings == ()


def test_modes_that_are_explained_say_what_is_not_missing() -> None:
    calm = judged(replace(MODES, bases=(replace(GOOD, errors=Errors(0.0008, np.nan)),)))
    look = by_modes(calm)
    (line,) = look.lines(LEFT_OPEN, look.instead(LEFT_OPEN))
    assert "are explained by the usual scatter alone" in line and "0.0008" in line


CALM = judged(replace(MODES, bases=(replace(GOOD, errors=Errors(0.0008, np.nan)),)))


def calm(**besides: object) -> ByModes:
    """Modes that the usual scatter explains, with what is said besides."""
    case = CALM.case
    evidence = replace(case.evidence, besides=Further(**besides))  # type: ignore[type-var,arg-type]
    return by_modes(replace(CALM, case=replace(case, evidence=evidence)))


def test_nothing_is_missing_where_the_modes_are_sound_and_no_effect_does_better() -> None:
    worse = judged(EVIDENCE, supposed(replace(OPEN, misfit=80.0), B))
    assert calm().calm and calm().instead(worse).sound
    verdict, says = verdict_of(calm().instead(worse), (), level=False)
    assert verdict == "consistent" and "modal constants" in says and "0.9 of the response" in says
    assert verdict_of(calm().instead(worse), (), level=True)[0] == "undetermined"
    assert not calm().instead(LEFT_OPEN).sound, "an effect halves what the responses leave"
    assert calm(met=True).instead(LEFT_OPEN).sound, "and yet held-out constants are the model's"


def test_where_the_modes_are_calm_no_sets_are_grown(monkeypatch: pytest.MonkeyPatch) -> None:
    def never(*_: object) -> None:
        raise AssertionError("nothing needs another effect")

    for name in ("on_these", "guided", "further"):
        monkeypatch.setattr(grown, name, never)
    coarse = [supposed(replace(OPEN, misfit=80.0), B)]
    assert leaves_much(EVIDENCE, coarse, []) and not leaves_much(EVIDENCE, [], [])  # type: ignore[arg-type]
    ended = grown.Grown([], ahead=False, ended=True)
    assert grown.grown_from(EVIDENCE, coarse, [], calm(), print) == ended  # type: ignore[arg-type]


def test_what_constants_bear_out_is_the_end(monkeypatch: pytest.MonkeyPatch) -> None:
    """What they tell is had on the responses; nothing beside it is sought there."""

    def never(*_: object) -> None:
        raise AssertionError("it is settled")

    monkeypatch.setattr(grown, "on_these", lambda *_: [supposed(OPEN, A)])
    monkeypatch.setattr(grown, "guided", never)
    monkeypatch.setattr(grown, "further", never)
    coarse = [supposed(replace(OPEN, misfit=80.0), B)]

    def sets(**besides: object) -> grown.Grown:
        case = replace(TOLD.case, evidence=replace(MODES, besides=Further(**besides)))  # type: ignore[arg-type]
        look = by_modes(replace(TOLD, case=case))
        return grown.grown_from(EVIDENCE, coarse, [], look, print)  # type: ignore[arg-type]

    found = sets(borne_out=True)
    assert found.ended and [h.keys for h in found.sets] == [{A.key}]
    for disputed in ({}, {"borne_out": True, "against": "The shapes are complex."}):
        with pytest.raises(AssertionError, match="settled"):
            sets(**disputed)


@pytest.mark.parametrize(
    "besides",
    [
        pytest.param({"against": "The shapes are complex."}, id="complex modes"),
        pytest.param({"alpha": (1.0, 0.1), "sure": 0.9}, id="a law of damping"),
        pytest.param({"strain": 40.0, "modes": 5, "most": 15.0}, id="damping ratios far off"),
    ],
)
def test_what_speaks_against_it_forbids_that_word(besides: dict[str, object]) -> None:
    worse = judged(EVIDENCE, supposed(replace(OPEN, misfit=80.0), B))
    look = calm(**besides)
    assert not look.calm and not look.instead(worse).sound
    (line,) = look.lines(worse, look.instead(worse))
    assert str(besides.get("against", "")) in line


def test_modes_that_time_cut_short_or_that_tell_something_are_not_calm() -> None:
    evidence = replace(CALM.case.evidence, unfinished=True)  # type: ignore[type-var]
    assert not by_modes(replace(CALM, case=replace(CALM.case, evidence=evidence))).calm
    assert not by_modes(TOLD).calm and not by_modes(None).calm and not by_modes(judged(MODES)).calm


def test_gains_are_told_where_the_modes_are_explained(monkeypatch: pytest.MonkeyPatch) -> None:
    gain = Gain("gain", ("n1.x",), 1.2, 0.02, 0.97)
    asked: list[tuple[Gain, ...]] = []

    def with_gains(judgement: Judgement, told: object, gains: tuple[Gain, ...]) -> Judgement:
        asked.append(gains)
        return judgement

    monkeypatch.setattr(module, "with_gains", with_gains)
    assert not calm(gains=(gain,)).instead(LEFT_OPEN).sound and asked == [(gain,)]
    off = judged(replace(MODES, besides=Further(gains=(gain,))))
    by_modes(off).instead(LEFT_OPEN)
    assert asked[-1] == (), "modes that nothing explains tell no gain"


def test_what_likely_sets_have_in_common_by_the_modes_is_said() -> None:
    graded = Graded("mass", Place(nodes=(4,)), 0.85, 0.9)
    assert by_modes(replace(judged(MODES), graded=graded)).instead(LEFT_OPEN).graded is graded


def test_the_search_ends_where_the_responses_say_yes_and_leave_much() -> None:
    evidence, look = EVIDENCE, by_modes(TOLD)
    assert look.likely[0].keys == {A.key}
    assert confirmed(evidence, supposed(OPEN, A, C), look)  # type: ignore[arg-type]
    assert not confirmed(evidence, supposed(OPEN, B), look)  # type: ignore[arg-type]
    assert not confirmed(evidence, supposed(replace(OPEN, misfit=1.0), A), look)  # type: ignore[arg-type]
    near = replace(OPEN, errors=Errors(0.05, 0.05))
    assert not confirmed(EVIDENCE, supposed(near, A), look)  # type: ignore[arg-type]
    high = replace(OPEN, errors=Errors(0.3, 0.8))
    assert not confirmed(evidence, supposed(high, A), look)  # type: ignore[arg-type]
    assert not confirmed(evidence, supposed(OPEN, A), by_modes(judged(MODES)))  # type: ignore[arg-type]


def borne_out(monkeypatch: pytest.MonkeyPatch, error: float, foretold: bool = False) -> ByModes:
    """A look whose constants bear out what it tells, and responses that are so far off with it."""
    further = Further(borne_out=True, foretold=foretold)
    case = replace(TOLD.case, evidence=replace(MODES, besides=further))
    left = {(): BASE, (A.key,): PlainFit(60.0, errors=Errors(error, 0.4))}

    def carried(evidence: object, told: object) -> object:
        keys = tuple(e.key for e in told.effects)  # type: ignore[attr-defined]
        return supposed(left[keys], *told.effects)  # type: ignore[attr-defined]

    monkeypatch.setattr(module, "carried", carried)
    return by_modes(replace(TOLD, case=case))


def test_what_constants_bear_out_is_claimed_as_the_modes_tell_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    other = judged(EVIDENCE, supposed(OPEN, B))
    look = borne_out(monkeypatch, 0.4)
    found = look.instead(other)
    assert found.findings == TOLD.findings and found.standings == TOLD.standings
    assert found.final is not None and found.last.errors == Errors(0.4, 0.4)
    (line,) = look.lines(other, found)
    assert "modal constants, fitted and held out" in line and "bear it out" in line
    assert borne_out(monkeypatch, 0.95).instead(other).findings == (), "the responses say no"
    held = borne_out(monkeypatch, 0.95, foretold=True).instead(other)
    assert held.findings == TOLD.findings, "light resonances say nothing beside what was held out"


def test_what_the_responses_confirm_comes_before_that(monkeypatch: pytest.MonkeyPatch) -> None:
    look = borne_out(monkeypatch, 0.4)
    found = look.instead(LEFT_OPEN)
    assert found.findings[0].parameters == {"factor": 1.4}, "halfway between both"
    (line,) = look.lines(LEFT_OPEN, found)
    assert "the responses confirm it" in line


def test_a_damper_by_shapes_and_ratios_is_claimed_where_the_responses_confirm_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The usual scatter explains the modes else; the search ends with it."""
    damped = Pattern(TOLD.findings)
    monkeypatch.setattr(module, "pattern_of", lambda further: damped)
    look = calm()
    assert look.damper is TOLD.findings[0] and not look.calm
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])

    def ended(*singles: Hypothesis) -> bool:
        coarse = [supposed(replace(OPEN, misfit=80.0), B), *singles]
        return grown.grown_from(EVIDENCE, coarse, [], look, print).ended  # type: ignore[arg-type]

    confirmed = supposed(OPEN, A, size=0.5)
    assert look.damps([confirmed]) and ended(confirmed)
    assert not ended(), "beside sensors that weigh it shows with these alone: 4226"
    found = look.instead(LEFT_OPEN)
    (finding,) = found.findings
    assert finding.parameters == {"factor": 1.4}, "halfway between both"
    (line,) = look.lines(LEFT_OPEN, found)
    assert "imaginary parts of the shapes" in line
    left = (replace(OPEN, errors=Errors(0.35, 0.6)), replace(OPEN, errors=Errors(0.6, 0.3)))
    for fit in left:  # not halved where it was held out, or where it was fitted
        assert not look.instead(judged(EVIDENCE, supposed(fit, A))).findings
    assert not look.instead(judged(EVIDENCE, supposed(OPEN, A, size=2.0))).findings, "four times"
    assert not look.instead(judged(EVIDENCE, supposed(OPEN, B))).findings
    assert calm(gains=(Gain("gain", ("n1.x",), 1.2, 0.01, 0.9),)).damper is None


def test_where_nothing_is_missing_a_claim_has_to_explain_all_that_is_left() -> None:
    """Sensors beside their nodes are like an effect: the search ends, and what leaves more than
    noise and tolerance is not claimed."""
    coarse = [supposed(replace(OPEN, misfit=2.0), B)]
    ended = grown.grown_from(EVIDENCE, coarse, [], calm(met=True), print)  # type: ignore[arg-type]
    assert ended.ended and not calm().met
    half = replace(GOOD, misfit=1.5, errors=Errors(0.01, 0.01))
    claimed = judged(EVIDENCE, supposed(half, B))
    assert claimed.findings
    found = calm(met=True).instead(claimed)
    assert not found.findings and found.final is None and found.sound
    assert calm().instead(claimed) is claimed
    all_of_it = judged(EVIDENCE, supposed(replace(half, misfit=1.0), B))
    assert calm(met=True).instead(all_of_it) is all_of_it
