"""What recordings say by themselves, in words: one line for each tell-tale that shows."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.settings import LOPSIDED, TELLTALE, UNEVEN, UNFORCED_PART
from cvxupdate.physics.place import listed
from cvxupdate.recordings.mains import tones
from cvxupdate.recordings.telltales import (
    Change,
    asymmetry,
    change,
    change_of_frfs,
    channels_of,
    halves,
    ring_down,
    stretch,
    unforced,
)
from cvxupdate.recordings.types import FrequencyResponse, Recording, TimeHistory

ALIKE = 0.02  # relative difference of levels that are one


def telltale_lines(recordings: Sequence[Recording], drifts: bool = False) -> list[str]:
    """Of the time histories and FRFs that are fitted; nothing of their levels where the structure
    ``drifts`` from one recording to the next, which looks like a level's doing."""
    frfs = [r for r in recordings if isinstance(r, FrequencyResponse)]
    lines = [] if drifts else _of_frfs(frfs)
    runs = [r for r in recordings if isinstance(r, TimeHistory) and r.origin.use == "fit"]
    runs = [r for r in runs if channels_of(r) is not None]
    if not runs:
        return lines
    loudest = max(runs, key=_level)
    lines += [*([] if drifts else _between_levels(runs)), *_at_one_level(runs)]
    lines += [*_asymmetry(loudest), *_unforced(loudest), *_hum(runs)]
    return lines + [line for r in runs for line in _ring_down(r)]


def _level(history: TimeHistory) -> float:
    known = channels_of(history)
    own = 0.0 if known is None else float(np.sqrt(np.mean(known[0] ** 2)))
    return own if history.origin.level is None else history.origin.level


def _between(a: TimeHistory, b: TimeHistory) -> Change | None:
    parts = stretch(a), stretch(b)
    return None if parts[0] is None or parts[1] is None else change(parts[0], parts[1])


def _amount(value: float, deviation: float) -> str:
    return f"{100.0 * abs(value):.2g} ± {100.0 * deviation:.1g} %"


def _between_levels(runs: Sequence[TimeHistory]) -> list[str]:
    low, high = min(runs, key=_level), max(runs, key=_level)
    if _level(high) <= (1.0 + ALIKE) * _level(low):
        return []
    return _how(_between(low, high), _level(low), _level(high))


def _of_frfs(recordings: Sequence[FrequencyResponse]) -> list[str]:
    """Of those at the lowest and the highest level."""
    levels = [(r.origin.level, r) for r in recordings if r.origin.use == "fit" and r.origin.level]
    if not levels:
        return []
    (a, low), (b, high) = (pick(levels, key=lambda pair: pair[0]) for pick in (min, max))
    return _how(change_of_frfs(low, high), a, b) if b > (1.0 + ALIKE) * a else []


def _how(found: Change | None, low: float, high: float) -> list[str]:
    """What resonances do from a ``low`` to a ``high`` level."""
    if found is None:
        return []
    says = []
    if found.shifts(*TELLTALE):
        up = found.shift > 0.0
        how = "up: it stiffens (a stop that closes, a hardening spring)"
        if not up:
            how = "down: it softens (slip, free play, a softening spring)"
        says.append(f"resonances move by {_amount(found.shift, found.shift_deviation)}, {how}")
    if found.widens(*TELLTALE):
        how = "grow wider: damping rises with the level"
        if found.wider < 0.0:
            how = "grow narrower: damping falls with the level, as with dry friction"
        says.append(f"they {how}" if says else f"resonances {how}")
    if not says:
        return []
    return [f"From level {low:.3g} to level {high:.3g} {'; '.join(says)}."]


def _at_one_level(runs: Sequence[TimeHistory]) -> list[str]:
    """Within runs and between runs at one level: what moves there goes with time."""
    out = []
    for r in runs:
        found = halves(r)
        if found is not None and found.shifts(*TELLTALE):
            out.append(
                f"Within {r.origin.name}, from its first half to its second under the same force, "
                f"resonances move {_way(found)}: that goes with time, not with the level."
            )
    for i, a in enumerate(runs):
        for b in runs[i + 1 :]:
            if abs(_level(a) - _level(b)) > ALIKE * _level(a):
                continue
            found = _between(a, b)
            if found is not None and found.shifts(*TELLTALE):
                out.append(
                    f"From {a.origin.name} to {b.origin.name}, at one level, resonances move "
                    f"{_way(found)}: the structure changed in between."
                )
    return out


def _way(found: Change) -> str:
    way = "up" if found.shift > 0.0 else "down"
    return f"{way} by {_amount(found.shift, found.shift_deviation)}"


def _asymmetry(loudest: TimeHistory) -> list[str]:
    found = asymmetry(loudest)
    if found is None or abs(found[0]) < max(LOPSIDED, TELLTALE[1] * found[1]):
        return []
    return [
        f"The motion is lopsided (third moment {found[0]:.2g} ± {found[1]:.1g}), the force is not: "
        "an even law, such as a stop on one side."
    ]


def distorted(recordings: Sequence[Recording]) -> bool:
    """Whether the loudest run that is fitted answers where nothing was forced."""
    runs = [r for r in recordings if isinstance(r, TimeHistory) and r.origin.use == "fit"]
    return bool(runs) and bool(_unforced(max(runs, key=_level)))


def _unforced(loudest: TimeHistory) -> list[str]:
    part = unforced(loudest)
    if part is None or part < UNFORCED_PART:
        return []
    return [
        f"{100.0 * part:.2g} % of the motion at level {_level(loudest):.3g} answers at frequencies "
        "where nothing was forced: distortion, which no linear structure makes."
    ]


def _hum(runs: Sequence[TimeHistory]) -> list[str]:
    """Of the mains, at what frequencies."""
    known = [(r.origin.name, {round(t.frequency) for t in tones(r)}) for r in runs]
    heard = [name for name, found in known if found]
    if not heard:
        return []
    at = listed([f"{f} Hz" for f in sorted(set().union(*(found for _, found in known)))])
    return [f"Mains hum at {at} was taken out of {listed(heard)}: it does not grow with the force."]


def _ring_down(history: TimeHistory) -> list[str]:
    found = ring_down(history)
    if found is None:
        return []
    (f0, f1), (z0, z1) = found.frequency, found.damping
    moved, grown = f1 / f0 - 1.0, z1 / max(z0, 1e-12) - 1.0
    says = []
    if abs(moved) > TELLTALE[0]:
        how = "falls" if moved < 0.0 else "rises"
        says.append(f"its frequency {how} from {f0:.4g} to {f1:.4g} Hz")
    if abs(grown) > UNEVEN:
        how = "rises" if grown > 0.0 else "falls"
        says.append(f"its damping {how} from {100 * z0:.2g} to {100 * z1:.2g} %")
    if not says:
        return []
    return [
        f"In the ring-down of {history.origin.name}, while the amplitude falls to "
        f"1/{found.ratio:.2g}, {' and '.join(says)}."
    ]
