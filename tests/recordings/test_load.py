"""From problem files to recordings: concealed cases in every form, faults that name file and
channel, real data within 1 %."""

from __future__ import annotations

import os
import tracemalloc
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings import opened
from cvxupdate.recordings.load import blocks_of, load_recordings
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, TimeHistory
from cvxupdate.spec import check_problem, load_problem
from validation.real import table

ROOT = Path(__file__).parents[2]
REAL = ROOT / "problems" / "real"
HAVE = bool(os.environ.get("CVXUPDATE_DATA")) and Path(os.environ["CVXUPDATE_DATA"]).is_dir()
needs_data = pytest.mark.skipif(
    not HAVE, reason="CVXUPDATE_DATA does not name a folder with the real recordings"
)

CHAIN = """
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 1, nodes = [1], k = 1000.0 }, { id = 2, nodes = [1, 2], k = 1000.0 }]
[[model.elements]]
type = "mass"
rows = [{ id = 3, nodes = [1], m = 1.0 }, { id = 4, nodes = [2], m = 1.0 }]
"""
CHANNELS = """channels = [
  { column = 0, quantity = "force", node = 2, dof = "x", unit = "lbf" },
  { column = 1, quantity = "acceleration", node=1, dof = "x", unit="V", sensitivity = "100 mV/g" },
]
"""


def problem(tmp_path: Path, recordings: str) -> Path:
    path = tmp_path / "problem.toml"
    path.write_text(CHAIN + recordings)
    return path


def test_a_time_history_arrives_in_si(tmp_path: Path) -> None:
    data = np.random.default_rng(0).normal(size=(300, 2))
    np.savez(tmp_path / "run.npz", data=data)
    (record,) = load_recordings(
        load_problem(
            problem(
                tmp_path,
                '[[recordings]]\nkind = "time"\nfile = "run.npz"\nrate = 50.0\nlevel = '
                "2.0\nstart = 10\nstop = 110\n" + CHANNELS,
            )
        )
    )
    assert isinstance(record, TimeHistory)
    np.testing.assert_allclose(record.data, data[10:110] * [4.4482216152605, 9.80665 / 0.1])
    assert (record.rate, record.origin.level, record.origin.use) == (50.0, 2.0, "fit")


RUN = '[[recordings]]\nkind = "time"\nfile = "{}.npz"\nrate = 50.0\nstart = {}\nstop = {}\n'


def counted(monkeypatch: pytest.MonkeyPatch) -> list[str]:
    """The names of the files that `load` reads, in order."""
    seen: list[str] = []

    def read(path: Path, *rest: object) -> Contents:
        seen.append(path.name)
        return read_file(path, *rest)  # type: ignore[arg-type]

    monkeypatch.setattr(opened, "read_file", read)
    return seen


