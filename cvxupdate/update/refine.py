"""The model that is updated, on a finer mesh where [update] asks for one."""

from __future__ import annotations

from cvxupdate.errors import InputError
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec


def refined_for(spec: Spec, model: Model) -> Model:
    """The model of a problem with the matrices of as many parts of its elements as ``refine`` says;
    as it is where nothing is asked or nothing can be divided.

    Raises
    ------
    InputError
        With a method that updates the file's own matrices.
    """
    update = spec.update
    if update is None or update.refine is None:
        return model
    if update.method == "ceam":
        raise InputError(
            f"{spec.path}: update.refine: ceam updates the matrices of the file, which cannot be "
            "those of finer parts. Leave `refine` out, or choose another method."
        )
    analysis = analysis_of(spec, model, update.refine)
    return model if analysis is None else analysis.on(model)
