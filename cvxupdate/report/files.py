"""The files of a command: where they go, and how they are written."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from contextlib import suppress
from pathlib import Path

from cvxupdate.errors import InputError


def folder_for(out: Path | None, name: str, command: str) -> Path:
    """The folder given, else out/<name of the problem>/<command>, so that no command overwrites
    what another one wrote."""
    return Path("out") / name / command if out is None else out


def must_be_writable(out: Path | None) -> None:
    """Say before the work, not after it, that the results have no place to go; creates nothing."""
    folder = Path("out") if out is None else out
    place = next((p for p in (folder, *folder.absolute().parents) if os.path.lexists(p)), Path("/"))
    if not place.is_dir():
        raise InputError(
            f"{folder}: the results cannot be written there ({place} is not a folder). Give "
            "another --out."
        )
    if not os.access(place, os.W_OK | os.X_OK):
        raise InputError(
            f"{folder}: the results cannot be written there ({place} may not be written to). "
            "Give another --out."
        )
    # Not everything shows in the permissions: a name too long, a file system of the kernel's. The
    # temporary file has no name, and is gone when it is closed.
    try:
        with suppress(FileNotFoundError):
            os.lstat(folder)
        tempfile.TemporaryFile(dir=place).close()
    except OSError as error:
        raise InputError(
            f"{folder}: the results cannot be written there ({error.strerror}). Give another --out."
        ) from error


def write_files(folder: Path, files: dict[str, str], replaced: Sequence[str] = ()) -> None:
    """Write files whole or not at all: into a temporary name first, then moved into place.

    Those of the ``replaced`` names that are not among the files are of an earlier call: they are
    taken away, so that a folder never holds the page of one result and the model of another.
    """
    try:
        folder.mkdir(parents=True, exist_ok=True)
        staged = []
        for name, text in files.items():
            final = folder / name
            final.parent.mkdir(exist_ok=True)
            temporary = final.with_name(f".{final.name}.{os.getpid()}.part")
            staged.append((temporary, final))
            temporary.write_text(text, encoding="utf-8")
        for temporary, final in staged:
            os.replace(temporary, final)
        for name in set(replaced) - set(files):
            (folder / name).unlink(missing_ok=True)
    except OSError as error:
        for temporary, _ in staged if "staged" in locals() else []:
            temporary.unlink(missing_ok=True)
        raise InputError(
            f"{folder}: the results cannot be written there ({error.strerror or error}). Give "
            "another --out."
        ) from error
