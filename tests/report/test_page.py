"""report.html: one self-contained page that says what the result says, with nothing from outside
let through."""

import dataclasses
import io
import re
from pathlib import Path

import pytest
from rich.console import Console

from cvxupdate.report import figures, run_files, run_summary, solvers_files, solvers_summary
from cvxupdate.report.svg import VARIABLES
from cvxupdate.study import run, solvers
from tests.cases.pages import Page, assert_self_contained

PLATE = Path(__file__).resolve().parents[2] / "problems" / "structure_a" / "problem.toml"


def page_of(updated):
    return run_files(updated)[0]["report.html"]


@pytest.fixture(scope="module")
def html(updated):
    return page_of(updated)


@pytest.fixture(scope="module")
def plate():
    return run(PLATE)


def test_one_file_with_nothing_from_outside(html):
    page = assert_self_contained(html)
    assert html.startswith("<!doctype html>") and len(html.encode()) < 500_000
    assert page.tags.count("svg") == 4 and page.tags.count("text") > 20, (
        "text of the figures stays text"
    )
    assert (
        'name="viewport"' in html
        and "@media print" in html
        and "prefers-color-scheme: dark" in html
    )


def test_figures_take_the_colours_of_the_page(html):
    assert not [c for c in VARIABLES if c in html]
    used = set(re.findall(r"var\(--([a-z]+)\)", html))
    defined = set(re.findall(r"--([a-z]+):", html))
    assert used <= defined


def test_says_what_was_asked_and_what_came_of_it(html, updated):
    text = Page(html).text
    for words in (
        "Three masses",
        "a drawing",
        "first test: 2 modes, fitted",
        "second test: 1 mode, held out",
        "frequencies, convex steps solved by CLARABEL",
        "e1.k",
        "floor.m",
        "cvxupdate run",
        "converged after",
        "Farkas" if updated.status == "infeasible" else "The last convex step is solved",
    ):
        assert words in text, words
    mean = updated.fit["fit"]["frequency_error_percent_mean"]
    assert f"from {mean['before']:.2f} % to {mean['after']:.2f} %" in text
    assert updated.undetermined and updated.undetermined[0]["says"] in text


def test_tables_hold_every_mode_and_parameter(html, updated):
    text = Page(html).text
    for m in updated.modes:
        assert f"{m.before:.3f}" in text and f"{m.after:.3f}" in text
    assert (
        "group floor (2 elements)" in text
        and "kN/m" in text
        and "280 … 520" in text.replace("−", "-")
    )


def test_names_cannot_break_out_of_the_page(hostile):
    html = page_of(hostile)
    page = assert_self_contained(html)
    assert "<script" not in html and '<script>alert("x")</script>' in page.text


def test_infeasible_page_names_conflict_and_ways_out(infeasible):
    html = page_of(infeasible)
    text = assert_self_contained(html).text
    assert (
        "The constraints contradict one another" in text
        and "Clauses in conflict" in text
        and "Ways out" in text
    )
    assert all(clause in text for clause in infeasible.conflict)
    assert "After" not in text and "filled: after" not in text.lower(), (
        "nothing moved, so there is no after"
    )
    assert "Farkas" in text


def test_page_of_the_plate(plate):
    html = page_of(plate)
    page = assert_self_contained(html)
    assert len(html.encode()) < 500_000
    assert (
        "over 18 fitted modes" in page.text
        and "over 2 modes held out" in page.text
        and "4 → 3" in page.text
    )
    assert "The recordings state no deviations" in page.text
    assert plate.judgement is not None and plate.correlations is not None
    on, all_of = plate.judgement.on_bounds, len(plate.parameters)
    assert "What stands beside the fit" in page.text and f"{on} of {all_of}" in page.text
    assert "Size of the correlation of each two parameters" in page.text
    first, second, r = plate.correlations.strongest[0]
    assert f"{r:.3f}".replace("-", "−") in page.text and first in page.text and second in page.text


def test_same_result_same_page(updated):
    assert page_of(updated) == page_of(updated)


def test_a_result_without_modes_or_history_still_has_a_page(updated):
    bare = dataclasses.replace(
        updated,
        modes=(),
        history=(),
        parameters=(),
        fit={"fit": {}, "hold_out": {}},
        undetermined=(),
        correlations=None,
        model={},
        source="",
        title="",
    )
    page = assert_self_contained(page_of(bare))
    assert "svg" not in page.tags and "The update converged." in page.text


