"""The sentence of every verdict, and the evidence that is stated for it."""

from __future__ import annotations

from dataclasses import dataclass, replace

import pytest

from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.output.evidence_words import MOST, evidence_lines
from cvxupdate.diagnose.output.wording import (
    RIVALS,
    depends_a_little,
    nonlinear,
    slightly,
    verdict_of,
)
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import LEVEL_CHANGE, LEVEL_NOISE, SLIGHT_CHANGE
from cvxupdate.diagnose.types import Errors, LevelChange
from cvxupdate.physics.effect import Effect
from tests.cases.plain_evidence import (
    NAN,
    PlainEvidence,
    PlainFit,
    PlainType,
    case_of,
    effect,
    weighed,
)

BASE = PlainFit(100.0, errors=Errors(0.5, 0.4))
CASE = case_of(PlainEvidence((BASE,)))
A, B = effect("added_mass", nodes=(2,)), effect("viscous_damper", nodes=(3,))
ONE = weighed(PlainFit(9.0, errors=Errors(0.1, 0.12)), A)
BOTH = weighed(PlainFit(1.0, errors=Errors(0.01, 0.02)), A, B)
EMPTY = Judgement(CASE, (), ())


class Rubs(PlainType):
    """A law that depends on the level."""

    told_by = frozenset({"motion"})


def told(e: Effect, says: str = "It is so.", equivalent: tuple[Effect, ...] = ()) -> Finding:
    return Finding(e.physics, e.place, e.title, {}, {}, {}, 0.9, 1.0, equivalent, says)


def test_recordings_that_depend_on_the_level_are_not_linear() -> None:
    quiet = 0.9 * LEVEL_CHANGE / LEVEL_NOISE
    assert nonlinear(LevelChange(1.01 * LEVEL_CHANGE, quiet))
    assert not nonlinear(LevelChange(LEVEL_CHANGE, 0.0)), "a change that does not matter"
    assert not nonlinear(LevelChange(0.5, 0.5 / LEVEL_NOISE)), "noise may be all of it"
    assert not nonlinear(None)


def test_distortion_makes_less_of_a_change_surely_nonlinear() -> None:
    """A sweep with a Bouc-Wen mount: 8.2 % (noise 1.8 %), and 5 % of the motion unforced."""
    change = LevelChange(0.082, 0.018)
    assert nonlinear(change, distortion=True) and not nonlinear(change)
    assert not nonlinear(LevelChange(0.082, 0.05), distortion=True), "noise may be all of it"
    assert not nonlinear(LevelChange(0.9 * LEVEL_CHANGE, 0.0), distortion=True)
    lines = evidence_lines(EMPTY, change, distortion=True)
    assert lines[0].endswith("so the structure is not linear.")


def test_laws_are_tried_of_a_slight_change_that_is_no_noise() -> None:
    little = LevelChange(1.5 * SLIGHT_CHANGE, 0.2 * SLIGHT_CHANGE)
    assert slightly(little) and not nonlinear(little)
    assert not slightly(LevelChange(little.change, 0.5 * SLIGHT_CHANGE)), "noise may be all of it"
    assert not slightly(LevelChange(0.9 * SLIGHT_CHANGE, 0.0)) and not slightly(None)
    says = evidence_lines(EMPTY, little)[0]
    assert says.endswith("the response depends on the level, though little.")


def test_what_depends_on_the_level_is_never_consistent() -> None:
    """Too little for a law, or with a law that does not convince: said either way."""
    motion = PlainEvidence((replace(BASE, misfit=2.0),), told_by="motion")
    verdict, says = verdict_of(replace(EMPTY, case=case_of(motion)), (), True)
    assert verdict == "undetermined" and says.endswith("too small for a law to be told by it.")
    tied = replace(EMPTY, case=case_of(motion), singles=(ONE,), single=ONE, final=ONE)
    verdict, says = verdict_of(tied, (), True)
    assert verdict == "undetermined" and "comes nearest" in says, "a law that is not told"
    rubs = PlainEvidence((BASE,), told_by="motion")
    verdict, says = verdict_of(replace(EMPTY, case=case_of(rubs), singles=(ONE,)), (), True)
    assert verdict == "undetermined" and "what remains is 0.5 of the response" in says
    assert says.startswith("Something in the structure depends on the vibration level")


def test_no_linear_sentence_of_what_is_not_linear() -> None:
    verdict, says = verdict_of(replace(EMPTY, findings=(told(A),)), (), True)
    assert verdict == "undetermined" and "depends on the vibration level" in says
    assert says.endswith("would tell which law it is and where: these recordings cannot.")
    lines = evidence_lines(EMPTY, LevelChange(0.2, 0.01))
    assert lines[0] == (
        "Between drive levels the transfer functions change by 20 % (noise alone: 1 %): the "
        "response depends on the level, so the structure is not linear."
    )
    assert lines[1:] == ["A line of the evidence."]


