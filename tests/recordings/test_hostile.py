"""Files made to exhaust a machine: each ends in one message, at once and without the memory that it
asks for."""

from __future__ import annotations

import io
import time
import tracemalloc
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from scipy.io import savemat

from cvxupdate.errors import InputError, ModelError, ProblemFileError, RecordingError
from cvxupdate.fe.elements.matrix import read_matrix
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.spec import load_problem
from cvxupdate.unpacking import PLENTY, RATIO, must_be_believable

SECONDS, MEMORY = 8.0, 2**28
"""A machine under load; each takes less than a second on an idle one."""
SHEET = "xl/worksheets/sheet1.xml"


def npz_bomb(path: Path) -> None:
    """3 GB of zeros declared and packed: only the first 128 MB are there, which nobody reaches."""
    head = io.BytesIO()
    np.lib.format.write_array_header_1_0(
        head, {"descr": "<f8", "fortran_order": False, "shape": (2**27,)}
    )
    with (
        zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive,
        archive.open("K.npy", "w") as file,
    ):
        file.write(head.getvalue())
        for _ in range(8):
            file.write(bytes(2**24))


def xlsx_bomb(path: Path) -> None:
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(SHEET, "<row><c><v>1</v></c></row>" * 4_000_000)


def mat_bomb(path: Path) -> None:
    """A compressed element whose body is 128 MB of nothing."""
    savemat(path, {"K": np.eye(2)})
    packer = zlib.compressobj(9)
    body = b"".join([packer.compress(bytes(2**24)) for _ in range(8)] + [packer.flush()])
    head = path.read_bytes()[:128]
    path.write_bytes(head + np.array([15, len(body)], "<u4").tobytes() + body)


def hdf5_of_nothing(path: Path, rows: int) -> None:
    """A shape that is declared, of which no chunk was ever written."""
    import h5py

    with h5py.File(path, "w") as file:
        file.create_dataset("data", (rows, 40), "f8", chunks=(1000, 40), compression="gzip")


def assert_refused(
    name: str, attempt: Callable[[], object], kind: type[InputError], words: str
) -> None:
    tracemalloc.start()
    begin = time.perf_counter()
    try:
        with pytest.raises(kind, match=words) as raised:
            attempt()
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert name in str(raised.value)
    assert time.perf_counter() - begin < SECONDS and peak < MEMORY


@pytest.mark.parametrize(
    ("name", "make"), [("b.npz", npz_bomb), ("b.xlsx", xlsx_bomb), ("b.mat", mat_bomb)]
)
def test_what_unpacks_without_end_is_not_unpacked(
    tmp_path: Path, name: str, make: Callable[[Path], None]
) -> None:
    path = tmp_path / name
    make(path)
    assert path.stat().st_size < 2**20
    assert_refused(
        name, lambda: inspect_file(path), RecordingError, "unpack to .* beyond 200 to one"
    )
    if path.suffix != ".xlsx":  # matrices of a model come by the same files
        assert_refused(name, lambda: read_matrix(path, "K"), ModelError, "beyond 200 to one")


@pytest.mark.parametrize(
    ("rows", "words"), [(10**9, "more than the file can hold"), (300_000, "beyond 200 to one")]
)
def test_a_shape_that_is_only_declared(tmp_path: Path, rows: int, words: str) -> None:
    path = tmp_path / "a.h5"
    hdf5_of_nothing(path, rows)
    if rows < 10**6:  # large enough that the first question does not catch it
        with path.open("ab") as file:
            file.write(bytes(10**6))
    assert_refused("a.h5", lambda: inspect_file(path), RecordingError, words)


@pytest.mark.parametrize(
    "text",
    [
        "a = " + "[" * 10**5 + "]" * 10**5,
        "[" * 10**5,
        ".".join("a" * 10**5) + " = 1",
        "[" + ".".join("a" * 10**5) + "]",
        "a = {" * 10**5,
    ],
    ids=["arrays", "headers", "dotted key", "dotted header", "tables"],
)
def test_a_problem_file_nested_without_end(tmp_path: Path, text: str) -> None:
    path = tmp_path / "p.toml"
    path.write_text(text)
    assert_refused(
        "p.toml", lambda: load_problem(path), ProblemFileError, "nested too deeply|not valid"
    )


def test_an_honest_file_is_unpacked(tmp_path: Path) -> None:
    must_be_believable(1, PLENTY, "small")
    must_be_believable(PLENTY, RATIO * PLENTY, "large")
    path = tmp_path / "quiet.npz"
    values = np.zeros((100_000, 4))
    values[:, 0] = np.random.default_rng(1).normal(size=100_000)
    np.savez_compressed(path, data=values, fs=1000.0)
    assert inspect_file(path).length == 100_000


@pytest.mark.parametrize("compressed", [False, True])
def test_a_cell_array_of_matrices_is_read_entry_by_entry(tmp_path: Path, compressed: bool) -> None:
    cell = np.empty((1, 2), dtype=object)
    cell[0, 0], cell[0, 1] = np.diag([2.0, 3.0]), np.arange(4.0).reshape(2, 2)
    path = tmp_path / "c.mat"
    savemat(path, {"K": cell}, do_compression=compressed)
    np.testing.assert_array_equal(read_matrix(path, "K{1}").toarray(), cell[0, 0])
    np.testing.assert_array_equal(read_matrix(path, "K{2}").toarray(), cell[0, 1])
    with pytest.raises(ModelError, match=r"It holds K\{1\}, K\{2\}"):
        read_matrix(path, "K")
