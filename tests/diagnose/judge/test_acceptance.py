"""Every rule of acceptance on plain figures: each condition by itself refuses."""

from __future__ import annotations

import math
from dataclasses import replace

import pytest

from cvxupdate.diagnose.judge.acceptance import (
    better,
    beyond,
    credible,
    explained,
    information,
    needs_several,
    refuted,
    saturated,
    shown,
)
from cvxupdate.diagnose.settings import DAMPING_COST, DAMPING_GAIN, HALVED, LOWER, MET, OPEN, STRONG
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import (
    NAN,
    PlainEvidence,
    PlainFit,
    case_of,
    effect,
    fault,
    weighed,
)


def test_errors_beyond_noise_add_in_squares() -> None:
    assert beyond(0.05, 0.03) == pytest.approx(0.04)
    assert beyond(0.03, 0.05) == 0.0 and beyond(0.03, 0.03) == 0.0


def test_nothing_held_out_and_noise_are_shown() -> None:
    assert shown(NAN, 0.5, 0.6, 0.01)
    assert shown(0.01, 0.01, 0.01, 0.01), "a held-out error that is noise cannot become lower"
    assert not shown(0.5, 0.5, 0.6, NAN), "no noise is known that it could be"


@pytest.mark.parametrize("noise", [NAN, 0.001])
def test_a_held_out_error_must_be_half_of_the_nominal_one(noise: float) -> None:
    assert shown(HALVED * 0.6, 0.6, 0.6, noise)
    assert not shown(1.01 * HALVED * 0.6, 0.6, 0.6, noise)


@pytest.mark.parametrize("noise", [NAN, 0.001])
def test_and_clearly_below_that_of_less_freedom(noise: float) -> None:
    assert shown(0.99 * LOWER * 0.2, 0.2, 0.6, noise)
    assert not shown(1.01 * LOWER * 0.2, 0.2, 0.6, noise)


def test_unless_noise_leaves_no_room_below() -> None:
    """At 1.1 times the noise nothing more can be asked; or where the part beyond noise falls
    clearly."""
    noise = 0.1
    assert shown(0.99 * MET * noise, 0.111, 0.6, noise)
    assert not shown(0.125, 0.13, 0.6, noise)
    before = 0.16
    after = math.hypot(noise, 0.99 * LOWER * beyond(before, noise))
    assert after > max(LOWER * before, MET * noise) and shown(after, before, 0.6, noise)
    worse = math.hypot(noise, 1.01 * LOWER * beyond(before, noise))
    assert not shown(worse, before, 0.6, noise)


def test_information_is_that_of_bayes_criterion() -> None:
    """n log(ratio of misfits) + unknowns log n; the unknowns must pay."""
    after, before = PlainFit(0.5, rows=200), PlainFit(1.0, rows=200)
    assert information(after, before, 3) == pytest.approx(  # type: ignore[arg-type]
        200 * math.log(0.5) + 3 * math.log(200)
    )
    assert information(before, before, 1) > 0.0 > information(after, before, 1)  # type: ignore[arg-type]
    assert math.isfinite(information(PlainFit(0.0), PlainFit(0.0), 1))  # type: ignore[arg-type]


BASE = PlainFit(100.0, errors=Errors(0.5, 0.5))
GOOD = PlainFit(1.0, errors=Errors(0.02, 0.02))


def test_what_halves_the_misfit_and_shows_is_better() -> None:
    case = case_of(PlainEvidence((BASE,)))
    assert better(weighed(GOOD, effect()), case.base, case)
    exactly = replace(GOOD, misfit=HALVED * BASE.misfit)
    assert better(weighed(exactly, effect()), case.base, case)


@pytest.mark.parametrize(
    "fit",
    [
        pytest.param(replace(GOOD, misfit=51.0), id="not halved"),
        pytest.param(replace(GOOD, misfit=1.0, beyond_noise=51.0), id="not halved beyond noise"),
        pytest.param(replace(GOOD, errors=Errors(0.02, 0.4)), id="not shown"),
    ],
)
def test_each_condition_by_itself_refuses(fit: PlainFit) -> None:
    case = case_of(PlainEvidence((BASE,)))
    assert not better(weighed(fit, effect()), case.base, case)


