"""Results in a few lines: for a prompt, and as a card in a notebook."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
    from cvxupdate.diagnose.results import Finding
    from cvxupdate.update.result import ParameterResult

MOST_ROWS = 12
WORDS = {
    "frequency_error_percent_mean": "mean frequency error (%)",
    "frequency_error_percent_max": "largest frequency error (%)",
    "mac_mean": "mean MAC",
    "mac_min": "least MAC",
    "frf_error": "error of the frequency responses",
    "response_error": "error of the time responses",
}
"""The metrics that a card shows; the others are in ``fit``."""


def figure(value: Any) -> str:
    """A number with four digits, a dash where there is none."""
    return f"{value:.4g}" if isinstance(value, int | float) and value == value else "–"


def fit_rows(fit: Mapping[str, Mapping[str, Any]]) -> list[tuple[str, str, str]]:
    """What is compared, before and after, in words; fitted recordings first."""
    out = []
    for key, where in (("fit", ""), ("hold_out", ", held out")):
        for name, both in fit.get(key, {}).items():
            if name in WORDS and isinstance(both, Mapping):
                before, after = figure(both.get("before")), figure(both.get("after"))
                out.append((f"{WORDS[name]}{where}", before, after))
    return out


def fit_words(fit: Mapping[str, Mapping[str, Any]]) -> str:
    """The first metric of a prompt's line."""
    rows = fit_rows(fit)
    return f", {rows[0][0]} {rows[0][1]} → {rows[0][2]}" if rows else ""


def card(
    title: str, says: Sequence[str], head: Sequence[str], rows: Sequence[Sequence[str]]
) -> str:
    """An HTML fragment without style or script: a title, sentences, one table."""
    told = "".join(f"<p>{html.escape(line)}</p>" for line in says if line)
    cells = [f"<tr>{''.join(f'<th>{html.escape(h)}</th>' for h in head)}</tr>"]
    cells += [
        f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>"
        for row in rows[:MOST_ROWS]
    ]
    more = len(rows) - MOST_ROWS
    rest = f"<p>… and {more} more</p>" if more > 0 else ""
    table = f"<table>{''.join(cells)}</table>" if rows else ""
    return f"<div><strong>{html.escape(title)}</strong>{told}{table}{rest}</div>"


def parameter_row(q: ParameterResult) -> tuple[str, str, str]:
    """A parameter in a card: name, before, after."""
    sd = "" if q.standard_deviation is None else f" ± {figure(q.standard_deviation)}"
    bound = ", on its bound" if q.at_bound else ""
    return q.name, figure(q.before), f"{figure(q.after)}{sd} {q.unit}{bound}".strip()


def sizes(f: Finding) -> str:
    """The sizes of a finding with their deviations."""
    return ", ".join(
        f"{k} = {figure(v)} ± {figure(f.deviations.get(k, float('nan')))}"
        for k, v in f.parameters.items()
    )


def finding_row(f: Finding) -> dict[str, Any]:
    """A finding as one flat row."""
    made = f.to_json()
    own = made.pop("parameters"), made.pop("standard_deviation"), made.pop("noise_deviation")
    sizes = {k: v for k, v in own[0].items()} | {f"{k}_std": v for k, v in own[1].items()}
    return {"title": f.title, **made, **sizes}
