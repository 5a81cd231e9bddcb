"""`run` with method direct: matrices of one formula beside the others, no certificate, and the
reasons where it cannot be done."""

import io
import json
import re
from dataclasses import replace

import numpy as np
import pytest
from rich.console import Console

from cvxupdate.direct.methods import NAMES
from cvxupdate.errors import InputError
from cvxupdate.report import run_files
from cvxupdate.report.summary import run_text
from cvxupdate.report.words import certificate_sentence, verdict
from cvxupdate.study import correlate, run

MODEL = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }, { id = 4, x = 3.0 }]

[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 9.0e5 }, { id = 2, nodes = [1, 2], k = 6.0e5 },
        { id = 3, nodes = [2, 3], k = 8.0e5 }, { id = 4, nodes = [3, 4], k = 5.0e5 }]

[[model.elements]]
type = "mass"
rows = [{ id = 11, nodes = [1], m = 2.0 }, { id = 12, nodes = [2], m = 1.5 },
        { id = 13, nodes = [3], m = 1.0 }, { id = 14, nodes = [4], m = 1.7 }]
"""
UPDATE = '\n[update]\nmethod = "direct"\ndirect = "{}"\n'


def recording(use, modes, channels):
    """Modes of the chain whose second spring is a fifth stiffer."""
    k = np.array([9.0, 7.2, 8.0, 5.0]) * 1e5
    K = np.diag(np.append(k[:-1] + k[1:], k[-1])) - np.diag(k[1:], 1) - np.diag(k[1:], -1)
    m = np.array([2.0, 1.5, 1.0, 1.7])
    values, vectors = np.linalg.eigh(K / np.sqrt(np.outer(m, m)))
    vectors = vectors / np.sqrt(m)[:, None]
    rows = ", ".join(
        f"{{ frequency = {float(np.sqrt(values[i])) / (2 * np.pi)!r}, "
        f"shape = {[float(vectors[c, i]) for c in channels]} }}"
        for i in modes
    )
    names = ", ".join(
        f'{{ column = {i}, quantity = "displacement", node = {c + 1}, dof = "x" }}'
        for i, c in enumerate(channels)
    )
    return (
        f'\n[[recordings]]\nkind = "modes"\nuse = "{use}"\nchannels = [{names}]\nrows = [{rows}]\n'
    )


@pytest.fixture
def problem(tmp_path):
    def write(method, channels=(0, 1, 2, 3), fit=(0, 1), held=(2,)):
        text = MODEL + recording("fit", fit, channels) + recording("hold-out", held, channels)
        path = tmp_path / "problem.toml"
        path.write_text(text + UPDATE.format(method), encoding="utf-8")
        return path

    return write


def test_the_convex_update_beside_it_finds_the_spring(problem):
    """The modes of a chain with one stiffer spring: no new entries, definite matrices, and what was
    not fitted comes right; the formula leaves it as it was."""
    path = problem("berman-nagy")
    rows = {d.name: d for d in run(path).direct}
    convex, formula = rows["convex"], rows["berman-nagy"]
    assert convex.new_entries == 0 and formula.new_entries > 0
    assert convex.mass_min > 0.0 and convex.stiffness_min > 0.0
    assert convex.hold_out_error < 0.2 * formula.hold_out_error
    assert convex.fit_error < 0.1  # per cent: a prior of 20 % each holds it back
    assert sum(part for _, part in convex.by_node) == pytest.approx(1.0)
    # with the file's own parameters nothing holds it back
    own = '\nparameters = [{ elements = "all", of = "stiffness", each = "element" }]\n'
    path.write_text(path.read_text(encoding="utf-8") + own, encoding="utf-8")
    found = run(path)
    convex = next(d for d in found.direct if d.name == "convex")
    assert convex.fit_error < 1e-6 and convex.hold_out_error < 1e-6
    assert {node for node, part in convex.by_node if part > 1e-6} == {1, 2}
    assert "converged" in convex.says[0]
    page = run_files(found)[0]["report.html"]
    assert "Beside the constrained convex update" in page
    assert "What Constrained convex update, method ceam changes where" in page


def test_frequencies_alone_stand_beside_their_convex_update(problem):
    path = problem("pole-placement")
    bare = re.sub(r", shape = \[[^]]*\]", "", path.read_text(encoding="utf-8"))
    path.write_text(re.sub(r"channels = \[[^]]*\]\n", "", bare), encoding="utf-8")
    rows = {d.name: d for d in run(path).direct}
    assert rows["convex"].new_entries == 0
    assert rows["convex"].title.endswith("method frequencies")
    assert rows["convex"].fit_error < 0.5


def test_fitted_modes_are_reproduced_and_the_faults_are_said(problem):
    found = run(problem("berman-nagy"))
    fit = found.fit["fit"]["frequency_error_percent_mean"]
    assert fit["before"] > 1.0 and fit["after"] < 1e-6
    assert found.method == "direct: berman-nagy" and found.parameters == ()
    assert "nothing to certify" in certificate_sentence(found)
    assert any("connectivity is lost" in line for line in found.caveats)
    assert [d.name for d in found.direct] == [*NAMES, "convex"]
    assert all(d.why or (d.new_entries is not None and d.where) for d in found.direct)
    held = found.fit["hold_out"]["frequency_error_percent_mean"]
    # a formula knows nothing of the spring: what was not fitted stays as wrong as it was
    assert held["after"] > 0.2 * held["before"]


def test_incomplete_shapes_are_expanded(problem):
    found = run(problem("baruch", channels=(0, 2, 3)))
    assert found.fit["fit"]["frequency_error_percent_mean"]["after"] < 1e-6
    assert "expanded to all 4 DOFs by null-space" in found.notes[0]


def test_the_page_and_the_data(problem, tmp_path):
    files, text = run_files(run(problem("wei")), tmp_path)
    page = files["report.html"]
    assert "Direct methods on the same modes" in page and "Minas and Inman" in page
    assert "nothing to certify" in page and "Most change at" in page
    data = json.loads(text)
    assert data["certificate"]["none"] is True and len(data["direct"]) == len(NAMES) + 1


def test_what_a_formula_loses_is_no_matter_of_parameters(problem, tmp_path):
    """The advice for a hold-out that got worse is that for a formula; no empty table is printed."""
    found = run(problem("caesar-link", fit=(0, 2), held=(1,)))
    worse = {"mac_mean": {"before": 0.9, "after": 0.5}}
    found = replace(found, fit={"fit": found.fit["fit"], "hold_out": worse})
    text = " ".join(verdict(found).sentences)
    assert "got worse" in text and "A direct method reproduces the fitted modes" in text
    assert "fewer parameters" not in text
    assert found.caveats[0].endswith(": the connectivity is lost.")
    console = Console(width=200, file=io.StringIO())
    console.print(run_text(found, tmp_path))
    said = console.file.getvalue()
    assert "direct: caesar-link, a formula evaluated once" in said and "parameter " not in said


def test_the_matrices_are_a_problem_of_their_own(problem, tmp_path):
    """What is written has the modes that were assigned, also to `correlate`."""
    files, _ = run_files(run(problem("berman-nagy")), tmp_path)
    for name in ("updated/problem.toml", "updated/stiffness.mtx", "updated/mass.mtx"):
        path = tmp_path / name
        path.parent.mkdir(exist_ok=True)
        path.write_text(files[name], encoding="utf-8")
    again = correlate(tmp_path / "updated" / "problem.toml")
    assert again.fit["fit"]["frequency_error_percent_max"]["after"] < 1e-6
    assert again.fit["fit"]["mac_min"]["after"] > 1 - 1e-9


def test_what_is_not_symmetric_is_no_model(problem, tmp_path):
    found = run(problem("minas-inman"))
    files, _ = run_files(found, tmp_path)
    assert "updated/problem.toml" not in files
    assert any("not symmetric" in note for note in found.notes)


def test_frequencies_alone_are_placed(tmp_path):
    """Without shapes pole placement still moves what was measured, and nothing else."""
    text = (
        '\n[[recordings]]\nkind = "modes"\nrows = [{ frequency = 60.0, mode = 1 }, '
        "{ frequency = 130.0, mode = 2 }]\n"
        '\n[[recordings]]\nkind = "modes"\nuse = "hold-out"\n'
        "rows = [{ frequency = 170.0, mode = 3 }]\n"
    )
    path = tmp_path / "problem.toml"
    path.write_text(MODEL + text + UPDATE.format("pole-placement"), encoding="utf-8")
    found = run(path)
    assert found.fit["fit"]["frequency_error_percent_mean"]["after"] < 1e-9
    held = found.fit["hold_out"]["frequency_error_percent_mean"]
    assert held["after"] == pytest.approx(held["before"], rel=1e-9)
    assert [d.name for d in found.direct if not d.why] == [
        "pole-placement",
        "modal-control",
        "convex",
    ]
    alone = found.direct[-2]
    assert alone.fit_error < 1e-9 and alone.hold_out_error == pytest.approx(held["before"])
    assert "the model's own shapes" in found.notes[0]


def test_frequencies_alone_are_not_enough(tmp_path):
    path = tmp_path / "problem.toml"
    text = '\n[[recordings]]\nkind = "modes"\nrows = [{ frequency = 40.0 }]\n'
    path.write_text(MODEL + text + UPDATE.format("baruch"), encoding="utf-8")
    with pytest.raises(InputError, match="needs measured mode shapes"):
        run(path)
