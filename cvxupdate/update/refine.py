"""The model that is updated, on a finer mesh where [update] or [model] asks for one."""

from __future__ import annotations

from cvxupdate.errors import InputError
from cvxupdate.fe.analysis import as_stated
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec

OWN = ("ceam", "direct")
"""Methods that update the matrices of the file themselves."""


def refined_for(spec: Spec, model: Model) -> Model:
    """The model of a problem with the matrices of as many parts of its elements as ``refine`` says;
    as it is where nothing is asked or nothing can be divided.

    Raises
    ------
    InputError
        With a method that updates the file's own matrices.
    """
    update = spec.update
    asked = None if update is None else update.refine
    own = asked is None and spec.model.refine is None
    if not own and update is not None and update.method in OWN:
        where = "model" if asked is None else "update"
        raise InputError(
            f"{spec.path}: {where}.refine: {update.method} updates the matrices of the file, which "
            "cannot be those of finer parts. Leave `refine` out, or choose another method."
        )
    return as_stated(spec, model, asked)