def test_nothing_is_told_of_what_the_mesh_may_leave_but_faults_and_damping() -> None:
    case = case_of(PlainEvidence((BASE,), mesh=0.5))
    assert not better(weighed(GOOD, effect()), case.base, case)
    assert not better(weighed(GOOD, effect(), fault("n1.x")), case.base, case)
    assert better(weighed(GOOD, fault("n1.x")), case.base, case)
    less = case_of(PlainEvidence((BASE,), mesh=0.49))
    assert better(weighed(GOOD, effect()), less.base, less)


def test_what_was_held_out_refutes_what_tells_it_no_better_than_nuisance_parameters() -> None:
    case = case_of(PlainEvidence((BASE,)))
    assert not refuted(weighed(GOOD, effect()), case)
    assert refuted(weighed(replace(GOOD, errors=Errors(0.02, 0.49)), effect()), case)
    assert not refuted(weighed(replace(GOOD, errors=Errors(0.02, NAN)), effect()), case)
    pattern = replace(case, damping_only=True)
    assert not refuted(weighed(replace(GOOD, errors=Errors(0.02, 0.49)), effect()), pattern)


def test_of_a_table_half_is_enough_beside_what_was_fitted_already() -> None:
    """Within the tolerance of any model much explains a table (the laboratory's 4709, where the
    truth was forty nats likelier). Not so beside nothing, beside a reference, or of responses."""
    tables = PlainEvidence(told_by="modes", limit=1.0)
    left = replace(GOOD, misfit=0.3, beyond_noise=0.3, independent=60.0, rows=60)
    before = replace(left, misfit=0.8, beyond_noise=0.8, errors=Errors(0.1, 0.1))
    after, fewer = weighed(left, effect(), effect(nodes=(2,))), weighed(before, effect(nodes=(3,)))
    assert better(after, fewer, case_of(tables))
    assert not better(after, weighed(before), case_of(tables))
    assert not better(after, fewer, case_of(replace(tables, told_by="responses")))
    beside = replace(tables, file=tables.model)
    assert not better(after, fewer, case_of(beside))


def test_unknowns_must_be_worth_it() -> None:
    """Few rows: a quarter of the misfit pays for one unknown and not for many; what nuisance
    parameters were let go counts as much."""
    base = replace(BASE, rows=9)
    case = case_of(PlainEvidence((base,)))
    fit = replace(GOOD, misfit=25.0, rows=9)
    assert better(weighed(fit, effect(count=1)), case.base, case)
    assert not better(weighed(fit, effect(count=4)), case.base, case)
    assert not better(weighed(fit, effect(count=1), freed=3), case.base, case)
    level = math.exp(-(STRONG + math.log(9)) / 9)
    for part, good in ((0.99, True), (1.01, False)):
        fit = PlainFit(100.0 * part * level, 1.0, errors=Errors(0.02, 0.02), rows=9)
        assert better(weighed(fit, effect()), case.base, case) == good


def strained(strain: float, misfit: float = 0.5) -> PlainFit:
    return PlainFit(misfit, damping_strain=strain)


def test_of_damping_alone_only_effects_of_damping_are_better() -> None:
    case = case_of(PlainEvidence((strained(40.0),)), damping_only=True)
    damper, lump = effect("viscous_damper", damping=True), effect("added_mass")
    assert better(weighed(strained(5.0), damper), case.base, case)
    assert not better(weighed(strained(5.0), lump), case.base, case)
    assert not better(weighed(strained(5.0), damper, lump), case.base, case)


def test_the_strain_must_fall_by_half_and_by_more_than_chance() -> None:
    damper = effect("viscous_damper", damping=True)
    large = case_of(PlainEvidence((strained(100.0),)), damping_only=True)
    assert better(weighed(strained(49.0), damper), large.base, large)
    assert not better(weighed(strained(51.0), damper), large.base, large)
    small = case_of(PlainEvidence((strained(15.0),)), damping_only=True)
    assert better(weighed(strained(14.9 - DAMPING_GAIN), damper), small.base, small)
    assert not better(weighed(strained(15.1 - DAMPING_GAIN), damper), small.base, small)


def test_damping_must_not_cost_the_misfit() -> None:
    case = case_of(PlainEvidence((strained(40.0),)), damping_only=True)
    damper = effect("viscous_damper", damping=True)
    assert better(weighed(strained(5.0, 0.5 * DAMPING_COST), damper), case.base, case)
    assert not better(weighed(strained(5.0, 0.51 * DAMPING_COST), damper), case.base, case)


