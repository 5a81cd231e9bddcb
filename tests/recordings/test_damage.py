"""Damaged recordings: nothing is lost in silence; what is left can be used where the file allows
it."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import FrequencyResponse
from cvxupdate.spec import load_problem
from tests.cases.bad_beam import channels, csv_text, good_table, good_text, uff_text, write

ALLOWED = 'damaged = "leave-out"\n'
TABLE = good_table()


def loaded(path: Path) -> FrequencyResponse:
    (recording,) = load_recordings(load_problem(path))
    assert isinstance(recording, FrequencyResponse)
    return recording


def spoilt(row: int, by: str) -> str:
    """The good text with one row (of the table) changed: its field 3 replaced, or its end cut."""
    lines = good_text().splitlines()
    fields = lines[row + 1].split(",")
    lines[row + 1] = ",".join(fields[:9] if by == "short" else [*fields[:3], by, *fields[4:]])
    return "\n".join(lines) + "\n"


@pytest.mark.parametrize(
    ("row", "by", "words"),
    [
        (49, "short", "line 51 is not a row of 11 numbers"),
        (49, "OVL", "line 51 is not a row of 11 numbers .*OVL"),
        (799, "short", "line 801 is not a row of 11 numbers"),
        (100, "", r"n9\.y.* a value that is not a number, the first at 27 Hz"),
        (100, "nan", r"n9\.y.* a value that is not a number, the first at 27 Hz"),
    ],
)
def test_a_damaged_row_is_refused_or_left_out_alone(
    tmp_path: Path, row: int, by: str, words: str
) -> None:
    """Wherever it stands, the lines before it stay, and keep their header."""
    text = spoilt(row, by)
    with pytest.raises(RecordingError, match=words):
        loaded(write(tmp_path, channels(), text))
    frf = loaded(write(tmp_path, ALLOWED + channels(), text))
    rest = np.delete(TABLE, row, axis=0)
    np.testing.assert_array_equal(frf.frequency, rest[:, 0])
    np.testing.assert_allclose(frf.H[:, 1, 0], rest[:, 3] + 1j * rest[:, 4], rtol=1e-12)
    assert any("1 lines are not numbers" in line for line in frf.origin.damage)


def test_a_last_line_cut_short_is_said(tmp_path: Path) -> None:
    frf = loaded(write(tmp_path, channels(), good_text()[:-20]))
    assert len(frf.frequency) == len(TABLE) - 1
    assert any("the last one, is cut off" in line for line in frf.origin.damage)


def test_a_footer_is_no_damage(tmp_path: Path) -> None:
    frf = loaded(write(tmp_path, channels(), good_text() + "measured by A. N. Other\n"))
    assert len(frf.frequency) == len(TABLE) and frf.origin.damage == ()


def test_two_tables_in_one_text_are_not_joined(tmp_path: Path) -> None:
    """A frequency axis that begins anew is another table, whatever stands between."""
    lines = good_text().splitlines()
    frf = loaded(write(tmp_path, channels(), "\n".join([*lines[:40], "1,2,3,4,5,6", *lines])))
    np.testing.assert_array_equal(frf.frequency, TABLE[:, 0])


@pytest.mark.parametrize("share", [0.15, 0.37, 0.605, 0.99])
def test_a_universal_file_cut_short_is_refused_or_used_as_far_as_it_goes(
    tmp_path: Path, share: float
) -> None:
    text = uff_text(TABLE)
    half = text[: int(share * len(text))]
    with pytest.raises(RecordingError, match="cannot be read|nothing in this universal file"):
        loaded(write(tmp_path, "", half, "beam.uff"))
    if share > 0.2:
        frf = loaded(write(tmp_path, ALLOWED, half, "beam.uff"))
        assert len(frf.responses) == int(share * 5)
        assert any("cannot be read" in line for line in frf.origin.damage)


def test_a_dead_channel_and_one_without_numbers_can_be_left_out(tmp_path: Path) -> None:
    table = TABLE.copy()
    table[:, 5:7] = 0.0
    table[:, 9] = np.nan
    frf = loaded(write(tmp_path, ALLOWED + channels(), csv_text(table)))
    assert [c.node for c in frf.responses] == [5, 9, 17]
    assert len(frf.frequency) == len(TABLE) and len(frf.origin.damage) == 2
    assert frf.variance is not None and np.all(np.isfinite(frf.variance))


OTHER = (105, 109, 113, 117, 121)


def test_a_file_with_other_node_numbers(tmp_path: Path) -> None:
    """`node_map` and `channels` give the same recording as the right numbers in the file."""
    text = uff_text(TABLE, OTHER)
    with pytest.raises(RecordingError, match="no node 105.*node_map"):
        loaded(write(tmp_path, "", text, "beam.uff"))
    right = loaded(write(tmp_path, "", uff_text(TABLE), "beam.uff"))
    mapped = "node_map = { 105 = 5, 109 = 9, 113 = 13, 117 = 17, 121 = 21 }\n"
    rows = ", ".join(
        f'{{ column = {k}, quantity = "acceleration", node = {n}, dof = "y" }}'
        for k, n in enumerate((5, 9, 13, 17, 21))
    )
    declared = f'channels = [{rows}]\nreferences = [{{ node = 9, dof = "y" }}]\n'
    for keys in (mapped, declared):
        frf = loaded(write(tmp_path, keys, text, "beam.uff"))
        assert [c.label for c in frf.responses] == [c.label for c in right.responses]
        assert frf.references[0].label == "n9.y"
        np.testing.assert_array_equal(frf.H, right.H)


def test_declared_channels_choose_turn_and_convert(tmp_path: Path) -> None:
    keys = (
        'channels = [{ column = 3, quantity = "acceleration", node = 17, dof = "y", sign = -1 }, '
        '{ column = 0, quantity = "acceleration", node = 5, dof = "y", unit = "mm/s^2" }]\n'
    )
    frf = loaded(write(tmp_path, keys, uff_text(TABLE), "beam.uff"))
    np.testing.assert_allclose(frf.H[:, 0, 0], -(TABLE[:, 7] + 1j * TABLE[:, 8]), rtol=1e-9)
    np.testing.assert_allclose(frf.H[:, 1, 0], 1e-3 * (TABLE[:, 1] + 1j * TABLE[:, 2]), rtol=1e-9)


@pytest.mark.parametrize(
    ("keys", "words"),
    [
        (
            'channels = [{ column = 0, quantity = "acceleration", node = 9, dof = "y" }, '
            '{ column = 1, quantity = "acceleration", node = 5, dof = "y" }]\n',
            "declared at n9.y is at n5.y as the file states it",
        ),
        (
            'channels = [{ column = 7, quantity = "acceleration", node = 9, dof = "y" }]\n',
            "no such response; the file holds 5",
        ),
        (
            'channels = [{ column = 0, quantity = "velocity", node = 5, dof = "y" }]\n',
            "the file states acceleration",
        ),
        (
            'references = [{ node = 9, dof = "y" }, { node = 5, dof = "y" }]\n',
            "2 references are declared, but the file has 1",
        ),
        ("node_map = { 77 = 5 }\n", "node_map names node 77"),
    ],
)
def test_what_contradicts_the_file_is_refused(tmp_path: Path, keys: str, words: str) -> None:
    with pytest.raises(RecordingError, match=words):
        loaded(write(tmp_path, keys, uff_text(TABLE), "beam.uff"))


@pytest.mark.parametrize(
    ("header", "column", "form"),
    [
        ("frequency,re_5,im_5", "re_5", "real-imaginary"),
        ("f [Hz],H5 real,H5 imag", "H5 real", "real-imaginary"),
        ("f [Hz],Mag 5,Phase 5", "Mag 5", "magnitude-phase"),
        ("f [Hz],n5 [dB],n5 phase [deg]", "n5 [dB]", "db-phase"),
    ],
)
def test_half_of_a_complex_number_is_refused(
    tmp_path: Path, header: str, column: str, form: str
) -> None:
    """A real part, or a modulus, whose other half stands unread beside it: refused with the keys
    that read both; those keys do."""
    rows = "\n".join(",".join(f"{v:.8g}" for v in row[:3]) for row in TABLE[:20])
    where = 'references = [{ node = 9, dof = "y" }]\n'
    row = 'channels = [{{ column = "{}", quantity = "acceleration", node = 5, dof = "y"{} }}]\n'
    other = 'pair = "(im_5|H5 imag|Phase 5|n5 phase)"'
    with pytest.raises(RecordingError, match=f'form = "{form}" and {other}') as refused:
        loaded(write(tmp_path, where + row.format(column, ""), f"{header}\n{rows}\n"))
    said = str(refused.value)
    pair = said[said.index("pair = ") :].rstrip(".")
    with pytest.raises(RecordingError, match=f"pair is given, but not how .*{form}"):
        loaded(write(tmp_path, where + row.format(column, f", {pair}"), f"{header}\n{rows}\n"))
    keys = f', form = "{form}", {pair}'
    frf = loaded(write(tmp_path, where + row.format(column, keys), f"{header}\n{rows}\n"))
    if form == "real-imaginary":
        np.testing.assert_allclose(frf.H[:, 0, 0], TABLE[:20, 1] + 1j * TABLE[:20, 2], rtol=1e-6)


def test_an_imaginary_part_is_no_channel_of_its_own(tmp_path: Path) -> None:
    text = channels().replace('pair = "im_5", form = "real-imaginary"', 'form = "complex"')
    with pytest.raises(RecordingError, match='form = "real-imaginary" and pair = "im_5"'):
        loaded(write(tmp_path, text, good_text()))
    twice = (
        channels()
        .replace("node = 9, dof", "node = 5, dof")
        .replace("references = [{ node = 5", "references = [{ node = 9")
    )
    with pytest.raises(RecordingError, match="declared twice .* the pair of one"):
        loaded(write(tmp_path, twice, good_text()))


def test_a_table_without_channels_points_to_inspect(tmp_path: Path) -> None:
    with pytest.raises(RecordingError, match="which column is which sensor.*cvxupdate inspect"):
        loaded(write(tmp_path, "", good_text()))
