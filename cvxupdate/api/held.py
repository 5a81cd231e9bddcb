"""Arrays of a program's own, kept as files while something needs them.

A problem names files; what comes from memory is put into one, so that it takes the very way of a
problem file and its files: the same checks, the same numbers, results that can be saved and run
again from the command line. Numbers go there and back unchanged. The folder is the process's own
and goes with it; each file goes with the object that made it.
"""

from __future__ import annotations

import contextlib
import itertools
import os
import shutil
import tempfile
import weakref
from collections.abc import Mapping
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import InputError
from cvxupdate.spec.write import FILED

_COUNT = itertools.count(1)
DATA = "data"
"""The folder beside a saved problem that takes its files."""


class Held:
    """A file that lives as long as this object: ``path``."""

    def __init__(self, name: str, arrays: Mapping[str, Any]) -> None:
        self.path = _folder() / f"{name}{next(_COUNT)}.npz"
        try:
            np.savez(self.path, **arrays)
        except OSError as error:
            raise InputError(
                f"{self.path}: the arrays cannot be kept there ({error.strerror}). Give room, or "
                "let TMPDIR name another folder."
            ) from error
        weakref.finalize(self, _remove, self.path)


def carried(tables: Any, folder: Path) -> Any:
    """The tables of a problem with its kept files copied into ``folder``/data, which they name
    then."""
    if isinstance(tables, Mapping):
        return {k: _moved(k, v, folder) for k, v in tables.items()}
    return [carried(v, folder) for v in tables] if isinstance(tables, list) else tables


def _moved(key: str, value: Any, folder: Path) -> Any:
    if key in FILED and isinstance(value, str) and Path(value).parent == _folder():
        target = (folder / DATA / Path(value).name).absolute()
        try:
            target.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(value, target)
        except OSError as error:
            raise InputError(f"{target}: cannot be written ({error.strerror}).") from error
        return str(target)
    return carried(value, folder)


@lru_cache(maxsize=1)
def _folder() -> Path:
    made = Path(os.path.realpath(tempfile.mkdtemp(prefix="cvxupdate-")))
    weakref.finalize(Held, shutil.rmtree, made, ignore_errors=True)  # at the end of the process
    return made


def _remove(path: Path) -> None:
    with contextlib.suppress(OSError):
        path.unlink(missing_ok=True)
