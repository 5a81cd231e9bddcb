"""What the laboratory of motions says of all its cases."""

from __future__ import annotations

import json
from xml.etree import ElementTree

from validation.calibrate import picture
from validation.motions.__main__ import main, nonlinear_words


def row(concealed: str | None, told: str | None, confidence: float) -> dict:
    effects = [] if concealed is None else [{"physics": concealed}]
    findings = [] if told is None else [{"physics": told, "confidence": confidence}]
    return {"effects": effects, "findings": findings}


def test_nonlinear_words_count_where_nothing_of_the_kind_is_there() -> None:
    rows = [
        row(None, None, 0.0),
        row(None, "clearance", 0.99),
        row("added_mass", "dry_friction", 0.4),
        row("added_mass", "added_mass", 0.99),
        row("clearance", "clearance", 0.99),
        row("dry_friction", "cubic_stiffness", 0.99),
    ]
    found = nonlinear_words(rows)
    assert (found["told"], found["linear"]) == (1, 4)
    assert 0.0 < found["interval"][0] < 0.25 < found["interval"][1]


def test_the_command_draws_confidence_against_hit_rate(tmp_path, capsys) -> None:
    truth = {"accept": ["consistent"], "family": "chain", "recording": "null", "drift": False}
    said = {"verdict": "consistent", "says": "", "evidence": [], "findings": []}
    case = {"seed": 0, "state": "", "seconds": 1.0, "cpu": 1.0, "why": ""}
    (tmp_path / "cases").mkdir()
    text = json.dumps({**case, "said": said, "truth": truth})
    (tmp_path / "cases" / "0.json").write_text(text, encoding="utf-8")
    assert main(["--seed", "0", "--count", "1", "--keep", "--out", str(tmp_path)]) == 0
    shown = capsys.readouterr().out
    assert "Nonlinear words on linear structures: 0 of 1" in shown
    drawn = ElementTree.parse(tmp_path / "development.svg").getroot()
    assert drawn.tag.endswith("svg") and "confidence stated" in "".join(drawn.itertext())


def test_a_picture_has_its_points() -> None:
    bins = [{"confidence": 0.9, "rate": 0.8, "interval": (0.6, 0.95), "hits": 8, "of": 10}]
    assert "8 of 10" in picture({"reliability": bins})
