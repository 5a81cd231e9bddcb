"""What a file holds, before a problem file says what it means: the one thing that every reader
gives back."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

AnyArray = NDArray[Any]
Progress = Callable[[str, int, int], None]
"""Called during a long task with ``(what, done, total)``."""


@dataclass(frozen=True)
class Options:
    """How to read a file where its own words do not suffice; every field may stay empty.

    ``delimiter``, ``decimal`` (``"."`` or ``","``), ``encoding``, ``skip_rows`` (lines left out on
    top) and ``header_lines`` (lines of header after those) are for text files. ``only`` names the
    arrays that are wanted, so that a container with hundreds of megabytes of others need not be
    read. ``progress`` is called while a large file is read; it does not affect the reading.
    """

    delimiter: str | None = None
    decimal: str | None = None
    encoding: str | None = None
    skip_rows: int | None = None
    header_lines: int | None = None
    only: frozenset[str] | None = None
    progress: Progress | None = field(default=None, compare=False)


@dataclass(frozen=True)
class Point:
    """Where a function was measured: node, DOF kind ("" when the file does not say) and sign of the
    direction."""

    node: int
    dof: str
    sign: int = 1


@dataclass(frozen=True)
class Function:
    """One Universal File Format data set 58: a function at a DOF.

    ``kind`` is the function type (1 time, 2 auto spectrum, 3 cross spectrum, 4 FRF, 6 coherence …);
    ``start`` and ``step`` the even abscissa, ``abscissa`` the uneven one (None when even);
    ``values`` (points,) real or complex, possibly a view of the file on disk; ``quantity`` and
    ``per`` of the ordinate and of its denominator; ``scale`` the factor to SI, signs left out.
    """

    kind: int
    response: Point
    reference: Point
    start: float
    step: float
    abscissa: AnyArray | None
    values: AnyArray
    quantity: str
    per: str
    unit: str
    scale: float
    title: str = ""


@dataclass(frozen=True)
class Shape:
    """One Universal File Format data set 55: a mode. ``values`` (nodes, 3 or 6), ``frequency`` Hz,
    ``damping`` (NaN unknown)."""

    frequency: float
    damping: float
    nodes: NDArray[np.int64]
    values: AnyArray
    quantity: str


@dataclass(frozen=True)
class Contents:
    """Named arrays, functions and shapes of one file, with the facts it states about itself.

    ``arrays`` holds the table of a text file under ``"data"`` (rows, columns); ``columns`` and
    ``units`` are that table's header (empty where it has none); ``rate`` in Hz where the file
    states it; ``nodes`` maps a node to its coordinates in metres; ``notes`` says what could not be
    read and was left out. Part of that is ``damage``: recorded numbers that are gone, or stand in
    the arrays as NaN; and ``cut``: what was lost of the last line of a table.
    """

    file: str
    format: str
    arrays: Mapping[str, AnyArray] = field(default_factory=dict)
    columns: tuple[str, ...] = ()
    units: tuple[str, ...] = ()
    rate: float | None = None
    functions: tuple[Function, ...] = ()
    shapes: tuple[Shape, ...] = ()
    nodes: Mapping[int, tuple[float, float, float]] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    damage: tuple[str, ...] = ()
    cut: tuple[str, ...] = ()


@dataclass(frozen=True)
class Format:
    """A format: its ``name`` in problem files and others that it goes by (``also``), the endings of
    its files, how its first bytes look, and its reader.

    ``disguised`` says what happens to such a file under a name of text files: it is "refused", or
    "read" as what it is; empty where text may begin like it. ``anything`` is for text, which is
    tried when the first bytes look like no other format's.
    """

    name: str
    endings: tuple[str, ...]
    looks: Callable[[bytes], bool]
    read: Callable[[Path, Options], Contents]
    also: tuple[str, ...] = ()
    disguised: Literal["", "refused", "read"] = ""
    anything: bool = False
