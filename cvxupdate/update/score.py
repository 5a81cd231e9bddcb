"""How well a model's responses fit the recordings of responses, before and after: the same score
for every method, whatever it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cvxupdate.correlate import response_errors
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.system import Array
from cvxupdate.update.result import Metrics, Updated


def response_metrics(model: Model, p: Array, recordings: Sequence[Recording]) -> dict[str, Metrics]:
    """{"fit": {"frf_error": {"before", "after"}, …}, "hold_out": {…}} of
    `correlate.response_errors`; empty for a use without recordings of responses."""
    before, after = (response_errors(model, recordings, at) for at in (model.zero(), p))
    return {
        key: {
            name: {"before": before[key][name], "after": after[key][name]} for name in before[key]
        }
        for key in ("fit", "hold_out")
    }


def scored(
    fitted: Mapping[str, Metrics], model: Model, p: Array, recordings: Sequence[Recording]
) -> dict[str, Metrics]:
    """A method's own metrics, with those of the responses."""
    more = response_metrics(model, p, recordings)
    return {key: {**fitted[key], **more[key]} for key in ("fit", "hold_out")}


GREW = {
    "frf_error": "error of the frequency responses",
    "response_error": "error of the time responses",
    "frequency_error_percent_mean": "mean frequency error",
}
"""Errors of the fitted recordings as a whole, which an update should not let grow."""
GROWN = 1.05
"""Times what it was: from there on an error has grown. Below, it went where its noise took it."""
ROUNDING = 1e-6


def caveats(updated: Updated, chosen: bool) -> tuple[str, ...]:
    """Where an error of the fitted recordings as a whole grew, although the objective fell: which,
    why, and what to do. ``chosen``: only some lines of the responses were fitted."""
    said = []
    for name, words in GREW.items():
        pair = updated.fit.get("fit", {}).get(name)
        if pair is None or not pair["after"] > GROWN * pair["before"] + ROUNDING:
            continue
        unit = " %" if name.endswith("_percent_mean") else ""
        grew = f"The {words} grew from {pair['before']:.4g}{unit} to {pair['after']:.4g}{unit}"
        if chosen and updated.method == "rfm" and name == "frf_error":
            said.append(
                f"{grew}: the fit sees only its chosen lines, which lie between the resonances, "
                'and what it gained there is lost on the others. Set frequency_points = "all" and '
                'residual = "receptance" in [update], or free what the model lacks.'
            )
        else:
            said.append(
                f"{grew}: the fit weighs each number by its deviation, and what it gained on the "
                "surest ones is lost on the others. Check the deviations, or free what the model "
                "lacks."
            )
    return tuple(said)
