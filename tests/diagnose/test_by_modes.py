"""A structure whose sensors stand beside their nodes, lightly damped: its responses leave too much
whatever is found, its modes do not."""

from __future__ import annotations

import copy
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import scipy.signal

from cvxupdate.diagnose import gather
from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.judge.by_modes import ByModes
from cvxupdate.diagnose.modes import identified as few_lowest
from cvxupdate.diagnose.modes.identified import FEW, identified
from cvxupdate.diagnose.modes.mixing import off_nodes
from cvxupdate.diagnose.modes.tables import prepared
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.grown import on_these
from cvxupdate.diagnose.settings import BESIDE
from cvxupdate.errors import ModelError
from cvxupdate.physics.place import Place
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, TimeHistory
from cvxupdate.study import open_problem
from tests.cases.rigs import Structure, frfs, hung_bar, with_lumps

SENSORS = [(n, "z") for n in (2, 4, 5, 7, 9, 10)]
DRIVES = [(10, "z"), (4, "z")]
LINES = np.arange(6.0, 900.0, 1.5)


def clamped() -> Structure:
    out = copy.deepcopy(hung_bar())
    out["supports"].append({"nodes": [1], "dofs": ["z", "ry"]})
    out["damping"]["zeta"] = 0.004
    return out


def beside(structure: Structure, off: float) -> Structure:
    """Inner nodes, and with them what is there, up to ``off`` beside where they are drawn."""
    out = copy.deepcopy(structure)
    shift = off * np.random.default_rng(5).uniform(-1.0, 1.0, len(out["nodes"]))
    shift[[0, -1]] = 0.0
    shift[3] = 0.0  # where the section changes
    for node, by in zip(out["nodes"], shift, strict=True):
        node["x"] += float(by)
    return out


