"""A mesh of lines too coarse for the recordings: told, taken out, and not taken for physics."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from scipy.signal import StateSpace, firwin, lsim

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.nominal.coarse import of_sheets, too_coarse
from cvxupdate.diagnose.nominal.refinement import PLAIN, Mesh
from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.diagnose.output.file_numbers import in_file_numbers
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import COARSE_MESH, EXACT_MESH
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.physics.place import Place
from cvxupdate.recordings.types import (
    Channel,
    FrequencyResponse,
    ModeTable,
    Origin,
    TimeHistory,
)
from cvxupdate.spec import Spec
from cvxupdate.study import open_problem
from tests.cases.elements import STEEL, chain, lines, toml

NOTHING: Any = object()  # some analysis model: only whether there is one counts here
LINES = np.linspace(20.0, 1500.0, 200)
BAR = {"shape": "rectangle", "width": 0.012, "height": 0.02}
AT = [(x, 0.0, 0.0) for x in (0.0, 0.11, 0.19, 0.31, 0.42, 0.55)]


def opened(folder: Path, mass: str) -> tuple[Spec, Model]:
    """A free beam of five unequal elements with a lump near one end."""
    model: dict[str, Any] = lines("beam2d", AT, chain(5), ["y", "rz"], BAR, STEEL)
    model["elements"][0]["mass"] = mass
    model["elements"].append({"type": "mass", "rows": [{"id": 9, "nodes": [2], "m": 0.1}]})
    model["damping"] = {"kind": "structural", "eta": 0.01}
    path = folder / "problem.toml"
    path.write_text(f"model = {toml(model)}\n", encoding="utf-8")
    return open_problem(path)[:2]


def built(spec: Spec, softer: slice = slice(0)) -> Model:
    """The same beam in eighths with consistent masses; elements ``softer`` have half the
    stiffness."""
    blocks = tuple(
        b.model_copy(update={"mass": "consistent", "rotary_inertia": False})
        if b.type == "beam2d"
        else b
        for b in spec.model.elements
    )
    text = refined(spec.model.model_copy(update={"elements": blocks}), lambda b, r: 8, True).model
    beam, *rest = text.elements
    rows = list(beam.rows)
    rows[softer] = [r.model_copy(update={"stiffness_factor": 0.5}) for r in rows[softer]]
    text = text.model_copy(update={"elements": (beam.model_copy(update={"rows": rows}), *rest)})
    return build_model(replace(spec, model=text, update=None))


def table(spec: Spec, count: int = 5, softer: slice = slice(0)) -> ModeTable:
    """Its lowest flexible modes."""
    fine = built(spec, softer)
    modes = model_modes(fine, count).flexible()
    channels = tuple(Channel(n, "y", "displacement") for n in range(1, 7))
    at = [fine.place[f"n{n}.y"] for n in range(1, 7)]
    f = modes.frequencies[:count]
    unknown = np.full(count, np.nan)
    shapes = modes.shapes[at, :count].T
    pairs = np.zeros(count, dtype=np.int64)
    return ModeTable(Origin("m", "m"), f, 1e-3 * f, unknown, unknown, channels, shapes, None, pairs)


def history(spec: Spec) -> TimeHistory:
    """Its motion from rest under a short random force up to 1500 Hz, from its modes."""
    rate, n = 8000.0, 1200
    force = np.convolve(
        np.random.default_rng(9).normal(size=n), firwin(61, 1500.0, fs=rate), mode="same"
    )
    fine = built(spec)
    modes = model_modes(fine, 14)
    sensors = (1, 3, 4, 6)
    at = modes.shapes[[fine.place[f"n{k}.y"] for k in sensors]]
    drive = modes.shapes[fine.place["n1.y"]]
    omega = 2 * np.pi * modes.frequencies
    many = len(omega)
    A = np.block(
        [[np.zeros((many, many)), np.eye(many)], [-np.diag(omega**2), -np.diag(0.01 * omega)]]
    )
    B = np.concatenate([np.zeros(many), drive])[:, None]
    system = StateSpace(A, B, at @ A[many:], (at @ drive)[:, None])
    motion = lsim(system, force, np.arange(n) / rate)[1]
    channels = (Channel(1, "y", "force"), *(Channel(k, "y", "acceleration") for k in sensors))
    data = np.column_stack([force, motion])
    return TimeHistory(Origin("t", "t"), rate, channels, data)


def diagnosis(finding: Finding) -> Diagnosis:
    """That says one thing."""
    says = f"So: {finding.says}"
    return Diagnosis("p", "p", "", "missing_physics", says, (finding,), (), {}, {}, (), 0.0, {})


def measured(spec: Spec, sensors: tuple[int, ...] = (1, 3, 4, 6)) -> list[FrequencyResponse]:
    """By the same beam in eighths, 1 % noise; the drive beside it held out."""
    fine = built(spec)
    rng = np.random.default_rng(4)
    out = []
    for use, drive in (("fit", 1), ("hold-out", 6)):
        at = np.array([fine.place[f"n{n}.y"] for n in sensors])
        H = frequency_responses(fine, LINES, at, np.array([fine.place[f"n{drive}.y"]]))
        size = 0.01 * np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) / np.sqrt(2.0)
        H = H + size * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
        channels = tuple(Channel(n, "y", "displacement") for n in sensors)
        driven = (Channel(drive, "y", "force"),)
        origin = Origin(use, use, use=use)
        out.append(FrequencyResponse(origin, LINES, H, "displacement", channels, driven))
    return out


def test_a_coarse_mesh_is_told_with_the_one_that_does(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, "lumped")
    found = too_coarse(spec, model, measured(spec))
    assert found is not None and found.told.shift > COARSE_MESH
    told = found.told
    assert told.left is not None and told.left <= EXACT_MESH
    # against a mesh twice as fine as the one that was compared with
    best = refined(found.spec.model, lambda b, r: 4, True).model
    sharp = model_modes(build_model(replace(spec, model=best, update=None)), 12).flexible()
    own = model_modes(found.model, 12).flexible().frequencies
    band = sharp.frequencies <= LINES[-1]
    assert np.abs(own / sharp.frequencies - 1.0)[band].max() < 1.5 * EXACT_MESH
    assert told.errors[0] > 0.5 and told.errors[1] < 0.05
    assert told.lumped and "consistent masses" in found.says


def test_it_and_no_effect_explains(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, "lumped")
    found = diagnose_problem(spec, model, measured(spec))
    assert found.verdict == "consistent" and not found.findings
    assert found.says.startswith("No physics is missing: the mesh is too coarse")
    told = found.details["discretisation"]
    assert told["fit"]["before"] == pytest.approx(found.fit["fit"]["before"], rel=1e-6)
    assert found.fit["fit"]["after"] < 0.03 and found.fit["hold_out"]["after"] < 0.03
    assert any("too coarse for these recordings" in line for line in found.evidence)


def test_a_mesh_that_does_stays(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, "consistent")
    low = [replace(r, frequency=LINES[:30], H=r.H[:30]) for r in measured(spec)]
    assert too_coarse(spec, model, low) is None


def test_tables_of_modes_tell_it_too(tmp_path: Path) -> None:
    spec, model = opened(tmp_path, "lumped")
    found = diagnose_problem(spec, model, [table(spec)])
    assert found.verdict == "consistent" and not found.findings
    assert found.says.startswith("No physics is missing: the mesh is too coarse")
    assert "of the frequencies are off with the mesh of the file" in found.says
    told = found.details["discretisation"]
    assert told["fit"]["before"] == pytest.approx(found.fit["fit"]["before"], rel=1e-6)
    assert told["fit"]["before"] > 0.05 and told["fit"]["after"] < 1e-3


@pytest.mark.parametrize(
    ("softer", "said"),
    [
        (slice(20, 24), "parts 3 and 4 of 4 of element 3 of the file, from its first node on.)"),
        (slice(16, 24), "are the whole of element 3 of the file.)"),
    ],
)
def test_what_is_found_has_the_numbers_of_the_file(
    tmp_path: Path, softer: slice, said: str
) -> None:
    spec, model = opened(tmp_path, "lumped")
    found = diagnose_problem(spec, model, [table(spec, 5, softer)])
    (finding,) = found.findings
    assert finding.physics == "stiffness_change" and finding.says.endswith(said)
    assert finding.parameters["factor"] == pytest.approx(0.5, abs=0.03)
    assert finding.to_json()["location"]["elements"] == [3]
    assert finding.says in found.says


def test_a_node_that_the_file_does_not_have_is_told_by_its_neighbours(tmp_path: Path) -> None:
    spec, _ = opened(tmp_path, "consistent")
    mesh = refined(spec.model, lambda b, r: 4, True)
    finding = Finding(
        "added_mass", Place(nodes=(11,), dof="y"), "a mass", {}, {}, {}, 0.9, 1.0, (), "More."
    )
    found = in_file_numbers(diagnosis(finding), mesh)
    assert found.findings[0].says == "More. (Node 11 lies 50 % of the way from node 2 to node 3.)"
    assert found.says == f"So: {found.findings[0].says}"
    own = replace(finding, place=Place(nodes=(2,), dof="y"))
    assert in_file_numbers(diagnosis(own), mesh).findings == (own,)


def test_time_histories_tell_it_too(tmp_path: Path) -> None:
    """In the band that their force excites."""
    spec, model = opened(tmp_path, "lumped")
    found = too_coarse(spec, model, [history(spec)])
    assert found is not None and found.told.of == "responses"
    # resonances that `EXACT_MESH` leaves 1e-3 off, at a loss of 1 %, are off by a fifth
    assert found.told.errors[0] > 0.5 and found.told.errors[1] < 0.2


def test_where_another_way_deals_with_it(tmp_path: Path) -> None:
    """Nothing to fit; responses count before tables, as in the diagnosis."""
    spec, model = opened(tmp_path, "lumped")
    assert too_coarse(spec, model, []) is None
    both = too_coarse(spec, model, [*measured(spec), table(spec)])
    assert both is not None and both.told.of == "responses"


@pytest.mark.parametrize(("alone", "said"), [(0.12, True), (0.08, False)])
def test_plates_are_told_by_what_their_mesh_leaves_by_itself(alone: float, said: bool) -> None:
    """Half of the error of the file, and more than the noise."""
    told = of_sheets(Mesh(analysis=NOTHING, shift=0.02, error=alone, advised=3), 0.2, 0.15, 0.01)
    assert told is not None and told.explains == said
    above = of_sheets(Mesh(analysis=NOTHING, shift=0.02, error=alone, advised=3), 0.2, 0.15, 0.2)
    assert above is not None and not above.explains
    assert of_sheets(PLAIN, 0.2, 0.15, 0.01) is None
