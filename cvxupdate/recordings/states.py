"""States of one structure: the reference, which the model describes, and the one that is looked
into."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.errors import InputError
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec

REFERENCE = "reference"


def parted(
    spec: Spec, recordings: Sequence[Recording]
) -> tuple[tuple[Spec, tuple[Recording, ...]], tuple[Spec, tuple[Recording, ...]]]:
    """(problem, recordings) of the reference state, and of the state that is looked into.

    Raises
    ------
    InputError
        When recordings to fit are of several states beside the reference.
    """
    fitted = [r.origin for r in recordings if r.origin.use == "fit"]
    others = dict.fromkeys(o.state for o in fitted if o.state != REFERENCE)
    if len(others) > 1:
        names = " and ".join("no state" if s is None else f"state {s!r}" for s in others)
        raise InputError(
            f"{spec.path}: recordings to fit have {names}: one model has one state beside the "
            "reference. Give each state a problem file of its own (the model by `include`)."
        )
    return _of(spec, recordings, True), _of(spec, recordings, False)


def states_of(
    spec: Spec, recordings: Sequence[Recording]
) -> dict[str, tuple[Spec, tuple[Recording, ...]]]:
    """(problem, recordings) of every state, where recordings to fit are of several that all have a
    name and none is the reference; empty else."""
    names = dict.fromkeys(r.origin.state for r in recordings if r.origin.use == "fit")
    if len(names) < 2 or None in names or REFERENCE in names:
        return {}
    return {
        str(name): _kept(spec, recordings, [r.origin.state == name for r in recordings])
        for name in names
    }


def looked_into(spec: Spec, recordings: Sequence[Recording]) -> tuple[Spec, tuple[Recording, ...]]:
    """The problem with the recordings of the state that is looked into: all but those of the
    reference; these where there are no others.

    Raises
    ------
    InputError
        As `parted`.
    """
    reference, other = parted(spec, recordings)
    return other if other[1] else reference


def _of(
    spec: Spec, recordings: Sequence[Recording], reference: bool
) -> tuple[Spec, tuple[Recording, ...]]:
    keep = [(r.origin.state == REFERENCE) == reference for r in recordings]
    return _kept(spec, recordings, keep)


def _kept(
    spec: Spec, recordings: Sequence[Recording], keep: Sequence[bool]
) -> tuple[Spec, tuple[Recording, ...]]:
    if all(keep):
        return spec, tuple(recordings)
    if not any(keep):
        return replace(spec, recordings=()), ()
    declared = tuple(d for d, k in zip(spec.recordings, keep, strict=True) if k)
    mine = tuple(r for r, k in zip(recordings, keep, strict=True) if k)
    return replace(spec, recordings=declared), mine
