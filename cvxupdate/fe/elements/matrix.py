"""Element or group matrices from another program: K = K₀ + Σ (1 + pᵢ) Kᵢ, with DOF labels.

A sparse symmetric matrix is held as one small block per stored entry: 1 × 1 on the diagonal, 2 × 2
(zero diagonal) beside it. So it arrives in every method like any other element, and no dense matrix
is formed.
"""

from __future__ import annotations

import zipfile
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, ClassVar

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError, RecordingError
from cvxupdate.fe.elements.base import Given, Real, Surroundings, Term, Values
from cvxupdate.fe.files import READERS, read_matrices
from cvxupdate.fe.files.found import Label
from cvxupdate.fe.labels import KINDS, parse_label
from cvxupdate.matfile import read_variables
from cvxupdate.spec.elements import MATRIX_FILES, ElementText, MatrixBlock, MatrixRow
from cvxupdate.unpacking import must_be_believable


@dataclass(frozen=True)
class Entries:
    """Entries of given matrices; ``size`` is 1 for diagonal ones, 2 for pairs."""

    matrix: str
    size: int
    name: str = "matrix"
    nodes: int = 0
    dofs: tuple[str, ...] = ()
    properties: tuple[str, ...] = ()
    text: ClassVar[ElementText] = ElementText(
        MatrixBlock, changes=("stiffness", "mass", "damping", "eta", "alpha", "beta")
    )
    brings: ClassVar[Mapping[str, str] | None] = None

    @classmethod
    def from_row(cls, row: MatrixRow, block: MatrixBlock, around: Surroundings) -> Iterator[Given]:
        """The matrices that the row names.

        Raises
        ------
        ModelError
            When one cannot be read, or its labels do not fit it.
        """
        named = {"K": row.stiffness, "M": row.mass, "C": row.damping, "D": row.structural}
        found: list[tuple[str, list[Label], sp.csr_array]] = []
        held: set[Label] = set()
        for matrix, name in named.items():
            if name is None:
                continue
            own = name.lower().endswith(MATRIX_FILES)
            path = around.folder / name if own else row.file
            if path is None:
                raise ModelError(
                    f"matrix row {row.id}: {name!r} names a variable, but no file is given. Add "
                    "`file`."
                )
            values, known, stuck = labelled_matrix(path, None if own else name)
            held |= stuck
            found.append((matrix, _labels(row, path, values.shape[0], known), values))
        kinds = {KINDS[kind] for _, labels, _ in found for _, kind in labels}
        missing = sorted(kinds - set(around.active), key=KINDS.index)
        if missing:
            raise ModelError(
                f"matrix row {row.id}: it has DOFs along {', '.join(missing)}, which model.dofs "
                "does not have. Add them there."
            )
        for matrix, labels, values in found:
            keep = [i for i, label in enumerate(labels) if label not in held]
            if len(keep) < len(labels):  # a huge number on the diagonal of K holds it
                values = values[keep][:, keep]
            yield Given(matrix, tuple(labels[i] for i in keep), values)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the terms of given matrices come from their file."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """One: only the p-values act on a given matrix."""
        return {"one": np.ones_like(properties["stiffness"])}


def _labels(row: MatrixRow, path: Path, size: int, known: Sequence[Label] | None) -> list[Label]:
    """(node id, kind) of every row of a given matrix; "auto": as its file says, else row i is
    n<i>.x."""
    if row.labels == "auto":
        return [(i + 1, 0) for i in range(size)] if known is None else list(known)
    names: Sequence[str]
    if isinstance(row.labels, str):
        if path.suffix.lower() == ".npz":
            with np.load(path, allow_pickle=False) as data:
                names = (
                    [str(v) for v in np.atleast_1d(data[row.labels])] if row.labels in data else []
                )
        else:
            names = [text.strip() for text in read_variables(path).texts.get(row.labels, ())]
    else:
        names = row.labels
    if len(names) != size:
        raise ModelError(
            f"matrix row {row.id}: {len(names)} labels for a matrix of {size} rows. Give one "
            'label like "n6.y" for each.'
        )
    return [parse_label(n) for n in names]


def split(matrix: sp.spmatrix | Real, where: str) -> dict[int, tuple[NDIndex, Real]]:
    """A symmetric matrix as small blocks: {1: (places (n, 1), values (n, 1, 1)), 2: (places (n, 2),
    values (n, 2, 2))}.

    Raises
    ------
    ModelError
        When the matrix is not square, not finite or not symmetric (to 1e-8 of its largest entry).
    """
    A = sp.csr_array(matrix)
    if A.shape[0] != A.shape[1]:
        raise ModelError(
            f"{where}: the matrix is {A.shape[0]} x {A.shape[1]}, not square. Give a square "
            "symmetric matrix."
        )
    if not np.all(np.isfinite(A.data)):
        raise ModelError(f"{where}: the matrix has entries that are not finite. Export it again.")
    largest = np.abs(A.data).max() if A.nnz else 0.0
    skew = abs(A - A.T)
    if skew.nnz and skew.max() > 1e-8 * largest:
        raise ModelError(
            f"{where}: the matrix is not symmetric (largest difference {skew.max():.3g}). "
            "Export the symmetric part."
        )
    S = sp.coo_array((A + A.T) / 2.0)
    i, j, v = S.coords[0], S.coords[1], np.asarray(S.data, dtype=float)
    on, above = (i == j) & (v != 0.0), (i < j) & (v != 0.0)
    pairs = np.zeros((int(above.sum()), 2, 2))
    pairs[:, 0, 1] = pairs[:, 1, 0] = v[above]
    return {
        1: (i[on][:, None].astype(np.int64), v[on][:, None, None]),
        2: (np.stack([i[above], j[above]], axis=1).astype(np.int64), pairs),
    }


NDIndex = np.ndarray[Any, np.dtype[np.int64]]


@lru_cache(maxsize=1)
def _of_mat_file(path: Path, changed: int, size: int) -> dict[str, Any]:
    """Every variable of a .mat file, matrices sparse: the rows of a block name the same file again
    and again, and all of it has to be unpacked to find one."""
    found = read_variables(path)
    out: dict[str, Any] = {
        name: sp.csc_array((m.values, m.rows, np.concatenate([[0], m.ends])), shape=m.shape)
        for name, m in found.sparse.items()
    }
    for name, values in found.arrays.items():
        plain = values.ndim == 2 and values.dtype.kind in "fiu"
        out[name] = sp.csr_array(values) if plain else values
    return out


def labelled_matrix(
    path: Path, variable: str | None
) -> tuple[sp.csr_array, tuple[Label, ...] | None, frozenset[Label]]:
    """One matrix, the DOFs of its rows where the file knows them, and those that the file holds.

    Raises
    ------
    ModelError
        As `read_matrix` does.
    """
    if path.suffix.lower() not in READERS:
        return read_matrix(path, variable), None, frozenset()
    found = read_matrices(path)
    wanted = variable
    if variable is not None and variable.upper() in found.matrices:  # Nastran has capitals only
        wanted = variable.upper()
    if variable is None and len(found.matrices) == 1:
        wanted = next(iter(found.matrices))
    values = _pick(found.matrices, wanted, path)
    return values, found.labels.get(wanted or ""), found.held


def read_matrix(path: Path, variable: str | None) -> sp.csr_array:
    """One matrix from .npz (dense array, or scipy.sparse.save_npz), .mat (version 5), or a file
    of another program (see `cvxupdate.fe.files`).

    Raises
    ------
    ModelError
        When the file or the variable cannot be read; the message lists the variables that are
        there.
    """
    suffix = path.suffix.lower()
    try:
        if suffix in READERS:
            return labelled_matrix(path, variable)[0]
        if suffix == ".npz":
            with zipfile.ZipFile(path) as archive:
                for member in archive.infolist():
                    must_be_believable(member.compress_size, member.file_size, str(path))
            with np.load(path, allow_pickle=False) as data:
                if variable is None and {"data", "indices", "indptr", "shape"} <= set(data.files):
                    return sp.csr_array(sp.load_npz(path))
                return sp.csr_array(np.asarray(_pick(dict(data), variable, path), dtype=float))
        if suffix == ".mat":
            stat = path.stat()
            known = _of_mat_file(path, stat.st_mtime_ns, stat.st_size)
            return sp.csr_array(_pick(known, variable, path)).astype(float)
    except ModelError:
        raise
    except RecordingError as error:  # the reader of .mat files says what is wrong with the file
        raise ModelError(str(error)) from error
    except Exception as error:  # the readers raise many kinds, none of them ours
        raise ModelError(
            f"{path}: cannot be read as a matrix file ({type(error).__name__}: {error}). Give "
            ".npz, .mat (version 5) or .mtx."
        ) from error
    raise ModelError(
        f"{path}: the ending {suffix or '(none)'} is not known. Give .npz, .mat (version 5), "
        f"{', '.join(READERS)}."
    )


def _pick(found: Mapping[str, Any], variable: str | None, path: Path) -> Any:
    if variable is None and len(found) == 1:
        return next(iter(found.values()))
    if variable is None or variable not in found:
        raise ModelError(
            f"{path}: there is no variable {variable!r}. It holds {', '.join(sorted(found))}."
        )
    return found[variable]