def test_what_comes_nearest_is_no_contradiction_of_what_the_level_says() -> None:
    """A linear change is told to be a part at most; a law is not."""
    motion = case_of(PlainEvidence((BASE,), told_by="motion"))
    cut = case_of(PlainEvidence((BASE,), told_by="motion", unfinished=True))
    law = effect("cubic_stiffness", nodes=(3,))
    law = replace(law, type=Rubs("cubic_stiffness", "some cubic stiffness"))
    ruled = weighed(ONE.fit, law)
    for case in (motion, cut):
        for w, said in ((ONE, ", a linear change and so a part of it at most,"), (ruled, "")):
            found = replace(EMPTY, case=case, singles=(w,), single=w, final=w)
            verdict, says = verdict_of(found, (), True)
            assert verdict == "undetermined" and says.count("Something") == 1
            assert "no linear change of the model is the whole explanation" in says
            assert f"{w.hypothesis.title}{said} comes nearest" in says


def test_some_figures_that_are_off_are_said_before_all_else() -> None:
    odd = case_of(PlainEvidence((replace(BASE, misfit=0.9),), limit=0.0, odd="the 11 figures"))
    found = replace(EMPTY, case=odd)
    verdict, says = verdict_of(found, (), False)
    start = "Taken by themselves the 11 figures are not explained, though all figures of the table"
    assert verdict == "undetermined" and says.startswith(start) and "Something differs" in says
    assert evidence_lines(found, None)[-1].startswith(start)


def test_findings_are_told_one_after_the_other() -> None:
    found = replace(EMPTY, final=BOTH, findings=(told(A, "One."), told(B, "Two.")))
    assert verdict_of(found, (), False) == ("missing_physics", "One. Two.")
    assert verdict_of(found, (told(B, "Three."),), False)[1] == "One. Two. Three."
    assert verdict_of(EMPTY, (told(B, "Three."),), False) == ("missing_physics", "Three.")


def test_wrong_numbers_of_groups_are_a_parameter_error() -> None:
    groups = effect("stiffness_change", elements=(1, 2), groups=("bar",))
    heavy = effect("mass_change", elements=(1, 2), groups=("bar",))
    some = effect("stiffness_change", elements=(1,))
    for findings, verdict in (
        ((groups, heavy), "parameter_error"),
        ((groups, some), "missing_physics"),
        ((groups, A), "missing_physics"),
        ((effect("thickness_change", groups=("bar",)),), "missing_physics"),
    ):
        found = replace(EMPTY, final=BOTH, findings=tuple(told(e) for e in findings))
        assert verdict_of(found, (), False)[0] == verdict


def test_nothing_missing_is_consistent() -> None:
    sound = replace(EMPTY, case=case_of(PlainEvidence((replace(BASE, misfit=2.0),))))
    verdict, says = verdict_of(sound, (), False)
    assert verdict == "consistent" and says == (
        "Nothing is missing: the model explains the recordings within noise, what a sound "
        "model may miss, and the usual scatter of its parameters."
    )


def test_what_comes_nearest_is_named_where_it_is_not_claimed() -> None:
    """With both of its errors, each by its name."""
    found = replace(EMPTY, singles=(ONE,), single=ONE, final=ONE)
    assert verdict_of(found, (), False) == (
        "undetermined",
        "No one or two effects explain the recordings: some added mass at node 2 comes nearest, "
        "but leaves 0.1 of the response and 0.12 "
        "(held out).",
    )
    assert evidence_lines(found, None)[-2:] == [
        "Some added mass at node 2 comes nearest and leaves 0.1 of the response and 0.12 (held "
        "out): too much for it to be claimed.",
        "What is left is 9.",
    ]


@pytest.mark.parametrize(
    ("held", "why"),
    [
        (0.02, "but at no size that they tell"),
        (0.7, "but what was held out refutes that (0.01 of the response and 0.7 (held out))"),
    ],
    ids=["of no size", "refuted"],
)
def test_what_explains_all_and_is_not_claimed_is_said_with_the_reason(
    held: float, why: str
) -> None:
    """An oscillator of 990 ± 3200 kg, as well at eight other nodes: "none of the known effects
    explains", it said, and "what remains is 115 % of the frequencies"."""
    fit = PlainFit(1.0, errors=Errors(0.01, held))
    every = tuple(weighed(fit, effect("added_mass", nodes=(k,)), std=0.9) for k in (2, 5, 6))
    found = replace(EMPTY, singles=every)
    assert verdict_of(found, (), False) == (
        "undetermined",
        "Something differs; some added mass at node 2, as 2 others would, explains what was fitted "
        f"of these recordings, {why}: it is not claimed.",
    )
    assert not any("too much" in line for line in evidence_lines(found, None))
    alone = verdict_of(replace(EMPTY, singles=every[:1]), (), False)[1]
    assert "node 2 explains what was fitted" in alone


