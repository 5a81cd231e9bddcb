"""Tables of modes: a support is found where it stands however stiff, repeats are held out, and nothing is found where nothing is."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from cvxupdate.spec import load_problem
from cvxupdate.study import correlate, diagnose, run

NODES = np.cumsum([0.0, 0.03, 0.034, 0.028, 0.031, 0.036, 0.03, 0.033, 0.029, 0.035, 0.032, 0.03, 0.034])  # unequal spans
BAR = """
title = "Cantilever"
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.steel]
E = {E}
nu = 0.3
rho = 7850.0
[model.sections.strip]
shape = "rectangle"
width = 0.04
height = 0.006
[[model.elements]]
type = "beam3d"
material = "steel"
section = "strip"
rows = [{elements}]
{extra}
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
[[recordings]]
kind = "modes"
rows = [{rows}]
{hold}
"""


def text(rows="{ frequency = 10.0 }", extra="", E="207e9", hold=""):
    nodes = ", ".join(f"{{ id = {i + 1}, x = {x:.6g} }}" for i, x in enumerate(NODES))
    elements = ", ".join(f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "bar" }}' for i in range(len(NODES) - 1))
    return BAR.format(nodes=nodes, elements=elements, rows=rows, extra=extra, E=E, hold=hold)


def load(folder, content):
    path = folder / "problem.toml"
    path.write_text(content, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


def rows_of(f):
    return ", ".join(f"{{ frequency = {v:.8g}, frequency_std = {1e-3 * v:.3g}, mode = {i + 1} }}" for i, v in enumerate(f))


def problem(folder, extra, modes=4, again=True):
    """The bare cantilever against the frequencies of one with ``extra`` elements and 0.7 % less E; the same modes, measured again, held out."""
    _, real = load(folder, text(extra=extra, E="205.5e9"))
    f = model_modes(real, modes).frequencies[:modes]
    rng = np.random.default_rng(3)
    hold = f'[[recordings]]\nkind = "modes"\nuse = "hold-out"\nrows = [{rows_of(f * (1 + 3e-4 * rng.standard_normal(modes)))}]\n' if again else ""
    return load(folder, text(rows_of(f * (1 + 3e-4 * rng.standard_normal(modes))), hold=hold))


def diagnosed(folder, extra, modes=4, again=True):
    """The diagnosis of `problem`."""
    spec, model = problem(folder, extra, modes, again)
    return diagnose_problem(spec, model, load_recordings(spec)).to_json()


@pytest.mark.parametrize(("node", "k"), [(5, 3e4), (8, 2e6), (10, 1e9)])
def test_a_support_is_found_from_soft_to_rigid(tmp_path, node, k):
    spring = f'[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{{ id = 90, nodes = [{node}], k = {k} }}]'
    said = diagnosed(tmp_path, spring)
    first = said["findings"][0]
    assert first["physics"] == "grounding_spring" and first["location"]["nodes"] == [node] and first["location"]["dof"] == "z"
    if k < 1e9:  # a rigid support's stiffness has no upper limit
        assert first["parameters"]["k"] == pytest.approx(k, rel=0.25)
    assert said["fit"]["hold_out"]["after"] < 0.1 * said["fit"]["hold_out"]["before"], "repeats of fitted modes are scored"


def test_a_heavy_lump_is_found(tmp_path):
    """Twice the mass of the bar's last third: far from small."""
    said = diagnosed(tmp_path, '[[model.elements]]\ntype = "mass"\nrows = [{ id = 90, nodes = [11], m = 0.35 }]')
    first = said["findings"][0]
    assert first["physics"] == "added_mass" and first["location"]["nodes"] == [11] and first["parameters"]["m"] == pytest.approx(0.35, rel=0.1)


def test_nothing_is_found_in_the_same_bar(tmp_path):
    said = diagnosed(tmp_path, "")
    assert said["verdict"] == "consistent" and not said["findings"]


def test_what_is_diagnosed_can_be_compared_and_updated(tmp_path):
    """`diagnose`, then `correlate` and `run` of the file that it writes: the held-out repeats of the modes go with them all the way."""
    spec, _ = problem(tmp_path, '[[model.elements]]\ntype = "mass"\nrows = [{ id = 90, nodes = [11], m = 0.35 }]')
    found = diagnose(spec.path)
    written = tmp_path / "updated.toml"
    written.write_text(found.updated, encoding="utf-8")
    for use in ("fit", "hold_out"):
        before = correlate(spec.path).fit[use]["frequency_error_percent_mean"]["after"]
        after = correlate(written).fit[use]["frequency_error_percent_mean"]["after"]
        assert before == pytest.approx(found.metrics[use]["frequency_error_percent_mean"]["before"], rel=1e-9)
        assert after == pytest.approx(found.metrics[use]["frequency_error_percent_mean"]["after"], rel=1e-6)
    updated = run(written)
    assert updated.fit["hold_out"]["frequency_error_percent_mean"]["after"] < 0.1
