"""The page of ``diagnose``: what is missing and where, the proof, and what the recordings cannot
tell."""

from __future__ import annotations

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any

from markupsafe import Markup

from cvxupdate.report.diagnosis_client import (
    GLOSSARY,
    held_out,
    not_tried,
    too_little,
    untested,
    untold,
)
from cvxupdate.report.diagnosis_curves import mode_bars, other_curves, overlay, remains
from cvxupdate.report.diagnosis_figures import fit_bars
from cvxupdate.report.diagnosis_modes import mode_rows, moving_modes
from cvxupdate.report.diagnosis_place import place_picture, size_words
from cvxupdate.report.diagnosis_places import map_picture
from cvxupdate.report.diagnosis_words import (
    capital,
    fit_rows,
    values_words,
    verdict_words,
)
from cvxupdate.report.numbers import fixed, number, seconds
from cvxupdate.report.page import command, render
from cvxupdate.report.words import METRICS

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.spec import Spec

BARS_SAY = (
    "How far the model's answer lies from the recordings: 0 is perfect, 1 is an error as large "
    "as the signal."
)
HELD_SAY = " Held-out recordings were never fitted."
MEANS_SAY = (
    " As modelled and with what was found: all channels together, as in the table of the fit. The "
    "usual scatter and noise alone: means over the channels, each by itself."
)
EVIDENCE_SAYS = (
    "Errors in these sentences are means over the channels, each by itself, and of a model without "
    "the error of its mesh; the table of the fit and the summary on the terminal take all channels "
    "together, and before they take the file as it came, with its mesh. So the figures differ, the "
    "more the coarser the mesh."
)
MODES_SAY = (
    "Each line is a measured natural frequency: how far the model was off, and how far it is now."
)
MOST_ROWS = 40
"""Candidates shown at most; diagnosis.json holds them all."""


def _bars_say(found: Diagnosis, responses: bool) -> str:
    """What the chart of errors shows, and why other figures of responses stand above it."""
    return BARS_SAY + (HELD_SAY if held_out(found) else "") + (MEANS_SAY if responses else "")


def diagnosis_page(found: Diagnosis, spec: Spec) -> str:
    """The HTML text of a report on ``diagnose``."""
    tone, meaning = verdict_words(found)
    second = "model after" if found.updated is not None else "usual scatter allowed"
    first, others = overlay(found.shown, second), other_curves(found.shown)
    modes = None if first else mode_bars(found.shown)
    return render(
        "diagnosis.html",
        {
            "d": found,
            "tone": tone,
            "meaning": meaning,
            "place": _svg(place_picture(found, spec)),
            "bars": _svg(fit_bars(found)),
            "bars_say": _bars_say(found, bool(first)),
            "evidence_says": EVIDENCE_SAYS if first else "",
            "fit": fit_rows(found),
            "overlay": _svg(first[0] if first else modes),
            "overlay_says": first[1] if first else MODES_SAY,
            "curves": _svg(others[0] if others else None),
            "remains": _svg(remains(found.shown)),
            "map": _svg(map_picture(found.shown, spec)),
            "updated": found.updated is not None,
            "untested": untested(found),
            "size": size_words(spec),
            "natural": mode_rows(found.beside),
            "measured_modes": found.beside is not None
            and any(m.measured is not None for m in found.beside.modes),
            "moving": moving_modes(found.beside),
            "not_tried": not_tried(found),
            "little": too_little(found),
            **untold(found),
            "glossary": GLOSSARY,
            "findings": [finding_part(f) for f in found.findings],
            "candidates": candidate_rows(found),
            "lower": below_found(found),
            "more": max(0, len(gathered_sets(found)) - MOST_ROWS),
            "metrics": metric_rows(found),
            "held_rows": held_out(found),
            "source": spec.source,
            "command": command("diagnose", found.path),
            "time": seconds(found.time),
        },
    )


def finding_part(f: Any) -> dict[str, Any]:
    """One finding for the page: title, figures with deviations, what is equivalent."""
    return {
        "title": capital(f.title),
        "confidence": f"{100 * f.confidence:.0f} %",
        "values": values_words(f.parameters, f.deviations, f.physics, f.place.dof),
        "equivalent": [capital(title) for title in f.alternatives],
        "unlikelier": [capital(title) for title in f.unlikelier],
    }


def candidate_rows(found: Diagnosis) -> list[dict[str, str]]:
    """Every effect at every place that was tried, and every set of them."""
    return [
        {
            "title": capital(_together([str(one["title"]) for one in rows])),
            "score": number(c.get("score"), 3),
            "hold_out": number(c.get("hold_out_score"), 3),
            "share": ""
            if c.get("explained_fraction") is None
            else f"{100 * float(c['explained_fraction']):.0f} %",
        }
        for rows in gathered_sets(found)[:MOST_ROWS]
        for c in rows[:1]
    ]


def _together(titles: list[str]) -> str:
    """Effects of one set."""
    if len(titles) == 1:
        return titles[0]
    return f"{', '.join(titles[:-1])} and {titles[-1]}, together"


def gathered_sets(found: Diagnosis) -> list[list[Mapping[str, Any]]]:
    """The candidates, those of one set together."""
    out: dict[object, list[Mapping[str, Any]]] = {}
    for k, c in enumerate(found.candidates):
        out.setdefault(("set", c["set"]) if "set" in c else k, []).append(c)
    return list(out.values())


def below_found(found: Diagnosis) -> bool:
    """Whether a set of several effects leaves less than what was found."""
    sets = [c for c in found.candidates if "set" in c and c.get("score") is not None]
    titles = {f.title for f in found.findings}
    own = [
        c["score"]
        for rows in gathered_sets(found)
        for c in rows[:1]
        if c.get("score") is not None and {one["title"] for one in rows} == titles
    ]
    return bool(own) and any(c["score"] < min(own) for c in sets)


def metric_rows(found: Diagnosis) -> list[dict[str, str]]:
    """The contract's metrics, fitted first."""
    out = []
    for key, what in (("fit", "fitted"), ("hold_out", "held out")):
        for metric, pair in found.metrics.get(key, {}).items():
            name, unit = METRICS.get(metric, (metric, ""))
            values = {
                k: f"{fixed(pair.get(k))} %"
                if unit == "%" and pair.get(k) is not None
                else number(pair.get(k), 3)
                for k in ("before", "after")
            }
            if pair.get("before") is not None:
                out.append({"name": name, "what": what, **values})
    return out


def _svg(text: str | None) -> Markup | None:
    return None if text is None else Markup(text)