def test_several_effects_come_nearest_and_leave() -> None:
    """A sentence of two things has the verbs of two."""
    two = weighed(PlainFit(9.0, errors=Errors(0.1, 0.12)), A, B)
    found = replace(EMPTY, several=(two,), final=two)
    says = verdict_of(found, (), False)[1]
    assert f"{two.hypothesis.title} come nearest, but leave 0.1 of the response" in says
    line = evidence_lines(found, None)[-2]
    assert "come nearest and leave 0.1 of the response" in line


def test_where_too_many_explain_them_the_recordings_cannot_tell() -> None:
    fit = PlainFit(1.0, errors=Errors(0.01, 0.02))
    alike = tuple(weighed(fit, effect("added_mass", nodes=(k,))) for k in (2, 5, 6, 7))
    found = replace(EMPTY, singles=alike, final=alike[0], field=alike)
    assert verdict_of(found, (), False) == (
        "undetermined",
        "Something differs, but these recordings cannot tell what: some added mass at node 2, some "
        "added mass at node 5, some added mass at node 6 and 1 other explain them about equally "
        "well.",
    )


def test_where_no_effect_helps_the_rest_is_stated() -> None:
    assert verdict_of(replace(EMPTY, singles=(ONE,)), (), False) == (
        "undetermined",
        "Something differs that none of the known effects explains at any one or two places; what "
        "remains is 0.5 of the response.",
    )


def test_a_search_that_time_ended_does_not_say_that_nothing_explains_it() -> None:
    """Not all was tried: the remedy is named, and a long list of effects is not."""
    cut = replace(EMPTY, case=case_of(PlainEvidence((BASE,), unfinished=True)))
    start = (
        "Something differs, and the time for one diagnosis ended the search before what it is was "
        "found (--thorough goes on)"
    )
    three = weighed(PlainFit(9.0, errors=Errors(0.1, 0.12)), A, B, effect("grounding_spring"))
    for found, rest in (
        (cut, "; what remains is 0.5 of the response."),
        (
            replace(cut, singles=(ONE,), single=ONE, final=ONE),
            ": some added mass at node 2 comes nearest, but leaves 0.1 of the response and 0.12 "
            "(held out).",
        ),
        (
            replace(cut, several=(three,), final=three),
            "; the nearest of what was tried leaves 0.1 of the response and 0.12 (held out).",
        ),
    ):
        assert verdict_of(found, (), False) == ("undetermined", start + rest)


@pytest.mark.parametrize(
    ("change", "noise", "said"),
    [
        (0.004, 0.0003, "more than noise, and less than what laws that depend on the level are "
         "sought for (0.5 %)."),
        (0.011, 0.009, "the structure is linear to that accuracy."),
        (0.02, 0.0003, "the response depends on the level, though little."),
    ],
)  # fmt: skip
def test_what_a_change_between_levels_says(change: float, noise: float, said: str) -> None:
    case = case_of(PlainEvidence((BASE,), noise=Errors(0.01, 0.01)))
    lines = evidence_lines(replace(EMPTY, case=case), LevelChange(change, noise))
    assert lines[0].endswith(f"%): {said}")


@pytest.mark.parametrize(
    ("noise", "said"), [(0.01, " (noise alone: 0.01 of the response)."), (NAN, ".")]
)
def test_the_nominal_model_s_error_and_that_of_its_scatter_are_stated(
    noise: float, said: str
) -> None:
    case = case_of(PlainEvidence((BASE,), noise=Errors(noise, noise)))
    lines = evidence_lines(replace(EMPTY, case=case), LevelChange(0.001, 0.001))
    assert lines[0].endswith("the structure is linear to that accuracy.")
    assert lines[1:] == [
        "A line of the evidence.",
        "The nominal model, without the error of its mesh, leaves 0.6 of the response and 0.6 "
        f"(held out){said}",
        "With stiffness, mass and damping of the groups fitted within their usual scatter it "
        "leaves 0.5 of the response and 0.4 (held out); the mean square of the differences is then "
        "100 times what noise and the tolerance of a sound model make.",
    ]


def test_a_finding_states_what_one_effect_left_and_what_is_not_claimed() -> None:
    found = replace(
        EMPTY, singles=(ONE,), single=ONE, final=BOTH, field=(BOTH, ONE), findings=(told(A),)
    )
    assert evidence_lines(found, None)[3:] == [
        "One effect alone, some added mass at node 2, leaves 0.1 of the response and 0.12 (held "
        "out): one is not enough.",
        "With some added mass at node 2 together with some viscous damper at node 3 the model "
        "leaves 0.01 of the response and 0.02 (held out).",
        "Some viscous damper at node 3 is needed for the last of it, but others elsewhere would "
        "do as well: it is not claimed.",
        "With some added mass at node 2 in its place the model leaves 0.1 of the response and 0.12 "
        "(held out).",
    ]


