"""What ``diagnose`` prints on a terminal."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cvxupdate.report.diagnosis_client import rivals_of, untested
from cvxupdate.report.diagnosis_words import (
    capital,
    fit_rows,
    values_words,
    verdict_words,
)
from cvxupdate.report.numbers import seconds

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis

TONES = {"good": "bold green", "fair": "bold yellow", "bad": "bold red"}


def diagnosis_text(found: Diagnosis, folder: Path) -> RenderableType:
    """Verdict sentence, findings with figures, fit before and after, files."""
    tone, meaning = verdict_words(found)
    parts: list[RenderableType] = [
        Text(found.title or found.problem, style="bold"),
        Text(found.says, style=TONES[tone]),
    ]
    for f in found.findings:
        values = ", ".join(
            f"{name} = {value}"
            for name, value in values_words(f.parameters, f.deviations, f.physics, f.place.dof)
        )
        parts.append(Text(f"  {capital(f.title)}: {values}; confidence {100 * f.confidence:.0f} %"))
        parts += [
            Text(f"    cannot be told from: {title}", style="dim") for title in f.alternatives[:4]
        ]
        parts += [Text(f"    not ruled out: {title}", style="dim") for title in f.unlikelier[:4]]
    parts += [
        Text(f"  explained about as well by: {line}", style="dim") for line in rivals_of(found)[:4]
    ]
    rows = fit_rows(found)
    if rows:
        table = Table(box=box.SIMPLE_HEAD, pad_edge=False)
        table.add_column("error of the model", no_wrap=True)
        table.add_column("before", justify="right", no_wrap=True)
        after = "after" if found.findings else "usual scatter fitted"
        table.add_column(after, justify="right", no_wrap=True)
        for row in rows:
            table.add_row(*row)
        parts.append(table)
    if untested(found):
        parts.append(Text(untested(found), style="yellow"))
    parts.append(Text(f"{meaning} ({found.verdict}), {seconds(found.time)}", style="dim"))
    where = f"Report: {folder / 'report.html'}\nData:   {folder / 'diagnosis.json'}"
    if found.updated is not None:
        where += f"\nModel:  {folder / 'updated' / 'problem.toml'}"
    if found.refined is not None:
        where += f"\n        {folder / 'updated' / 'refined.toml'} (finer mesh)"
    parts.append(Text(where, style="dim", no_wrap=True, overflow="ignore"))
    return Group(*parts)
