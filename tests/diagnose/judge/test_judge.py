"""What is claimed, of plain figures: one effect, several, numbers of groups, or nothing."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.judge.judge import _a_rig_instead, judge
from cvxupdate.diagnose.judge.larger import _open
from cvxupdate.diagnose.judge.parts import parts_of
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.settings import CLEAR, MOST_SURE, STATED
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import (
    PlainEvidence,
    PlainFit,
    PlainModel,
    PlainSetting,
    case_of,
    effect,
    fault,
    parameter,
    rig,
    supposed,
    weighed,
)

BASE = PlainFit(100.0, errors=Errors(0.5, 0.5))
GOOD = PlainFit(1.0, errors=Errors(0.02, 0.02))
POOR = PlainFit(40.0, errors=Errors(0.3, 0.3))
A, B, C = effect(nodes=(1,)), effect(nodes=(2,)), effect(nodes=(3,))
EVIDENCE = PlainEvidence((BASE,))


def judged(evidence: PlainEvidence, singles=(), several=()):
    return judge(evidence, Found(singles=tuple(singles), several=tuple(several)))  # type: ignore[arg-type]


def test_one_effect_that_explains_is_claimed() -> None:
    found = judged(EVIDENCE, [supposed(GOOD, A), supposed(POOR, B)])
    (finding,) = found.findings
    assert found.final is found.single is found.last
    assert (finding.physics, finding.place) == ("stiffness_change", A.place)
    assert finding.parameters == {"factor": 1.5}
    assert finding.deviations == {"factor": 0.01} and finding.noise_deviations == {"factor": 0.005}
    assert finding.confidence == MOST_SURE
    assert finding.explains == pytest.approx(0.99) and finding.equivalent == ()
    assert finding.says == "A factor 1.5 at node 1." and len(found.standings) == 1


def test_nothing_tried_claims_nothing() -> None:
    found = judged(EVIDENCE)
    assert found.final is None and found.findings == () and found.last is found.case.base
    assert found.nearest is None


def test_what_does_not_halve_the_misfit_is_not_claimed() -> None:
    found = judged(EVIDENCE, [supposed(replace(GOOD, misfit=60.0), A)])
    assert found.final is None and found.findings == () and found.last is found.case.base
    assert found.nearest is found.singles[0]


def test_what_is_not_credible_is_named_and_not_claimed() -> None:
    """It halves the misfit, but leaves a third of it."""
    found = judged(EVIDENCE, [supposed(POOR, A), supposed(replace(POOR, misfit=90.0), B)])
    assert found.final is found.singles[0] and found.findings == ()
    assert found.last is found.case.base


def test_what_was_held_out_refutes_is_no_rival() -> None:
    """It is nearer to what was fitted, and no better on the rest; where all are refuted nothing is
    claimed."""
    wrong = replace(GOOD, misfit=0.5, errors=Errors(0.01, 0.48))
    found = judged(EVIDENCE, [supposed(wrong, B), supposed(GOOD, A)])
    (finding,) = found.findings
    assert finding.place == A.place and finding.confidence == MOST_SURE
    assert finding.equivalent == () and found.standings[0].rivals == 0
    assert judged(EVIDENCE, [supposed(wrong, B)]).findings == ()


@pytest.mark.parametrize(("held", "told"), [(0.3, True), (0.02, False)])
def test_a_set_of_as_many_unknowns_as_figures_is_a_rival_by_what_it_foretells(
    held: float, told: bool
) -> None:
    """A softer element was told at another (the laboratory's 2728): the true one, with what a rig
    does, had as many unknowns as figures, and foretold what was held out far better."""

    class Foretold(PlainEvidence):
        def held_out(self, fit: PlainFit) -> float:
            return -50.0 * fit.errors.hold_out

    evidence = Foretold((replace(BASE, independent=2.0),))
    one = supposed(replace(GOOD, errors=Errors(0.02, 0.2), independent=2.0), A)
    full = supposed(replace(GOOD, errors=Errors(0.02, held), independent=2.0), B, C)
    found = judged(evidence, [one], [full])
    assert found.final is found.single and bool(found.findings) == told


def test_rivals_are_equivalents_and_share_the_confidence() -> None:
    """Misfits of 1 and 1.1 of twenty figures: odds of 1.1 to the tenth power."""
    close, share = replace(GOOD, misfit=1.1), 1.0 / (1.0 + 1.1**-10)
    found = judged(EVIDENCE, [supposed(GOOD, A), supposed(close, B)])
    assert found.standings[0].rivals == 1
    assert found.findings[0].confidence == pytest.approx(share)
    assert found.findings[0].equivalent == (B,)
    alike = effect("added_mass", nodes=(1,))
    found = judged(EVIDENCE, [supposed(GOOD, A), supposed(close, alike)])
    assert found.findings[0].equivalent == (alike,)
    assert found.findings[0].confidence == pytest.approx(share), "another type is another sentence"
    assert found.findings[0].alternatives == (alike.title,) == ("some added mass at node 1",)


def test_a_rival_that_is_less_likely_is_not_said_to_be_untold() -> None:
    """Misfits of 1 and 1.25 of twenty figures: 9 times less likely, and no strong evidence."""
    found = judged(EVIDENCE, [supposed(GOOD, A), supposed(replace(GOOD, misfit=1.25), B)])
    (finding,) = found.findings
    assert finding.equivalent == (B,) and finding.alternatives == ()
    assert finding.unlikelier == (f"{B.title} (9 times less likely)",)
    (entry,) = finding.to_json()["equivalent"]
    assert entry["odds"] == pytest.approx(1.25**10, abs=0.01)


@pytest.mark.parametrize(("next_", "claimed"), [(1.01, False), (1.3, True)])
def test_confidence_below_what_is_stated_is_not_claimed(next_: float, claimed: bool) -> None:
    """An explained single effect is told where it is likelier than not: among eight others it
    depends on how far they are behind."""
    others = [supposed(replace(GOOD, misfit=next_), effect(nodes=(n,))) for n in range(2, 10)]
    found = judged(EVIDENCE, [supposed(GOOD, A), *others])
    assert (found.standings[0].confidence >= STATED) == claimed == bool(found.findings)
    assert bool(found.tied) != claimed


def test_types_that_tie_at_one_place_are_told_with_their_equivalents() -> None:
    """Three types at one place, none likelier than not: the place is."""
    physics = ("stiffness_change", "mass_change", "thickness_change")
    ties = [supposed(GOOD, effect(p, elements=(4,))) for p in physics]
    found = judged(EVIDENCE, ties)
    (finding,) = found.findings
    assert finding.confidence == pytest.approx(1.0 / 3.0) and len(finding.equivalent) == 2
    elsewhere = [supposed(GOOD, effect(elements=(n,))) for n in (4, 5, 6)]
    assert judged(EVIDENCE, elsewhere).findings == ()


def test_what_leaves_something_unexplained_has_the_same_limit() -> None:
    """Credible, not explained: a tenth of the misfit is left."""
    half = replace(GOOD, misfit=9.0, errors=Errors(0.08, 0.08))
    sure = judged(EVIDENCE, [supposed(half, A), supposed(replace(POOR, misfit=90.0), B)])
    assert sure.findings and sure.standings[0].confidence >= STATED
    near = [supposed(replace(half, misfit=9.1), effect(nodes=(n,))) for n in range(2, 10)]
    rival = judged(EVIDENCE, [supposed(half, A), *near[:2]])
    assert rival.standings[0].confidence < STATED and rival.findings == () and rival.tied


def test_the_likelier_is_claimed_not_the_one_that_fits_a_little_closer() -> None:
    """Below noise misfits differ by chance; three further unknowns are not worth that much."""
    closer = supposed(replace(GOOD, misfit=0.95), effect(nodes=(2,), count=3))
    found = judged(EVIDENCE, [closer, supposed(GOOD, A)])
    assert found.final is not None and found.final.hypothesis.effects == (A,)


SMALLER = PlainFit(20.0, errors=Errors(0.1, 0.1))


def test_several_are_claimed_where_one_is_not_enough() -> None:
    a, b = fault("n1.x"), fault("n3.x")
    pair, other = supposed(GOOD, a, b), supposed(replace(GOOD, misfit=30.0), a, C)
    found = judged(alone(20.0, 40.0), [supposed(SMALLER, a)], [pair, other])
    assert found.final is not None and found.final.hypothesis is pair
    assert found.single is not None and found.single.hypothesis.effects == (a,)
    assert len(found.field) == 3 and len(found.standings) == 2


def test_one_clear_effect_needs_no_second() -> None:
    """Beyond noise it leaves no more than `CLEAR`."""
    clear = replace(GOOD, misfit=1.0, beyond_noise=CLEAR)
    a, better = fault("n1.x"), replace(GOOD, misfit=0.3, errors=Errors(0.01, 0.01))
    pair = supposed(replace(better, beyond_noise=0.01), a, fault("n3.x"))
    found = judged(alone(1.0, 40.0), [supposed(clear, a)], [pair])
    assert found.final is found.single
    open_ = replace(clear, beyond_noise=1.01 * CLEAR)
    found = judged(alone(1.0, 40.0), [supposed(open_, a)], [pair])
    assert found.final is not None and found.final.hypothesis is pair


@pytest.mark.parametrize(
    ("told_by", "further", "wins"),
    [
        pytest.param("modes", [rig("sensor_mass")], True, id="the rest of a rig"),
        pytest.param("modes", [A], True, id="one thing beside a rig"),
        pytest.param("responses", [A], False, id="of responses little is left by chance"),
    ],
)
def test_in_the_tolerance_of_a_fitted_model_something_may_be_missing(told_by, further, wins):
    """Springs under a frame's feet explained a table within tolerance (the laboratory's 4389), with
    accelerometers beside them thirty nats less unlikely."""
    feet = rig("equal_supports", nodes=(1,))
    clear = weighed(replace(GOOD, misfit=0.9, beyond_noise=CLEAR), feet)
    more = weighed(replace(GOOD, misfit=0.1, beyond_noise=0.01), feet, *further)
    case = case_of(replace(EVIDENCE, told_by=told_by))
    assert _open(clear, more, case) == wins and _open(None, more, case)
    weak = weighed(replace(GOOD, misfit=0.8, beyond_noise=0.01), feet, *further)
    assert not _open(clear, weak, case)
    unclear = weighed(replace(GOOD, misfit=0.9, beyond_noise=1.01 * CLEAR), feet)
    assert _open(unclear, weak, case)


@pytest.mark.parametrize(
    ("left", "spent", "wins"),
    [
        pytest.param(0.05, False, True, id="it pays for its places"),
        pytest.param(0.4, False, False, id="strongly likelier, but not by as many"),
        pytest.param(0.05, True, False, id="noise alone was left"),
    ],
)
def test_a_second_thing_in_the_tolerance_pays_for_its_places(left, spent, wins):
    """A loose joint left two thirds of what a model may, and the lump above it, ninety nats
    likelier, was not sought; a foot on a fixture was told (the laboratory's 3893)."""
    places = [effect("added_mass", nodes=(n,)) for n in range(1, 60)]
    case = case_of(replace(EVIDENCE, told_by="modes", everything=[A, B, *places]))
    one = weighed(replace(GOOD, misfit=0.9, beyond_noise=CLEAR, spent=spent), A)
    assert _open(one, weighed(replace(GOOD, misfit=left, beyond_noise=0.01), A, B), case) == wins


def test_no_effect_is_had_for_leading_out_of_a_wrong_valley() -> None:
    """One effect alone was fitted into a valley where it leaves much; from where it is beside
    another it leaves as little as both: the other is not claimed."""
    a, b = fault("n1.x"), fault("n3.x")
    pair = supposed(replace(GOOD, misfit=0.3, beyond_noise=0.01), a, b)
    lost = supposed(replace(GOOD, misfit=30.0, errors=Errors(0.1, 0.1)), a)
    near = replace(GOOD, misfit=0.3, beyond_noise=0.01)
    evidence = PlainEvidence((BASE,), alone={("n1.x",): near, ("n3.x",): lost.fit})
    found = judged(evidence, [lost], [pair])
    assert [f.place for f in found.findings] == [a.place]
    evidence = PlainEvidence((BASE,), alone={("n1.x",): lost.fit, ("n3.x",): lost.fit})
    assert len(judged(evidence, [lost], [pair]).findings) == 2


@pytest.mark.parametrize(
    ("misfit", "effects"),
    [
        pytest.param(4.9, 3, id="it halves"),
        pytest.param(5.1, 3, id="strongly likelier"),
        pytest.param(7.0, 2, id="neither"),
    ],
)
def test_a_third_effect_must_halve_what_two_leave(misfit: float, effects: int) -> None:
    """Or the responses are strong evidence for it: a rig and a lump on a portal took away three
    quarters of what a sound model may leave beside the rig alone (the laboratory's 4888)."""
    channels = ("n1.x", "n2.x", "n3.x")
    left = replace(GOOD, misfit=30.0, errors=Errors(0.1, 0.1))
    sets = [(c,) for c in channels] + [(c, d) for c in channels for d in channels if c < d]
    evidence = PlainEvidence((BASE,), alone={s: left for s in sets})
    two = replace(GOOD, misfit=10.0, errors=Errors(0.08, 0.04))
    pair = supposed(two, *map(fault, channels[:2]))
    three = supposed(replace(GOOD, misfit=misfit), *map(fault, channels))
    found = judged(evidence, [supposed(left, fault("n1.x"))], [three, pair])
    assert found.final is not None and len(found.final.hypothesis.effects) == effects


def test_the_nearest_is_that_with_the_least_penalised_misfit() -> None:
    far, near = supposed(POOR, A), supposed(replace(POOR, misfit=30.0), B, C)
    assert judged(EVIDENCE, [far], [near]).nearest.hypothesis is near  # type: ignore[union-attr]


def groups(fit: PlainFit, *p: float) -> PlainFit:
    names = ("beam", "plate", "frame", "mast")
    own = tuple(parameter(f"{g}.stiffness", group=g) for g in names[: len(p)])
    values = np.array(p)
    return replace(
        fit, p=values, deviations=0.01 + 0.0 * values, setting=PlainSetting(PlainModel(own))
    )


def test_groups_far_off_are_claimed_where_nothing_else_explains() -> None:
    evidence = replace(EVIDENCE, far=groups(GOOD, -0.2, 0.01))
    found = judged(evidence, [supposed(POOR, A)])
    (finding,) = found.findings
    assert finding.physics == "stiffness_change" and finding.place.groups == ("beam",)
    assert finding.parameters["factor"] == pytest.approx(0.8)
    assert found.final is found.last and found.final.freed == 1  # type: ignore[union-attr]


@pytest.mark.parametrize(
    "far",
    [
        pytest.param(groups(GOOD, 0.01, 0.01), id="none is beyond its scatter"),
        pytest.param(groups(replace(GOOD, misfit=5.0), -0.2), id="it does not explain"),
        pytest.param(groups(replace(GOOD, errors=Errors(0.02, 0.5)), -0.2), id="it is not shown"),
        pytest.param(None, id="it is no structure"),
    ],
)
def test_groups_that_do_not_explain_are_not_claimed(far: PlainFit | None) -> None:
    found = judged(replace(EVIDENCE, far=far), [supposed(POOR, A)])
    assert found.findings == () and found.final is found.singles[0]


@pytest.mark.parametrize(
    ("misfit", "left", "told"),
    [
        pytest.param(0.9, 0.01, False, id="nothing is wrong"),
        pytest.param(3.0, 1.0, False, id="explained, and a third is left"),
        pytest.param(3.0, 0.01, True, id="explained, and hardly anything is left"),
    ],
)
def test_groups_are_believed_of_what_is_explained_as_effects_are(misfit, left, told) -> None:
    evidence = replace(EVIDENCE, far=groups(replace(GOOD, misfit=left), -0.2))
    found = judged(replace(evidence, bases=(replace(BASE, misfit=misfit),)))
    assert bool(found.findings) == told


def test_groups_are_not_let_go_where_nobody_asked() -> None:
    evidence = replace(EVIDENCE, far=groups(replace(GOOD, misfit=0.01), -0.2))
    other = replace(evidence, names=("added_mass",))
    assert judged(other, [supposed(POOR, A)]).findings == ()


@pytest.mark.parametrize(("left", "wins"), [(0.8, True), (0.9, False)])
def test_groups_and_effects_that_explain_compete(left: float, wins: bool) -> None:
    """Two groups cost an unknown more than one effect: twenty figures ask a misfit lower by the
    twentieth root of twenty, squared."""
    evidence = replace(EVIDENCE, far=groups(replace(GOOD, misfit=left), -0.2, 0.2))
    found = judged(evidence, [supposed(GOOD, A)])
    assert found.final is not None and (not found.final.hypothesis.effects) == wins
    assert found.findings and all(f.confidence < MOST_SURE for f in found.findings)


def test_groups_must_only_beat_what_is_credible() -> None:
    poor = replace(GOOD, misfit=9.0, errors=Errors(0.3, 0.3))
    evidence = replace(EVIDENCE, limit=5.0, far=groups(replace(GOOD, misfit=4.9), -0.2))
    found = judged(evidence, [supposed(poor, A)])
    assert found.final is not None and not found.final.hypothesis.effects


def test_of_several_those_are_told_that_are_likelier_than_not() -> None:
    """Where the second stands is open between three nodes; the first is in all of them."""
    left, first = replace(GOOD, misfit=30.0, errors=Errors(0.1, 0.1)), "n1.x"
    seconds = ("n2.x", "n3.x", "n4.x")
    evidence = PlainEvidence((BASE,), alone={(c,): left for c in (first, *seconds)})
    fits = [replace(GOOD, misfit=1.0 + 0.01 * k) for k in range(3)]
    pairs = [supposed(f, fault(first), fault(c)) for f, c in zip(fits, seconds, strict=True)]
    found = judged(evidence, [supposed(left, fault(first))], pairs)
    assert [s.confidence >= STATED for s in found.standings] == [True, False]
    assert [f.place for f in found.findings] == [fault(first).place]


def test_the_part_of_a_single_effect_is_what_it_takes_away() -> None:
    case = case_of(EVIDENCE)
    assert parts_of(case, weighed(GOOD, A)) == pytest.approx([0.99])
    assert parts_of(case, weighed(replace(GOOD, misfit=200.0), A)) == [0.0]
    pattern = case_of(PlainEvidence((PlainFit(1.0, damping_strain=40.0),)), damping_only=True)
    assert parts_of(pattern, weighed(PlainFit(1.0, damping_strain=10.0), A)) == pytest.approx(
        [0.75]
    )


def alone(one: float, other: float) -> PlainEvidence:
    """Sensor faults: what is left with the one alone, and with the other."""
    rests = {("n1.x",): PlainFit(one), ("n3.x",): PlainFit(other)}
    return replace(EVIDENCE, alone=rests)


def test_the_parts_of_several_go_by_what_comes_back_without_each() -> None:
    """Without the first 31 come back, without the second 11: three quarters and a quarter."""
    pair = weighed(GOOD, fault("n1.x"), fault("n3.x"))
    parts = parts_of(case_of(alone(11.0, 31.0)), pair)
    assert parts == pytest.approx([0.99 * 0.75, 0.99 * 0.25])
    assert sum(parts) == pytest.approx(0.99), "never more than both take away"


def test_an_effect_that_nothing_misses_has_no_part() -> None:
    pair = weighed(GOOD, fault("n1.x"), fault("n3.x"))
    assert parts_of(case_of(alone(0.5, 31.0)), pair) == pytest.approx([0.99, 0.0])
    same = parts_of(case_of(alone(0.5, 0.5)), pair)
    assert same == pytest.approx([0.495, 0.495]), "either would do: both share alike"


def test_findings_come_strongest_first() -> None:
    a, b = fault("n1.x"), fault("n3.x")
    evidence = replace(alone(31.0, 11.0), limit=4.0)
    found = judged(evidence, [supposed(SMALLER, a)], [supposed(GOOD, a, b)])
    assert [f.place.nodes for f in found.findings] == [(3,), (1,)]
    assert [f.explains for f in found.findings] == pytest.approx([0.99 * 0.75, 0.99 * 0.25])


def test_only_the_pattern_of_damping_is_at_stake_where_the_rest_is_explained() -> None:
    base = PlainFit(0.9, damping_strain=60.0)
    damper, lump = effect("viscous_damper", damping=True, nodes=(1,)), effect(nodes=(2,))
    found = judged(
        PlainEvidence((base,)),
        [
            supposed(PlainFit(0.9, damping_strain=3.0), damper),
            supposed(PlainFit(0.1, damping_strain=60.0), lump),
        ],
    )
    assert found.case.damping_only
    (finding_,) = found.findings
    assert finding_.physics == "viscous_damper" and finding_.explains == pytest.approx(0.95)
    assert (
        judged(
            PlainEvidence((base,)), [supposed(PlainFit(0.1, damping_strain=60.0), lump)]
        ).findings
        == ()
    )


def test_a_rig_alone_that_is_likelier_is_claimed_instead() -> None:
    """Fewer things of which one is sought are tried first; with so many places where that may stand
    it is chance."""
    feet, sensors, gain = rig(nodes=(1,)), rig("equal_joints"), rig("sensor_fault")
    fewer = weighed(replace(GOOD, misfit=1.1), A, feet)
    alone = weighed(GOOD, feet, sensors, gain)
    many = tuple(effect(nodes=(n,)) for n in range(1, 200))
    case = case_of(replace(EVIDENCE, everything=many))
    assert _a_rig_instead([fewer, alone], fewer, case) is alone
    few = case_of(replace(EVIDENCE, everything=(A,)))
    assert _a_rig_instead([fewer, alone], fewer, few) is fewer
    bad = weighed(replace(POOR, misfit=60.0), feet, sensors, gain)
    assert _a_rig_instead([fewer, bad], fewer, case) is fewer
    assert _a_rig_instead([fewer, alone], alone, case) is alone


def test_nothing_is_claimed_for_leading_out_of_a_wrong_valley() -> None:
    """The nuisance parameters fitted from beside the effect explain as well; where they do better
    than alone but do not explain, the effect has to do better than that."""
    good = supposed(GOOD, A)
    assert judged(replace(EVIDENCE, beside=replace(GOOD, misfit=1.2)), [good]).findings == ()
    near = PlainFit(30.0, errors=Errors(0.2, 0.2))
    found = judged(replace(EVIDENCE, beside=near), [good])
    assert found.case.base.fit.misfit == 30.0 and len(found.findings) == 1
    assert judged(replace(EVIDENCE, beside=PlainFit(200.0)), [good]).case.base.fit.misfit == 100.0
