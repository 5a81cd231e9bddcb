"""Damaged and mislabelled files: a `RecordingError`, or contents whose shapes are those that were
written. Nothing else, and no waiting."""

from __future__ import annotations

import contextlib
import faulthandler
import json
import tempfile
from collections.abc import Iterator
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.read.to_time import gather, time_blocks
from cvxupdate.recordings.read.wanted import Wanted
from cvxupdate.recordings.types import Origin
from tests.cases.universal import uff_sets

ORIGIN = Origin("test", "test")
DATA = np.random.default_rng(3).normal(size=(200, 3))
WANTED = [
    Wanted(0, "force", 4, "x"),
    Wanted(1, "acceleration", 1, "x"),
    Wanted(2, "acceleration", 2, "x"),
]

NAMES = (
    "a.stored.npz",
    "a.npz",
    "a.npy",
    "a.mat",
    "a.h5",
    "a.json",
    "a.csv",
    "a.uff",
    "b.uff",
    "a.xlsx",
    "c.npz",
)
ENDINGS = (".npz", ".npy", ".mat", ".h5", ".json", ".csv", ".txt", ".uff", ".xlsx", ".bin", "")
# seconds; a file of a few kilobytes takes milliseconds, so this ends a reader that never would and
# says nothing of speed
HANG = 300


@contextlib.contextmanager
def no_hang() -> Iterator[None]:
    """Ends the test run with the stacks of all threads where a reader does not come back, whatever
    the load of the machine is."""
    faulthandler.dump_traceback_later(HANG, exit=True)
    try:
        yield
    finally:
        faulthandler.cancel_dump_traceback_later()


def written(tmp_path: Path, name: str) -> Path:
    """The table DATA in the format of the ending."""
    path = tmp_path / name
    if name.endswith("stored.npz"):
        np.savez(path, data=DATA)
    elif path.suffix == ".npz":
        np.savez_compressed(path, data=DATA)
    elif path.suffix == ".npy":
        np.save(path, DATA)
    elif path.suffix == ".mat":
        from scipy.io import savemat

        savemat(path, {"data": DATA})
    elif path.suffix == ".h5":
        import h5py

        with h5py.File(path, "w") as file:
            file["data"] = DATA
    elif path.suffix == ".json":
        path.write_text(json.dumps({"data": DATA.tolist(), "sampling freq": 100}))
    elif path.suffix == ".csv":
        np.savetxt(path, DATA, delimiter=",", header="f,a1,a2", comments="")
    return path


@cache
def original(name: str) -> bytes:
    """A sound file of each format."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / name
        if name == "a.uff":
            import pyuff

            pyuff.UFF(str(path)).write_sets(uff_sets(), "add")
        elif name == "b.uff":
            import pyuff

            for column, quantity in enumerate((13, 12, 12)):
                pyuff.UFF(str(path)).write_sets(
                    pyuff.prepare_58(
                        binary=1,
                        func_type=1,
                        rsp_node=(4, 1, 2)[column],
                        rsp_dir=1,
                        ref_node=4,
                        ref_dir=1,
                        data=DATA[:, column],
                        x=0.01 * np.arange(len(DATA)),
                        id1="t",
                        rsp_ent_name="a",
                        ref_ent_name="b",
                        abscissa_spacing=1,
                        abscissa_spec_data_type=17,
                        ordinate_spec_data_type=quantity,
                        orddenom_spec_data_type=0,
                    ),
                    "add",
                )
        elif name == "a.xlsx":
            import zipfile

            with zipfile.ZipFile(path, "w") as archive:
                ns = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
                rows = "".join(
                    f'<row r="{y + 1}">' + "".join(f"<c><v>{v!r}</v></c>" for v in row) + "</row>"
                    for y, row in enumerate(DATA.tolist())
                )
                archive.writestr(
                    "xl/worksheets/sheet1.xml",
                    f"<worksheet {ns}><sheetData>{rows}</sheetData></worksheet>",
                )
        elif name == "c.npz":
            f = np.arange(1.0, 65.0)
            np.savez(
                path,
                frequency=f,
                H=np.exp(1j * f)[:, None, None] * np.ones((1, 2, 1)),
                response_node=[1, 2],
                response_dof=[1, 1],
                reference_node=[1],
                reference_dof=[1],
                coherence=np.full((64, 2, 1), 0.9),
            )
        else:
            written(Path(folder), name)
        return path.read_bytes()


def assert_read_or_refused(raw: bytes, ending: str) -> None:
    """Read, inspect and interpret a file; anything but a `RecordingError` fails, and so does a
    shape that was never written."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        path.write_bytes(raw)
        with no_hang():
            assert_refused_by_name(path)


