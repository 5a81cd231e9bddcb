"""What a client reads: plain words, and what was measured in one ink on every page."""

from __future__ import annotations

import ast
import re
from pathlib import Path

from cvxupdate.report import diagnosis_client
from tests.report.test_diagnosis import FOUND, page

REPORT = Path(diagnosis_client.__file__).parent
OURS = ("placebo", "weighted misfit", "per row", "nan", "None", "words for physics")


def _named(call: ast.Call, key: str) -> str:
    return next((ast.unparse(k.value) for k in call.keywords if k.arg == key), "")


def test_what_was_measured_has_the_same_ink_on_every_page() -> None:
    """Every curve that is called measured is drawn in the ink of the page."""
    curves = [
        call
        for path in sorted(REPORT.glob("*.py"))
        if "plots" not in path.name  # figures for programs have no page
        for call in ast.walk(ast.parse(path.read_text(encoding="utf-8")))
        if isinstance(call, ast.Call) and _named(call, "label") == "'measured'"
    ]
    assert len(curves) >= 4
    assert {_named(call, "color") for call in curves} == {"INK"}


def test_the_page_of_a_diagnosis_has_a_glossary_and_no_words_of_ours() -> None:
    text = re.sub(r"<(style|svg).*?</\1>|<[^>]+>", " ", page(FOUND), flags=re.DOTALL)
    assert "What the words mean" in text
    for word, says in diagnosis_client.GLOSSARY:
        assert word and len(says) > 20
    for word in OURS:
        assert not re.search(rf"\b{word}\b", text), word


def test_evidence_is_said_in_plain_words() -> None:
    """Where the sentences are made: a page may show any of them."""
    package = REPORT.parent
    for path in (package / "diagnose").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                said = "".join(v.value for v in node.values if isinstance(v, ast.Constant))
                assert not re.search(r"Placebo:|weighted misfit|per row\b", said), path
