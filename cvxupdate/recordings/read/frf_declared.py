"""FRFs that a file labels, under the places that the problem file gives them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.frf_parts import FrfParts
from cvxupdate.recordings.read.wanted import Wanted, channel_of
from cvxupdate.recordings.types import Channel


def declared(
    parts: FrfParts, contents: Contents, wanted: Sequence[Wanted], references: Sequence[Channel]
) -> FrfParts:
    """The responses that ``wanted`` names, at the places that it gives, in its unit and sign where
    it has one; ``references`` in place of the file's.

    Raises
    ------
    RecordingError
        For a response that the file does not have, or a place that the file gives to another one.
    """
    if references:
        if len(references) != len(parts.references):
            raise RecordingError(
                f"{contents.file}: {len(references)} references are declared, but the file has "
                f"{len(parts.references)}. Declare as many, in the order of the file."
            )
        _other(contents.file, "reference", references, parts.references)
        parts = replace(parts, references=tuple(references))
    if not wanted:
        return parts
    count = len(parts.responses)
    for want in wanted:
        if isinstance(want.column, str) or not 0 <= want.column < count:
            raise RecordingError(
                f"{contents.file}: {want.label}: no such response; the file holds {count} "
                f"(column 0 to {count - 1})."
            )
        if want.quantity not in (parts.quantity, "unknown", "voltage"):
            raise RecordingError(
                f"{contents.file}: {want.label}: the file states {parts.quantity}. Correct the one "
                "that is wrong."
            )
    columns = [int(want.column) for want in wanted]
    own = [parts.responses[k] for k in columns]
    _other(contents.file, "response", [Channel(w.node, w.dof, "") for w in wanted], own)
    channels, H = [], parts.H[:, columns].copy()
    for k, (want, was) in enumerate(zip(wanted, own, strict=True)):
        scale, unit = was.scale * want.sign, was.unit
        if want.unit or want.sensitivity is not None:
            stated = channel_of(contents, want, "force")
            # the sign that the direction in the file has, and that of the problem file, both hold
            scale, unit = stated.scale * (1.0 if was.scale > 0.0 else -1.0), stated.unit
        H[:, k] *= scale / was.scale
        channels.append(Channel(want.node, want.dof, parts.quantity, unit, scale))
    coherence = None if parts.coherence is None else parts.coherence[:, columns]
    return replace(parts, H=H, coherence=coherence, responses=tuple(channels))


def _other(where: str, what: str, given: Sequence[Channel], stated: Sequence[Channel]) -> None:
    """Raise `RecordingError` where the file labels one channel as the problem file labels another:
    then one of the two is wrong. Labels that the problem file does not use are another
    numbering."""
    places = {(c.node, c.dof) for c in given}
    for now, was in zip(given, stated, strict=True):
        at = (was.node, was.dof)
        if was.dof and at != (now.node, now.dof) and at in places:
            raise RecordingError(
                f"{where}: the {what} declared at {now.label} is at {was.label} as the file "
                "states it, which is declared elsewhere. Correct the one that is wrong."
            )
