"""Models that the commands write as problem files: updated, and on a finer mesh."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.errors import CvxupdateError, ModelError
from cvxupdate.spec import Spec

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Compared
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.fe.model import Model
    from cvxupdate.spec.write import Written

MESH_MATTERS, NEARER = 1e-3, 0.7  # shift of frequencies for a finer mesh, and its error at most
# the least absolute reduction of the error
WORTH = {"frf_error": 0.01, "response_error": 0.01, "frequency_error_percent_mean": 0.1}
ALIKE = 0.05  # relative difference of two errors up to which they are one figure
UNITS = {
    "frf_error": " of the frequency responses",
    "response_error": " of the time responses",
    "frequency_error_percent_mean": " % of the frequencies",
}


def updated_file(spec: Spec, model: Model, p: Sequence[float]) -> Written | None:
    """The model of a problem at ``p`` as a problem file, the rest of which is as it was; None where
    the grammar has no form for what moved."""
    from cvxupdate.diagnose.output.export import problem_file
    from cvxupdate.diagnose.results import Updated

    try:
        return problem_file(spec, Updated(model, np.array(p)), command="run")
    except ModelError:
        return None


def with_refined(
    found: Diagnosis,
    spec: Spec,
    after: tuple[Spec, Model] | None,
    compared: Callable[[Spec, Model], Compared],
) -> Diagnosis:
    """With the updated model (``after``, reopened) on a finer mesh where that comes closer to the
    recordings in `correlate`, and the figures of both; ``compared`` is `correlate` of an opened
    problem."""
    from cvxupdate.diagnose.output.refine import finer, finer_file, shift
    from cvxupdate.fe.build import build_model

    if after is None:
        return found
    try:
        coarse, model = after
        if coarse.model.refine is not None and spec.model.refine is None:
            stated = compared(coarse, model)
            return replace(found, evidence=(*found.evidence, *_as_written(found, stated)))
        fine = finer(coarse)
        if fine is None:
            return found
        specs, models = [coarse, fine], [build_model(s) for s in (coarse, fine)]
        if shift(*models) < MESH_MATTERS:
            return found
        both = [compared(s, m).fit for s, m in zip(specs, models, strict=True)]
    except CvxupdateError:
        return found
    key, where = ("hold_out", "held-out") if both[0]["hold_out"] else ("fit", "fitted")
    name = next(m for m in WORTH if m in both[0][key])
    errors = [b[key][name]["after"] for b in both]
    if errors[1] > min(NEARER * errors[0], errors[0] - WORTH[name]):
        return found
    says = (
        f"In correlate, updated/problem.toml has an error of {errors[0]:.3g}{UNITS[name]} ({where} "
        "recordings), because it keeps the mesh of the file that was diagnosed; on a finer "
        f"mesh the same model has {errors[1]:.3g}{UNITS[name]}: updated/refined.toml."
    )
    return replace(found, refined=finer_file(fine), evidence=(*found.evidence, says))


def _as_written(found: Diagnosis, stated: Compared) -> list[str]:
    """The error of the model that is written beside that of the diagnosis, where they differ: what
    the diagnosis let vary beside its findings is not all in the file."""
    said, differ = [], False
    for key, where in (("fit", "fitted"), ("hold_out", "held out")):
        for name, unit in UNITS.items():
            mine = found.metrics.get(key, {}).get(name, {}).get("after")
            theirs = stated.fit.get(key, {}).get(name, {}).get("after")
            if mine is None or theirs is None:
                continue
            differ = differ or abs(theirs - mine) > ALIKE * abs(mine)
            said.append(f"{theirs:.3g}{unit} ({where}) where the diagnosis has {mine:.3g}")
    if not differ:
        return []
    return [
        f"In correlate and run, updated/problem.toml has an error of {' and '.join(said)}: it "
        "holds what was found, the damping and finer parts of the elements, but not all that the "
        "diagnosis let vary within its usual scatter (the depth of clamps, points that hold, what "
        "is left of thin-plate theory)."
    ]
