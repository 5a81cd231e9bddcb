"""The minima that many starts reached, on the page of `run`."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from cvxupdate.report.numbers import NOTHING, count, fixed, number

if TYPE_CHECKING:
    from cvxupdate.update.result import Updated

MOST = 20
"""Minima on the page at most; result.json holds them all."""


def starts_parts(updated: Updated) -> dict[str, Any]:
    """A sentence and a row for each minimum, lowest first; empty without many starts."""
    report = updated.starts
    if not report:
        return {}
    minima = report["minima"]
    ended = sum(len(b["starts"]) for b in minima)
    return {
        "says": _sentence(report, ended),
        "rows": [_row(k, b, report["count"]) for k, b in enumerate(minima[:MOST], 1)],
        "more": max(0, len(minima) - MOST),
        "mac": any("mac_mean" in b["fit"] for b in minima),
    }


def _sentence(report: Mapping[str, Any], ended: int) -> str:
    lost = report["count"] - ended
    minima = count(len(report["minima"]), "minimum", "minima")
    said = f"{count(report['count'], 'start')} led to {minima}"
    if lost:
        said += f"; {count(lost, 'start')} led to no model that is a structure"
    return said + "."


def _row(place: int, b: Mapping[str, Any], starts: int) -> dict[str, str]:
    fit = b["fit"]
    return {
        "number": str(place),
        "objective": number(b["objective"], 5),
        "ridge": NOTHING if b["ridge"] is None else number(b["ridge"], 3),
        "starts": f"{len(b['starts'])} ({100.0 * len(b['starts']) / starts:.0f} %)",
        "error": fixed(fit.get("frequency_error_percent_mean")),
        "mac": fixed(fit.get("mac_mean"), 3),
        "bounds": str(b["on_bounds"]),
        "differs": "; ".join(
            f"{q['name']} {number(q['here'], 3)} instead of {number(q['lowest'], 3)}"
            for q in b["differs"]
        )
        or NOTHING,
    }
