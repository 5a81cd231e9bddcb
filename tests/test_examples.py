"""Every example is a script, a test and a figure: each finds what it says, and leaves a figure in
the folder it was given. What the documents claim, and Structure A, on which some of it rests."""

import doctest
import importlib.util
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import cvxupdate
from cvxupdate.fe.modes import model_modes
from validation.studies import structure_a_mesh as mesh

ROOT = Path(__file__).resolve().parents[1]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


PUBLIC = (
    "check",
    "correlate",
    "diagnose",
    "identify",
    "inspect",
    "plan",
    "run",
    "solvers",
    "update",
)
"""The functions of the package that are commands."""


def load(name):
    """An example as a module."""
    spec = importlib.util.spec_from_file_location(
        f"example_{name}", ROOT / "examples" / f"{name}.py"
    )
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def check_plate(updated):
    assert updated.status == "converged"


def check_mass(found):
    (finding,) = found.findings
    assert finding.physics == "added_mass" and finding.place.nodes == (6,)
    assert finding.parameters["m"] == pytest.approx(0.12, rel=0.03)


def check_compared(compared):
    assert len(compared.modes) == 3 and compared.fit["fit"]["mac_min"]["after"] > 0.9
    assert max(m.model / m.measured for m in compared.modes) > 1.01  # the foot is softer


def check_modes(both):
    found, true = both
    for m, f in zip(found.sets[0].modes, true, strict=True):
        assert abs(m.frequency - f) < 4 * m.frequency_std + 1e-3 and m.damping < 0.012


def check_plan(found):
    assert len(found.sensors[0].labels) == 6 and len(found.parameters) == 2
    assert all(0.0 < d < 0.05 for d in found.lines[0].deviations)


def check_matrices(updated):
    assert updated.status == "converged"
    for q, true in zip(updated.parameters, (-0.1, 0.0, 0.1), strict=True):
        assert abs(q.p - true) < 4 * q.p_std < 0.02


CHECKS = {
    "compare_before_updating": check_compared,
    "find_a_mass": check_mass,
    "modes_from_a_record": check_modes,
    "plan_a_test": check_plan,
    "update_a_plate": check_plate,
    "update_own_matrices": check_matrices,
}


def test_every_command_has_an_example():
    assert {p.stem for p in EXAMPLES} == set(CHECKS)
    texts = [p.read_text(encoding="utf-8") for p in EXAMPLES]
    for name in PUBLIC:
        assert any(f"cvxupdate.{name}(" in text for text in texts), name


