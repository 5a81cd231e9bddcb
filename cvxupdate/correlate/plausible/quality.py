"""What the quality checks say of each recording, and of the recordings against one another."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.recordings.quality import check, compare
from cvxupdate.recordings.types import Recording


def damage_doubts(recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """What was left out of files when they were read."""
    return tuple(
        Doubt("damage", f"{r.origin.name}: {line}.", r.origin.name)
        for r in recordings
        for line in r.origin.damage
    )


def quality_doubts(recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """Faults of single recordings, and where recordings of one structure contradict one another,
    one sentence each."""
    own = [
        Doubt(f.check, f"{r.origin.name}: {f.says}", r.origin.name, f.channel, f.value)
        for r in recordings
        for f in check(r)
    ]
    between = [
        Doubt(f.check, f"The recordings contradict one another: {f.says}", "", f.channel, f.value)
        for f in compare(recordings)
    ]
    return tuple(dict.fromkeys([*own, *between]))