def test_equivalents_and_other_hypotheses_are_counted() -> None:
    others = tuple(effect("added_mass", nodes=(k,)) for k in range(10, 10 + MOST + 2))
    field = (ONE, *(weighed(PlainFit(20.0), e) for e in others))
    found = replace(
        EMPTY, single=ONE, final=ONE, field=field, findings=(told(A, equivalent=others),)
    )
    lines = evidence_lines(found, None)[3:]
    assert lines[1] == "What is left is 9."
    assert lines[2].startswith("That is 10 times what noise alone would leave.")
    assert lines[3].startswith("These recordings do not tell some added mass at node 2 from some ")
    assert lines[3].count("at node") == MOST + 1 and lines[3].endswith(" and 2 more.")
    assert sum(" in its place the model leaves " in line for line in lines) == RIVALS


def test_a_search_that_time_ended_is_not_consistent_where_something_comes_near() -> None:
    base = replace(BASE, misfit=3.0, errors=Errors(0.12, 0.17))
    near = weighed(PlainFit(0.8, errors=Errors(0.015, 0.02)), A)
    far = weighed(PlainFit(2.0, errors=Errors(0.1, 0.15)), A)
    whole, cut = (case_of(PlainEvidence((base,), unfinished=u)) for u in (False, True))
    assert verdict_of(replace(EMPTY, case=whole, singles=(near,)), (), False)[0] == "consistent"
    assert verdict_of(replace(EMPTY, case=cut, singles=(far,)), (), False)[0] == "consistent"
    assert verdict_of(replace(EMPTY, case=cut), (), False)[0] == "consistent"
    verdict, says = verdict_of(replace(EMPTY, case=cut, singles=(near,)), (), False)
    assert verdict == "undetermined"
    assert "ended the search" in says and near.hypothesis.title in says


def test_a_set_that_leaves_less_is_told_with_the_unknowns_that_it_took() -> None:
    """Named by its first effect, where it is long; and why it lost."""
    many = [effect("added_mass", nodes=(k,)) for k in range(10, 15)]
    more = weighed(PlainFit(8.0, errors=Errors(0.05, 0.2)), *many)
    found = replace(EMPTY, single=ONE, final=ONE, field=(ONE, more), findings=(told(A),))
    line = next(x for x in evidence_lines(found, None) if " in its place " in x)
    assert line == (
        "With 5 effects together, some added mass at node 10 first, in its place the model leaves "
        "0.05 of the response and 0.2 (held out): less, but with 4 unknowns more, and for those "
        "the gain is too small."
    )


@pytest.mark.parametrize(
    ("misfit", "said"),
    [(9.0, ""), (11.0, "; all figures weighed, that is about 7.4 times less likely"),
     (40.0, "; all figures weighed, that is more than a thousand times less likely")],
)  # fmt: skip
def test_a_rival_with_the_same_error_is_told_how_likely_it_is(misfit: float, said: str) -> None:
    """Of frequencies an error alone does not say what the shapes do."""
    rival = weighed(PlainFit(misfit, errors=Errors(0.1, 0.12)), B)
    found = replace(EMPTY, single=ONE, final=ONE, field=(ONE, rival), findings=(told(A),))
    line = next(x for x in evidence_lines(found, None) if " in its place " in x)
    assert line.endswith(f"leaves 0.1 of the response and 0.12 (held out){said}.")


def test_scatter_that_leaves_more_than_the_nominal_model_is_explained() -> None:
    base = replace(BASE, errors=Errors(0.7, 0.8))
    lines = evidence_lines(replace(EMPTY, case=case_of(PlainEvidence((base,)))), None)
    assert "more than the nominal model leaves, because a fit weighs each line" in lines[-1]


@dataclass(frozen=True)
class Said:
    verdict: str
    says: str
    candidates: tuple[dict[str, str], ...] = ()
    time: float = 1.0


def test_what_a_linear_model_explains_may_depend_on_the_level_all_the_same() -> None:
    found, laws = (
        Said("consistent", "Nothing."),
        Said("", "", ({"title": "a stop at node 3"},), 20.0),
    )
    change = LevelChange(0.009, 0.0003)
    told = depends_a_little(found, laws, change)  # type: ignore[arg-type]
    assert told.verdict == "undetermined" and told.time == 20.0
    assert "change by 0.9 %, and noise makes 0.03 % of it" in told.says
    assert told.says.endswith("Nearest comes a stop at node 3.")
    assert depends_a_little(found, laws, None) is found  # type: ignore[arg-type]