def test_what_is_compared_is_the_misfit_beyond_noise_or_the_strain() -> None:
    w = weighed(PlainFit(3.0, 2.0, damping_strain=7.0), effect())
    assert case_of(PlainEvidence()).scale(w) == 2.0
    assert case_of(PlainEvidence(), damping_only=True).scale(w) == 7.0


def test_explained_is_what_the_evidence_says() -> None:
    case = case_of(PlainEvidence(limit=4.0))
    assert explained(weighed(PlainFit(4.0), effect()), case)
    assert not explained(weighed(PlainFit(4.1), effect()), case)


def test_one_clear_effect_is_credible_although_not_all_is_explained() -> None:
    """A tenth of the responses left and a tenth of the misfit; beyond either it is not."""
    case = case_of(PlainEvidence((BASE,)))
    near, far = Errors(0.05, 0.1), Errors(0.05, 0.11)
    assert credible(weighed(PlainFit(10.0, errors=near), effect()), case)
    assert not credible(weighed(PlainFit(10.0, errors=far), effect()), case)
    assert not credible(weighed(PlainFit(10.1, errors=near), effect()), case)
    assert credible(weighed(PlainFit(3.0, errors=far), effect()), case), "explained"
    pattern = case_of(PlainEvidence((BASE,)), damping_only=True)
    assert credible(weighed(PlainFit(10.1, errors=near), effect()), pattern)
    tables = case_of(PlainEvidence((BASE,), told_by="modes"))
    assert credible(weighed(PlainFit(OPEN, errors=near), effect()), tables)
    assert not credible(weighed(PlainFit(1.01 * OPEN, errors=near), effect()), tables)


def test_several_are_needed_where_they_are_credible_and_halve_what_one_leaves() -> None:
    case = case_of(PlainEvidence((BASE,)))
    both = effect(), effect(nodes=(3,))
    single = weighed(PlainFit(10.0, errors=Errors(0.1, 0.1)), effect())
    assert needs_several(weighed(GOOD, *both), single, case)
    assert needs_several(weighed(GOOD, *both), None, case)
    clear = replace(GOOD, misfit=4.5)  # not all is explained, a twentieth of the misfit is left
    assert needs_several(weighed(clear, *both), single, case)
    far = replace(clear, errors=Errors(0.05, 0.11))
    assert not needs_several(weighed(far, *both), single, case), "not credible"
    close = weighed(PlainFit(1.9, errors=Errors(0.1, 0.1)), effect())
    assert not needs_several(weighed(GOOD, *both), close, case), "not half of what one leaves"
    unseen = replace(GOOD, errors=Errors(0.02, 0.09))
    assert not needs_several(weighed(unseen, *both), single, case), "nor seen in what is held out"


def test_several_modes_need_not_beat_what_is_not_credible_itself() -> None:
    """What one leaves much of may tell a held-out mode by chance: a portal on a fixture with soft
    joints (the laboratory's table 4175), explained, was not told."""
    case = case_of(PlainEvidence((BASE,), told_by="modes"))
    several = weighed(
        replace(GOOD, misfit=0.5, errors=Errors(0.02, 0.09)), effect(), effect(nodes=(3,))
    )
    for left, needed in ((40.0, True), (3.9, False)):
        single = weighed(PlainFit(left, errors=Errors(0.1, 0.1)), effect())
        assert credible(single, case) != needed
        assert needs_several(several, single, case) == needed


def test_each_further_effect_must_halve_what_fewer_leave() -> None:
    """Two more that together halve it are one too many."""
    case = case_of(PlainEvidence((BASE,)))
    three = effect(), effect(nodes=(3,)), effect(nodes=(4,))
    single = weighed(PlainFit(10.0, errors=Errors(0.1, 0.1)), effect())
    for left, needed in ((2.4, True), (2.6, False)):
        more = weighed(PlainFit(left, errors=Errors(0.02, 0.02)), *three)
        assert needs_several(more, single, case) == needed
        pair = weighed(PlainFit(left, errors=Errors(0.02, 0.02)), *three[:2])
        assert needs_several(pair, single, case)


def test_no_second_effect_is_taken_out_of_what_the_mesh_may_leave() -> None:
    both = effect(), effect(nodes=(3,))
    single = weighed(PlainFit(10.0, errors=Errors(0.1, 0.1)), effect())
    for mesh, needed in ((0.049, True), (0.05, False)):
        case = case_of(PlainEvidence((BASE,), mesh=mesh))
        assert needs_several(weighed(GOOD, *both), single, case) == needed


