"""One comparison has one number under one name: on the terminal, on the page, in result.json."""

import io
import json
import re
from pathlib import Path

import pytest
from rich.console import Console

from cvxupdate.report import correlate_files, correlate_summary
from cvxupdate.report.correlate_words import compared_verdict
from cvxupdate.study import correlate
from tests.cases.pages import assert_self_contained

USES = ("fit", "hold_out")
STRANGERS = Path(__file__).resolve().parents[1] / "strangers"
PER_CENT = re.compile(r"([+−-]?\d+(?:\.\d+)?) %")
BALANCE = re.compile(r"([\d.]+) % of the elastic forces")


@pytest.fixture(scope="module", params=["portal_exact", "portal_k2e5", "beam_modal"])
def told(request):
    """Terminal, text of the page, and JSON. The left foot of the portals (node 1) turns."""
    name = "mass.toml" if request.param == "beam_modal" else "problem.toml"
    compared = correlate(STRANGERS / request.param / name)
    console = Console(file=io.StringIO(), width=200)
    console.print(correlate_summary(compared, Path("out")))
    files, _ = correlate_files(compared)
    page = assert_self_contained(files["report.html"])
    return request.param, console.file.getvalue(), page.text, json.loads(files["result.json"])


def test_every_per_cent_of_the_terminal_stands_on_the_page(told):
    _, terminal, page, _ = told
    said = set(PER_CENT.findall(terminal))
    assert said and not {value for value in said if value not in page}


def test_one_figure_says_how_much_is_out_of_balance(told):
    """The portals said 56 % on the terminal (shapes as measured) and 2028 % on the page (shapes on
    four modes below most of their frequencies): smoothing is taken only where it helps."""
    _, terminal, page, result = told
    (shapes,) = result["correlation"]["shapes"]
    level = 100.0 * shapes["correlation"]["element_balance"]["imbalance"]
    figures = {float(value) for value in BALANCE.findall(terminal + page)}
    assert figures == {round(level)} and level < 100.0


def test_the_balance_points_to_the_foot(told):
    """Element 1 stands on the foot that turns; smoothed, the shapes pointed to the beam."""
    name, _, page, _ = told
    if name == "beam_modal":
        pytest.skip("the lump of the beam is no change of an element")
    assert "e1 alone explains" in page and "is a hint at most" in page


def test_large_ratios_are_said_as_multiples(told):
    """Not "1382 %", "condition number inf" or "noise grows 754168091469753.2 times"."""
    name, _, page, _ = told
    statics = page[page.index("The static forces") :][:250]
    assert " times (" in statics and not re.search(r"\d{3,} %", statics)
    assert "number inf" not in page and not re.search(r"grows \d{5,}", page)
    assert ("is a mixture of the others" in page) == (name == "beam_modal")


def test_the_mean_error_is_that_of_the_modes_to_fit():
    """It is the figure of result.json; what was held out has its own, and is not mixed in."""
    compared = correlate(STRANGERS.parents[1] / "problems" / "concealed" / "o14" / "problem.toml")
    (headline,) = re.findall("4 measured modes.*", compared_verdict(compared).headline)
    fit, held = (compared.fit[k]["frequency_error_percent_mean"]["before"] for k in USES)
    assert f"paired with the model's: mean frequency error {fit:.2f} %" in headline
    assert f"1 measured mode held out: mean frequency error {held:.2f} %" in headline