def test_every_file_is_read_once(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """Also where recordings of two files alternate."""
    for name in "ab":
        np.savez(tmp_path / f"{name}.npz", data=np.random.default_rng(0).normal(size=(300, 2)))
    order = "abab"
    text = "".join(RUN.format(n, 10 * k, 200 + k) + CHANNELS for k, n in enumerate(order))
    seen = counted(monkeypatch)
    records = load_recordings(load_problem(problem(tmp_path, text)))
    assert seen == ["a.npz", "b.npz"]
    assert [len(r.data) for r in records] == [200 - 9 * k for k in range(4)]  # type: ignore[union-attr]


def test_a_known_recording_is_corrected_and_not_read_again(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """As when an updated model with a gain taken out is compared with what was diagnosed."""
    np.savez(tmp_path / "a.npz", data=np.random.default_rng(0).normal(size=(300, 2)))
    gain = 'corrections = [{{ node = 1, dof = "x", gain = {} }}{}]\n'
    more = ', { node = 1, dof = "x", gain = 4.0 }'
    table = RUN.format("a", 10, 110) + CHANNELS
    first = load_problem(problem(tmp_path, table + gain.format(2.0, "")))
    known = tuple(zip(first.recordings, load_recordings(first), strict=True))
    again = load_problem(problem(tmp_path, table + gain.format(2.0, more)))
    other = load_problem(problem(tmp_path, table + gain.format(5.0, "")))
    seen = counted(monkeypatch)
    (record,) = load_recordings(again, known=known)
    assert seen == [] and isinstance(record, TimeHistory)
    assert np.array_equal(record.data, load_recordings(again)[0].data)  # type: ignore[union-attr]
    seen.clear()
    load_recordings(other, known=known)
    assert seen == ["a.npz"], "another correction is another recording"


def test_frf_arrays_and_the_band(tmp_path: Path) -> None:
    f = np.arange(1.0, 101.0)
    H = np.exp(1j * f)[:, None, None] * np.array([1.0, 2.0])[None, :, None]
    np.savez(
        tmp_path / "frf.npz",
        frequency=f,
        H=H.astype(np.complex64),
        response_node=[1, 2],
        response_dof=[1, 1],
        reference_node=[2],
        reference_dof=[1],
        coherence=np.full((100, 1, 1), 0.99),
    )
    (frf,) = load_recordings(
        load_problem(
            problem(
                tmp_path,
                '[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nresponse = "velocity"\nband '
                "= [10.0, 50.0]\n",
            )
        )
    )
    assert (
        isinstance(frf, FrequencyResponse)
        and frf.coherence is not None
        and frf.variance is not None
    )
    assert frf.quantity == "velocity" and frf.frequency[0] == 10.0 and frf.frequency[-1] == 50.0
    assert [c.label for c in frf.responses] == ["n1.x", "n2.x"] and [
        c.label for c in frf.references
    ] == ["n2.x"]
    assert np.all(frf.coherence[:, 0] == pytest.approx(0.99)) and np.all(
        np.isnan(frf.coherence[:, 1])
    )
    assert frf.variance.shape == frf.H.shape == (41, 2, 1)


def test_modes_with_and_without_deviations(tmp_path: Path) -> None:
    rows = """[[recordings]]
kind = "modes"
rows = [{ frequency = 9.0, frequency_std = 0.1, damping = 0.01, shape = [1, [0.5, -0.1]], mode=2 },
        { frequency = 3.0, frequency_std = 0.05 }]
channels = [{ column = 1, quantity = "displacement", node = 1, dof = "x" },
            { column = 0, quantity = "displacement", node = 2, dof = "x", sign = -1 }]
[[recordings]]
kind = "modes"
use = "hold-out"
rows = [{ frequency = 4.0 }]
"""
    table, bare = load_recordings(load_problem(problem(tmp_path, rows)))
    assert isinstance(table, ModeTable) and isinstance(bare, ModeTable) and table.shapes is not None
    np.testing.assert_array_equal(table.frequency, [3.0, 9.0])
    np.testing.assert_array_equal(table.pairs, [0, 2])
    np.testing.assert_allclose(table.shapes[1], [0.5 - 0.1j, -1.0])
    assert (
        np.all(np.isnan(table.shapes[0])) and np.isnan(table.damping[0]) and not table.relative_only
    )
    assert bare.relative_only and bare.frequency_std[0] == pytest.approx(0.04)


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (("node=1, dof", "node=2, dof"), None),
        (
            ('sensitivity = "100 mV/g"', 'sensitivity = "100 mV/N"'),
            "channel 1 .acceleration at n1.x.*does not measure",
        ),
        (("column = 1", "column = 7"), "no column 7; the table has 2"),
        (("rate = 50.0", "rate = 50.0\nstart = 299"), "leave fewer than 2 of 300"),
        (("rate = 50.0\n", ""), "does not state its sampling rate"),
        (("column = 1", 'column = "acc"'), "no column or array 'acc'.*data 300x2"),
    ],
)
def test_faults_name_the_file_and_the_channel(
    tmp_path: Path, change: tuple[str, str], words: str | None
) -> None:
    np.savez(tmp_path / "run.npz", data=np.random.default_rng(0).normal(size=(300, 2)))
    text = '[[recordings]]\nkind = "time"\nfile = "run.npz"\nrate = 50.0\n' + CHANNELS
    assert change[0] in text
    spec = load_problem(problem(tmp_path, text.replace(*change)))
    if words is None:
        load_recordings(spec)
        return
    with pytest.raises(RecordingError, match=f"run.npz.*{words}"):
        load_recordings(spec)


