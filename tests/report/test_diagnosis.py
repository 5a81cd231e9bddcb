"""The page of a diagnosis: first screen, proof, map; self-contained and escaped; and what is
written beside it."""

from __future__ import annotations

import io
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from markupsafe import escape
from rich.console import Console

from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.shown import Curve, ModeError, Shown, Spectrum
from cvxupdate.physics import told
from cvxupdate.physics.place import Place
from cvxupdate.report.diagnosis import diagnosis_files, diagnosis_summary
from cvxupdate.report.diagnosis_place import place_picture
from cvxupdate.report.diagnosis_places import sketch_of
from cvxupdate.spec import load_problem
from cvxupdate.spec.write import Written

SPEC = load_problem(Path(__file__).parents[2] / "problems" / "concealed" / "o05" / "problem.toml")
F = np.linspace(1.0, 300.0, 200)
CURVE = Curve(
    "run <2>",
    "hold-out",
    "n5.z",
    ("n3.z",),
    "acceleration",
    True,
    F,
    1 + F,
    2 + F,
    1.1 + F,
    np.full(200, 0.01),
)
SHOWN = Shown(
    (CURVE, replace(CURVE, use="fit", sensor="n7.z")),
    (Spectrum("hold-out", F, 1 + F, F / 10, np.full(200, 0.01)),),
    (),
    {1: 0.9, 5: 0.4, 99: 0.3},
    {1: 0.7, 2: 0.1},
)
FINDING = Finding(
    "grounding_spring",
    Place(nodes=(1,), dof="ry"),
    "a support that <gives way> at node 1 (ry)",
    {"k": 3498.1},
    {"k": 1.3},
    {"k": 0.4},
    0.97,
    1.0,
    (told("joint_flexibility", Place(nodes=(1,), elements=(1,))),),
    "The support gives way & <turns>.",
)
FOUND = Diagnosis(
    "o05",
    "Bar <no. 3>",
    "o05/problem.toml",
    "missing_physics",
    "The support gives way & <turns>.",
    (FINDING,),
    (
        {
            "physics": "grounding_spring",
            "title": "a spring to ground at node 1 (ry)",
            "location": {"nodes": [1], "elements": [], "groups": [], "dof": "ry"},
            "score": 0.01,
            "hold_out_score": 0.02,
        },
    ),
    {
        "fit": {"before": 1.5, "nuisance": 0.8, "after": 0.01, "noise": 0.005},
        "hold_out": {"before": 1.4, "nuisance": 0.9, "after": 0.02},
    },
    {"fit": {"frf_error": {"before": 1.5, "after": 0.01}}},
    ("One line of <evidence>.",),
    3.2,
    {},
    Written({"model": {"dofs": ["x"]}}, ("the model",)),
    SHOWN,
)


def page(found: Diagnosis) -> str:
    return diagnosis_files(found, SPEC)[0]["report.html"]


def captions(text: str) -> list[str]:
    return re.findall(r'aria-label="([^"]*)"', text)


def test_the_first_screen_has_sentence_place_and_held_out_overlay() -> None:
    text = page(FOUND)
    first = text[: text.index("<h2>")]
    assert str(escape(FOUND.says)) in first and first.count("<svg") == 2
    drawn = captions(first)
    assert (
        drawn[1].startswith("The structure")
        and "Acceleration at node 5 (z) under a force at node 3 (z), from a recording that was "
        "never fitted"
        in drawn[2]
    )


def test_a_finding_tested_on_nothing_is_said_to_be_untested() -> None:
    """On the page and on the terminal, without a nan; not where something was held out, nor where
    nothing was found."""
    said = "Nothing was held out, so what was found is untested on recordings that were not fitted."
    fit = {"fit": FOUND.fit["fit"], "hold_out": {"before": None, "nuisance": None, "after": None}}
    alone = replace(
        FOUND,
        fit=fit,
        shown=replace(SHOWN, curves=(replace(CURVE, use="fit"),), spectra=()),
    )
    for bare in (alone, replace(alone, fit={"fit": fit["fit"]})):
        text = page(bare)
        assert said in text[: text.index("<h2>")] and "never fitted" not in text
        assert not re.search(r"\bnan\b", re.sub(r"<[^>]*>", " ", text))
        console = Console(width=400, file=io.StringIO())
        console.print(diagnosis_summary(bare, Path("out")))
        assert said in str(console.file.getvalue())  # type: ignore[attr-defined]
    assert said not in page(FOUND)
    assert said not in page(replace(alone, findings=(), verdict="consistent"))


def test_below_stand_proof_map_remains_and_other_channels() -> None:
    text = page(FOUND)
    drawn = " ".join(captions(text[text.index("<h2>") :]))
    for word in (
        "Error of the model before and after",
        "Fraction of the mismatch",
        "leaves unexplained at each frequency",
        "Measured responses",
    ):
        assert word in drawn
    assert "cvxupdate correlate updated/problem.toml" in text and "cannot tell" in text
    assert "A joint that gives way at the joint of element 1 at node 1" in text
    assert "A spring to ground at node 1 (ry)" in text
    assert (
        "<script" not in text
        and "http" not in text.replace("http://www.w3.org", "")
        and "<turns>" not in text
        and "<gives way>" not in text
        and "<evidence>" not in text
    )
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))


