"""Recordings from files and from what other packages read."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from cvxupdate import study
from cvxupdate.api.arrays import Numbers, numbers
from cvxupdate.api.places import Place, place_of
from cvxupdate.errors import InputError
from cvxupdate.recordings.types import Recording

ANY_MODEL = {
    "dofs": ["x", "y", "z", "rx", "ry", "rz"],
    "elements": [{"type": "matrix", "rows": [{"id": 1, "stiffness": "K", "file": __file__}]}],
}
"""A model beside which every table of recordings holds: its nodes are those of a matrix that is
not read."""


def recording_of(kind: str, file: str | os.PathLike[str], keys: Mapping[str, Any]) -> Recording:
    """The file as a [[recordings]] table of these keys says, without a model to fit.

    Raises
    ------
    InputError
        When it cannot be read so; the messages are those of a problem file.
    """
    use = keys.get("use", "fit")
    table = {"kind": kind, "file": file, **keys, "use": "fit"}  # alone it cannot be held out
    if use not in ("fit", "hold-out"):
        table["use"] = use  # refused with the words of a problem file
    (found,) = study.read_recordings({"model": ANY_MODEL, "recordings": [table]})
    return replace(found, origin=replace(found.origin, use=use))


def uff_entries(sets: Any) -> tuple[Numbers, Numbers, list[Place], list[Place], int]:
    """Frequencies, H, responses, references and the code of the quantity of data sets 58 as pyuff
    reads them.

    Raises
    ------
    InputError
        When they are no FRFs on one axis, or a pair is missing or there twice.
    """
    given = [sets] if isinstance(sets, Mapping) else list(sets)
    found = [s for s in given if s.get("type") == 58 and s.get("func_type") == 4]
    if not found:
        raise InputError("none of the data sets is an FRF (type 58, func_type 4).")
    f = numbers(found[0].get("x"), "x", 1)
    entries: dict[tuple[Place, Place], Numbers] = {}
    for number, one in enumerate(found, 1):
        what = f"data set {number}"
        x, values = numbers(one.get("x"), what, 1), numbers(one.get("data"), what, 1, complex)
        if x.shape != f.shape or not np.allclose(x, f, rtol=1e-6, atol=0.0):
            raise InputError(f"{what}: has other frequencies than the first one.")
        pair = tuple(
            place_of((one.get(f"{who}_node"), one.get(f"{who}_dir")), what)
            for who in ("rsp", "ref")
        )
        if pair in entries:
            raise InputError(f"{what}: the FRF {pair[0].label} / {pair[1].label} is there twice.")
        entries[pair[0], pair[1]] = values
    outputs = list(dict.fromkeys(o for o, _ in entries))
    inputs = list(dict.fromkeys(i for _, i in entries))
    missing = [f"{o.label} / {i.label}" for o in outputs for i in inputs if (o, i) not in entries]
    if missing:
        raise InputError(f"the FRFs {', '.join(missing[:5])} are missing among the data sets.")
    H = np.stack([np.stack([entries[o, i] for i in inputs], 1) for o in outputs], 1)
    return f, H, outputs, inputs, int(found[0].get("ordinate_spec_data_type") or 0)
