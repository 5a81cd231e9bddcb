"""What a client reads: plain words, and what was measured in one ink on every page."""

from __future__ import annotations

import ast
import io
import re
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from cvxupdate.diagnose.shown import ModeError, Shown
from cvxupdate.report import diagnosis_client
from cvxupdate.report.diagnosis import diagnosis_summary
from tests.report.test_diagnosis import FINDING, FOUND, page

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


def test_what_cannot_be_told_has_its_section_whatever_there_is() -> None:
    """One plain sentence where nothing is; whom the confidence is shared with, where somebody
    is."""
    alone = replace(FINDING, equivalent=())
    rival = {"rivals": ["wrong numbers of whole groups, which finds the same"]}
    nothing = "othing else that was tried explains these recordings as well with as few unknowns."
    for findings, details, said, title in (
        ((FINDING,), {}, "these recordings cannot tell it from", "it"),
        ((alone,), {}, f"<p>N{nothing}", "it"),
        ((FINDING, alone), {}, f": n{nothing}", "them"),
        ((alone,), rival, "Wrong numbers of whole groups", "it"),
    ):
        found = replace(FOUND, findings=findings, details=details)
        text = page(found)
        assert f"<h2>What cannot be told from {title}</h2>" in text and said in text
        assert (nothing in text) == (alone in findings and not details)
        console = Console(width=400, file=io.StringIO())
        console.print(diagnosis_summary(found, Path("out")))
        shown = str(console.file.getvalue())  # type: ignore[attr-defined]
        assert ("explained about as well by: wrong numbers" in shown) == bool(details)
    assert "What cannot be told" not in page(replace(FOUND, findings=(), verdict="consistent"))
    assert "Nuisance parameters" in dict(diagnosis_client.GLOSSARY)


def test_sentences_that_measure_errors_otherwise_say_so() -> None:
    """Beside responses; a table of modes has one measure."""
    says = "Errors in these sentences are means over the channels, each by itself"
    text = page(FOUND)
    assert text.index("What the recordings say") < text.index(says) < text.index("One line of")
    assert "noise alone: means over the channels" in text
    modes = Shown(modes=(ModeError(12.0, "fit", 0.1, 0.001),))
    assert "means over the channels" not in page(replace(FOUND, shown=modes))


def test_what_was_tried_and_not_listed_says_what_it_explains() -> None:
    fractions = {
        "grounding_spring": 0.9,
        "axial_preload": 0.12,
        "gyroscopic": 0.001,
        "clearance": None,
    }
    text = page(replace(FOUND, details={"tried": fractions}))
    assert (
        "that each explains at best: axial preload (12 %), gyroscopic (less than 1 %), clearance "
        "(too little to be refitted)." in text
    )
    assert "not listed" not in page(FOUND)


def test_evidence_is_said_in_plain_words() -> None:
    """Where the sentences are made: a page may show any of them."""
    package = REPORT.parent
    for path in (package / "diagnose").rglob("*.py"):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.JoinedStr):
                said = "".join(v.value for v in node.values if isinstance(v, ast.Constant))
                assert not re.search(r"Placebo:|weighted misfit|per row\b", said), path
