"""Readers, one small file for each format. The list below is explicit: add a file, and its line
here."""

from __future__ import annotations

import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Options
from cvxupdate.recordings.read.hdf5 import read_hdf5
from cvxupdate.recordings.read.json_rows import read_json
from cvxupdate.recordings.read.mat import read_mat
from cvxupdate.recordings.read.npz import read_npz
from cvxupdate.recordings.read.text import read_text
from cvxupdate.recordings.read.uff import read_uff
from cvxupdate.recordings.read.xlsx import read_xlsx


@dataclass(frozen=True)
class Format:
    """A format: its name in problem files, the endings of its files, how its first bytes look, and
    its reader."""

    name: str
    endings: tuple[str, ...]
    looks: Callable[[bytes], bool]
    read: Callable[[Path, Options], Contents]


def _is_uff(head: bytes) -> bool:
    return re.match(rb"(\s*-1\s*\r?\n)+\s*\d{1,4}b?\b", head) is not None


FORMATS: tuple[Format, ...] = (
    Format(
        "npz",
        (".npz", ".npy"),
        lambda head: head.startswith((b"PK\x03\x04", b"\x93NUMPY")),
        read_npz,
    ),
    Format(
        "hdf5",
        (".h5", ".hdf5", ".hdf", ".mat"),
        lambda head: b"\x89HDF\r\n\x1a\n" in head,
        read_hdf5,
    ),
    Format("mat", (".mat",), lambda head: head.startswith(b"MATLAB 5.0 MAT-file"), read_mat),
    Format("xlsx", (".xlsx",), lambda head: head.startswith(b"PK\x03\x04"), read_xlsx),
    Format("uff", (".uff", ".unv", ".uf", ".bunv"), _is_uff, read_uff),
    Format(
        "json",
        (".json",),
        lambda head: head.lstrip(b"\xef\xbb\xbf \t\r\n")[:1] in (b"{", b"["),
        read_json,
    ),
    Format(
        "text",
        (".csv", ".txt", ".dat", ".asc", ".tsv", ".lvm", ".prn", ""),
        lambda head: True,
        read_text,
    ),
)
"""Every format that can be read, in the order in which a file's first bytes are tried."""

_BINARY = ("npz", "hdf5", "mat")


def _choose(path: Path, head: bytes, wanted: str | None) -> Format:
    """The format by name, else by ending and content; a file whose content contradicts its ending
    is refused."""
    names = {fmt.name: fmt for fmt in FORMATS} | {
        "csv": FORMATS[-1],
        "txt": FORMATS[-1],
        "h5": FORMATS[1],
        "uff58": FORMATS[4],
    }
    if wanted is not None:
        if wanted.lower() not in names:
            raise RecordingError(
                f"{path}: format {wanted!r} is not supported. Formats: "
                f"{', '.join(fmt.name for fmt in FORMATS)}."
            )
        return names[wanted.lower()]
    ending = path.suffix.lower()
    by_ending = [fmt for fmt in FORMATS if ending in fmt.endings]
    for fmt in by_ending:
        if fmt.looks(head):
            return fmt
    looks_like = next(fmt for fmt in FORMATS if fmt.looks(head))
    if not by_ending:
        return looks_like
    other = (
        f" Its content looks like {looks_like.name}: rename it, or set format = "
        f'"{looks_like.name}".'
        if looks_like.name != "text"
        else " The file is damaged, or it is another kind of file: set format, or export it again."
    )
    if by_ending[0].name == "mat" and ending == ".mat" and looks_like.name == "text":
        other = ' It is damaged, or a MATLAB 4 file: set format = "mat" for the latter.'
    raise RecordingError(f"{path}: it does not start like a {ending} file.{other}")


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
        if not path.is_file():
            raise RecordingError(f"{path}: there is no such file.")
        with path.open("rb") as file:
            head = file.read(1024)
        if not head:
            raise RecordingError(f"{path}: the file is empty.")
        chosen = _choose(path, head, format)
        # text and CSV by ending, but a binary format by content
        if chosen.name == "text" and format is None:
            hidden = next(
                (fmt for fmt in FORMATS[:-1] if fmt.name in (*_BINARY, "uff") and fmt.looks(head)),
                None,
            )
            if hidden is not None and hidden.name == "uff":
                chosen = hidden
            elif hidden is not None:
                raise RecordingError(
                    f"{path}: it is named as text, but its content looks like {hidden.name}: "
                    "rename it, or set "
                    f'format = "{hidden.name}".'
                )
        return chosen.read(path, options or Options())
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
