"""Normal modes of what `identify` found, by the route that the user named."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.errors import CvxupdateError

if TYPE_CHECKING:
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.identify import IdentifiedModes
    from cvxupdate.recordings.realise import ModelModes, NormalModes, Route
    from cvxupdate.recordings.types import Channel, Complex

SPARE = 12
"""Modes of the model beyond as many as there are channels: measured ones among the lowest are left
out of what fills them up."""


def routes_of(name: str) -> tuple[Route, ...]:
    """The route of that name, or every one for "all"; raises where there is none."""
    from cvxupdate.recordings.realise.routes import ROUTES, route_named

    return ROUTES if name == "all" else (route_named(name),)


def normal_of(
    poles: Complex,
    shapes: Complex,
    channels: Sequence[Channel],
    name: str | None,
    fitted: IdentifiedModes | None,
    model: Model | None,
) -> tuple[NormalModes, ...]:
    """Normal modes by the route of that name, by every one for "all", none for None."""
    if name is None:
        return ()
    from cvxupdate.recordings.realise import ModeSet, realised

    wanted = routes_of(name)
    needed = any(route.name == "ibrahim-fill" for route in wanted)
    beside = model_at(model, channels) if needed and model is not None else None
    found = ModeSet(poles, shapes, fitted, beside)
    return tuple(realised(found, route) for route in wanted)


def model_at(model: Model, channels: Sequence[Channel]) -> ModelModes:
    """The model's modes at the channels, rigid-body modes first, or why there are none."""
    from cvxupdate.fe.modes import model_modes
    from cvxupdate.recordings.realise import ModelModes

    labels = [c.label for c in channels]
    first = [labels.index(name) == k for k, name in enumerate(labels)]
    at = np.array(
        [model.place.get(name, -1) if own else -1 for name, own in zip(labels, first, strict=True)],
        dtype=np.int64,
    )
    known = at >= 0
    try:
        modes = model_modes(model, min(model.size, int(np.count_nonzero(known)) + SPARE))
    except CvxupdateError as error:
        return ModelModes(np.zeros(0), np.zeros((0, len(at))), str(error))
    shapes = np.full((modes.frequencies.size, len(at)), np.nan)
    shapes[:, known] = modes.shapes[at[known]].T
    return ModelModes(modes.frequencies, shapes)
