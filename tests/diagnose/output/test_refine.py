"""The diagnosed model on a finer mesh: numbers kept, the same structure, and the error that the
evidence states."""

from __future__ import annotations

import itertools
import re
import tomllib
from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.cli import app
from cvxupdate.diagnose.output.refine import finer, finer_file
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import check_problem, load_problem
from cvxupdate.study import correlate, diagnose
from tests.cases.cantilever import NODES, load, rows_of, text
from tests.cases.effects import PLATE, problem

EVERY = (0, 2, 4, 6, 8, 10, 12)  # nodes of a rough mesh of the same bar


def rough(content: str) -> str:
    """The bar of `text` on every second node, with their numbers."""
    kept = re.sub(
        r"nodes = \[\{.*?\}\]\n",
        "nodes = [" + ", ".join(f"{{ id = {i + 1}, x = {NODES[i]:.6g} }}" for i in EVERY) + "]\n",
        content,
        count=1,
    )
    rows = ", ".join(
        f'{{ id = {k + 1}, nodes = [{a + 1}, {b + 1}], group = "bar" }}'
        for k, (a, b) in enumerate(itertools.pairwise(EVERY))
    )
    return re.sub(r"rows = \[\{ id = 1, nodes = .*?\]\n", f"rows = [{rows}]\n", kept, count=1)


def lump(m: float) -> str:
    return f'[[model.elements]]\ntype = "mass"\nrows = [{{ id = 90, nodes = [9], m = {m} }}]'


@pytest.fixture(scope="module")
def told(tmp_path_factory):
    """A rough bar diagnosed from four frequencies of a fine one with a lump, and its files."""
    folder = tmp_path_factory.mktemp("rough")
    _, real = load(folder, text(extra=lump(0.3)))
    f = model_modes(real, 4).frequencies[:4]
    spec, _ = load(folder, rough(text(rows_of(f))))
    found = diagnose(spec.path)
    out = folder / "out"
    with pytest.raises(SystemExit) as end:
        app(["diagnose", str(spec.path), "--out", str(out), "--json"])
    assert end.value.code == 0
    return found, out / "updated"


def test_the_finer_file_is_the_same_structure_with_its_numbers(told):
    found, folder = told
    before, after = (
        tomllib.loads((folder / name).read_text(encoding="utf-8"))["model"]
        for name in ("problem.toml", "refined.toml")
    )
    assert found.findings[0].physics == "added_mass" and found.findings[0].place.nodes == (9,)
    assert check_problem(folder / "refined.toml") == ()
    assert after["nodes"][: len(before["nodes"])] == before["nodes"]
    old = {r["id"]: r for b in before["elements"] for r in b["rows"]}
    new = {r["id"]: r for b in after["elements"] for r in b["rows"]}
    assert set(old) < set(new) and min(set(new) - set(old)) > max(old)
    assert all(
        new[i]["nodes"][0] == r["nodes"][0]
        and {k: v for k, v in new[i].items() if k != "nodes"}
        == {k: v for k, v in r.items() if k != "nodes"}
        for i, r in old.items()
    )
    masses = [
        build_model(load_problem(folder / name)).total_mass()
        for name in ("problem.toml", "refined.toml")
    ]
    assert masses[1] == pytest.approx(masses[0], rel=1e-12)


def test_the_evidence_states_what_correlate_says_of_both(told):
    found, folder = told
    said = [
        correlate(folder / name).fit["fit"]["frequency_error_percent_mean"]["after"]
        for name in ("problem.toml", "refined.toml")
    ]
    line = next(e for e in found.evidence if "refined.toml" in e)
    assert all(f"{x:.3g} % of the frequencies" in line for x in said)
    assert said[1] < 0.7 * said[0]
    assert said[1] == pytest.approx(
        found.metrics["fit"]["frequency_error_percent_mean"]["after"], abs=0.05
    ), "what was diagnosed, the mesh taken out"


def test_no_finer_file_where_the_mesh_is_fine(tmp_path):
    _, real = load(tmp_path, text(extra=lump(0.3)))
    spec, _ = load(tmp_path, text(rows_of(model_modes(real, 3).frequencies[:3])))
    found = diagnose(spec.path)
    assert (
        found.updated is not None
        and found.refined is None
        and not any("refined.toml" in e for e in found.evidence)
    )


def test_nodes_between_are_held_where_all_are_and_plates_are_left_alone(tmp_path):
    """A plane frame in space, every node held out of its plane by number: the finer one has the
    same lowest frequencies and no mode out of it."""
    wide = text().replace(
        'dofs = ["z", "ry"]\nnodes = [{', 'dofs = ["y", "z", "ry", "rz"]\nnodes = [{'
    )
    held = (
        wide + f'[[model.supports]]\nnodes = {list(range(2, len(NODES) + 1))}\ndofs = ["y", "rz"]\n'
    )
    held = held.replace(
        'nodes = [1]\ndofs = ["z", "ry"]', 'nodes = [1]\ndofs = ["y", "z", "ry", "rz"]'
    )
    spec, model = load(tmp_path, held)
    divided = finer(spec)
    assert divided is not None
    _, fine = load(tmp_path, finer_file(divided).text)
    assert fine.size == 2 * model.size
    np.testing.assert_allclose(
        model_modes(fine, 5).frequencies[:5], model_modes(model, 5).frequencies[:5], rtol=2e-3
    )
    plate = problem(tmp_path, PLATE)
    both = (*spec.model.elements, *plate.model.elements)
    for elements in (plate.model.elements, both):
        mixed = replace(spec, model=spec.model.model_copy(update={"elements": elements}))
        assert finer(mixed) is None
