"""Detect, locate, name, model, prove: what the recordings say the model leaves out."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cvxupdate.diagnose.finding import Diagnosis
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.types import Recording
    from cvxupdate.spec import Spec


def diagnose_problem(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[str], None] | None = None,
) -> Diagnosis:
    """Diagnose responses where there are any, else tables of modes.

    Raises
    ------
    InputError
        When there is no recording to fit.
    """
    from cvxupdate.recordings.types import FrequencyResponse, TimeHistory

    if any(
        isinstance(r, FrequencyResponse | TimeHistory) and r.origin.use == "fit" for r in recordings
    ):
        from cvxupdate.diagnose.verdict import diagnose_responses

        return diagnose_responses(spec, model, recordings, progress)
    from cvxupdate.diagnose.modal import diagnose_modes

    return diagnose_modes(spec, model, recordings, progress)


__all__ = ["diagnose_problem"]
