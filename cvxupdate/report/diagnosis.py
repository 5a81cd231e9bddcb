"""The files and the summary of ``diagnose``; plotting and templates load on first use."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from rich.console import RenderableType

    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.spec import Spec

__all__ = ["diagnosis_files", "diagnosis_summary"]


def diagnosis_files(
    found: Diagnosis, spec: Spec, folder: Path = Path()
) -> tuple[dict[str, str], str]:
    """{"diagnosis.json": text, "report.html": text, "updated/problem.toml": text,
    "updated/refined.toml": text} (the last two where a model was found, and where a finer mesh
    makes a difference to it), and the JSON text by itself.

    ``spec`` is drawn; ``folder`` is where the files will lie.
    """
    from cvxupdate.report.as_json import dumps, plain
    from cvxupdate.report.diagnosis_page import diagnosis_page

    text = dumps(plain(found.to_json()))
    files = {"diagnosis.json": text, "report.html": diagnosis_page(found, spec)}
    models = {"problem": found.updated, "refined": found.refined}
    files |= {
        f"updated/{name}.toml": written.text_in(folder / "updated")
        for name, written in models.items()
        if written is not None
    }
    return files, text


def diagnosis_summary(found: Diagnosis, folder: Path) -> RenderableType:
    """What ``diagnose`` prints on a terminal: verdict sentence, findings, fit before and after,
    where the files lie."""
    from cvxupdate.report.diagnosis_text import diagnosis_text

    return diagnosis_text(found, folder)
