"""`identify`: recordings in, modes with deviations out."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cvxupdate.commands.identified import Identified, ModeSetResult
from cvxupdate.commands.identify_ambient import of_responses
from cvxupdate.commands.identify_damping import of_table, with_measured_damping
from cvxupdate.commands.identify_frf import of_frf
from cvxupdate.commands.identify_normal import routes_of
from cvxupdate.commands.identify_options import METHODS, Options
from cvxupdate.commands.sources import Source, open_source
from cvxupdate.errors import InputError, RecordingError

if TYPE_CHECKING:
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.read.contents import Progress
    from cvxupdate.recordings.types import Recording, TimeHistory
    from cvxupdate.spec.given import Given


def identify(
    given: Given,
    options: Options | None = None,
    progress: Progress | None = None,
) -> Identified:
    """Modes of every recording of a problem in any form, of [[recordings]] alone (a TOML file, its
    text or its tables), or of a raw file.

    Raises
    ------
    InputError
        For a fault of the input, or where no recording holds what modes can be identified from.
    """
    begin = time.perf_counter()
    chosen = Options() if options is None else options
    if chosen.normal is not None:
        routes_of(chosen.normal)
    source = open_source(given, chosen.rate, progress)
    sets: list[ModeSetResult] = []
    skipped: list[str] = []
    for recording in _wanted(source, chosen.recording):
        try:
            sets.append(_one(recording, chosen, source.model))
        except RecordingError as error:
            name, says = recording.origin.name, str(error)  # most name the recording already
            skipped.append(says if says.startswith(name) else f"{name}: {says}")
    if not sets:
        raise InputError("; ".join(skipped) or f"{source.path}: no recording to identify.")
    if source.model is not None:
        sets = with_measured_damping(sets, source.model)
    if len(sets) > 1:
        sets = [replace(s, file=f"modes_{k}.csv") for k, s in enumerate(sets, start=1)]
    return Identified(
        source.name,
        source.title,
        source.path,
        time.perf_counter() - begin,
        tuple(sets),
        source.geometry,
        chosen.line(),
        source.notes,
        tuple(skipped),
    )


def _wanted(source: Source, which: str | None) -> Sequence[Recording]:
    if not source.recordings:
        raise InputError(f"{source.path}: no recording. Add a [[recordings]] table.")
    if which is None:
        return source.recordings
    names = [r.origin.name for r in source.recordings]
    if which in names:
        return (source.recordings[names.index(which)],)
    if which.isdecimal() and 1 <= int(which) <= len(names):
        return (source.recordings[int(which) - 1],)
    listed = ", ".join(f"{k} {name}" for k, name in enumerate(names, start=1))
    raise InputError(f"{source.path}: no recording {which!r}. There are: {listed}.")


def _one(recording: Recording, o: Options, model: Model | None) -> ModeSetResult:
    from cvxupdate.recordings.types import FrequencyResponse, ModeTable

    if isinstance(recording, ModeTable):
        return of_table(recording)
    if isinstance(recording, FrequencyResponse):
        return of_frf(recording, "frf", o, (), model)
    return _of_time(recording, o, model)


def _of_time(history: TimeHistory, o: Options, model: Model | None) -> ModeSetResult:
    from cvxupdate.recordings.impacts import struck
    from cvxupdate.recordings.spectral import frf_from_time, main_motion, usual_method
    from cvxupdate.recordings.types import MOTIONS

    kinds = {c.quantity for c in history.channels if c.quantity in MOTIONS}
    quantity = main_motion(history)
    forced = any(c.quantity == "force" for c in history.channels)
    if quantity is None and (forced or not history.channels):
        raise RecordingError(
            "no channel reads a motion (displacement, velocity, acceleration): give quantity and "
            "unit of its channels in a [[recordings]] table; 'cvxupdate inspect' prints one"
        )
    o = o if o.band is not None else replace(o, band=history.band)
    if o.method == "ssi" or not forced or quantity is None:
        return of_responses(history, o, model)
    if o.estimator is None and struck(history):
        return _of_blows(history, o, quantity, len(kinds) > 1, model)
    way = o.estimator or usual_method(history)
    frf = frf_from_time(history, method=way, quantity=quantity)
    notes = [f"frequency responses estimated by {'local polynomials' if way == 'lpm' else way}"]
    if len(kinds) > 1:
        notes.append(_only(quantity))
    return of_frf(frf, "time", o, notes, model)


def _only(quantity: str) -> str:
    return f"only its channels of {quantity} are used"


def _of_blows(
    history: TimeHistory, o: Options, quantity: str, several: bool, model: Model | None
) -> ModeSetResult:
    """Of a hammer's record; the window that its blocks need comes on top of one that was applied
    when it was recorded."""
    from cvxupdate.recordings.impacts import frf_from_blows

    frf, blows, top = frf_from_blows(history, quantity)
    o = replace(
        o,
        band=o.band if o.band is not None else (4.0 * history.rate / blows.block, top),
        decay=o.decay + blows.decay,
    )
    hits = len(blows.starts)
    notes = [
        f"a record of {hits} blow{'s' if hits > 1 else ''}: frequency responses of whole blocks "
        f"of {blows.block / history.rate:.3g} s, no Hann window; the force reaches {top:.4g} Hz"
    ]
    if blows.rebounds:
        notes.append(
            "the hammer hit again within a block: where the two pulses cancel each other, modes "
            "may be found that the structure does not have. Compare with a single hit"
        )
    if hits == 1:
        notes.append("one blow alone: nothing tells its noise from the structure's own response")
    if several:
        notes.append(_only(quantity))
    return of_frf(frf, "time", o, notes, model)


__all__ = ["METHODS", "Options", "identify"]
