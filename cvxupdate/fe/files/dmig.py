"""Nastran's DMIG cards (a punch file, or a part of a bulk data file): small, large and free field.

Source: the public description of the card: a header ``DMIG NAME 0 IFO TIN TOUT POLAR - NCOL``,
then for each column ``DMIG NAME GJ CJ -`` with continuations of ``G C A B``; IFO 6 is symmetric, of
which one triangle is written; grid points have directions 1 to 6, scalar points 0.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.found import Found, Label, of_labels

SYMMETRIC, SQUARE = 6, 1
_EXPONENT = re.compile(r"(?<=[\d.])([+-]\d+)$")


class _Card:
    """One matrix as it is gathered: the form of its header, whether complex, its entries."""

    def __init__(self, form: int, kind: int) -> None:
        self.form, self.complex = form, kind in (3, 4)
        self.entries: list[tuple[int, int, int, int, float]] = []
        self.loss: list[float] = []


def read_dmig(path: Path) -> Found:
    """Every matrix of the file, by name; of a complex one the real part, and the imaginary part
    under its name with ``_imag``.

    Raises
    ------
    ModelError
        For a card that is none, or a matrix that is not square.
    """
    cards: dict[str, _Card] = {}
    for number, fields in _cards(path):
        try:
            _read(cards, fields)
        except (ValueError, IndexError, KeyError) as error:
            raise ModelError(
                f"{path}: line {number}: is no DMIG card that can be read ({error}). Export it "
                "again."
            ) from None
    if not cards:
        raise ModelError(f"{path}: holds no DMIG card.")
    matrices: dict[str, sp.csr_array] = {}
    labels: dict[str, tuple[Label, ...]] = {}
    held: frozenset[Label] = frozenset()
    for name, card in cards.items():
        if card.form not in (SYMMETRIC, SQUARE):
            continue  # loads and other rectangles
        table = np.array(card.entries, dtype=float).reshape(-1, 5)
        ends = [table[:, k].astype(np.int64) for k in range(4)]
        parts = {name: table[:, 4]}
        if card.complex:
            parts[f"{name}_imag"] = np.array(card.loss)
        for key, values in parts.items():
            A, at, stuck = of_labels(path, ends, values, card.form == SYMMETRIC)
            matrices[key], labels[key] = A, at
            held |= stuck
    if not matrices:
        raise ModelError(f"{path}: has no square matrix among {', '.join(cards)}.")
    return Found(matrices, labels, held)


def _read(cards: dict[str, _Card], fields: list[str]) -> None:
    name = fields[1].upper()
    if fields[2] == "0":
        cards[name] = _Card(int(fields[3]), int(fields[4]))
        return
    card = cards[name]
    column = (int(fields[2]), _direction(fields[3]))
    rest = fields[5:]
    for k in range(0, len(rest), 4):
        group = [*rest[k : k + 4], "", "", ""]
        if not group[0]:
            continue
        card.entries.append((int(group[0]), _direction(group[1]), *column, _number(group[2])))
        if card.complex:
            card.loss.append(_number(group[3]))


def _direction(text: str) -> int:
    """1 to 6; a scalar point moves along its own axis, x."""
    return int(text) or 1 if text else 1


def _number(text: str) -> float:
    """A number as Nastran writes it: 1.5D+3, 1.5+3, blank for zero."""
    if not text:
        return 0.0
    return float(
        _EXPONENT.sub(r"E\1", text.upper().replace("D", "E").replace("E+", "+").replace("E-", "-"))
    )


def _cards(path: Path) -> Iterator[tuple[int, list[str]]]:
    """Line number and fields of every DMIG card, continuations joined; field 0 is the card's
    name."""
    begun, fields = 0, list[str]()
    with path.open(encoding="latin-1") as file:
        for number, raw in enumerate(file, 1):
            line = raw.split("$")[0].rstrip().expandtabs(8)
            if not line:
                continue
            more = line[0] in "*+ ," and bool(fields)
            if not more:
                if fields:
                    yield begun, fields
                fields = []
            if more:
                fields += _fields(line)[1:]
            elif line.upper().startswith("DMIG"):
                begun, fields = number, _fields(line)
    if fields:
        yield begun, fields


def _fields(line: str) -> list[str]:
    """The fields of a line: the first, and the data, as many as a line has."""
    if "," in line:
        parts = [p.strip() for p in line.split(",")]
        return [*parts[:9], *[""] * (9 - len(parts))]
    if "*" in line[:8]:
        cells = [line[8 + 16 * k : 24 + 16 * k].strip() for k in range(4)]
    else:
        cells = [line[8 + 8 * k : 16 + 8 * k].strip() for k in range(8)]
    return [line[:8].strip().rstrip("*"), *cells]
