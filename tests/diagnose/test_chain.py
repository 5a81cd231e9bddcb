"""Chains made here, with seeded noise and scatter: what is concealed is found and sized, and
nothing is found where nothing is."""

from __future__ import annotations

import json
from dataclasses import replace

import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.errors import InputError

# of the catalogue, for time
SOME = ("added_mass", "stiffness_change", "sensor_fault", "grounding_spring")


def diagnose(chain, *recordings):
    spec, model = chain
    return diagnose_problem(spec, model, recordings)


def measured(measure, lab, **keywords):
    return measure(lab, 4, seed=11, **keywords), measure(lab, 1, "hold-out", seed=12, **keywords)


def halved(found):
    return all(found.fit[k]["after"] <= 0.5 * found.fit[k]["before"] for k in ("fit", "hold_out"))


@pytest.fixture(scope="module")
def lump(chain, lab, measure):
    """The diagnosis of 0.25 kg at floor 2."""
    return diagnose(chain, *measured(measure, lab(m=(0, 0.25, 0, 0))))


def test_added_mass_is_found_and_sized(lump):
    found = lump
    first = found.findings[0]
    assert found.verdict in ("missing_physics", "parameter_error") and halved(found)
    assert first.physics == "added_mass" and first.place.nodes == (2,)
    assert first.parameters["m"] == pytest.approx(0.25, rel=0.15)
    assert 0.0 < first.deviations["m"] < 0.1
    placebo = next(line for line in found.evidence if line.startswith("Check against luck: "))
    assert "none of these does as well" in placebo


def test_half_of_the_recordings_chooses_the_true_effect(chain, lab, measure):
    """Stability selection: a seeded resampling of frequencies and sensors lets the true lump in
    nearly always, a far one seldom."""
    found = diagnose(chain, *measured(measure, lab(m=(0, 0.06, 0, 0))))
    often = {
        (c["physics"], tuple(c["location"]["nodes"])): c["stability"]
        for c in found.candidates
        if c.get("stability") is not None
    }
    assert often[("added_mass", (2,))] >= 0.7 and often.get(("added_mass", (4,)), 0.0) <= 0.5


def test_dashpot_is_found_and_sized(chain, lab, measure):
    found = diagnose(chain, *measured(measure, lab(c=(0, 0, 9.0, 0))))
    assert (
        found.verdict == "missing_physics"
        and found.findings[0].physics == "viscous_damper"
        and found.findings[0].place.nodes == (2, 3)
    )
    assert found.findings[0].parameters["c"] == pytest.approx(9.0, rel=0.15)
    assert halved(found)


@pytest.mark.parametrize("seed", [21, 31])
def test_nothing_is_found_where_nothing_is(chain, lab, measure, seed):
    found = diagnose(
        chain, measure(lab(), 4, seed=seed), measure(lab(), 1, "hold-out", seed=seed + 1)
    )
    assert found.verdict == "consistent" and found.findings == ()


def test_a_soft_group_is_a_parameter_error(chain, lab, measure):
    found = diagnose(chain, *measured(measure, lab(k=(1, 1, 0.88, 1))))
    first = found.findings[0]
    assert (
        found.verdict == "parameter_error"
        and first.physics == "stiffness_change"
        and first.place.groups == ("spring 3",)
    )
    assert first.parameters["factor"] == pytest.approx(0.88, abs=0.03)


def test_a_channel_with_the_wrong_sign_is_the_measurement(chain, lab, measure):
    found = diagnose(chain, *measured(measure, lab(), gain=(1, 1, -1, 1)))
    first = found.findings[0]
    assert first.physics == "sensor_fault" and first.place.nodes == (3,) and first.place.dof == "x"
    assert first.parameters["gain"] == pytest.approx(-1.0, abs=0.05)
    assert "measurement" in first.says and halved(found)


def test_responses_that_depend_on_the_level_get_no_linear_sentence(chain, lab, measure):
    loud = measure(lab(k=(1, 1, 1, 1.08)), 4, level=5.0, seed=14)
    found = diagnose(chain, measure(lab(), 4, level=1.0, seed=13), loud)
    assert found.verdict == "undetermined" and found.findings == ()
    assert any("level" in line for line in found.evidence)


def test_two_linear_runs_at_two_levels_are_linear(chain, lab, measure):
    found = diagnose(
        chain, measure(lab(), 4, level=1.0, seed=13), measure(lab(), 4, level=5.0, seed=14)
    )
    assert found.verdict == "consistent"


