"""Tables of the modes in responses: where a real structure is off from its model by more than a
light resonance is wide, frequencies and shapes still tell what is missing."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.diagnose.modes.foreign import without
from cvxupdate.diagnose.nominal.linear import SAME, different
from cvxupdate.diagnose.types import Progress, Real
from cvxupdate.errors import RecordingError
from cvxupdate.physics.shaker import MOST
from cvxupdate.recordings.types import Channel, FrequencyResponse, ModeTable, TimeHistory

FEWEST = 5  # modes: fewer tell little of what is missing
FEW = 4  # fewer do not tell where to begin
KNOWN = 3.0  # deviations from zero of an entry that is no noise
# The lowest modes that are looked at: ten with their shapes tell kinds and places apart; waves of
# higher ones are so short that where in an element a lump stands counts, which no candidate says.
LOWEST = 10


@dataclass(frozen=True)
class Identified:
    """A table of modes with what only FRFs tell of them: the ``drives``, and the modal constants
    φ_r φ_d of each mode, (modes, channels, drives), 1/kg, of shapes of unit modal mass."""

    table: ModeTable
    drives: tuple[Channel, ...]
    constants: Real


def driven(seen: Sequence[Identified]) -> tuple[str, ...]:
    """Where a shaker stood, at one place or two, which brings its mass along: labels of DOFs. A
    hammer that goes from place to place brings nothing."""
    labels = tuple(dict.fromkeys(f"n{c.node}.{c.dof}" for s in seen for c in s.drives))
    return labels if len(labels) <= MOST else ()


def identified(
    recordings: Sequence[FrequencyResponse | TimeHistory],
    band: tuple[float, float],
    progress: Progress,
    each: bool = False,
    fewest: int = FEWEST,
) -> list[Identified]:
    """Of each set of sensors (``each``: of every recording, however few) the modes in ``band``
    (Hz), with deviations, where they have any (`cvxupdate.recordings.identify.identify_modes`);
    none at all where recordings have too few between them."""
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
            table = heard(_lowest(found.to_table()))
            constants = np.real(found.constants[: len(table.frequency)])
            tables.append(Identified(table, found.references, constants))
    kept = tables if each else _of_each_set(tables)
    return kept if each or different(f for k in kept for f in k.table.frequency) >= fewest else []


def _of_each_set(tables: Sequence[Identified]) -> list[Identified]:
    """Of each set of sensors the table with most modes, and of the others the modes that it lacks
    (another drive, another axis): the same once more say nothing new of what a model misses."""
    kept: list[Identified] = []
    for found in sorted(tables, key=lambda t: -len(t.table.frequency)):
        labels = {c.label for c in found.table.channels}
        alike = [k.table for k in kept if {c.label for c in k.table.channels} == labels]
        known = [f for table in alike for f in table.frequency]
        again = [k for k, f in enumerate(found.table.frequency) if _near(f, known)]
        if len(again) < len(found.table.frequency):
            kept.append(without_rows(found, again))
    return kept


def _near(f: float, known: Sequence[float]) -> bool:
    return any(abs(f - other) <= SAME * other for other in known)


def without_rows(found: Identified, rows: Sequence[int]) -> Identified:
    """Without some of its modes; as it is where their errors are correlated."""
    table = without(found.table, rows) if rows else None
    if table is None:
        return found
    return Identified(table, found.drives, np.delete(found.constants, rows, axis=0))


def without_shapes_at(found: Identified, label: str) -> ModeTable:
    """Its table without what one channel says of the shapes."""
    table = found.table
    if table.shapes is None:
        return table
    shapes = table.shapes.copy()
    shapes[:, [k for k, c in enumerate(table.channels) if c.label == label]] = np.nan
    return replace(table, shapes=shapes)


def _lowest(table: ModeTable) -> ModeTable:
    """Those `LOWEST` ones."""
    return without(table, range(LOWEST, len(table.frequency))) or table


def heard(table: ModeTable) -> ModeTable:
    """Without entries of shapes that are as uncertain as the largest that is known is large: where
    a drive hardly moves a mode, channels that answer to others have noise there, which would be
    nearly all of the shape. What is left is told by its largest."""
    if table.shapes is None or table.shape_std is None:
        return table
    size = np.abs(table.shapes)
    std = np.broadcast_to(table.shape_std, size.shape)
    largest = np.max(np.where(size > KNOWN * std, size, 0.0), axis=1, initial=0.0)[:, None]
    told = (std < largest) | (largest == 0.0)
    top = np.max(np.where(told, size, 0.0), axis=1, initial=0.0)[:, None]
    scale = 1.0 / np.where(top > 0.0, top, 1.0)
    shapes, spread = np.where(told, table.shapes, np.nan), np.where(told, std, np.nan)
    return replace(table, shapes=scale * shapes, shape_std=scale * spread)


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
