"""Matrices as finite-element programs write them: values, and the node and direction of each row
where the file knows them.

| ending | written by | knows its DOFs |
|---|---|---|
| ``.mtx`` | Matrix Market; Abaqus (``*MATRIX GENERATE``) | Abaqus: yes |
| ``.sti``, ``.mas`` | CalculiX (``SOLVER=MATRIXSTORAGE``) | ``.dof`` beside it |
| ``.pch``, ``.dmig`` | Nastran, DMIG cards | yes |
| ``.op4`` | Nastran, OUTPUT4 (read by pyyeti) | no |
| ``.hb``, ``.rsa``, ``.rua`` | Harwell–Boeing: Ansys (``HBMAT``) | ``.mapping`` beside it |
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from functools import lru_cache
from pathlib import Path

from cvxupdate.errors import ModelError
from cvxupdate.fe.files.abaqus import read_mtx
from cvxupdate.fe.files.calculix import read_calculix
from cvxupdate.fe.files.dmig import read_dmig
from cvxupdate.fe.files.found import Found
from cvxupdate.fe.files.harwell_boeing import read_harwell_boeing
from cvxupdate.fe.files.op4 import read_op4

__all__ = ["READERS", "Found", "read_matrices"]

READERS: Mapping[str, Callable[[Path], Found]] = {
    ".mtx": read_mtx,
    ".sti": read_calculix,
    ".mas": read_calculix,
    ".pch": read_dmig,
    ".dmig": read_dmig,
    ".op4": read_op4,
    ".hb": read_harwell_boeing,
    ".rsa": read_harwell_boeing,
    ".rua": read_harwell_boeing,
}

BESIDE = (".dof", ".mapping")
"""Endings of files that tell the DOFs of the one whose name they have."""


def read_matrices(path: Path) -> Found:
    """Every matrix of a file.

    Raises
    ------
    ModelError
        When it cannot be read; the message names the file and what is wrong.
    """
    files = [path, *(path.with_suffix(ending) for ending in BESIDE)]
    stats = [f.stat() for f in files if f.is_file()]
    return _read(path, tuple((s.st_mtime_ns, s.st_size) for s in stats))


@lru_cache(maxsize=4)
def _read(path: Path, state: tuple[tuple[int, int], ...]) -> Found:
    """The rows of a block name the same file again and again."""
    try:
        return READERS[path.suffix.lower()](path)
    except ModelError:
        raise
    except (OSError, ValueError, IndexError, KeyError, OverflowError, MemoryError) as error:
        what = str(error).splitlines()[0] if str(error) else type(error).__name__
        raise ModelError(
            f"{path}: cannot be read as the matrix file that its ending says ({what}). Export it "
            "again."
        ) from error
