"""What a `Model` shows of its structure: rows of places, damping ratios of modes."""

from __future__ import annotations

from typing import Any

import numpy as np

from cvxupdate.api.arrays import Numbers, optional
from cvxupdate.api.places import Place
from cvxupdate.errors import InputError
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model as Structure


def row_of(structure: Structure, place: Place) -> int:
    """The place among the free DOFs, −1 for one that is held.

    Raises
    ------
    InputError
        When the structure has no such DOF.
    """
    known = structure.place
    if place.label in known:
        return known[place.label]
    kinds = {KINDS[k] for k in structure.dof_kind.tolist()}
    if place.node in structure.node_ids and place.dof in kinds:
        return -1
    labels = structure.labels
    raise InputError(
        f"{place.label}: the model has no such degree of freedom. It has "
        f"{', '.join(labels[:10])}{' …' if len(labels) > 10 else ''}."
    )


def damping_ratios(structure: Structure, f: Numbers, shapes: Numbers, m: Any) -> Numbers | None:
    """Ratios of the lowest flexible modes, mass-normalised (N, modes) at ``f`` Hz, to first order
    where C and D of the matrices ``m`` couple them; None without damping."""
    omega = 2.0 * np.pi * f
    viscous, loss = (np.einsum("im,im->m", shapes, A @ shapes) for A in (m.C, m.D))
    zeta = np.abs((viscous * omega + loss) / (2.0 * omega**2))
    own = structure.modal_damping
    if own:
        zeta = zeta + np.array([own[min(k, len(own) - 1)] for k in range(len(f))])
    return zeta if np.any(zeta > 0.0) else None


def elements_frame(blocks: list[dict[str, Any]]) -> Any:
    """A pandas DataFrame with a row for each element of a [model] table."""
    pandas = optional("pandas", "to_dataframe")
    rows = [{"type": block["type"], **row} for block in blocks for row in block["rows"]]
    return pandas.DataFrame(rows).set_index("id")
