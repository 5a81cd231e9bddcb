"""Two cables exchanged: it is said of the measurement, the structure is left alone, and the written
file takes it out."""

from __future__ import annotations

import tomllib
from dataclasses import replace

import pytest

from cvxupdate.diagnose import diagnose_problem


@pytest.mark.parametrize("pair", [(2, 4), (1, 2)])
def test_exchanged_channels_are_found(chain, lab, measure, pair):
    a, b = pair
    order = [{a: b, b: a}.get(n, n) - 1 for n in (1, 2, 3, 4)]
    recordings = [
        replace(r, H=r.H[:, order], variance=r.variance[:, order])
        for r in (measure(lab(), 4, seed=11), measure(lab(), 1, "hold-out", seed=12))
    ]
    found = diagnose_problem(*chain, recordings)
    (first,) = found.findings
    assert (
        found.verdict == "missing_physics"
        and first.physics == "sensor_fault"
        and first.place.nodes == pair
    )
    assert first.parameters["gain"] == pytest.approx(1.0, abs=0.05)
    assert f"the channels at node {a} (x) and at node {b} (x) are exchanged" in first.says
    assert all(found.fit[k]["after"] <= 0.2 * found.fit[k]["before"] for k in ("fit", "hold_out"))
    assert found.updated is not None
    model = tomllib.loads(found.updated.text)["model"]
    assert all(len(block["rows"]) == 4 for block in model["elements"])  # nothing was added
