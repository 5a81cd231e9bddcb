"""What a compressed file may unpack to: a few kilobytes can be made to stand for terabytes."""

from __future__ import annotations

from cvxupdate.errors import RecordingError

PLENTY = 2**26
"""Bytes (64 MB) that are unpacked without a question."""
RATIO = 200
"""Unpacked bytes for each packed one, beyond `PLENTY`. Records of vibration pack to a half, whole
numbers of a converter to a tenth, text to a twentieth; deflate itself ends at 1032, with nothing
but one byte repeated."""


def must_be_believable(packed: int, unpacked: int, where: str) -> None:
    """Refuse what would unpack to far more than a recording can hold.

    Raises
    ------
    RecordingError
        Where ``unpacked`` bytes are more than `PLENTY` and more than `RATIO` times ``packed``.
    """
    if unpacked > PLENTY and unpacked > RATIO * packed:
        raise RecordingError(
            f"{where}: {packed / 2**20:.3g} MB unpack to {unpacked / 2**20:.3g} MB or more, "
            f"beyond {RATIO} to one: no recording packs like that, and it was not unpacked. If it "
            "is one (nearly all zeros), save it without compression."
        )