def test_keys_of_the_file_reach_the_page() -> None:
    """What nuisance parameters leave has a bar, what was only screened its explained fraction."""
    screened = {
        "physics": "added_mass",
        "title": "an added mass at node 7",
        "location": {"nodes": [7], "elements": [], "groups": []},
        "score": None,
        "hold_out_score": None,
        "explained_fraction": 0.57,
    }
    text = page(replace(FOUND, candidates=(*FOUND.candidates, screened)))
    assert "with the usual scatter" in text and "An added mass at node 7" in text
    assert "57 %" in text


@pytest.mark.parametrize(
    ("change", "figures"),
    [
        ({"shown": None}, 2),
        ({"shown": None, "findings": (), "verdict": "consistent"}, 2),
        ({"shown": Shown()}, 2),
        (
            {
                "shown": Shown(
                    modes=(
                        ModeError(12.0, "fit", 0.1, 0.001),
                        ModeError(80.0, "hold-out", 0.07, np.nan),
                    )
                )
            },
            3,
        ),
    ],
)
def test_what_is_not_there_is_left_out(change: dict[str, Any], figures: int) -> None:
    """Without curves the bars come to the first screen; a table of modes has its own figure
    there."""
    text = page(replace(FOUND, **change))
    assert text.count("<svg") == figures
    plain = re.sub(r"<style>.*?</style>", "", text, flags=re.DOTALL)
    assert not re.search(r"\bnan\b", plain, flags=re.IGNORECASE)


def test_the_model_is_a_file_beside_the_page() -> None:
    files, text = diagnosis_files(FOUND, SPEC)
    assert (
        files["updated/problem.toml"] == FOUND.updated.text
        and '"shown"' not in text
        and '"updated"' not in text
    )
    assert "updated/problem.toml" not in diagnosis_files(replace(FOUND, updated=None), SPEC)[0]


def test_the_summary_names_it() -> None:
    text = io.StringIO()
    Console(width=100, file=text).print(diagnosis_summary(FOUND, Path("out/o05")))
    assert "out/o05/updated/problem.toml" in text.getvalue()


def test_the_command_writes_the_model_and_takes_an_old_one_away(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """A folder never holds the page of one diagnosis and the model of another."""
    import sys

    import cvxupdate.study
    from cvxupdate import cli

    for found, there in (
        (FOUND, True),
        (replace(FOUND, findings=(), verdict="consistent", updated=None), False),
    ):
        monkeypatch.setattr(cvxupdate.study, "diagnose", lambda *_, result=found: result)
        monkeypatch.setattr(
            sys, "argv", ["cvxupdate", "diagnose", str(SPEC.path), "--out", str(tmp_path / "out")]
        )
        with pytest.raises(SystemExit) as stop:
            cli.main()
        assert stop.value.code == 0
        assert (tmp_path / "out" / "updated" / "problem.toml").exists() == there
        assert sorted(p.name for p in (tmp_path / "out").iterdir() if p.is_file()) == [
            "diagnosis.json",
            "report.html",
        ]


ONE_NODE = """[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 1000.0 }]
[[model.elements]]
type = "mass"
rows = [{ id = 2, nodes = [1], m = 1.0 }]
"""


def test_a_model_of_one_node_is_not_drawn(tmp_path: Path) -> None:
    path = tmp_path / "problem.toml"
    path.write_text(ONE_NODE)
    assert sketch_of(load_problem(path)) is None


def test_a_place_that_is_not_drawn_has_no_mark_and_takes_none_of_another() -> None:
    """An element that an effect added is not in the file; the whole structure has no node."""
    nowhere = replace(FINDING, place=Place(elements=(901, 902)), title="added elements")
    whole = replace(FINDING, place=Place(), title="the whole structure")
    found = replace(FOUND, findings=(whole, nowhere, FINDING))
    with_all, alone = page(found), page(FOUND)

    def rings(text: str) -> int:
        figure = text[text.index('aria-label="The structure') :]
        return figure[: figure.index("</svg>")].count("<use ")

    assert rings(with_all) == rings(alone)


def test_many_names_above_a_flat_structure_leave_it_room() -> None:
    """A bar with twelve findings at one node: their names were higher than the picture."""
    many = [replace(FINDING, title=f"effect number {k}") for k in range(12)]
    picture = place_picture(replace(FOUND, findings=tuple(many)), SPEC)
    assert picture is not None and all(f"number {k}" in picture for k in range(12))
    shape = re.search(r'viewBox="0 0 ([\d.]+) ([\d.]+)"', picture)
    assert shape is not None and float(shape[2]) > 12 * 13.0
