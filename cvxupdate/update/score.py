"""How well a model's responses fit the recordings of responses, before and after: the same score
for every method, whatever it fits."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from cvxupdate.correlate import response_errors
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.system import Array
from cvxupdate.update.result import Metrics


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