def test_what_was_tested_on_nothing_is_said_to_be_untested(updated, infeasible):
    """On the page and on the terminal, without a nan; not where something was held out, nor where
    nothing was fitted."""
    alone = dataclasses.replace(
        updated,
        fit={"fit": updated.fit["fit"]},
        modes=[m for m in updated.modes if m.use == "fit"],
    )
    said = "Nothing was held out, so the update is untested on recordings that were not fitted."
    text = Page(page_of(alone)).text
    assert said in text and "nan" not in text.lower().split()
    console = Console(width=400, file=io.StringIO())
    console.print(run_summary(alone, Path("out")))
    assert said in console.file.getvalue()
    assert "Nothing was held out" not in page_of(updated) + page_of(infeasible)


def test_worse_hold_out_is_said(updated):
    fit = {
        "fit": {"mac_mean": {"before": 0.8, "after": 0.9}},
        "hold_out": {"mac_mean": {"before": 0.8, "after": 0.7}},
    }
    assert "the hold-out got worse" in Page(page_of(dataclasses.replace(updated, fit=fit))).text
    assert "Use fewer parameters" in page_of(dataclasses.replace(updated, fit=fit))
    better = {"fit": fit["fit"], "hold_out": {"mac_mean": {"before": 0.8, "after": 0.85}}}
    assert "got worse" not in page_of(dataclasses.replace(updated, fit=better))


def test_many_parameters_keep_the_page_small(updated):
    many = tuple(
        dataclasses.replace(updated.parameters[0], name=f"e{k}.k", p=1e-3 * k) for k in range(1000)
    )
    html = page_of(dataclasses.replace(updated, parameters=many))
    assert (
        len(html.encode()) < 500_000
        and "e999.k" in html
        and ">e299.k<" not in html
        and "700 that moved least" in html
    )


def test_error_bars_have_the_sign_and_size_of_the_errors(updated):
    """The bars of the figure, read back from its paths, are as long as the errors."""
    svg = figures.mode_errors(updated.modes, True, False)
    drawn = re.findall(
        r'<path d="M ([\d.]+) [\d.]+ \nL ([\d.]+)[^"]*" clip-path="[^"]*" '
        r'style="fill: var\(--(\w+)\)',
        svg,
    )
    fitted, held = (tuple(m for m in updated.modes if m.use == use) for use in ("fit", "hold-out"))
    errors = {
        "before": [m.before / m.measured - 1 for m in (*fitted, *held)],
        "after": [m.after / m.measured - 1 for m in fitted],
        "held": [m.after / m.measured - 1 for m in held],
    }
    lengths = {
        name: [float(b) - float(a) for a, b, colour in drawn if colour == name] for name in errors
    }
    scale = lengths["before"][0] / errors["before"][0]
    assert scale > 0
    for name, values in errors.items():
        assert lengths[name] == pytest.approx([scale * e for e in values], rel=1e-3, abs=0.01), name


def test_summary_is_short_and_names_the_files(updated, infeasible, tmp_path):
    for result, words in (
        (updated, ("e1.k", "mean frequency error", "report.html")),
        (infeasible, ("total mass set to 20 kg", "contradict")),
    ):
        console = Console(width=80, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
        console.print(run_summary(result, tmp_path), crop=False)
        text = console.export_text()
        assert (
            len(text.splitlines()) < 32
            and all(w in text for w in words)
            and str(tmp_path / "report.html") in text
        )


def test_solvers_page_and_summary(updated, infeasible, tmp_path):
    spec, rows, spread = solvers(updated.path)
    page = assert_self_contained(
        solvers_files(spec.name, spec.title, rows, spread)[0]["report.html"]
    )
    assert all(r.solver in page.text for r in rows) and "agree within" in page.text
    console = Console(width=100, record=True, file=open("/dev/null", "w"))  # noqa: SIM115
    console.print(solvers_summary(spec.name, rows, spread, tmp_path))
    assert "agree on the objective" in console.export_text()
    spec, rows, spread = solvers(infeasible.path)
    page = assert_self_contained(
        solvers_files(spec.name, spec.title, rows, spread)[0]["report.html"]
    )
    assert "no solver can find a step" in page.text


def test_indefinite_matrices_are_said(updated):
    assert "it is positive definite" in Page(page_of(updated)).text
    for name in ("mass", "stiffness"):
        bad = dataclasses.replace(updated, model={**updated.model, f"{name}_eigenvalue_min": -1e-3})
        assert f"no structure: the {name} matrix" in Page(page_of(bad)).text
    unknown = dataclasses.replace(updated, model={**updated.model, "mass_eigenvalue_min": None})
    assert "The updated m" not in Page(page_of(unknown)).text
