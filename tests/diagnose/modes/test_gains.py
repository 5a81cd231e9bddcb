"""Gains of channels by modal constants: of a clamped bar whose sensors stand beside their nodes."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.judge.by_modes import ByModes
from cvxupdate.diagnose.modes.borne_out import (
    constants_are_met,
    constants_are_of,
    constants_bear_out,
)
from cvxupdate.diagnose.modes.complexity import complex_modes, imaginary
from cvxupdate.diagnose.modes.constants import constants_of
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.gains import as_it_may_be, gains_of, not_gainsaid, suspect
from cvxupdate.diagnose.modes.identified import Identified, identified, without_rows
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.recordings.types import FrequencyResponse, ModeTable
from cvxupdate.study import open_problem
from tests.cases.rigs import frfs
from tests.diagnose.test_by_modes import DRIVES, LINES, SENSORS, beside, clamped, quiet

BAND = (6.0, 900.0)


@dataclass(frozen=True)
class Bar:
    """The bar as it was measured, sound but for sensors and drives 8 mm beside their nodes at most,
    and the modes in what is fitted and in what is held out."""

    path: Path
    fitted: Identified
    held: Identified
    evidence: ModesEvidence

    @property
    def point(self):
        return self.evidence.bases[-1].point


def recordings_of(path: Path) -> list[FrequencyResponse]:
    return [r for r in open_problem(path)[2] if isinstance(r, FrequencyResponse)]


@pytest.fixture(scope="module")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Bar:
    folder = tmp_path_factory.mktemp("sound")
    path = frfs(folder, beside(clamped(), 0.008), clamped(), SENSORS, DRIVES, LINES, zeta=0.004)
    spec, model, recordings = open_problem(path)
    evidence = gathered(spec, model, recordings, quiet)
    assert isinstance(evidence, ResponseEvidence)
    modes = evidence.by_modes()
    assert isinstance(modes, ModesEvidence)
    fitted, held = (identified([r], BAND, quiet)[0] for r in recordings_of(path))
    return Bar(path, fitted, held, modes)


def off(found: Identified, factors: Mapping[str, float], force: float = 1.0) -> Identified:
    """As sensors that read so many times what they should would have it, and all responses."""
    by = np.array([factors.get(c.label, 1.0) for c in found.table.channels])
    return replace(found, constants=force * found.constants * by[:, None])


def test_constants_are_those_of_the_model_and_sound_channels_have_no_gain(bar: Bar) -> None:
    c = constants_of(bar.point, [bar.fitted])
    assert c is not None and len(c.modes) == 6
    assert float(c.y @ c.y) < 1.5 * len(c.y), "what stands beside its node is allowed for"
    assert gains_of(bar.point, [bar.fitted]) == () and suspect(bar.point, [bar.fitted]) is None


@pytest.mark.parametrize("value", [0.85, 1.2])
def test_one_factor_in_all_constants_is_the_forces(bar: Bar, value: float) -> None:
    (gain,) = gains_of(bar.point, [off(bar.fitted, {}, value)])
    assert gain.how == "force" and gain.channels == ("n10.z",)
    assert abs(gain.value - value) < 3.0 * gain.deviation < 0.15 and gain.confidence > 0.9
    assert suspect(bar.point, [off(bar.fitted, {}, value)]) is None, "no sensor is to be left out"


def test_one_factor_in_all_modes_of_a_sensor_is_its_own(bar: Bar) -> None:
    seen = off(bar.fitted, {"n7.z": 1.25})
    (gain,) = gains_of(bar.point, [seen])
    assert (gain.how, gain.channels) == ("gain", ("n7.z",))
    assert abs(gain.value - 1.25) < 3.0 * gain.deviation < 0.2
    assert suspect(bar.point, [seen]) == "n7.z"


def test_two_gains_are_told_at_once(bar: Bar) -> None:
    found = gains_of(bar.point, [off(bar.fitted, {"n7.z": 1.3}, 0.8)])
    values = {g.channels: g.value for g in found}
    assert values[("n7.z",)] == pytest.approx(1.3, rel=0.1)
    assert values[("n10.z",)] == pytest.approx(0.8, rel=0.1)


def test_what_one_mode_alone_says_is_no_gain(bar: Bar) -> None:
    constants = bar.fitted.constants.copy()
    constants[0] *= 0.5  # a peak narrower than a line
    assert gains_of(bar.point, [replace(bar.fitted, constants=constants)]) == ()


def test_what_is_held_out_bears_it_out_or_not(bar: Bar) -> None:
    gains = gains_of(bar.point, [off(bar.fitted, {"n7.z": 1.3}, 0.8)])
    named = {g.how: g for g in not_gainsaid(gains, bar.point, [off(bar.held, {"n7.z": 1.3}, 0.8)])}
    assert named["gain"].channels == ("n7.z",)
    assert set(named["force"].channels) == {"n10.z", "n4.z"}, "one transducer for both drives"
    (own,) = not_gainsaid(gains, bar.point, [bar.held])
    assert own.how == "force" and own.channels == ("n10.z",), "that drive's own, and no sensor's"
    assert not_gainsaid(gains, bar.point, []) == gains


def test_sizes_of_effects_may_be_off_by_a_tenth(bar: Bar) -> None:
    last = bar.evidence.bases[-1]
    assert as_it_may_be(last, len(last.p)) == []
    heavier = replace(last, point=last.setting.evaluate(last.p + 0.5, last.point))
    others = as_it_may_be(heavier, len(last.p) - 1)
    assert len(others) == 1 and others[0].p[-1] == pytest.approx(0.9 * heavier.p[-1])
    seen = [off(bar.fitted, {}, 0.85)]
    sure, wary = (gains_of(bar.point, seen, o)[0] for o in ([], [other(bar)]))
    assert wary.deviation > 1.2 * sure.deviation


def other(bar: Bar):
    """Shapes of a tenth less mass."""
    modes = replace(bar.point.modes, shapes=bar.point.modes.shapes * np.sqrt(1.05))
    return replace(bar.point, modes=modes)


def test_rows_go_with_their_constants(bar: Bar) -> None:
    rest = without_rows(bar.fitted, [1, 3])
    assert rest.constants.shape[0] == len(rest.table.frequency) == 4
    assert rest.constants[1] == pytest.approx(bar.fitted.constants[2])
    assert without_rows(bar.fitted, []) is bar.fitted


def twisted(table: ModeTable, by: float) -> ModeTable:
    """Parts of every shape turned against the rest by an angle (rad)."""
    assert table.shapes is not None
    turn = np.exp(1j * by * (np.arange(table.shapes.shape[1]) % 2))
    return replace(table, shapes=table.shapes * turn)


def test_proportional_damping_leaves_shapes_real_and_a_dashpot_does_not(bar: Bar) -> None:
    table = bar.fitted.table
    assert complex_modes([table]) == "" and complex_modes([]) == ""
    whole = replace(table, shapes=np.exp(0.7j) * np.asarray(table.shapes))
    assert imaginary(whole) == pytest.approx(imaginary(table), abs=1e-6), "one phase is none"
    assert "The shapes are complex" in complex_modes([twisted(table, 0.1)])
    real = replace(table, shapes=np.real(table.shapes))
    assert not np.any(imaginary(real)) and complex_modes([real]) == ""


def diagnosed(path: Path, scale: Mapping[str, float], force: float):
    """The judgement of responses that a search of nothing leaves open."""
    from cvxupdate.diagnose.judge.judge import judge
    from cvxupdate.diagnose.search.search import Found

    spec, model, recordings = open_problem(path)
    recordings = [
        replace(r, H=force * r.H * np.array([[scale.get(c.label, 1.0)] for c in r.responses]))
        for r in recordings
        if isinstance(r, FrequencyResponse)
    ]
    evidence = gathered(spec, model, recordings, quiet)
    look = ByModes(evidence, quiet)
    return look, look.instead(judge(evidence, Found()))


def test_a_sensors_gain_is_a_finding_though_its_shapes_are_off(bar: Bar) -> None:
    look, found = diagnosed(bar.path, {"n5.z": 1.3}, 1.0)
    assert look.calm, "its entries left the table"
    (finding,) = found.findings
    assert finding.physics == "sensor_fault" and finding.place.nodes == (5,)
    assert finding.parameters["gain"] == pytest.approx(1.3, rel=0.06)
    assert found.final is not None and found.last is found.final
    assert len(found.standings) == 1 and found.standings[0].confidence == finding.confidence
    (line,) = look.lines(replace(found, findings=()), found)
    assert "modal constants" in line


def test_the_force_channels_gain_is_that_of_all_its_drives(bar: Bar) -> None:
    _, found = diagnosed(bar.path, {}, 1.0 / 0.8)
    (finding,) = found.findings
    assert finding.parameters["gain"] == pytest.approx(0.8, rel=0.06)
    assert set(finding.place.nodes) >= {10} and "wherever it drives" in finding.says
    assert found.final is not None
    evidence = found.case.evidence
    alike = evidence.bases[found.final.fit.setting.level]  # beside recordings as smooth
    assert found.final.errors.hold_out < evidence.errors(alike).hold_out


def test_a_sound_bar_is_consistent_whatever_its_light_resonances_do(bar: Bar) -> None:
    look, found = diagnosed(bar.path, {}, 1.0)
    assert look.calm and found.sound and not found.findings


def test_constants_bear_a_model_out_that_nothing_was_fitted_to(bar: Bar) -> None:
    """The bar is sound: a model with a third less mass has its constants half as large again."""
    lighter = replace(bar.point.modes, shapes=np.sqrt(1.5) * bar.point.modes.shapes)
    wrong = replace(bar.point, modes=lighter)
    assert constants_are_of(bar.point, wrong, [bar.fitted], ())
    assert not constants_are_of(bar.point, bar.point, [bar.fitted], ()), (
        "no better than what it had before"
    )
    assert not constants_are_of(wrong, wrong, [bar.fitted], ()) and not constants_are_of(
        wrong, bar.point, [bar.fitted], ()
    )
    assert constants_bear_out(bar.point, bar.point, ([bar.fitted], []), ()) is False
    constants = bar.fitted.constants.copy()
    constants[2:] *= -1.0  # no figures that compare
    few = replace(bar.fitted, constants=constants)
    assert not constants_are_of(bar.point, wrong, [few], ()), "two modes are no proof"


def test_one_mode_may_leak_and_gains_are_taken_out(bar: Bar) -> None:
    wrong = replace(bar.point, modes=replace(bar.point.modes, shapes=2.0 * bar.point.modes.shapes))
    constants = bar.fitted.constants.copy()
    constants[0] *= 0.5
    assert constants_are_of(bar.point, wrong, [replace(bar.fitted, constants=constants)], ())
    constants[1] *= 0.5
    assert not constants_are_of(bar.point, wrong, [replace(bar.fitted, constants=constants)], ())
    seen = [off(bar.fitted, {"n7.z": 1.3}, 0.8)]
    gains = gains_of(bar.point, seen)
    assert constants_are_of(bar.point, wrong, seen, gains) and not constants_are_of(
        bar.point, wrong, seen, gains[:1]
    )


def test_what_is_held_out_must_bear_it_out_too(bar: Bar) -> None:
    last = bar.evidence.bases[-1].point
    heavier = bar.evidence.bases[-1].setting.evaluate(last.p, last)
    wrong = replace(heavier, modes=replace(heavier.modes, shapes=2.0 * heavier.modes.shapes))
    held = off(bar.held, {}, 0.5)
    assert constants_are_of(last, wrong, [bar.fitted], ())
    assert not constants_bear_out(last, wrong, ([bar.fitted], [held]), ())


def test_constants_are_met_where_those_held_out_are_the_models_too(bar: Bar) -> None:
    last = bar.evidence.bases[-1].point
    assert constants_are_met(last, ([bar.fitted], [bar.held]))
    assert not constants_are_met(last, ([bar.fitted], [])), "nothing was held out"
    assert not constants_are_met(last, ([bar.fitted], [off(bar.held, {}, 0.5)]))
