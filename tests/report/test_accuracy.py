"""The section on how accurate recordings must be: its numbers obey chapter 5, its words follow from
its numbers."""

import dataclasses
import math
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.report import run_files
from cvxupdate.report.accuracy import sentences
from cvxupdate.study import run
from tests.cases.pages import assert_self_contained
from tests.cases.problems import written_whole

PROBLEMS = Path(__file__).resolve().parents[2] / "problems"


@pytest.fixture(scope="module")
def chain():
    return run(PROBLEMS / "chain10/noisy" / "problem.toml")


@pytest.fixture(scope="module")
def quieter(tmp_path_factory):
    """The same recording said to be ten times more accurate."""
    folder = tmp_path_factory.mktemp("quiet")
    path = folder / "problem.toml"
    text = written_whole(PROBLEMS / "chain10/noisy" / "problem.toml")
    old = next(line for line in text.splitlines() if line.startswith("noise = "))
    path.write_text(text.replace(old, f"noise = {float(old.split('=')[1]) / 10}"))
    return run(path)


def test_page_and_json_hold_it(chain):
    files, text = run_files(chain)
    page = assert_self_contained(files["report.html"])
    (a,) = chain.accuracy
    assert "How accurate the recordings must be" in page.text and '"accuracy"' in text
    for line in sentences(a):
        assert line.split(":")[0][:20] in page.text
    # responses, parameters, which of them the recordings fix together, convergence, accuracy
    assert page.tags.count("svg") == 5
    assert (
        "error component" in page.text
        and "system component" in page.text
        and "fitted lines" in page.text
    )


def test_methods_without_responses_have_no_such_section(updated):
    assert updated.accuracy == ()
    assert "How accurate" not in run_files(updated)[0]["report.html"]


def test_the_bearable_noise_is_where_the_components_meet(chain):
    (a,) = chain.accuracy
    bearable = a.noise * 10.0 ** (np.array(a.system) - np.array(a.error))
    assert np.allclose(a.bearable, bearable, rtol=1e-9)
    assert (
        set(a.fitted) <= set(a.frequency)
        and set(a.best) <= set(a.frequency)
        and len(a.best) <= len(a.fitted)
    )
    at = dict(zip(a.frequency, a.bearable, strict=True))
    assert np.median([at[f] for f in a.best]) > np.median(a.bearable)


def test_what_is_bearable_does_not_depend_on_the_noise(chain, quieter):
    (a,), (b,) = chain.accuracy, quieter.accuracy
    assert b.noise == pytest.approx(a.noise / 10, rel=1e-6)
    assert np.allclose(a.bearable, b.bearable, rtol=1e-9) and np.allclose(
        np.subtract(a.error, b.error), 1.0
    )
    assert b.spread == pytest.approx(a.spread / 10, rel=1e-6) and b.borne == pytest.approx(
        a.borne, rel=1e-6
    )
    assert np.allclose(a.radius, 10 * np.array(b.radius))


def test_the_expected_spread_is_that_of_draws(chain):
    """What is said before the update is about what the update finds: the median deviation of p at
    its end."""
    (a,) = chain.accuracy
    found = np.median([q.p_std for q in chain.parameters])
    assert found / 3 < a.spread < 3 * found


def test_words_follow_the_numbers(chain):
    (a,) = chain.accuracy
    text = " ".join(sentences(a))
    assert ("The noise is borne." in text) == (a.borne > a.noise)
    drowned = " ".join(sentences(dataclasses.replace(a, noise=2 * a.borne)))
    assert "drown: measure more accurately" in drowned
    open_ = " ".join(
        sentences(
            dataclasses.replace(
                a, spread=None, borne=None, stated=False, radius=(None,) * len(a.frequency)
            )
        )
    )
    assert (
        "undetermined whatever the noise" in open_
        and "an assumption" in open_
        and "(5.6)" not in open_
    )
    assert "quieter at every line" in " ".join(sentences(dataclasses.replace(a, noise=1e-12)))
    assert "noisier at every line" in " ".join(sentences(dataclasses.replace(a, noise=1e3)))
    assert math.isfinite(a.spread) and "(5.12)" in text and "(5.15)" in text and "(5.6)" in text
