"""`view`: what a problem file says, before anything is solved: the structure, its supports, where
the recordings were taken, and the first modes of the model as it is."""

from __future__ import annotations

import time
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError, ModelError

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.types import Recording
    from cvxupdate.spec import Given, Spec

MODES = 6
"""Modes where nothing is asked for."""
MOST = 60
"""Modes that a page still shows."""


@dataclass(frozen=True)
class Viewed:
    """What there is to see. ``mass`` in kg (None for matrices of another program), ``extent`` (3,)
    in m; ``rigid`` motions without stiffness, ``frequencies`` (m,) Hz of the modes above them,
    ``shapes`` (m) arrays (nodes, 3) of translations; ``sensors`` and ``forces`` are labels;
    ``faults`` what kept a part of it from being shown, ``notes`` what is to be minded."""

    spec: Spec
    time: float
    counts: dict[str, int]
    mass: float | None
    extent: tuple[float, ...]
    rigid: int
    frequencies: tuple[float, ...]
    shapes: tuple[NDArray[np.float64], ...]
    sensors: tuple[str, ...]
    forces: tuple[str, ...]
    geometry: Geometry | None
    faults: tuple[str, ...] = ()
    notes: tuple[str, ...] = ()


def view(problem: Given, modes: int = MODES) -> Viewed:
    """The model of a problem and the places of its recordings. A model that is a mechanism, or
    recordings that cannot be read, are told among the ``faults``; the rest is shown all the same,
    because a picture says best what is wrong.

    Raises
    ------
    InputError
        For a fault of the problem file or of a table that the model is made of.
    """
    from cvxupdate.correlate.compare import geometry_of
    from cvxupdate.fe.analysis import as_stated
    from cvxupdate.fe.build import build_model
    from cvxupdate.spec import spec_of

    begin = time.perf_counter()
    if not 1 <= modes <= MOST:
        raise InputError(f"--modes {modes}: give 1 to {MOST}.")
    spec = spec_of(problem)
    model = as_stated(spec, build_model(spec))
    faults: list[str] = []
    recordings = _recordings(spec, faults)
    sensors, forces = _places(recordings)
    rigid, frequencies, shapes = _modes(model, modes, faults)
    given = any(b.kind.name == "matrix" for b in model.blocks)
    extent = np.ptp(model.xyz, axis=0) if len(model.xyz) else np.zeros(3)
    return Viewed(
        spec,
        time.perf_counter() - begin,
        {
            "nodes": len(model.node_ids),
            "elements": sum(len(b.rows) for b in spec.model.elements),
            "free DOFs": model.size,
            "recordings": len(spec.recordings),
            "parameters": len(model.parameters),
        },
        None if given else float(model.total_mass()),
        tuple(float(x) for x in extent),
        rigid,
        frequencies,
        shapes,
        sensors,
        forces,
        geometry_of(spec, model),
        tuple(faults),
        _notes(model, rigid, sensors),
    )


def _recordings(spec: Spec, faults: list[str]) -> tuple[Recording, ...]:
    from cvxupdate.study import read_recordings

    try:
        return read_recordings(spec)
    except InputError as error:
        faults.append(f"The recordings are not shown: {error}")
        return ()


def _places(recordings: tuple[Recording, ...]) -> tuple[tuple[str, ...], tuple[str, ...]]:
    from cvxupdate.beside import measured_at

    return measured_at(recordings)


def _modes(
    model: Model, count: int, faults: list[str]
) -> tuple[int, tuple[float, ...], tuple[NDArray[np.float64], ...]]:
    """(rigid-body motions, frequencies, translations) of the lowest modes."""
    from cvxupdate.correlate.modes import node_translations
    from cvxupdate.fe.modes import model_modes

    try:
        found = model_modes(model, count)
    except ModelError as error:
        faults.append(f"The modes are not shown: {error}")
        return 0, (), ()
    first = found.flexible()
    return (
        found.rigid,
        tuple(first.frequencies[:count].tolist()),
        tuple(node_translations(model, s) for s in first.shapes.T[:count]),
    )


def _notes(model: Model, rigid: int, sensors: tuple[str, ...]) -> tuple[str, ...]:
    from cvxupdate.correlate.plausible.facts import free_says

    said = free_says(model, rigid)
    held = [s for s in sensors if s not in model.place]
    if held:
        said.append(f"The model holds, or has not, the places of {', '.join(held[:8])}")
    return tuple(said)
