"""Readers: what one tool writes, ours reads, in every format; and what cannot be read is said."""

from __future__ import annotations

import json
import re
import zipfile
from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read import FORMATS, read_file
from cvxupdate.recordings.read.contents import Options
from cvxupdate.recordings.read.time_axis import rate_of_times
from cvxupdate.recordings.read.to_frf import frequency_response
from cvxupdate.recordings.read.to_modes import modes_of_contents
from cvxupdate.recordings.read.to_time import gather, time_blocks
from cvxupdate.recordings.read.variance import averages_from_scatter, variance_of_frf
from cvxupdate.recordings.read.wanted import Names, Wanted
from cvxupdate.recordings.types import Channel, Origin
from tests.cases.universal import uff_sets

ORIGIN = Origin("test", "test")
RNG = np.random.default_rng(3)
DATA = RNG.normal(size=(200, 3))
WANTED = [
    Wanted(0, "force", 4, "x"),
    Wanted(1, "acceleration", 1, "x"),
    Wanted(2, "acceleration", 2, "x", sign=-1),
]


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


@pytest.mark.parametrize(
    "name", ["stored.npz", "small.npz", "a.npy", "a.mat", "a.h5", "a.json", "a.csv"]
)
def test_every_table_format_gives_the_same_time_history(tmp_path: Path, name: str) -> None:
    history = gather(time_blocks(read_file(written(tmp_path, name)), WANTED, ORIGIN, rate=100.0))
    np.testing.assert_allclose(history.data, DATA * [1.0, 1.0, -1.0], rtol=1e-12)
    assert history.rate == 100.0
    assert [c.label for c in history.channels] == ["n4.x", "n1.x", "n2.x"]


def test_blocks_are_the_record_cut_in_order(tmp_path: Path) -> None:
    blocks = time_blocks(
        read_file(written(tmp_path, "stored.npz")), WANTED, ORIGIN, rate=100.0, start=13, stop=-20
    )
    whole = gather(blocks).data
    for size in (1, 7, 64, 1000):
        np.testing.assert_array_equal(np.concatenate(list(blocks.pieces(size))), whole)
    np.testing.assert_allclose(whole[:, 0], DATA[13:-20, 0])


def test_an_uncompressed_array_stays_on_disk(tmp_path: Path) -> None:
    array = read_file(written(tmp_path, "stored.npz")).arrays["data"]
    assert not array.flags.owndata


