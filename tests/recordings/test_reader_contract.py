"""Contract of every reader that is registered: what was written is read, by ending, by content and
by name; what is empty, cut short or mislabelled is said and named."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read import formats, read_file
from cvxupdate.registry import READERS
from tests.cases.readers import CASES, DATA, ReaderCase

EVERY = pytest.mark.parametrize("case", CASES, ids=lambda c: c.file)


def test_every_registered_reader_has_a_case() -> None:
    assert set(READERS.names()) == {case.format for case in CASES}


def test_text_is_tried_last() -> None:
    assert [fmt.anything for fmt in formats()] == [False] * (len(formats()) - 1) + [True]


@EVERY
def test_what_was_written_is_read(case: ReaderCase, tmp_path: Path) -> None:
    path = tmp_path / case.file
    case.write(path)
    contents = read_file(path)
    assert contents.format == case.format
    np.testing.assert_allclose(case.values(contents), DATA, rtol=1e-5, atol=1e-6)


@EVERY
def test_a_format_is_known_by_its_first_bytes_and_by_its_name(
    case: ReaderCase, tmp_path: Path
) -> None:
    """Under an ending that says nothing, the word of the problem file decides, else the first
    format that looks like it (a workbook begins as any ZIP archive does)."""
    path = tmp_path / case.file
    case.write(path)
    assert READERS.named(case.format).looks(path.read_bytes()[:1024])
    unknown = path.rename(tmp_path / "a.record")
    named = read_file(unknown, format=case.format)
    np.testing.assert_allclose(case.values(named), DATA, rtol=1e-5, atol=1e-6)
    if case.format != "xlsx":
        np.testing.assert_array_equal(case.values(named), case.values(read_file(unknown)))


@EVERY
def test_an_empty_file_is_said(case: ReaderCase, tmp_path: Path) -> None:
    path = tmp_path / case.file
    path.write_bytes(b"")
    with pytest.raises(RecordingError, match="empty"):
        read_file(path)


@EVERY
@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
def test_a_file_cut_short_is_never_a_whole_one(
    case: ReaderCase, share: float, tmp_path: Path
) -> None:
    """It is refused, or what is left is a beginning of the record: no number is made up."""
    path = tmp_path / case.file
    case.write(path)
    whole = path.read_bytes()
    path.write_bytes(whole[: int(share * len(whole))])
    try:
        left = case.values(read_file(path))
    except RecordingError as error:
        assert str(path) in str(error)
    else:
        rows, columns = left.shape
        assert left.size < DATA.size
        np.testing.assert_allclose(left[:-1], DATA[: rows - 1, :columns], rtol=1e-5, atol=1e-6)
