"""Records that nothing drives, and forces that move nothing."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse, Recording, TimeHistory


def input_doubts(model: Model, recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """Of each recording at most one: time histories without an input, and inputs at DOFs that a
    support holds."""
    return tuple(d for r in recordings for d in _of(model, r))


def _of(model: Model, recording: Recording) -> Iterator[Doubt]:
    name = recording.origin.name
    if isinstance(recording, TimeHistory):
        forces = [c for c in recording.channels if c.quantity == "force"]
        if not forces:
            says = (
                f"{name} has neither a force nor an imposed motion: it is ambient vibration, whose "
                "modes `identify` finds; nothing else is compared with it. Is one of its channels "
                "a force, or (imposed = true) what moves the structure?"
            )
            yield Doubt("input", says, name)
    elif isinstance(recording, FrequencyResponse):
        forces = [c for c in recording.references if c.quantity == "force"]
    else:
        return
    held = [c for c in forces if c.label not in model.place and _has_node(model, c.node)]
    for c in held[:1]:
        says = (
            f"{name}: the force at node {c.node} ({c.dof}) is where a support holds the model, and "
            "moves nothing. Is it a reaction, or another node or direction?"
        )
        yield Doubt("input", says, name, c.label)


def _has_node(model: Model, node: int | None) -> bool:
    return node is not None and node in set(model.node_ids.tolist())