def test_a_second_effect_stands_that_takes_all_of_what_one_leaves_unexplained() -> None:
    """The mesh may leave up to twice its allowance beside one effect, which does not explain then;
    what leaves nothing of that is no mesh."""
    both = effect(), effect(nodes=(3,))
    open_, told = (PlainFit(m, errors=Errors(0.04, 0.06)) for m in (10.0, 3.9))
    nothing = PlainFit(0.2, errors=Errors(0.005, 0.006))
    for one, two, needed in (
        (open_, nothing, True),
        (open_, replace(nothing, misfit=1.01, beyond_noise=0.2), False),
        (open_, replace(nothing, misfit=0.4), False),
        (told, nothing, False),
    ):
        case = case_of(PlainEvidence((BASE,), mesh=0.025))
        assert needs_several(weighed(two, *both), weighed(one, effect()), case) == needed
    more = (*both, effect(nodes=(4,)))
    assert not needs_several(weighed(nothing, *more), weighed(open_, effect()), case), "two may"


def test_of_motion_free_runs_that_are_off_by_half_are_as_good_as_half_the_misfit() -> None:
    """Lines where nothing was forced keep the misfit up; where the model without explains the
    recordings already, all of the misfit counts."""
    base = PlainFit(2.5, errors=Errors(0.075, 0.043))
    law = weighed(PlainFit(1.75, errors=Errors(0.0074, 0.0067)), effect("quadratic_damping"))

    def accepted(w, told_by="motion", limit=1.0):
        evidence = PlainEvidence(
            (base,), Errors(0.5, 0.5), Errors(0.007, 0.006), limit, told_by=told_by
        )
        case = case_of(evidence)
        return better(w, case.base, case)

    assert accepted(law)
    assert not accepted(law, limit=4.0), "explained already"
    assert not accepted(law, told_by="responses")
    for errors in (Errors(0.06, 0.0067), Errors(0.0074, 0.036), Errors(0.06, NAN)):
        assert not accepted(weighed(PlainFit(1.75, errors=errors), effect("quadratic_damping")))
    alone = weighed(PlainFit(1.75, errors=Errors(0.0074, NAN)), effect("quadratic_damping"))
    assert accepted(alone)


def test_no_more_unknowns_than_figures_to_tell_them_by() -> None:
    """As many effects as there are figures are another way to write these down."""
    both = (effect(), effect("viscous_damper"))
    for figures, needed in ((3.0, True), (2.0, False)):
        case = case_of(PlainEvidence((replace(BASE, independent=figures),)))
        assert needs_several(weighed(GOOD, *both), None, case) == needed


def test_a_law_within_the_discrepancy_must_foretell_what_changes_between_levels() -> None:
    """The error of the responses is a sound model's at every level alike, and says nothing."""
    same = Errors(0.0053, 0.0037)
    base = replace(BASE, misfit=0.4, errors=same, between_levels=Errors(0.009, 0.006))

    def accepted(left: Errors, told_by: str = "motion") -> bool:
        law = PlainFit(0.05, errors=same, between_levels=left)
        figures = Errors(0.5, 0.5), Errors(0.001, 0.001)
        case = case_of(PlainEvidence((base,), *figures, told_by=told_by))
        return better(weighed(law, effect()), case.base, case)

    assert accepted(Errors(0.004, 0.003))
    assert not accepted(Errors(0.004, 0.005)), "not of what was held out"
    assert not accepted(Errors(0.006, 0.002))
    assert accepted(Errors(0.004, NAN)), "nothing at another level was held out"
    assert not accepted(Errors(NAN, NAN)), "one level: by what was held out, as ever"
    assert not accepted(Errors(0.004, 0.003), "responses")


@pytest.mark.parametrize(("seen", "full"), [(0, True), (4, False)])
def test_modes_that_are_seen_count_where_the_model_has_fewer(seen: int, full: bool) -> None:
    """The right set of five of a frame on a heavy fixture (the laboratory's 4156) had as many
    unknowns as figures, of which the model as it was has two in the band."""
    base = PlainFit(100.0, independent=4.0)
    case = case_of(PlainEvidence((base,), resonances=seen))
    assert saturated(weighed(PlainFit(0.5), effect(), effect(nodes=(2,), count=4)), case) == full
    assert not saturated(weighed(PlainFit(0.5), effect(count=9)), case), "one effect is no list"
