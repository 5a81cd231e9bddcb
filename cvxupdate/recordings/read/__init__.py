"""Readers, one small file for each format. The list below is explicit: add a file, and its line
here."""

from __future__ import annotations

import os
from pathlib import Path

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Format, Options
from cvxupdate.recordings.read.hdf5 import HDF5
from cvxupdate.recordings.read.json_rows import JSON
from cvxupdate.recordings.read.mat import MAT
from cvxupdate.recordings.read.npz import NPZ
from cvxupdate.recordings.read.text import TEXT
from cvxupdate.recordings.read.uff import UFF
from cvxupdate.recordings.read.xlsx import XLSX
from cvxupdate.registry import READERS

FORMATS: tuple[Format, ...] = (NPZ, HDF5, MAT, XLSX, UFF, JSON, TEXT)
"""The package's own, in the order in which a file's first bytes are tried."""


def formats() -> tuple[Format, ...]:
    """Every format that can be read, text last: it looks like anything."""
    return tuple(sorted(READERS.members(), key=lambda fmt: fmt.anything))


def _choose(path: Path, head: bytes, wanted: str | None) -> Format:
    """The format by name, else by ending and content; a file whose content contradicts its ending
    is refused."""
    known = formats()
    if wanted is not None:
        names = {name: fmt for fmt in known for name in (fmt.name, *fmt.also)}
        if wanted.lower() not in names:
            raise RecordingError(
                f"{path}: format {wanted!r} is not supported. Formats: "
                f"{', '.join(fmt.name for fmt in known)}."
            )
        return names[wanted.lower()]
    ending = path.suffix.lower()
    by_ending = [fmt for fmt in known if ending in fmt.endings]
    looks_like = next(fmt for fmt in known if fmt.looks(head))
    if not by_ending:
        return looks_like
    chosen = next((fmt for fmt in by_ending if fmt.looks(head)), None)
    if chosen is not None:
        return _undisguised(path, head, known) or chosen if chosen.anything else chosen
    other = (
        f" Its content looks like {looks_like.name}: rename it, or set format = "
        f'"{looks_like.name}".'
        if not looks_like.anything
        else " The file is damaged, or it is another kind of file: set format, or export it again."
    )
    raise RecordingError(f"{path}: it does not start like a {ending} file does.{other}")


def _undisguised(path: Path, head: bytes, known: tuple[Format, ...]) -> Format | None:
    """The format of a file that is text by its ending, but not by its content."""
    hidden = next((fmt for fmt in known if fmt.disguised and fmt.looks(head)), None)
    if hidden is not None and hidden.disguised == "refused":
        raise RecordingError(
            f"{path}: it is named as text, but its content looks like {hidden.name}: rename it, "
            f'or set format = "{hidden.name}".'
        )
    return hidden


def _instead(path: Path) -> str:
    """What a path is that is not a file."""
    if os.path.isdir(path):
        return "is a folder. Name a file in it."
    if os.path.exists(path):
        return "is not a file that can be read through (a pipe or a device). Copy it into one."
    return "there is no such file."


def read_file(
    path: Path | str, options: Options | None = None, format: str | None = None
) -> Contents:
    """What a file holds: arrays, functions, shapes, the facts it states, and notes on what was left
    out.

    Every fault of a file becomes a `RecordingError` that names it: missing, empty, cut short,
    damaged, mislabelled.
    """
    path = Path(path)
    try:
        if not os.path.isfile(path):  # False, too, for a name that cannot be one
            raise RecordingError(f"{path}: {_instead(path)}")
        with path.open("rb") as file:
            head = file.read(1024)
        if not head:
            raise RecordingError(f"{path}: the file is empty.")
        return _choose(path, head, format).read(path, options or Options())
    except RecordingError:
        raise
    except MemoryError as error:
        raise RecordingError(
            f"{path}: it does not fit into memory. Cut it, or read it in blocks."
        ) from error
    except Exception as error:
        # the libraries that parse these formats raise whatever a damaged byte leads them to
        raise RecordingError(
            f"{path}: it cannot be read ({type(error).__name__}: {str(error)[:200]}). The "
            "file is cut short or damaged: copy or export it again."
        ) from error
