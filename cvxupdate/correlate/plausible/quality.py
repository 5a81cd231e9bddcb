"""What the quality checks say of each recording, and of the recordings against one another."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.recordings.quality import check, compare
from cvxupdate.recordings.types import ModeTable, Recording

LEVEL = "level dependence"
"""The check that tells FRFs that change from one recording to the next."""
UNUSED = "(unknown)"
"""How a channel is named that is at no place of the model."""
SAID = 5
"""Sentences of one check that are given in full."""


def damage_doubts(recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """What was left out of files when they were read, and what was done to recordings."""
    return tuple(
        Doubt(check, f"{r.origin.name}: {line}.", r.origin.name)
        for r in recordings
        for check, lines in (("damage", r.origin.damage), (_remarked(r), r.origin.remarks))
        for line in lines
    )


def _remarked(recording: Recording) -> str:
    return "covariance" if isinstance(recording, ModeTable) else "beginning"


def quality_doubts(recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """Faults of single recordings, and where recordings of one structure contradict one another,
    one sentence each."""
    own = [
        Doubt(f.check, f"{r.origin.name}: {f.says}", r.origin.name, f.channel, f.value)
        for r in recordings
        for f in check(r)
        if UNUSED not in f.channel
    ]
    between = []
    # what changes with the level or from one state to another contradicts nothing
    for state in dict.fromkeys(r.origin.state for r in recordings):
        alike = [r for r in recordings if r.origin.state == state]
        between += [f for f in compare(alike) if f.check != LEVEL]
    for level, state in dict.fromkeys((r.origin.level, r.origin.state) for r in recordings):
        alike = [r for r in recordings if (r.origin.level, r.origin.state) == (level, state)]
        between += [f for f in compare(alike) if f.check == LEVEL]
    out = [
        Doubt(f.check, f"The recordings contradict one another: {f.says}", "", f.channel, f.value)
        for f in between
    ]
    return _few(dict.fromkeys([*own, *out]))


def _few(doubts: Iterable[Doubt]) -> tuple[Doubt, ...]:
    """The first `SAID` of each check, and how many more there are."""
    count: dict[str, int] = {}
    out = []
    for d in doubts:
        count[d.check] = count.get(d.check, 0) + 1
        if count[d.check] <= SAID:
            out.append(d)
    for name, n in count.items():
        if n > SAID:
            more = "warning" if n - SAID == 1 else "warnings"
            out.append(Doubt(name, f"And {n - SAID} more {more} of this kind: {name}."))
    return tuple(out)
