"""Is something in another unit than it is said to be? The recordings and the model as they came,
and with one mistake taken back after the other.

A recording is looked into only where it is grossly off: in the median its levels by a factor of
2.5, its natural frequencies by 1.8. No effect of the catalogue does that to a sound model; where
one does, no unit takes it back. A mistake is named when it leaves less than a third of the
distance, next to no common factor, and little beside the shape that the model's responses have of
themselves (a mass line could be any other's).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.correlate.plausible.changes import AXES, Change, changes_of
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.correlate.plausible.levels import Levels, levels_of
from cvxupdate.correlate.plausible.models import Mistake, mistakes
from cvxupdate.correlate.plausible.seen import (
    GROSS_FREQUENCY,
    Against,
    Seen,
    explains,
    joined,
    of_levels,
)
from cvxupdate.correlate.plausible.tables import Table, modes_of
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.spec import Spec

ALIKE = 0.1
"""Distances (nepers) that cannot be told from one another: so far off are sound models."""
MOST = 6
"""Recordings of one kind that are looked into, at most: a unit is that of a set."""
QUANTITY = "quantity of the responses"
"""Name of the check that says that responses are of another quantity than they are called."""
FEW = 3
"""Of these, recordings that a mistake of the model is held against: it is in all of them."""
HOPELESS = 0.6
"""Of the distance at first, left in one recording, from which on the others need not be asked."""
LARGEST = 4000
"""DOFs above which the model is not built anew with its mistakes taken back: each takes seconds."""


def unit_doubts(spec: Spec, model: Model, recordings: Sequence[Recording]) -> tuple[Doubt, ...]:
    """What is probably in another unit than it is said to be, or on its side."""
    bare = Against(replace(model, modal_damping=()))
    driven = [r for r in recordings if not isinstance(r, ModeTable)][:MOST]
    levels = [found for r in driven for found in levels_of(r)]
    tables = [Table(r.origin.name, r) for r in recordings if isinstance(r, ModeTable)][:MOST]
    at_first = [(x, of_levels(x, bare)) for x in levels]
    judged = [(x, s) for x, s in at_first if s is not None]
    modes = modes_of(model, tables) if tables else None
    logs_ = [] if modes is None else [(t, t.logs(modes, model)) for t in tables]
    paired = [(t, Seen(v, GROSS_FREQUENCY, np.inf)) for t, v in logs_ if len(v)]
    every = [s for _, s in judged] + [s for _, s in paired]
    wrong = [s for s in every if s.off]
    if not wrong:
        return ()
    found: list[tuple[float, Doubt]] = []
    if 2 * len(wrong) > len(every):
        found += _in_the_model(spec, model, judged, paired)
    found += _in_the_recordings(judged, bare, recordings)
    found += _in_the_tables(paired)
    if not found:
        return ()
    found.sort(key=lambda item: item[0])
    tied = [d for left, d in found if left <= found[0][0] + ALIKE]
    if any(not d.recording for d in tied):  # of the model: all recordings are explained by it
        return (_one(tied),)
    out = []
    for name in dict.fromkeys(d.recording for _, d in found if d.recording):
        mine = [(left, d) for left, d in found if d.recording == name]
        out.append(_one([d for left, d in mine if left <= mine[0][0] + ALIKE]))
    return tuple(out)


def _one(doubts: Sequence[Doubt]) -> Doubt:
    """Doubts that cannot be told from one another as one: the likeliest, then what else it may
    be."""
    questions = dict.fromkeys(d.says.rsplit(": ", 1)[-1] for d in doubts[1:])
    more = "".join(f" Or {q}" for q in questions if q not in doubts[0].says)
    return replace(doubts[0], says=doubts[0].says + more)


def _in_the_model(
    spec: Spec,
    model: Model,
    judged: Sequence[tuple[Levels, Seen]],
    paired: Sequence[tuple[Table, Seen]],
) -> list[tuple[float, Doubt]]:
    """Mistakes of the model, held against all recordings together."""
    if model.size > LARGEST or any(b.kind.name == "matrix" for b in model.blocks):
        return []
    judged = judged[:FEW]
    before = joined([s for _, s in judged] + [s for _, s in paired])
    first = _first(model)
    out = []
    for mistake in mistakes(spec):
        other = mistake.model()
        if other is None:
            continue
        now: list[Seen] = []
        for x, s in judged:
            own = of_levels(x, Against(other))
            if own is None or own.distance > HOPELESS * s.distance:
                break
            now.append(own)
        if len(now) < len(judged):
            continue
        if paired:
            modes = modes_of(other, [t for t, _ in paired])
            if modes is None:
                continue
            logs_ = [t.logs(modes, other) for t, _ in paired]
            now += [Seen(v, GROSS_FREQUENCY, np.inf) for v in logs_ if len(v)]
        if len(now) < len(judged) + len(paired):
            continue  # a table that can no longer be paired
        whole = joined(now)
        if explains(whole, before, np.inf):
            out.append((whole.distance, _model_doubt(mistake, first, _first(other))))
    return out


def _first(model: Model) -> float:
    """The lowest natural frequency in Hz."""
    try:
        flexible = model_modes(model, 1).flexible().frequencies
    except ModelError:
        return float("nan")
    return float(flexible[0]) if len(flexible) else float("nan")


def _model_doubt(mistake: Mistake, first: float, other: float) -> Doubt:
    ratio = first / other
    if not np.isfinite(ratio) or abs(np.log(ratio)) < 0.1:
        return Doubt(
            "units of the model",
            f"The model's responses are not of the recordings' size: {mistake.asks}",
            value=ratio,
        )
    times = f"{_number(ratio)} times" if ratio > 1.0 else f"1/{_number(1.0 / ratio)} of"
    says = f"The model's frequencies are {times} the measured ones: {mistake.asks}"
    return Doubt("units of the model", says, value=ratio)


def _in_the_recordings(
    judged: Sequence[tuple[Levels, Seen]], model: Against, recordings: Sequence[Recording]
) -> list[tuple[float, Doubt]]:
    """Units of recordings of responses: of all that are off together, else of each."""
    off = [(x, s) for x, s in judged if s.off]
    if not off:
        return []
    groups: dict[tuple[bool, str, frozenset[str]], list[tuple[Levels, Seen]]] = {}
    for x, s in off:
        key = (x.damped, x.measured.quantity, frozenset(c.unit for c in x.measured.responses))
        groups.setdefault(key, []).append((x, s))
    out = []
    for (damped, quantity, units), members in groups.items():
        changes = changes_of("time" if damped else "frf", quantity, units)
        together = _best(members, model, changes)
        parts = (
            [together]
            if together or len(members) == 1
            else [_best([one], model, changes) for one in members]
        )
        out += [p for part in parts for p in part]
    return out


def _best(
    members: Sequence[tuple[Levels, Seen]], model: Against, changes: Sequence[Change]
) -> list[tuple[float, Doubt]]:
    """Every change that explains these recordings together."""
    before = joined([s for _, s in members])
    names = tuple(dict.fromkeys(x.name for x, _ in members))
    out = []
    for change in changes:
        now: list[Seen] = []
        for x, s in members:
            own = of_levels(x, model, change)
            if own is None or own.distance > HOPELESS * s.distance:
                break
            now.append(own)
        if len(now) < len(members):
            continue
        whole = joined(now)
        size = abs(float(np.log(change.factor))) if change.factor != 1.0 else np.inf
        if explains(whole, before, size):
            out.append((whole.distance, _doubt(change, before, names)))
    return out


def _doubt(change: Change, before: Seen, names: Sequence[str]) -> Doubt:
    who = names[0] if len(names) == 1 else f"{names[0]} and {len(names) - 1} more"
    if change.factor != 1.0:
        factor = change.factor
        how = (
            f"{factor:.4g} times too large"
            if factor > 1.0
            else f"{1.0 / factor:.4g} times too small"
        )
        says = f"Every response of {who} is {how} for this model: {change.asks}"
        return Doubt("unit of the responses", says, names[0], value=factor)
    if change.power:
        says = f"The responses of {who} grow with frequency as another quantity does: {change.asks}"
        return Doubt(QUANTITY, says, names[0], value=float(change.power))
    return Doubt("frequency axis", _axis_says(who, change), names[0], value=change.axis)


def _axis_says(who: str, change: Change) -> str:
    a = change.axis
    how = f"{1.0 / a:.4g} times too high" if a < 1.0 else f"{a:.4g} times too low"
    return f"The frequencies of {who} are {how} for this model: {change.asks}"


def _in_the_tables(paired: Sequence[tuple[Table, Seen]]) -> list[tuple[float, Doubt]]:
    out = []
    for table, seen in paired:
        if not seen.off:
            continue
        for change in AXES["modes"]:
            now = replace(seen, values=seen.values - np.log(change.axis))
            if explains(now, seen, abs(float(np.log(change.axis)))):
                out.append(
                    (
                        now.distance,
                        Doubt(
                            "frequency axis",
                            _axis_says(table.name, change),
                            table.name,
                            value=change.axis,
                        ),
                    )
                )
    return out


def _number(value: float) -> str:
    """Three digits, without an exponent where there is room."""
    rounded = float(f"{value:.3g}")
    return f"{rounded:.0f}" if 1e3 <= rounded < 1e7 else f"{value:.3g}"
