"""A body on a beam whose length is felt: said by points it is three of them, side by side."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.fe.build import build_model
from cvxupdate.fe.refinement import refined
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.physics.added_mass import lumps
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.study import open_problem
from tests.cases.elements import STEEL, chain, lines, toml

STEP, LENGTH, MASS, NODE = 0.06, 0.1, 0.15, 5
LINES = np.linspace(40.0, 1100.0, 200)
BAR = {"shape": "rectangle", "width": 0.012, "height": 0.02}


def problem(folder):
    """A free beam of ten elements."""
    at = [(STEP * k, 0.0, 0.0) for k in range(11)]
    model = lines("beam2d", at, chain(10), ["y", "rz"], BAR, STEEL)
    model["damping"] = {"kind": "structural", "eta": 0.01}
    path = folder / "problem.toml"
    path.write_text(
        f'diagnose = {{ physics = ["added_mass", "grounding_spring"] }}\nmodel = {toml(model)}\n',
        encoding="utf-8",
    )
    return open_problem(path)[:2]


def real(spec):
    """In parts of an eighth, with a body of `LENGTH` about node `NODE`; its second moment."""
    text = refined(spec.model, lambda b, r: 8, True).model
    fine = build_model(replace(spec, model=text, update=None))
    off = fine.xyz[:, 0] - STEP * (NODE - 1)
    under = np.flatnonzero(np.abs(off) <= LENGTH / 2.0)
    rows = [[fine.place[f"n{n}.y"]] for n in fine.node_ids[under]]
    body = lumps(fine, rows)
    share = np.full(len(rows), MASS / len(rows))
    body = replace(body, properties={**body.properties, "m": share})
    return replace(fine, blocks=(*fine.blocks, body)), MASS * float(np.mean(off[under] ** 2))


def measured(fine):
    rng = np.random.default_rng(7)
    sensors = (1, 3, 4, 6, 8, 11)
    for use, drive in (("fit", 1), ("hold-out", 9)):
        at = np.array([fine.place[f"n{n}.y"] for n in sensors])
        H = frequency_responses(fine, LINES, at, np.array([fine.place[f"n{drive}.y"]]))
        size = 0.01 * np.sqrt(np.mean(np.abs(H) ** 2, axis=0)) / np.sqrt(2.0)
        H = H + size * (rng.normal(size=H.shape) + 1j * rng.normal(size=H.shape))
        channels = tuple(Channel(n, "y", "displacement") for n in sensors)
        origin = Origin(use, use, use=use)
        driven = (Channel(drive, "y", "force"),)
        yield FrequencyResponse(origin, LINES, H, "displacement", channels, driven)


def test_a_body_has_its_mass_and_its_second_moment(tmp_path) -> None:
    spec, model = problem(tmp_path)
    fine, second = real(spec)
    found = diagnose_problem(spec, model, list(measured(fine)))
    (finding,) = found.findings
    assert finding.physics == "added_mass" and finding.place.nodes == (NODE,)
    # the beam's mass takes up a hundredth of its size, within its own scatter
    assert finding.parameters["m"] == pytest.approx(MASS, rel=0.04)
    radius = np.sqrt(finding.parameters["J"] / finding.parameters["m"])
    assert radius == pytest.approx(np.sqrt(second / MASS), rel=0.2)  # to second order in its size
    assert "spread over its surroundings (radius of gyration" in finding.says
    assert found.updated is not None and found.updated.text.count("added mass at node") == 3
