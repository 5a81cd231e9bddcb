"""Tables of the modes in responses: where a real structure is off from its model by more than a
light resonance is wide, frequencies and shapes still tell what is missing."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.modes.foreign import without
from cvxupdate.diagnose.types import Progress
from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, TimeHistory

FEWEST = 5  # modes: fewer tell little of what is missing
# The lowest modes that are looked at: ten with their shapes tell kinds and places apart; waves of
# higher ones are so short that where in an element a lump stands counts, which no candidate says.
LOWEST = 10


def identified(
    recordings: Sequence[FrequencyResponse | TimeHistory],
    band: tuple[float, float],
    progress: Progress,
) -> list[ModeTable]:
    """Of each set of sensors the modes in ``band`` (Hz), with deviations, where they have any
    (`cvxupdate.recordings.identify.identify_modes`); none at all where no recording has enough."""
    from cvxupdate.recordings.identify import identify_modes

    tables = []
    for recording in recordings:
        progress(f"identifying the modes in {recording.origin.name}")
        try:
            frf = _frf(recording)
            found = None if frf is None else identify_modes(frf, band)
        except RecordingError:
            continue
        if found is not None and found.frequency.size:
            tables.append(_lowest(found.to_table()))
    most = max((len(t.frequency) for t in tables), default=0)
    return _of_each_set(tables) if most >= FEWEST else []


def _of_each_set(tables: Sequence[ModeTable]) -> list[ModeTable]:
    """Of each set of sensors the table with most modes: the same modes once more say nothing new
    of what a model misses of them."""
    best: dict[frozenset[str], ModeTable] = {}
    for table in sorted(tables, key=lambda t: -len(t.frequency)):
        best.setdefault(frozenset(c.label for c in table.channels), table)
    return list(best.values())


def _lowest(table: ModeTable) -> ModeTable:
    """Those `LOWEST` ones."""
    return without(table, range(LOWEST, len(table.frequency))) or table


def _frf(recording: FrequencyResponse | TimeHistory) -> FrequencyResponse | None:
    """None of a record without force, or of blows, in which responses go on beyond their blocks."""
    from cvxupdate.recordings.impacts import struck
    from cvxupdate.recordings.spectral import frf_from_time, main_motion, usual_method

    if isinstance(recording, FrequencyResponse):
        return recording
    forced = any(c.quantity == "force" for c in recording.channels)
    quantity = main_motion(recording)
    if not forced or quantity is None or struck(recording):
        return None
    return frf_from_time(recording, method=usual_method(recording), quantity=quantity)
