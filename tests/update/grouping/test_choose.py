"""Macro elements that the recordings choose, on FE2 of chapter 8.3."""

from __future__ import annotations

import json
from pathlib import Path

import numpy as np
import pytest

from cvxupdate import study
from cvxupdate.errors import InputError
from cvxupdate.report.as_json import run_data
from cvxupdate.report.run_page import run_page
from validation import make_physical as made

BEAM = Path(__file__).resolve().parents[3] / "problems" / "physical" / "beam" / "problem.toml"
STRUCTURE_B = BEAM.parents[2] / "structure_b"


def problem(tmp_path: Path, extra: str) -> Path:
    """FE2 with second moments, whose row has ``extra`` keys."""
    text = BEAM.read_text().replace('each = "element" }', f'each = "element"{extra} }}')
    text = text.replace("../../bay", str(BEAM.parents[2] / "bay"))
    text = text.replace('"frf.npz"', f'"{BEAM.parent / "frf.npz"}"')
    path = tmp_path / "problem.toml"
    path.write_text(text)
    return path


def test_the_eight_thick_elements_are_selected_and_the_rest_is_one(tmp_path: Path) -> None:
    """8.3: the selection alone says which elements are wrong; the page shows it."""
    updated = study.run(problem(tmp_path, ', grouping = "subset"'))
    (found,) = updated.groupings
    assert sorted(e for g in found.elements if len(g) == 1 for e in g) == sorted(made.bay.THICK)
    assert len(found.elements) == len(made.bay.THICK) + 1
    p = {q.name: q.p for q in updated.parameters}
    assert set(p) == set(found.names)
    for name, elements in zip(found.names, found.elements, strict=True):
        assert np.isclose(p[name], 1 / 1.3 - 1 if len(elements) == 1 else 0.0, atol=1e-8)
    assert "Macro elements that the recordings chose" in run_page(updated)
    data = json.loads(json.dumps(run_data(updated)))
    assert data["groupings"][0]["single"] == 20 and "geometry" not in data


def test_total_variation_keeps_every_edge(tmp_path: Path) -> None:
    """Patches never join a thick element with one that is not."""
    updated = study.run(problem(tmp_path, ', grouping = "total-variation"'))
    (found,) = updated.groupings
    thick = set(made.bay.THICK)
    assert len(found.elements) < 20
    assert all(set(g) <= thick or not set(g) & thick for g in found.elements)


@pytest.mark.parametrize(
    ("extra", "says"),
    [
        (", resolution = 0.2", "nothing to act on"),
        (', grouping = "subset", resolution = 0.2', "nothing to act on"),
    ],
)
def test_what_has_nothing_to_choose_from_is_refused(tmp_path: Path, extra: str, says: str) -> None:
    with pytest.raises(InputError, match=says):
        study.check(problem(tmp_path, extra))


def test_grouping_without_each_is_refused(tmp_path: Path) -> None:
    path = problem(tmp_path, "")
    path.write_text(path.read_text().replace('each = "element"', 'grouping = "clusters"'))
    with pytest.raises(InputError, match="one parameter only to choose from"):
        study.check(path)


def test_frequencies_of_a_real_plate_show_its_strips() -> None:
    """Structure B (Table 9.3): groups are symmetric about both middle lines, for frequencies do not
    tell sides, and the middle lines, where strips were welded on, are the thickest."""
    updated = study.run(STRUCTURE_B / "grouped.toml")
    (found,) = updated.groupings
    value = {q.name: q.p for q in updated.parameters}
    group, p = np.zeros(140, dtype=int), np.zeros(140)
    for k, (name, elements) in enumerate(zip(found.names, found.elements, strict=True)):
        group[[e - 1 for e in elements]], p[[e - 1 for e in elements]] = k, value[name]
    grid, thick = group.reshape(10, 14), p.reshape(10, 14)
    assert np.array_equal(grid, grid[::-1]) and np.array_equal(grid, grid[:, ::-1])
    assert len(found.names) < 13
    strips = np.zeros((10, 14), dtype=bool)
    strips[:, 6:8] = strips[4:6, 4:10] = True
    assert thick[strips].min() > 0.3 and np.median(thick[~strips]) < 0.2
    error = updated.fit["fit"]["frequency_error_percent_mean"]
    assert error["before"] > 15.0 and error["after"] < 1.0


def test_the_thick_elements_under_noise(tmp_path: Path) -> None:
    """As without noise: the eight, and one of all the others."""
    noise = 0.05
    path = problem(tmp_path, ', grouping = "subset"')
    H = made.bay.receptance(made.bay.build("X1"), made.BEAM_LINES, made.ALL, [made.FORCE])
    noisy = made.bay.noisy(H, noise, 3)
    made.bay.save_frf(tmp_path / "frf.npz", made.BEAM_LINES, noisy, made.ALL, [made.FORCE])
    text = path.read_text().replace(f'"{BEAM.parent / "frf.npz"}"', '"frf.npz"')
    path.write_text(text.replace("trust_radius", f"noise = {noise / np.sqrt(3):.4g}\ntrust_radius"))
    updated = study.run(path)
    (found,) = updated.groupings
    assert sorted(e for g in found.elements if len(g) == 1 for e in g) == sorted(made.bay.THICK)
    p = {q.name: q.p for q in updated.parameters}
    for name, elements in zip(found.names, found.elements, strict=True):
        assert abs(p[name] - (1 / 1.3 - 1 if len(elements) == 1 else 0.0)) < 0.3 * noise + 0.001
