"""The same request as a constrained convex update, beside the direct methods: parameters of the
model's own elements within bounds instead of free entries of its matrices."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.direct.result import DirectUpdate
from cvxupdate.errors import CvxupdateError, InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec
from cvxupdate.spec.update import Regulariser, Update
from cvxupdate.spec.update_parameters import ParameterRow
from cvxupdate.update.ceam import update_ceam
from cvxupdate.update.modal import update_modal
from cvxupdate.update.result import Updated

NAME = "convex"
LEAST, MOST = -0.9, 9.0
"""Bounds of the relative change of an element where the file has none: a tenth to ten times. Above
-1 every element stays definite, and so does the model."""
SPREAD = 0.2
"""Prior deviation of the change of each element where the file has neither parameters nor a
penalty: as macro elements are chosen by (`cvxupdate.update.grouping`)."""


@dataclass(frozen=True)
class Beside:
    """The ``update``, and the matrices that it ended at (``made``)."""

    update: Updated
    made: DirectUpdate

    @property
    def title(self) -> str:
        """In the table of methods."""
        return f"Constrained convex update, method {self.update.method}"

    @property
    def changes(self) -> str:
        """What it may change."""
        return f"{len(self.update.parameters)} parameters of elements, within bounds"

    @property
    def says(self) -> tuple[str, ...]:
        """How it ended."""
        u = self.update
        on = sum(q.at_bound for q in u.parameters)
        steps = f"{u.iterations} convex step{'' if u.iterations == 1 else 's'}"
        return (
            f"{u.status} after {steps}: {u.reason}",
            f"certificate of the last step: {u.certificate.get('says', 'none')}",
            f"{on} of {len(u.parameters)} parameters on a bound",
        )


def convex_version(spec: Spec, recordings: Sequence[Recording], shaped: bool) -> Beside:
    """Measured modes assigned by method ceam where they have shapes (``shaped``), else their
    frequencies fitted: with the parameters, constraints and penalties of the file, though it asks
    for a direct method; without such parameters the stiffness of each element and the mass of each
    element, changed as little as need be.

    Raises
    ------
    CvxupdateError
        Where that cannot be done.
    """
    asked, model = _request(spec, shaped)
    update = (update_ceam if shaped else update_modal)(asked, model, recordings)
    if update.status == "infeasible":
        raise InputError(f"no parameters keep all clauses: {'; '.join(update.conflict)}")
    m = model.matrices(np.array([q.p for q in update.parameters]))
    return Beside(update, DirectUpdate(NAME, m.M.toarray(), m.K.toarray()))


def _request(spec: Spec, shaped: bool) -> tuple[Spec, Model]:
    table = spec.update
    if table is None:
        raise InputError(f"{spec.path}: there is no [update] table. Add one with a method.")
    method = "ceam" if shaped else "frequencies"
    if table.parameters:
        asked = _with(spec, table, method, table.parameters)
        return asked, build_model(asked)
    rows: list[ParameterRow] = []
    for of in ("stiffness", "mass"):
        row = ParameterRow(of=of, elements="all", each="element", lower=LEAST, upper=MOST)
        try:
            build_model(_with(spec, table, method, (row,)))
        except CvxupdateError:  # no element has that property
            continue
        rows.append(row)
    asked = _with(spec, table, method, tuple(rows))
    if not asked.regularisation:
        least = Regulariser(kind="tikhonov", weight=1.0 / SPREAD**2)
        asked = replace(asked, regularisation=(least,))
    return asked, build_model(asked)


def _with(spec: Spec, table: Update, method: str, rows: tuple[ParameterRow, ...]) -> Spec:
    return replace(spec, update=table.model_copy(update={"method": method, "parameters": rows}))
