"""What the commands print on a terminal."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

from rich import box
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from cvxupdate.report.correlate_words import compared_verdict
from cvxupdate.report.numbers import (
    NOTHING,
    count,
    fixed,
    number,
    power,
    prefix_of,
    seconds,
    signed,
    with_deviation,
)
from cvxupdate.report.parameter_figures import strongest
from cvxupdate.report.words import METRICS, conflict_sentence, verdict

if TYPE_CHECKING:
    from cvxupdate.convex import SolverRow
    from cvxupdate.correlate.result import Compared
    from cvxupdate.update.result import ParameterResult, Updated

TONES = {"good": "bold green", "fair": "bold yellow", "bad": "bold red"}
MOST = 12
MOST_PAIRS = 40


def run_text(updated: Updated, folder: Path) -> RenderableType:
    """Verdict, fit, parameters, files; for an infeasible problem the conflict and the ways out."""
    says = verdict(updated)
    parts: list[RenderableType] = [
        Text(updated.title or updated.problem, style="bold"),
        Text(says.headline, style=TONES[says.tone]),
    ]
    parts += [Text(line) for line in says.sentences]
    if updated.conflict:
        parts.append(Text(conflict_sentence(updated)))
        parts += [Text(f"  - {line}") for line in updated.conflict[:MOST]] + [
            Text(f"  > {line}") for line in updated.relaxation[:3]
        ]
    else:
        parts.append(_fit(updated))
        if updated.parameters:
            parts.append(_parameters(updated))
    parts.append(
        Text(
            f"{updated.status}, {_steps(updated)}, {seconds(updated.time)}",
            style="dim",
        )
    )
    parts.append(_where(folder))
    return Group(*parts)


def correlate_text(compared: Compared, folder: Path) -> RenderableType:
    """Verdict, pairs of modes, responses, notes, files."""
    says = compared_verdict(compared)
    parts: list[RenderableType] = [
        Text(compared.title or compared.problem, style="bold"),
        Text(says.headline, style=TONES[says.tone]),
    ]
    parts += [Text(line) for line in says.sentences]
    if compared.modes:
        several = len({m.recording for m in compared.modes}) > 1
        names = ("recording",) if several else ()
        table = _table("", *names, "measured", "mode of the model", "model", "error", "MAC")
        last = ""
        for m in compared.modes[:MOST_PAIRS]:
            own = (m.recording if m.recording != last else "",) if several else ()
            last = m.recording
            table.add_row(
                *own,
                f"{m.measured:.5g} Hz{'' if m.use == 'fit' else ', held out'}",
                str(m.mode),
                f"{m.model:.5g} Hz",
                f"{signed(m.error_percent)} %",
                fixed(m.mac, 3),
            )
        parts.append(table)
    if compared.frfs:
        table = _table("", "frequency responses", "error", "lowest FRAC")
        for f in compared.frfs[:MOST_PAIRS]:
            finite = f.correlation.frac[f.correlation.frac == f.correlation.frac]
            least = float(finite.min()) if finite.size else None
            table.add_row(
                f.recording + ("" if f.use == "fit" else ", held out"),
                number(f.correlation.total, 3),
                fixed(least),
            )
        parts.append(table)
    parts += [Text(f"Note: {line}") for line in compared.notes[:MOST]]
    parts += [Text(f"nothing was changed, {seconds(compared.time)}", style="dim"), _where(folder)]
    return Group(*parts)


def solvers_text(
    name: str, rows: Sequence[SolverRow], spread: float, folder: Path
) -> RenderableType:
    """A row for each solver, and how far they agree."""
    table = _table(
        f"{name}: one step, every solver", "solver", "status", "objective", "residual", "time"
    )
    for row in rows:
        optimal = row.status == "optimal"
        table.add_row(
            row.solver,
            row.status,
            f"{row.objective:.9g}" if row.objective == row.objective else NOTHING,
            power(row.certificate.worst) if optimal and row.certificate.worst > 0 else NOTHING,
            seconds(row.seconds) if row.seconds > 0 else NOTHING,
        )
    solved = sum(r.status == "optimal" for r in rows)
    if solved > 1:
        line = Text(
            f"{solved} solvers agree on the objective within "
            f"{power(spread) if spread > 0 else '0'} (relative).",
            style=TONES["good"],
        )
    elif solved:
        line = Text(
            "Only one solver reached the optimum; there is nothing to compare it with.",
            style=TONES["fair"],
        )
    else:
        line = Text(
            "No solver reached the optimum. " + next((r.note for r in rows if r.note), ""),
            style=TONES["bad"],
        )
    return Group(table, line, _where(folder))


def _steps(updated: Updated) -> str:
    if updated.direct:
        return f"{updated.method}, a formula evaluated once"
    return f"{count(updated.iterations, 'iteration')}, {updated.solver}"


def _fit(updated: Updated) -> Table:
    table = _table("", "fit", "before", "after")
    for key, heading in (("fit", ""), ("hold_out", ", held out")):
        for metric, pair in updated.fit.get(key, {}).items():
            name, unit = METRICS.get(metric, (metric, ""))
            values = [
                f"{fixed(v)} %" if unit == "%" else number(v)
                for v in (pair["before"], pair["after"])
            ]
            table.add_row(name + heading, *values)
    return table


def _parameters(updated: Updated) -> Table:
    table = _table("", "parameter", "before", "after ± standard deviation", "unit", "")
    shown = strongest(updated.parameters, MOST)
    for q in shown:
        table.add_row(*_row(q))
    left = len(updated.parameters) - len(shown)
    if left:
        table.add_row(f"… and {left} that moved less", "", "", "", "")
    return table


def _row(q: ParameterResult) -> tuple[str, ...]:
    factor, unit = prefix_of(q.unit, q.before, q.after)
    deviation = None if q.standard_deviation is None else q.standard_deviation / factor
    after = with_deviation(q.after / factor, deviation) + (
        "" if deviation is not None else " (not determined)"
    )
    return (
        q.name,
        number(q.before / factor, 5),
        after,
        unit,
        f"at its {q.bound} bound" if q.at_bound else "",
    )


def _table(title: str, *columns: str) -> Table:
    table = Table(title=title or None, box=box.SIMPLE_HEAD, title_justify="left", pad_edge=False)
    for k, column in enumerate(columns):
        numeric = column in (
            "before",
            "after",
            "objective",
            "residual",
            "time",
            "model",
            "error",
            "MAC",
            "lowest FRAC",
        ) or column.startswith("after")
        table.add_column(column, justify="right" if numeric else "left", no_wrap=numeric or k == 0)
    return table


def _where(folder: Path) -> Text:
    return Text(
        f"Report: {folder / 'report.html'}\nData:   {folder / 'result.json'}",
        style="dim",
        no_wrap=True,
        overflow="ignore",
    )