@pytest.fixture(scope="module")
def problem(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("beside")
    real = with_lumps(with_lumps(beside(clamped(), 0.008), [6], 0.12), [9], 0.09)
    return frfs(folder, real, clamped(), SENSORS, DRIVES, LINES, zeta=0.004)


def quiet(_: str) -> None:
    """Progress that nobody reads."""


@pytest.fixture(scope="module")
def look(problem: Path) -> ByModes:
    spec, model, recordings = open_problem(problem)
    return ByModes(gathered(spec, model, recordings, quiet), quiet)


def test_what_is_missing_is_told_by_the_modes_in_responses(look: ByModes) -> None:
    assert look.sure and look.told is not None
    found = {f.place.nodes: f for f in look.told.findings}
    assert set(found) == {(6,), (9,)}
    for node, m in (((6,), 0.12), ((9,), 0.09)):
        assert found[node].physics == "added_mass" and found[node].confidence >= 0.9
        assert found[node].parameters["m"] == pytest.approx(m, rel=0.1)


def test_luck_is_asked_of_the_modes(look: ByModes) -> None:
    sham = look.sham
    assert sham is not None and sham.as_good == 0 and sham.mine < sham.left
    assert sham.says.startswith("Check against luck (by the modes in the responses): ")
    silent = ByModes(look.evidence, quiet)
    silent.__dict__["_searched"] = None
    assert silent.told is None and silent.sham is None


def test_the_responses_have_it_from_there(look: ByModes) -> None:
    evidence = look.evidence
    start = carried(evidence, look.likely[0])
    assert start is not None and start.keys == look.likely[0].keys
    sizes = [v["m"] for v in start.values]
    assert sizes == pytest.approx([v["m"] for v in look.likely[0].values], rel=1e-6)
    best = on_these(evidence, look, quiet)[0]
    base = evidence.errors(evidence.bases[-1])
    assert evidence.errors(best.fit).fit < 0.5 * base.fit
    assert evidence.errors(best.fit).hold_out < 0.5 * base.hold_out


def test_what_cannot_stand_on_the_responses_is_left_out(look: ByModes) -> None:
    gone = [replace(e, place=Place(nodes=(99,))) for e in look.likely[0].effects]
    assert carried(look.evidence, replace(look.likely[0], effects=tuple(gone))) is None


def test_an_oscillator_has_its_fitted_tuning_on_the_responses_and_a_dashpot(look: ByModes) -> None:
    """Its parameters are relative to what was planted: they begin anew from what was fitted."""
    seen = look.evidence.by_modes()
    (own, *_) = seen.candidates(seen.model, ("attached_resonator",))
    begun = together(seen, Hypothesis((), seen.bases[-1]), [own], 0.05)
    p = begun.fit.p.copy()
    p[-2:] = 0.3, -0.2
    told = Hypothesis(begun.effects, seen.evaluated(begun.fit.setting, p))
    there = carried(look.evidence, told)
    assert there is not None and there.keys == told.keys
    (before,), (after,) = told.values, there.values
    assert set(before) == {"m", "k"} and set(after) == {"m", "k", "c"}
    assert [after[n] for n in "mk"] == pytest.approx([before[n] for n in "mk"], rel=1e-6)
    assert after["c"] > 0.0


def frf(problem: Path) -> FrequencyResponse:
    found = open_problem(problem)[2][0]
    assert isinstance(found, FrequencyResponse)
    return found


def test_modes_of_every_recording_in_the_band(problem: Path) -> None:
    first = frf(problem)
    (found,) = identified([first], (6.0, 900.0), quiet)
    table = found.table
    assert table.origin is first.origin and len(table.frequency) == 6
    assert found.drives == first.references and found.constants.shape == (6, 6, 1)
    assert np.all(np.diff(table.frequency) > 0.0) and table.shapes is not None
    assert table.damping == pytest.approx(0.004, rel=0.1)
    fewer = replace(first, responses=first.responses[:4], H=first.H[:, :4])
    fewer = replace(fewer, variance=None, coherence=None)
    again = identified([fewer, first, first], (6.0, 900.0), quiet)
    assert sorted(len(t.table.channels) for t in again) == [4, 6], "one of each set of sensors"
    assert len(identified([first, first], (6.0, 900.0), quiet, each=True)) == 2
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(few_lowest, "LOWEST", 5)
        (few,) = few_lowest.identified([first], (6.0, 900.0), quiet)
    lowest = few.table
    assert lowest.frequency == pytest.approx(table.frequency[:5]) and lowest.shapes.shape == (5, 6)
    assert few.constants == pytest.approx(found.constants[:5])
    assert identified([first], (6.0, 400.0), quiet) == [], "four modes tell little"
    (few,) = identified([first], (6.0, 400.0), quiet, fewest=FEW)  # but where to begin
    assert few.table.frequency == pytest.approx(table.frequency[:4], rel=1e-3)
    assert len(identified([first], (6.0, 400.0), quiet, each=True)) == 1


def test_what_another_drive_shows_beside_is_added(problem: Path) -> None:
    """Four modes of one record and two of another make six; a mode of both comes once."""
    first = frf(problem)
    low, high = (
        replace(
            first, frequency=first.frequency[band], H=first.H[band], variance=None, coherence=None
        )
        for band in (first.frequency < 400.0, first.frequency > 250.0)
    )
    one, other = identified([low, high], (6.0, 900.0), quiet)
    both = np.concatenate([one.table.frequency, other.table.frequency])
    (whole,) = identified([first], (6.0, 900.0), quiet)
    assert np.sort(both) == pytest.approx(whole.table.frequency, rel=2e-3)
    assert len(other.constants) == len(other.table.frequency) < len(one.table.frequency)


def test_records_without_force_and_silent_ones_have_none(problem: Path) -> None:
    silent = replace(frf(problem), H=0.0 * frf(problem).H)
    force, motion = Channel(1, "z", "force"), Channel(2, "z", "acceleration")
    noise = np.random.default_rng(2).standard_normal((4096, 1))
    free = TimeHistory(Origin("free", "free"), 2048.0, (motion,), noise)
    alone = replace(free, channels=(force,))
    assert identified([silent, free, alone], (6.0, 900.0), quiet) == []


def test_modes_of_a_time_history_are_those_of_its_responses() -> None:
    rate, rng = 1024.0, np.random.default_rng(7)
    f = np.array([40.0, 75.0, 130.0, 210.0, 300.0])
    s = -0.01 * 2.0 * np.pi * f + 2j * np.pi * f
    force = rng.standard_normal(2**14)
    t = np.arange(len(force)) / rate
    responses = [
        scipy.signal.fftconvolve(force, (shape[:, None] * np.exp(s[:, None] * t)).imag.sum(0))
        for shape in rng.standard_normal((3, 5))
    ]
    data = np.column_stack([force, *(y[: len(force)] for y in responses)])
    motions = [Channel(n, "z", "displacement") for n in (1, 2, 3)]
    channels = (Channel(1, "z", "force"), *motions)
    record = TimeHistory(Origin("run", "run"), rate, channels, data)
    (found,) = identified([record], (10.0, 400.0), quiet)
    assert found.table.frequency == pytest.approx(f, rel=2e-3)


def test_sensors_beside_their_nodes_read_the_slope_there(problem: Path, look: ByModes) -> None:
    """An entry of a shape is off by the way between sensor and node times the slope of the mode."""
    evidence = look.evidence.by_modes()
    point, table = evidence.nominal_point, evidence.tables.measured[0]
    off = off_nodes(point, 0, table)
    assert off.shape == (6, 6) and np.all(off > 0.0)
    model, own = point.residual.model, point.modes.shapes[:, point.places[0][0]]
    z, ry = (np.array([own[model.place[f"n{n}.{d}"]] for n, _ in SENSORS]) for d in ("z", "ry"))
    scale = np.max(np.abs(table.shapes[0])) / np.max(np.abs(z))
    assert off[0] == pytest.approx(BESIDE * scale * np.abs(ry), rel=1e-9)
    assert np.all(off[-1] > off[0]), "shorter waves are steeper"
    plain = prepared(model, [table], evidence.mesh)
    wide = prepared(model, [table], evidence.mesh, beside=True)
    assert wide.fit[0].shape_std ** 2 == pytest.approx(plain.fit[0].shape_std ** 2 + off**2)
    assert wide.measured[0].shape_std == pytest.approx(table.shape_std), "that is no noise"
    turned = replace(table, channels=tuple(replace(c, dof="ry") for c in table.channels))
    assert np.all(off_nodes(point, 0, turned) == 0.0)


def test_a_repeated_eigenvalue_leaves_the_responses_alone(problem: Path, monkeypatch) -> None:
    """Modes that have no derivatives tell nothing; a free beam (the rigs' 4646) ended in an
    error."""

    def repeated(*_: object, **__: object) -> None:
        raise ModelError("a repeated eigenvalue is singular.")

    spec, model, recordings = open_problem(problem)
    evidence = gathered(spec, model, recordings, quiet)
    assert evidence.by_modes(3) is not None
    monkeypatch.setattr(gather, "modes_evidence", repeated)
    assert evidence.by_modes(3) is None