@pytest.mark.parametrize("name", CHECKS)
@pytest.mark.slow
def test_finds_what_it_says_and_leaves_a_figure(name, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    out = tmp_path / "results"
    CHECKS[name](load(name).main(str(out)))
    assert capsys.readouterr().out.strip()
    figures = [p for p in out.rglob("*") if p.suffix in (".png", ".svg")]
    assert figures and all(p.stat().st_size > 2000 for p in figures)
    assert not (tmp_path / "out").exists(), "the folder given was not honoured"


@pytest.mark.slow
def test_as_a_script(tmp_path):
    done = subprocess.run(
        [sys.executable, str(ROOT / "examples" / "plan_a_test.py"), "here"],
        capture_output=True,
        text=True,
        cwd=tmp_path,
        timeout=300,
        env={**os.environ, "MPLBACKEND": "agg"},
    )
    assert done.returncode == 0, done.stderr
    assert "sensors n" in done.stdout and (tmp_path / "here" / "places.png").is_file()


@pytest.mark.slow
def test_plate_answer_settles_with_the_mesh():
    results = mesh.study(((14, 10), (20, 14), (28, 20)))
    found = {size: mesh.values(*result) for size, result in results.items()}
    finest, (updated, _) = found[28, 20], results[28, 20]
    for q in updated.parameters:
        coarse, middle = (
            abs(found[14, 10][q.name] - finest[q.name]),
            abs(found[20, 14][q.name] - finest[q.name]),
        )
        assert middle < 0.5 * coarse, q.name  # second order: a third of it
        assert middle < 0.5 * q.standard_deviation, q.name
    for size, (updated, _) in results.items():
        assert updated.status == "converged"
        assert updated.fit["fit"]["frequency_error_percent_mean"]["after"] < 0.4, size


@pytest.mark.slow
@pytest.mark.parametrize(
    ("nx", "ny", "known"),
    [
        (7, 5, (27.4, 29.9, 63.4, 66.3, 79.7, 90.9, 118.0, 132.4, 168.7, 181.6)),
        (28, 20, (27.3, 29.8, 63.3, 66.1, 79.3, 91.0, 118.1, 133.6, 167.3, 180.1)),
    ],
)
def test_nominal_plate_agrees_with_an_independent_calculation(nx, ny, known, tmp_path):
    _, model, _ = cvxupdate.open_problem(mesh.write_problem(tmp_path, nx, ny, [], 1.0))
    modes = model_modes(model, len(known), model.zero())
    assert modes.rigid == 3
    assert modes.frequencies[3:13] == pytest.approx(known, abs=0.0501)


def test_table_9_1_is_paired_by_family(tmp_path):
    """The mode numbers of the problem's own files are those of the families of mode shapes."""
    import csv

    path = mesh.write_problem(tmp_path, 28, 20, [], 1.0)
    for name in ("modes_fit.csv", "modes_hold_out.csv"):
        mine, theirs = (
            list(csv.DictReader((folder / name).read_text(encoding="utf-8").splitlines()))
            for folder in (path.parent, mesh.PROBLEM)
        )
        assert [r["mode"] for r in mine] == [r["mode"] for r in theirs]


def test_tables_of_structure_a_are_the_printed_ones():
    """Frequencies and damping of the recordings are those of Table 9.1; its printed errors follow
    from its printed frequencies."""
    import csv

    folder = ROOT / "problems" / "structure_a"
    printed, fit, held = (
        [
            {k: float(v) for k, v in row.items()}
            for row in csv.DictReader((folder / name).read_text(encoding="utf-8").splitlines())
        ]
        for name in ("table_9_1.csv", "modes_fit.csv", "modes_hold_out.csv")
    )
    assert [r["frequency"] for r in fit + held] == [r["measured"] for r in printed]
    for mine, row in zip(fit + held, printed, strict=True):
        assert mine["damping"] == pytest.approx(
            row["damping_percent"] / 200
        )  # a loss factor in per cent
        assert row["relative_error_percent"] == pytest.approx(
            100 * abs(row["model"] / row["measured"] - 1), abs=0.1
        )  # one decimal, rounded or cut (259.1 Hz)


# ── what the documents claim
# ─────────────────────────────────────────────────────────────────────────────────────


def text_of(name):
    return (ROOT / name).read_text(encoding="utf-8")


@pytest.fixture(scope="module")
def plate():
    return cvxupdate.run(ROOT / "problems" / "structure_a" / "problem.toml")


def test_python_of_the_first_page(monkeypatch):
    monkeypatch.chdir(ROOT)
    blocks = re.findall(r"```python\n(.*?)```", text_of("docs/index.md"), flags=re.S)
    assert blocks
    for block in blocks:
        found = doctest.DocTestParser().get_doctest(block, {}, "index.md", "index.md", 0)
        assert len(found.examples) > 3
        said = []
        doctest.DocTestRunner(optionflags=doctest.ELLIPSIS).run(found, out=said.append)
        assert not said, "".join(said)


def test_problem_file_of_the_first_page(tmp_path):
    (block,) = re.findall(r"```toml\n(.*?)```", text_of("docs/index.md"), flags=re.S)
    path = tmp_path / "problem.toml"
    path.write_text(block, encoding="utf-8")
    updated = cvxupdate.run(path)
    assert (
        updated.status == "converged"
        and updated.fit["fit"]["frequency_error_percent_max"]["after"] < 0.2
    )
    assert not any(q.at_bound for q in updated.parameters)


@pytest.mark.parametrize("document", ["docs/evidence.md", "problems/structure_a/source.md"])
def test_figures_of_the_plate_are_those_of_a_run(document, plate):
    text = (ROOT / document).read_text(encoding="utf-8")
    fit, held = (plate.fit[key]["frequency_error_percent_mean"] for key in ("fit", "hold_out"))
    if document == "docs/evidence.md":
        assert f"| 18 fitted modes | {fit['before']:.2f} % | {fit['after']:.2f} % |" in text
        assert f"| 2 held-out modes | {held['before']:.2f} % | {held['after']:.2f} % |" in text
        for q in plate.parameters[:4]:
            (row,) = re.findall(
                rf"\| {q.of},[^|]*\| 1 \| ([\d.]+) ± ([\d.]+) \| 0.75 … 1.25 \|", text
            )
            assert float(row[0]) == pytest.approx(q.after, abs=0.0051) and float(
                row[1]
            ) == pytest.approx(q.standard_deviation, abs=0.0051)
        assert (
            f"{plate.parameters[4].after / 1e3:.2f} ± "
            f"{plate.parameters[4].standard_deviation / 1e3:.2f} kN/m" in text
        )
    else:
        assert f"{fit['before']:.2f} → {fit['after']:.2f} | {held['after']:.2f} |" in text
        assert f"| middle of the short edges | {fit['after']:.2f} (" in text


def test_links_of_the_documents_lead_somewhere():
    for name in ("README.md", "CONTRIBUTING.md", "CHANGELOG.md"):
        text = (ROOT / name).read_text(encoding="utf-8")
        for link in re.findall(r"\]\((?!https?:)([^)#]+)", text):
            assert (ROOT / link).exists(), (name, link)
        for path in re.findall(r"`((?:cvxupdate|tests|examples|problems|docs)/[\w/.-]+)`", text):
            assert (ROOT / path).exists(), (name, path)


def test_readme_names_every_command():
    from typer.main import get_command

    from cvxupdate.cli import app

    for command in get_command(app).commands:
        assert f"cvxupdate {command} " in text_of("README.md"), command
