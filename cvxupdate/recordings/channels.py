"""Which channels of a recording are references, and which are responses."""

from __future__ import annotations

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Channel


def split_channels(
    channels: tuple[Channel, ...],
    quantity: str | None = None,
    references: tuple[int, ...] | None = None,
) -> tuple[list[int], list[int], str]:
    """Columns of the references (forces, unless named), columns of the responses, and the quantity
    of the responses.

    Raises
    ------
    RecordingError
        When there is no reference, no response, or the responses are of several quantities and none
        was chosen.
    """
    inputs = (
        [k for k, c in enumerate(channels) if c.quantity == "force"]
        if references is None
        else list(references)
    )
    if not inputs:
        raise RecordingError(
            "no force channel in the time history; declare one, or use transmissibility or "
            "output_spectra"
        )
    motions = [k for k, c in enumerate(channels) if k not in inputs and c.quantity != "force"]
    kinds = sorted({channels[k].quantity for k in motions})
    if quantity is None and len(kinds) > 1:
        raise RecordingError(
            f"the responses are of several quantities ({', '.join(kinds)}); choose one with "
            "quantity="
        )
    chosen = quantity if quantity is not None else (kinds[0] if kinds else "")
    outputs = [k for k in motions if channels[k].quantity == chosen]
    if not outputs:
        raise RecordingError(
            f"no response channel of quantity {chosen or 'motion'!r} in the time history"
        )
    return inputs, outputs, chosen
