"""Which columns of a table form an FRF each: complex numbers, real and imaginary parts, modulus or
decibels with a phase, a coherence beside; by the names of the columns, else by their values."""

from __future__ import annotations

import re
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.read.column_words import FORM, PARTNER, role_of
from cvxupdate.recordings.read.contents import AnyArray

_PLACE = re.compile(
    r"(?<![A-Za-z0-9.])(?:n|p|node|point|pt|ch|channel|sensor)?[ _-]*(?P<node>\d{1,6})"
    r"(?:\s*[:._ ]?\s*(?P<sign>[+-]?)(?P<dof>r?[xyz])(?![a-z]))?",
    re.IGNORECASE,
)


@dataclass(frozen=True)
class FrfColumns:
    """One FRF: its ``column``, how it and its ``pair`` write a complex number, the columns' common
    name, the coherence; ``node``, ``dof`` and ``sign`` as far as the name says them."""

    column: int
    form: str = "complex"
    pair: int | None = None
    name: str = ""
    coherence: int | None = None
    node: int | None = None
    dof: str = ""
    sign: int = 1
    phase_unit: str = "deg"


def frf_columns(data: AnyArray, names: Sequence[str], units: Sequence[str]) -> list[FrfColumns]:
    """The FRFs of a table whose first column is the frequency."""
    count = data.shape[1]
    if data.dtype.kind == "c":
        return [_placed(FrfColumns(k, name=names[k])) for k in range(1, count)]
    roles = [role_of(names[k], units[k]) for k in range(count)]
    known = [role for role, _ in roles[1:]]
    if not any(known):
        return _by_values(data, names)
    used: set[int] = set()
    out = []
    for k in range(1, count):
        role, rest = roles[k]
        partner = PARTNER.get(role)
        if partner is None and (role or k in used):
            continue
        pair = next(
            (j for j in range(1, count) if j not in used and roles[j] == (partner, rest)), None
        )
        if pair is None and partner is not None and k + 1 < count and roles[k + 1][0] == partner:
            pair = k + 1
        used |= {k} if pair is None else {k, pair}
        form = FORM.get(role, "magnitude-phase")
        coherence = next((j for j in range(1, count) if roles[j] == ("coherence", rest)), None)
        if coherence is None and known.count("coherence") == 1 and len(used) + 2 == count:
            coherence = next(j for j in range(1, count) if roles[j][0] == "coherence")
        out.append(
            _placed(
                FrfColumns(
                    k,
                    form,
                    pair,
                    rest or names[k],
                    coherence,
                    phase_unit=_phase_unit(data, pair, units) if role != "real" else "deg",
                )
            )
        )
    return out


def _by_values(data: AnyArray, names: Sequence[str]) -> list[FrfColumns]:
    """Columns without telling names: pairs where every second one looks like a phase, or where
    both of a pair change sign; else moduli."""
    count = data.shape[1]
    if count >= 3 and count % 2:
        pairs = [(k, k + 1) for k in range(1, count, 2)]
        if all(_phase(data[:, j]) and not _signed(data[:, k]) for k, j in pairs):
            return [
                _placed(FrfColumns(k, "magnitude-phase", j, phase_unit=_unit_by_size(data[:, j])))
                for k, j in pairs
            ]
        if all(_phase(data[:, j]) and np.median(data[:, k]) < 0.0 for k, j in pairs) and all(
            np.abs(data[:, j]).max() > 4.0 for _, j in pairs
        ):
            return [_placed(FrfColumns(k, "db-phase", j)) for k, j in pairs]
        if all(_signed(data[:, k]) or _signed(data[:, j]) for k, j in pairs):
            return [_placed(FrfColumns(k, "real-imaginary", j, names[k])) for k, j in pairs]
    return [_placed(FrfColumns(k, "magnitude-phase", None, names[k])) for k in range(1, count)]


def _signed(x: AnyArray) -> bool:
    return bool(np.any(x < 0.0) and np.any(x > 0.0))


def _phase(x: AnyArray) -> bool:
    """Within one turn, in degrees or radians, and using a good part of it."""
    top = float(np.abs(x).max())
    return 0.5 < top <= 6.2832 or 30.0 < top <= 360.5


def _unit_by_size(x: AnyArray) -> str:
    return "rad" if float(np.abs(x).max()) <= 6.2832 else "deg"


def _phase_unit(data: AnyArray, pair: int | None, units: Sequence[str]) -> str:
    if pair is None:
        return "deg"
    stated = units[pair].lower()
    return stated if stated in ("deg", "rad") else _unit_by_size(data[:, pair])


def _placed(found: FrfColumns) -> FrfColumns:
    """With the node and direction that the name of the columns states."""
    places = list(_PLACE.finditer(found.name))
    if len(places) != 1:
        return found
    at = places[0]
    return FrfColumns(
        found.column,
        found.form,
        found.pair,
        found.name,
        found.coherence,
        int(at["node"]) or None,
        (at["dof"] or "").lower(),
        -1 if at["sign"] == "-" else 1,
        found.phase_unit,
    )


def frf_rows(found: Sequence[FrfColumns], quantity: str) -> list[str]:
    """``channels``: nodes as the columns name them, else counted, for no two channels may share a
    place; what is not the file's own is said."""
    stated = [(f.node, f.dof or "z") for f in found]
    counted = None in [f.node for f in found] or len(set(stated)) < len(stated)
    guessed = "nodes are counted, directions guessed" if counted else "directions are guessed"
    rows = [
        f"channels = [   # {guessed}: correct them"
        if counted or not all(f.dof for f in found)
        else "channels = ["
    ]
    for number, f in enumerate(found, 1):
        node, dof = (number, "z") if counted else (f.node, f.dof or "z")
        row = f'  {{ column = {f.column}, quantity = "{quantity}", node = {node}, dof = "{dof}"'
        row += f', form = "{f.form}"' if f.form != "complex" else ""
        row += f", pair = {f.pair}" if f.pair is not None else ""
        row += ', phase_unit = "rad"' if f.pair is not None and f.phase_unit == "rad" else ""
        row += f", coherence = {f.coherence}" if f.coherence is not None else ""
        row += ", sign = -1" if f.sign < 0 and not counted else ""
        name = "".join(c for c in f.name if c.isprintable())
        rows.append(row + " }," + (f"   # {name}" if counted and name else ""))
    return [*rows, "]"]