def test_a_recording_that_does_not_fit_the_model_is_refused(tmp_path: Path) -> None:
    f = np.arange(1.0, 41.0)
    for node, dof, words in ((9, 1, "n9.x.*no node 9"), (1, 2, "n1.y.*active DOFs are x")):
        np.savez(
            tmp_path / "frf.npz",
            frequency=f,
            H=np.ones((40, 1, 1), complex),
            response_node=[node],
            response_dof=[dof],
            reference_node=[2],
            reference_dof=[1],
        )
        spec = load_problem(
            problem(
                tmp_path,
                '[[recordings]]\nkind = "frf"\nfile = "frf.npz"\nresponse = "acceleration"\n',
            )
        )
        with pytest.raises(RecordingError, match=f"frf.npz: channel {words}"):
            load_recordings(spec)
    data = np.ones((300, 2))
    data[7, 1] = np.nan
    np.savez(tmp_path / "run.npz", data=data)
    spec = load_problem(
        problem(
            tmp_path, '[[recordings]]\nkind = "time"\nfile = "run.npz"\nrate = 50.0\n' + CHANNELS
        )
    )
    with pytest.raises(
        RecordingError, match=r"n1.x \(acceleration\) has a value that is not a number, .*.sample 7"
    ):
        load_recordings(spec)


def test_a_large_record_is_read_in_blocks_without_being_held(tmp_path: Path) -> None:
    """64 MB of single precision: the pieces never need more than a few megabytes (500 MB scales
    with the disk, not with memory)."""
    path = tmp_path / "run.npz"
    samples = 8_000_000
    np.savez(
        path, data=np.lib.stride_tricks.as_strided(np.zeros(1, np.float32), (samples, 2), (0, 0))
    )
    spec = load_problem(
        problem(
            tmp_path, '[[recordings]]\nkind = "time"\nfile = "run.npz"\nrate = 50.0\n' + CHANNELS
        )
    )
    tracemalloc.start()
    blocks = blocks_of(spec.recordings[0])  # type: ignore[arg-type]
    count = sum(len(piece) for piece in blocks.pieces(2**16))
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert count == blocks.samples == samples
    assert peak < 16e6


@pytest.mark.parametrize(
    "path", sorted(REAL.rglob("problem*.toml")), ids=lambda p: f"{p.parent.name}-{p.stem}"
)
@needs_data
def test_every_real_problem_file_holds(path: Path) -> None:
    assert check_problem(path) == ()


@needs_data
@pytest.mark.slow
def test_every_real_file_opens_and_agrees_with_its_readme_within_one_per_cent() -> None:
    rows = table.rows()
    stated = [row for row in rows if row.stated]
    assert len(rows) >= 100 and len(stated) >= 80
    assert [
        (row.recording, row.found, row.stated) for row in stated if not row.deviation <= 1.0
    ] == []
    left = table.unread(table.data_root())
    assert {Path(name).name for name, _ in left} == {
        "Mass position.xlsx",
        "slow10steps_commanded_indexes.txt",
    }


def test_a_misspelt_key_in_the_only_row_is_one_fault_not_an_empty_recording(tmp_path: Path) -> None:
    path = problem(
        tmp_path,
        '[[recordings]]\nkind = "modes"\nrows = [{ frequency = 5.0, frequenci_std = 0.1 }]\n',
    )
    assert [fault.problem for fault in check_problem(path)] == [
        "unknown key 'frequenci_std' (value 0.1)."
    ]
    path = problem(tmp_path, '[[recordings]]\nkind = "modes"\nrows = []\n')
    assert any("the recording is empty" in fault.problem for fault in check_problem(path))