def assert_refused_by_name(path: Path) -> None:
    try:
        contents = read_file(path)
    except RecordingError as error:
        assert str(path) in str(error)
        contents = None
    if contents is not None:
        assert_consistent(contents)
    for attempt in (
        lambda: inspect_file(path),
        lambda: gather(time_blocks(read_file(path), WANTED, ORIGIN, rate=100.0)),
        lambda: frequency_response(read_file(path), ORIGIN, quantity="acceleration"),
    ):
        with contextlib.suppress(RecordingError):
            attempt()


def assert_consistent(contents: Contents) -> None:
    """Functions have as many values as abscissae; a text table that lost rows says so."""
    for f in contents.functions:
        assert f.values.ndim == 1 and (f.abscissa is None or f.abscissa.shape == f.values.shape)
    for shape in contents.shapes:
        assert shape.values.shape[0] == len(shape.nodes)


FEW = settings(
    max_examples=60,
    deadline=None,
    suppress_health_check=[HealthCheck.too_slow, HealthCheck.data_too_large],
)


@pytest.mark.parametrize("name", NAMES)
def test_truncated_files(name: str) -> None:
    raw = original(name)
    for fraction in np.linspace(0.0, 1.0, 25):
        assert_read_or_refused(raw[: int(fraction * len(raw))], Path(name).suffix)


@pytest.mark.parametrize("name", NAMES)
@FEW
@given(data=st.data())
def test_flipped_bits(name: str, data: st.DataObject) -> None:
    raw = bytearray(original(name))
    # headers are short and decide most: half of the flips go there
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(
            st.one_of(st.integers(0, min(len(raw), 700) - 1), st.integers(0, len(raw) - 1))
        )
        raw[place] ^= 1 << data.draw(st.integers(0, 7))
    assert_read_or_refused(bytes(raw), Path(name).suffix)


@pytest.mark.parametrize("name", NAMES)
def test_mislabelled_files(name: str) -> None:
    for ending in ENDINGS:
        assert_read_or_refused(original(name), ending)


@FEW
@given(raw=st.binary(max_size=400), ending=st.sampled_from(ENDINGS))
def test_random_bytes(raw: bytes, ending: str) -> None:
    assert_read_or_refused(raw, ending)


@FEW
@given(
    raw=st.text(alphabet="0123456789+-.,;eEjJ\t \n\"'()nanif#*", max_size=400),
    ending=st.sampled_from((".csv", ".json", ".uff")),
)
def test_random_text(raw: str, ending: str) -> None:
    assert_read_or_refused(raw.encode(), ending)


@FEW
@given(
    at=st.integers(0, 250),
    cut=st.integers(1, 60),
    name=st.sampled_from(("a.csv", "a.uff", "b.uff", "a.json")),
)
def test_a_piece_cut_out(at: int, cut: int, name: str) -> None:
    raw = original(name)
    assert_read_or_refused(raw[:at] + raw[at + cut :], Path(name).suffix)


@pytest.mark.parametrize("name", ["a.stored.npz", "a.npz", "a.npy", "a.mat", "b.uff"])
@FEW
@given(fraction=st.floats(0.05, 0.999))
def test_a_truncated_record_is_never_a_shorter_record(name: str, fraction: float) -> None:
    """A binary format states its length: half a file must not pass for a shorter test."""
    raw = original(name)
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{Path(name).suffix}"
        path.write_bytes(raw[: int(fraction * len(raw))])
        try:
            history = gather(time_blocks(read_file(path), WANTED, ORIGIN, rate=100.0))
        except RecordingError:
            return
        assert history.data.shape == DATA.shape


def test_a_json_nested_without_end() -> None:
    assert_read_or_refused(b"[" * 100_000, ".json")
    assert_read_or_refused(b'{"data":' * 50_000, ".json")


@pytest.mark.parametrize("name", ["a.stored.npz", "a.npy", "a.mat", "a.h5", "b.uff"])
def test_a_nan_that_signals_is_a_nan(name: str) -> None:
    """One bit beyond the largest number is a nan at which a processor raises a flag."""
    raw = original(name)
    value = DATA[57, 1].tobytes()
    signal = np.array([0x7FF4_0000_0000_0001], dtype=np.uint64).tobytes()
    assert raw.count(value) == 1 and np.isnan(np.frombuffer(signal)[0])
    assert_read_or_refused(raw.replace(value, signal), Path(name).suffix)