def test_only_the_effects_that_the_problem_allows(chain, lab, measure):
    spec, model = chain
    only = replace(spec, diagnose=spec.diagnose.model_copy(update={"physics": ("sensor_fault",)}))
    found = diagnose_problem(only, model, measured(measure, lab(m=(0, 0.25, 0, 0))))
    assert {c["physics"] for c in found.candidates} <= {"sensor_fault"}


def test_nothing_to_fit_is_bad_input(chain, lab, measure):
    with pytest.raises(InputError):
        diagnose(chain, measure(lab(), 1, "hold-out"))


def test_files_hold_no_nan_and_the_contract_s_keys(chain, lump):
    from cvxupdate.report.diagnosis import diagnosis_files

    found = lump
    files, payload = diagnosis_files(found, chain[0])
    data = json.loads(payload, parse_constant=lambda name: pytest.fail(name))
    assert set(data) >= {"verdict", "findings", "candidates", "fit", "metrics", "evidence"}
    assert set(data["findings"][0]) == {
        "physics",
        "location",
        "parameters",
        "standard_deviation",
        "noise_deviation",
        "confidence",
        "explains",
        "equivalent",
        "says",
    }
    assert files["diagnosis.json"] == payload
    page = files["report.html"]
    assert (
        found.says.split(".")[0] in page
        and page.count("<svg") == 6
        and "<script" not in page
        and "http" not in page.replace("http://www.w3.org", "")
    )


@pytest.mark.slow
def test_two_effects_are_both_found(chain, lab, measure):
    found = diagnose(chain, *measured(measure, lab(m=(0, 0.25, 0, 0), c=(0, 0, 0, 6.0))))
    assert [(f.physics, f.place.nodes) for f in found.findings] == [
        ("added_mass", (2,)),
        ("viscous_damper", (3, 4)),
    ]
    mass, damper = found.findings
    assert mass.parameters["m"] == pytest.approx(0.25, rel=0.15) and damper.parameters[
        "c"
    ] == pytest.approx(6.0, rel=0.15)


@pytest.mark.parametrize(
    ("changes", "found_at"),
    [
        ({"m": (0, 0.25, 0, 0.2)}, {("added_mass", (2,)): 0.25, ("added_mass", (4,)): 0.2}),
        ({"m": (0, 0, 0.2, 0.3)}, {("added_mass", (3,)): 0.2, ("added_mass", (4,)): 0.3}),
    ],
)
@pytest.mark.slow
def test_two_lumps_are_both_found(chain, lab, measure, changes, found_at):
    """The best single lump is at neither place, or takes the other's share: only the search over
    pairs with exchange finds them."""
    spec, model = chain
    some = replace(spec, diagnose=spec.diagnose.model_copy(update={"physics": SOME}))
    found = diagnose((some, model), *measured(measure, lab(**changes)))
    assert {(f.physics, f.place.nodes): f.parameters["m"] for f in found.findings} == pytest.approx(
        found_at, rel=0.1
    )
    assert halved(found)


def test_a_calibrated_model_scatters_less(chain):
    """`[diagnose] scatter`: bounds and priors of the nuisance parameters shrink together."""
    _, model = chain
    usual, known = (with_nuisance(undamped(model), scatter=s) for s in (1.0, 0.1))
    assert [q.upper for q in known.parameters] == pytest.approx(
        [0.1 * q.upper for q in usual.parameters]
    )
    scales = [setting_for(m, model, (), 75.0).scales[: len(m.parameters)] for m in (usual, known)]
    assert scales[1] == pytest.approx(0.1 * scales[0])


@pytest.mark.slow
def test_three_things_at_once_are_told_apart(chain, lab, measure):
    """A lump, a softer spring and a sensor that reads too much: no one or two of them explain."""
    gain = (1.0, 1.0, 1.0, 1.2)
    real = lab(m=(0.4, 0, 0, 0), k=(1, 1, 0.75, 1))
    spec, model = chain
    some = replace(spec, diagnose=spec.diagnose.model_copy(update={"physics": SOME}))
    found = diagnose((some, model), *measured(measure, real, gain=gain))
    said = {(f.physics, f.place.nodes or f.place.elements): f for f in found.findings}
    assert set(said) == {
        ("added_mass", (1,)),
        ("stiffness_change", (103,)),
        ("sensor_fault", (4,)),
    }
    sizes = [next(iter(f.parameters.values())) for f in said.values()]
    assert sorted(sizes) == pytest.approx([0.4, 0.75, 1.2], rel=0.1)