@pytest.mark.parametrize("delimiter", ["\t", ";", " ", "|"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize(
    "header", ["", "\n", "one line\n", "a\n\nb\n***End_of_Header***\t\n", "k\t3\nname;0,5;1\n"]
)
@pytest.mark.parametrize("end", ["", "\n", "\n1{0}2\n", "\nend of file\n"])
def test_text_of_any_writing_gives_the_same_table(
    tmp_path: Path, delimiter: str, decimal: str, header: str, end: str
) -> None:
    lines = [delimiter.join(f"{value:.6f}".replace(".", decimal) for value in row) for row in DATA]
    path = tmp_path / "a.txt"
    path.write_text(header + "\n".join(lines) + end.format(delimiter), encoding="latin-1")
    contents = read_file(path)
    np.testing.assert_allclose(contents.arrays["data"], DATA, atol=1e-6)
    assert len(contents.notes) == (end.count("2") or end.count("end")) and contents.format == "text"


def test_names_and_units_come_from_the_header(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_bytes(
        "Signal:\tH1\n\nFrequency\tMagnitude\tPhase\n[ Hz ]\t[ m/s² / N ]\t[ ° "
        "]\n0.5\t2.0\t-90\n1.0\t4.0\t90\n".encode("latin-1")
    )
    contents = read_file(path)
    assert contents.columns == ("Frequency", "Magnitude", "Phase") and contents.units == (
        "Hz",
        "m/s² / N",
        "°",
    )
    path.write_text(
        "Time [s],Force (lbf),Acc (g)\n" + "".join(f"{k / 10},{k},{k}\n" for k in range(20))
    )
    contents = read_file(path)
    assert contents.columns == ("Time", "Force", "Acc") and contents.units == ("s", "lbf", "g")
    history = gather(
        time_blocks(
            contents,
            [Wanted("Force", "force", 1, "x"), Wanted("Acc", "acceleration", 1, "x")],
            ORIGIN,
            time_column="Time",
        )
    )
    np.testing.assert_allclose(history.data[5], [5 * 4.4482216152605, 5 * 9.80665])
    assert history.rate == pytest.approx(10.0)


def test_complex_numbers_as_text(tmp_path: Path) -> None:
    H = RNG.normal(size=(50, 2)) + 1j * RNG.normal(size=(50, 2))
    for template in ("{0.real!r}{0.imag:+}j", "({0.real!r}{0.imag:+}j)", "{0.real!r} {0.imag:+}i"):
        path = tmp_path / "a.csv"
        path.write_text(
            "".join(
                f"{k + 1}+0j;" + ";".join(template.format(complex(v)) for v in row) + "\n"
                for k, row in enumerate(H)
            )
        )
        frf = frequency_response(
            read_file(path),
            ORIGIN,
            wanted=[
                Wanted(1, "acceleration", 1, "x", unit="g/N"),
                Wanted(2, "acceleration", 2, "x", unit="g/N"),
            ],
            references=[Channel(1, "x", "force")],
            frequency_column=0,
        )
        np.testing.assert_allclose(frf.H[:, :, 0], H * 9.80665, rtol=1e-12)


def test_decibel_and_phase_are_the_same_frf(tmp_path: Path) -> None:
    H = RNG.normal(size=60) + 1j * RNG.normal(size=60)
    table = np.column_stack(
        [np.arange(1.0, 61.0), 20 * np.log10(np.abs(H)), np.degrees(np.angle(H)), np.full(60, 0.9)]
    )
    path = tmp_path / "a.txt"
    np.savetxt(path, table, delimiter="\t", header="x", comments="")
    want = [Wanted(1, "velocity", 3, "y", form="db-phase", pair=2, coherence=3)]
    frf = frequency_response(
        read_file(path), ORIGIN, wanted=want, references=[Channel(3, "y", "force")], averages=20.0
    )
    np.testing.assert_allclose(frf.H[:, 0, 0], H, rtol=1e-9)
    assert frf.variance is not None and frf.coherence is not None
    np.testing.assert_allclose(
        frf.variance[:, 0, 0], (1 - 0.9) / (19 * 0.9) * np.abs(H) ** 2, rtol=1e-9
    )


def test_a_row_that_is_not_one_says_its_line(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("a,b\n" + "".join(f"{k},{k}\n" for k in range(50)) + "oops\n1,2\n3,4\n")
    contents = read_file(path)
    (said,) = contents.damage
    assert re.search(r"line 52 is not a row of 2 numbers .'oops'.*line 53 goes on", said)
    table = contents.arrays["data"]  # the rows around it keep their places
    assert table.shape == (53, 2) and np.isnan(table[50]).all()
    np.testing.assert_array_equal(table[[49, 51]], [[49, 49], [1, 2]])


def test_missing_values_are_nan_and_not_zero(tmp_path: Path) -> None:
    path = tmp_path / "a.csv"
    path.write_text("1,2,3\n4,,6\n7,NaN,9\n10,11,12\n")
    table = read_file(path).arrays["data"]
    assert np.isnan(table[1:3, 1]).all() and np.isfinite(table[[0, 3]]).all()


def test_universal_files_agree_with_pyuff(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(uff_sets(), "overwrite")
    contents = read_file(path)
    theirs = [s for s in pyuff.UFF(str(path)).read_sets() if s["type"] == 58]
    assert len(contents.functions) == len(theirs) == 2 and not contents.notes
    for ours, other in zip(contents.functions, theirs, strict=True):
        np.testing.assert_allclose(ours.values, other["data"], rtol=1e-12)
    assert contents.nodes[2] == (1.0, 0.0, 0.5)
    frf = frequency_response(contents, ORIGIN)
    f = frf.frequency
    np.testing.assert_allclose(f, 10.0 + 0.5 * np.arange(40), rtol=1e-6)
    # the second response was measured along -z
    np.testing.assert_allclose(frf.H[:, 1, 0], -(2 + f) * np.exp(1j * f), rtol=1e-5)
    assert frf.quantity == "acceleration" and [c.label for c in frf.responses] == ["n1.z", "n2.z"]
    modes, channels = modes_of_contents(contents, Names())
    assert (
        modes[0].frequency == 12.5
        and modes[0].damping == pytest.approx(0.01)
        and [c.label for c in channels] == ["n1.z", "n2.z"]
    )


def test_units_of_a_universal_file_are_applied(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    sets = uff_sets()
    sets[0] = pyuff.prepare_164(5, "mm, mN", 1, 1000.0, 1000.0, 1.0, 0.0)
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")
    contents = read_file(path)
    # mm/s² over mN is m/s² over N; a length alone shrinks
    assert contents.functions[0].scale == pytest.approx(1.0) and contents.nodes[2][
        0
    ] == pytest.approx(1e-3)


def test_what_cannot_be_read_is_said_and_the_rest_is_kept(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "a.uff"
    pyuff.UFF(str(path)).write_sets(uff_sets(), "overwrite")
    raw = path.read_bytes()
    path.write_bytes(raw + b"    -1\n  9999\nwhatever\n    -1\n")
    assert (
        any("9999" in note for note in read_file(path).notes)
        and len(read_file(path).functions) == 2
    )
    cut = raw[: raw.rindex(b"    -1\n    55") - 60]  # the last function loses its end
    path.write_bytes(cut)
    contents = read_file(path)
    assert len(contents.functions) == 1 and any("58" in note for note in contents.notes)


def test_a_binary_body_may_hold_the_bytes_of_an_end_mark(tmp_path: Path) -> None:
    pyuff = pytest.importorskip("pyuff")
    path = tmp_path / "a.uff"
    values = np.frombuffer(b"\n    -1\n" * 40, dtype="<f8").copy()
    one = pyuff.prepare_58(
        binary=1,
        func_type=1,
        rsp_node=1,
        rsp_dir=1,
        ref_node=1,
        ref_dir=1,
        data=values,
        x=0.01 * np.arange(40),
        id1="t",
        rsp_ent_name="a",
        ref_ent_name="b",
        abscissa_spacing=1,
        abscissa_spec_data_type=17,
        ordinate_spec_data_type=12,
        orddenom_spec_data_type=0,
    )
    pyuff.UFF(str(path)).write_sets([one, one], "add")
    contents = read_file(path)
    assert [len(f.values) for f in contents.functions] == [40, 40]
    np.testing.assert_array_equal(contents.functions[1].values, values)


def test_matlab_7_3_has_its_axes_turned_back(tmp_path: Path) -> None:
    h5py = pytest.importorskip("h5py")
    path = tmp_path / "a.mat"
    with h5py.File(path, "w", userblock_size=512) as file:
        file["data"] = DATA.T
        file["data"].attrs["MATLAB_class"] = np.bytes_(b"double")
        file.create_dataset(
            "H", data=np.array([(1.0, 2.0)], dtype=[("real", "f8"), ("imag", "f8")])
        )
    with path.open("r+b") as raw:
        raw.write(b"MATLAB 7.3 MAT-file")
    contents = read_file(path)
    np.testing.assert_array_equal(contents.arrays["data"], DATA)
    assert contents.arrays["H"][0] == 1 + 2j


def test_pickles_are_never_loaded(tmp_path: Path) -> None:
    class Bomb:
        def __reduce__(self) -> tuple[object, tuple[str]]:
            return (Path.touch, (tmp_path / "ran",))  # type: ignore[return-value]

    path = tmp_path / "a.npz"
    np.savez(path, data=DATA, bad=np.array([Bomb()], dtype=object))
    contents = read_file(path)
    assert "bad" not in contents.arrays and any("objects" in note for note in contents.notes)
    np.save(tmp_path / "b.npy", np.array([Bomb()], dtype=object), allow_pickle=True)
    with pytest.raises(RecordingError, match="pickled"):
        read_file(tmp_path / "b.npy")
    assert not (tmp_path / "ran").exists()


def test_mislabelled_files_are_refused_with_both_names(tmp_path: Path) -> None:
    npz = written(tmp_path, "a.npz").read_bytes()
    for ending in (".h5", ".mat", ".uff", ".json", ".csv"):
        path = tmp_path / f"wrong{ending}"
        path.write_bytes(npz)
        with pytest.raises(RecordingError, match="npz"):
            read_file(path)
    for path, words in ((tmp_path / "none.csv", "no such file"), (tmp_path, "is a folder")):
        with pytest.raises(RecordingError, match=words):
            read_file(path)
    (tmp_path / "empty.csv").write_bytes(b"")
    with pytest.raises(RecordingError, match="empty"):
        read_file(tmp_path / "empty.csv")
    with pytest.raises(RecordingError, match="Formats: npz"):
        read_file(written(tmp_path, "a.csv"), format="wav")


def test_a_workbook_gives_its_numbers(tmp_path: Path) -> None:
    ns = 'xmlns="http://schemas.openxmlformats.org/spreadsheetml/2006/main"'
    sheet = (
        f'<worksheet {ns}><sheetData><row r="1"><c r="A1" t="s"><v>0</v></c><c '
        'r="B1"><v>1.5</v></c></row><row r="2"><c r="A2"><v>2</v></c><c '
        'r="B2"><v>3e0</v></c></row></sheetData></worksheet>'
    )
    path = tmp_path / "a.xlsx"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/worksheets/sheet1.xml", sheet)
    np.testing.assert_array_equal(read_file(path).arrays["data"], [[np.nan, 1.5], [2.0, 3.0]])
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("xl/worksheets/sheet1.xml", '<!DOCTYPE x [<!ENTITY a "b">]>' + sheet)
    with pytest.raises(RecordingError, match="entities"):
        read_file(path)


def test_the_list_of_formats_has_no_ending_twice_but_mat() -> None:
    endings = [ending for fmt in FORMATS for ending in fmt.endings]
    assert sorted(e for e in set(endings) if endings.count(e) > 1) == [".mat"]


def test_rate_from_rounded_times() -> None:
    times = np.round(np.arange(4108) / 1651.613, 6)
    assert rate_of_times(times, "x") == pytest.approx(1651.613, rel=1e-6)
    with pytest.raises(RecordingError, match="not evenly spaced"):
        rate_of_times(np.delete(times, slice(100, 300)), "x")


def test_frf_arrays_of_wrong_shape_are_refused(tmp_path: Path) -> None:
    base = {
        "frequency": np.arange(1.0, 41.0),
        "H": np.ones((40, 2, 1), complex),
        "response_node": [1, 2],
        "response_dof": [3, 3],
        "reference_node": [1],
        "reference_dof": [3],
    }
    path = tmp_path / "a.npz"
    np.savez(path, **base)  # type: ignore[arg-type]
    assert frequency_response(read_file(path), ORIGIN, quantity="acceleration").H.shape == (
        40,
        2,
        1,
    )
    for key, value, words in (
        ("H", np.ones((40, 1, 2), complex), "shape"),
        ("H", np.ones((39, 2, 1), complex), "39"),
        ("response_dof", [3, 7], "1 to 6"),
        ("frequency", np.zeros(40), "increasing"),
        ("response_node", [1], "do not agree"),
        ("coherence", np.ones((40, 2, 3)), "coherence"),
        ("coherence", np.full((40, 2, 1), 1.5), "between 0 and 1"),
    ):
        np.savez(path, **{**base, key: value})  # type: ignore[arg-type]
        with pytest.raises(RecordingError, match=words):
            frequency_response(read_file(path), ORIGIN, quantity="acceleration")


def test_a_stated_variance_is_taken_as_it_is_in_si(tmp_path: Path) -> None:
    rng = np.random.default_rng(4)
    variance = rng.uniform(1.0, 2.0, (40, 3, 1))
    base = {
        "frequency": np.arange(1.0, 41.0),
        "H": rng.normal(size=(40, 3, 1)) + 0j,
        "variance": variance,
        "reference_node": [1],
        "reference_dof": [3],
        "response_node": [1, 2, 3],
        "response_dof": [3, 3, 3],
        "coherence": np.full((40, 3, 1), 0.9),
    }
    path = tmp_path / "a.npz"
    np.savez(path, **base)  # type: ignore[arg-type]
    seen = frequency_response(read_file(path), ORIGIN, quantity="acceleration")
    assert seen.variance == pytest.approx(variance)
    wanted = [Wanted(2, "acceleration", 3, "z", "g"), Wanted(0, "acceleration", 1, "z", sign=-1)]
    some = frequency_response(read_file(path), ORIGIN, quantity="acceleration", wanted=wanted)
    assert some.variance == pytest.approx(variance[:, [2, 0]] * np.array([[9.80665**2], [1.0]]))
    np.savez(path, **{**base, "variance": variance[:, :, 0]})  # type: ignore[arg-type]
    assert frequency_response(
        read_file(path), ORIGIN, quantity="acceleration"
    ).variance == pytest.approx(variance)
    np.savez(path, **{**base, "s2": variance, "variance": -variance})  # type: ignore[arg-type]
    assert frequency_response(
        read_file(path), ORIGIN, quantity="acceleration", names=Names({"variance": "s2"})
    ).variance == pytest.approx(variance)
    with pytest.raises(RecordingError, match="negative or not numbers"):
        frequency_response(read_file(path), ORIGIN, quantity="acceleration")
    with pytest.raises(RecordingError, match="there is no array 'sigma'"):
        frequency_response(
            read_file(path), ORIGIN, quantity="acceleration", names=Names({"variance": "sigma"})
        )
    np.savez(path, **{**base, "variance": variance[:39]})  # type: ignore[arg-type]
    with pytest.raises(RecordingError, match="not that of H"):
        frequency_response(read_file(path), ORIGIN, quantity="acceleration")


def noisy_frf(averages: int, seed: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """A two-mode receptance estimated by H1 over blocks with independent lines: (H, estimate,
    coherence)."""
    rng = np.random.default_rng(seed)
    f = np.arange(1.0, 2001.0) * 0.1
    H = sum(1.0 / (f0**2 - f**2 + 0.04j * f0 * f) for f0 in (60.0, 133.0)) * 1e3
    x = rng.normal(size=(averages, len(f))) + 1j * rng.normal(size=(averages, len(f)))
    n = 0.05 * (rng.normal(size=x.shape) + 1j * rng.normal(size=x.shape))
    y = H * x + n
    Sxx, Syy, Syx = np.sum(np.abs(x) ** 2, 0), np.sum(np.abs(y) ** 2, 0), np.sum(y * np.conj(x), 0)
    return H, Syx / Sxx, np.abs(Syx) ** 2 / Sxx / Syy


@pytest.mark.parametrize("averages", [16, 50])
def test_the_variance_from_coherence_is_the_scatter_about_the_truth(averages: int) -> None:
    found, errors = [], []
    for seed in range(6):
        H, estimate, coherence = noisy_frf(averages, seed)
        variance, n = variance_of_frf(estimate[:, None, None], coherence[:, None, None])
        assert variance is not None
        found.append(n)
        errors.append(np.mean(np.abs(estimate - H) ** 2 / variance[:, 0, 0]))
    assert np.mean(found) == pytest.approx(averages - 1, rel=0.1)
    assert np.mean(errors) == pytest.approx(1.0, rel=0.15)


def test_functions_without_coherence_get_the_variance_of_their_neighbours() -> None:
    H, first, coherence = noisy_frf(30, 1)
    _, second, _hidden = noisy_frf(30, 2)
    both = np.stack([first, 2.0 * second], axis=1)[:, :, None]
    gamma = np.stack([coherence, np.full_like(coherence, np.nan)], axis=1)[:, :, None]
    variance, _ = variance_of_frf(both, gamma)
    assert variance is not None
    assert np.mean(np.abs(2.0 * (second - H)) ** 2 / variance[:, 1, 0]) == pytest.approx(
        1.0, rel=0.2
    )
    alone, n = variance_of_frf(both, None)
    assert alone is not None and np.isnan(n)
    far = np.abs(np.arange(2000) * 0.1 - 60.0) > 30.0
    far &= np.abs(np.arange(2000) * 0.1 - 133.0) > 30.0
    assert np.mean((np.abs(first - H) ** 2 / alone[:, 0, 0])[far]) == pytest.approx(1.0, rel=0.2)
    assert np.isnan(averages_from_scatter(first[:20, None], coherence[:20, None]))


def test_options_override_what_is_guessed(tmp_path: Path) -> None:
    path = tmp_path / "a.txt"
    path.write_text("1;2\n" * 5 + "7;8\n9;10\n")
    np.testing.assert_array_equal(
        read_file(path, Options(skip_rows=5)).arrays["data"], [[7, 8], [9, 10]]
    )
    with pytest.raises(RecordingError, match="encoding"):
        read_file(path, Options(encoding="no-such-code"))
