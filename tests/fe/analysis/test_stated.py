"""[model] `refine`: one model on finer parts for every command, and a word where it is wanted."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

import cvxupdate
from cvxupdate.correlate.plausible.mesh import PER_HALF_WAVE, mesh_doubts
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.errors import InputError
from cvxupdate.fe.analysis import as_stated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.recordings.load import load_recordings
from cvxupdate.spec import load_problem, read_text
from cvxupdate.study import check, correlate, run
from tests.update.test_refine import problem

KEY = "frequency_error_percent_mean"


def stated(folder, **more):
    """The rod of `tests.update.test_refine` with `refine` in [model]."""
    path = problem(folder, **more)
    text = path.read_text(encoding="utf-8").replace("[model]\n", "[model]\nrefine = 8\n", 1)
    path.write_text(text, encoding="utf-8")
    return path


@pytest.fixture
def measured(tmp_path):
    """The second frequency of the rod of 210 GPa, on a fine mesh."""
    spec = load_problem(problem(tmp_path, E=210e9))
    fine = refined(spec.model, lambda block, row: 40).model
    return float(model_modes(build_model(replace(spec, model=fine, update=None)), 2).frequencies[1])


def test_run_and_correlate_take_one_model(tmp_path, measured):
    """`correlate` of the true rod finds no error; `run` from a wrong one finds the true one, and
    `correlate` of what `run` wrote gives the figure that `run` gave."""
    assert correlate(stated(tmp_path, E=210e9, f=measured)).fit["fit"][KEY]["after"] < 0.05
    done = run(stated(tmp_path, f=measured))
    assert done.parameters[0].after == pytest.approx(210e9, rel=2e-3)
    assert done.written is not None and "refine = 8" in done.written.text
    (tmp_path / "again.toml").write_text(done.written.text, encoding="utf-8")
    again = correlate(tmp_path / "again.toml").fit["fit"][KEY]["after"]
    assert again == pytest.approx(done.fit["fit"][KEY]["after"], abs=1e-6)
    plain = correlate(problem(tmp_path, E=210e9, f=measured)).fit["fit"][KEY]["after"]
    assert plain > 1.0, "what the file's own mesh would say"


def test_every_door_opens_on_the_same_model(tmp_path):
    path = stated(tmp_path)
    fine = cvxupdate.open_problem(path)[1]
    plain = build_model(load_problem(path))
    assert fine.size > plain.size
    f = model_modes(fine, 2).frequencies[:2]
    assert check(path)["frequencies"][:2] == pytest.approx(f, rel=1e-9)


def test_ceam_keeps_the_matrices_of_the_file(tmp_path):
    with pytest.raises(InputError, match=r"model\.refine: ceam updates the matrices of the file"):
        run(stated(tmp_path, method="ceam"))


def test_what_thin_theory_leaves_out_is_of_finer_parts_only(tmp_path):
    path = problem(tmp_path)
    text = path.read_text(encoding="utf-8").replace("[model]\n", "[model]\nsolid = true\n", 1)
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InputError, match=r"model\.solid: is of finer parts only. Add refine = 8"):
        run(path)


def test_a_diagnosed_model_says_on_which_parts_it_was_diagnosed(tmp_path):
    spec = load_problem(problem(tmp_path))
    model = build_model(replace(spec, update=None))
    file = problem_file(spec, Updated(model, model.zero(), refine=8))
    other = read_text(file.text, spec.path)
    assert other.model.refine == 8 and other.model.solid
    assert as_stated(other, build_model(other)).size > model.size


def test_sheets_may_be_solids_in_part(tmp_path):
    """Of a thick sheet with either part of the theory of solids: stiffer than with both, softer
    than with none; what is written is read."""
    from tests.fe.analysis.test_solid import sheet as thick

    found = {}
    for word in ("false", '"sheared"', '"turning"', "true"):
        path = tmp_path / "sheet.toml"
        text = thick(4, 3, h=0.012).replace("[model]\n", f"[model]\nrefine = 4\nsolid = {word}\n")
        path.write_text(text, encoding="utf-8")
        spec = load_problem(path)
        model = as_stated(spec, build_model(spec))
        found[word] = model_modes(model, 8).flexible().frequencies[:5]
        written = problem_file(spec, Updated(model, model.zero(), refine=8, solid=spec.model.solid))
        assert read_text(written.text, spec.path).model.solid == spec.model.solid
    thin, lags, turns, both = found.values()
    for part in (lags, turns):
        assert np.all(thin > 1.0001 * part) and np.all(part > 1.0001 * both)
    lost = (thin - lags) + (thin - turns)
    np.testing.assert_allclose(thin - both, lost, rtol=0.05)


SHEET = """
[model]
dofs = ["z", "rx", "ry"]
{refine}
nodes = [{nodes}]
supports = [
  {{ nodes = {along}, dofs = ["z", "ry"] }}, {{ nodes = {across}, dofs = ["z", "rx"] }},
]
materials = {{ steel = {{ E = 210e9, nu = 0.3, rho = 7850.0 }} }}
sections = {{ sheet = {{ shape = "plate", thickness = 0.003 }} }}
[[model.elements]]
type = "plate"
material = "steel"
section = "sheet"
rows = [{rows}]
[[recordings]]
kind = "modes"
rows = [{{ frequency = {f} }}]
"""
A, B = 0.6, 0.4


def sheet(folder, n, f, refine=""):
    """A simply supported sheet of n × n elements, and a frequency up to which it was measured."""
    ids = np.arange(1, (n + 1) ** 2 + 1).reshape(n + 1, n + 1)
    x, y = np.linspace(0.0, A, n + 1), np.linspace(0.0, B, n + 1)
    nodes = ", ".join(
        f"{{ id = {ids[j, i]}, x = {x[i]:.9g}, y = {y[j]:.9g} }}"
        for j in range(n + 1)
        for i in range(n + 1)
    )
    rows = ", ".join(
        f"{{ id = {1 + j * n + i}, nodes = [{ids[j, i]}, {ids[j, i + 1]}, {ids[j + 1, i + 1]}, "
        f"{ids[j + 1, i]}] }}"
        for j in range(n)
        for i in range(n)
    )
    along = sorted({*ids[0].tolist(), *ids[-1].tolist()})
    across = sorted({*ids[:, 0].tolist(), *ids[:, -1].tolist()})
    path = folder / "sheet.toml"
    path.write_text(
        SHEET.format(refine=refine, nodes=nodes, along=along, across=across, rows=rows, f=f),
        encoding="utf-8",
    )
    spec = load_problem(path)
    return spec, build_model(spec), load_recordings(spec)


@pytest.mark.parametrize(("m", "k"), [(2, 2), (3, 2)])
def test_a_mesh_of_sheets_is_doubted_where_it_shifts_what_was_measured(tmp_path, m, k):
    """By about as much as it does, by the closed form of a simply supported sheet; on finer parts
    nothing is doubted."""
    D = 210e9 * 0.003**3 / (12.0 * (1.0 - 0.3**2))
    i, j = np.meshgrid(np.arange(1, 20), np.arange(1, 20))
    every = np.pi / 2.0 * ((i / A) ** 2 + (j / B) ** 2) * np.sqrt(D / (7850.0 * 0.003))
    exact = float(every[k - 1, m - 1])
    below = np.sort(every[every <= 1.0001 * exact])
    for n in (6, 10, 24):
        opened = sheet(tmp_path, n, exact)
        f = model_modes(opened[1], len(below)).frequencies[: len(below)]
        shift = float(np.abs(f / below - 1.0).max())
        doubts = mesh_doubts(*opened)
        spans = 1.0 / (np.hypot(m / A, k / B) * A / n)
        assert bool(doubts) == (spans < PER_HALF_WAVE)
        if doubts:
            assert 0.3 < doubts[0].value / shift < 3.0 and "refine = 8" in doubts[0].says
            assert "spans 3 " not in doubts[0].says, "where it should span 3"
    assert mesh_doubts(*sheet(tmp_path, 5, exact, "refine = 8")) == ()
