"""The block that `inspect` prints, pasted, is right: for tables as other programs write them, and
for every file of the public data sets."""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.recordings.inspect.result import Inspection
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import check_problem, load_problem
from tests.cases.bad_beam import csv_text, good_text

F = np.arange(5.0, 105.0, 0.5)
MOST = 3_000_000  # bytes of a file that is read here; longer ones: test_long_records.py


def _frfs() -> np.ndarray:
    """(lines, 2) accelerances of two modes each."""
    s = 2j * np.pi * F[:, None]
    out = np.zeros((F.size, 2), dtype=complex)
    for f0, shape in ((20.0, (1.0, 0.6)), (61.0, (-0.7, 0.9))):
        w = 2 * np.pi * f0
        out += s**2 * np.array(shape) / (s**2 + 2 * 0.01 * w * s + w**2)
    return out


H = _frfs()
FLAT = {"re": H.real, "im": H.imag, "mag": np.abs(H), "deg": np.degrees(np.angle(H))}
FLAT |= {"rad": np.angle(H), "db": 20 * np.log10(np.abs(H))}


def test_names_of_channels_with_units_are_places(tmp_path):
    """A logger's CSV: time, ``4:-Z [m/s^2]``."""
    t = np.arange(256) / 128.0
    columns = np.c_[t, np.sin(t), np.cos(t), np.sin(3 * t)]
    head = "time [s],4:-Z [m/s^2],n7.x (m/s^2),7:+X [N]"
    path = tmp_path / "logger.csv"
    np.savetxt(path, columns, delimiter=",", header=head, comments="")
    (table,) = tomllib.loads(inspect_file(path).block)["recordings"]
    said = [(row["node"], row["dof"], row.get("sign", 1)) for row in table["channels"]]
    assert said == [(4, "z", -1), (7, "x", 1), (7, "x", 1)]


def pasted(path: Path) -> Recording:
    """The recording that a problem with the block of ``path`` loads, on as many nodes as it
    names."""
    block = inspect_file(path).block.replace("# rate =", "rate = 1.0  #")  # that nobody states
    (table,) = tomllib.loads(block)["recordings"]
    named = [*table.get("channels", ()), *table.get("references", ())]
    nodes = {row.get("node", 1) for row in named} | set(range(1, 60))
    rows = ", ".join(f"{{ id = {n}, x = {float(n)} }}" for n in sorted(nodes))
    springs = ", ".join(
        f"{{ id = {k}, nodes = [{n}], k = 1e3 }}" for k, n in enumerate(sorted(nodes), 1)
    )
    masses = ", ".join(
        f"{{ id = {k}, nodes = [{n}], m = 1.0 }}" for k, n in enumerate(sorted(nodes), 10**8)
    )
    problem = path.parent / f"{path.name}.toml"
    problem.write_text(
        f'[model]\ndofs = ["x", "y", "z"]\nnodes = [{rows}]\n'
        + "".join(
            f'[[model.elements]]\ntype = "spring"\ndof = "{d}"\nrows = [{springs}]\n'.replace(
                "id = ", f"id = {i}0000"
            )
            for i, d in enumerate("xyz", 1)
        )
        + f'[[model.elements]]\ntype = "mass"\nrows = [{masses}]\n'
        + block,
        encoding="utf-8",
    )
    (recording,) = load_recordings(load_problem(problem))
    return recording


def _csv(path: Path, header: str, *columns: Any, delimiter: str = ",") -> Path:
    table = np.column_stack(columns)
    np.savetxt(path, table, delimiter=delimiter, header=header, comments="", fmt="%.15g")
    return path


@pytest.mark.parametrize(
    ("header", "parts"),
    [
        ("frequency,re_5,im_5,re_9,im_9", ("re", "im")),
        ("Frequency [Hz],H1 real,H1 imag,H2 real,H2 imag", ("re", "im")),
        ("f (Hz),Re(5:+Z),Im(5:+Z),Re(9:+Z),Im(9:+Z)", ("re", "im")),
        ("freq,c1,c2,c3,c4", ("re", "im")),
        ("freq,a,b,c,d", ("mag", "deg")),
        ("Frequency,Mag 5,Phase 5,Mag 9,Phase 9", ("mag", "deg")),
        ("Frequency,Mag 5,Phase 5 (rad),Mag 9,Phase 9 (rad)", ("mag", "rad")),
        ("Frequency [Hz],n5 [dB],n5 phase [deg],n9 [dB],n9 phase [deg]", ("db", "deg")),
        ("Frequency,dB_5,phase_5,dB_9,phase_9", ("db", "deg")),
    ],
)
def test_columns_of_frfs(tmp_path: Path, header: str, parts: tuple[str, str]) -> None:
    """Real and imaginary parts, moduli or decibels with a phase: every channel, and its numbers."""
    columns = [FLAT[p][:, k] for k in range(2) for p in parts]
    found = pasted(_csv(tmp_path / "frf.csv", header, F, *columns))
    assert isinstance(found, FrequencyResponse)
    np.testing.assert_allclose(found.H[:, :, 0], H, rtol=1e-9, atol=1e-9)
    if "9" in header:
        assert [c.label for c in found.responses] == ["n5.z", "n9.z"]


@pytest.mark.parametrize(
    ("header", "said"),
    [
        ("Frequency [Hz],A1 Real,A1 Imag,A2 Real,A2 Imag", "nodes are counted, directions guessed"),
        ("frequency,re_5,im_5,re_9,im_9", "directions are guessed"),
        ("f (Hz),Re(5:+Z),Im(5:+Z),Re(9:+Z),Im(9:+Z)", ""),
    ],
)
def test_places_that_the_file_does_not_say_are_said_to_be_guessed(
    tmp_path: Path, header: str, said: str
) -> None:
    """And counted channels keep their own names beside them."""
    columns = [FLAT[p][:, k] for k in range(2) for p in ("re", "im")]
    block = inspect_file(_csv(tmp_path / "frf.csv", header, F, *columns)).block
    (line,) = [row for row in block.splitlines() if row.startswith("channels = [")]
    assert line == (f"channels = [   # {said}: correct them" if said else "channels = [")
    assert ("# A1" in block) == ("counted" in said)


def test_matrices_of_a_model_are_told_from_recordings(tmp_path: Path) -> None:
    np.savez(tmp_path / "km.npz", K=np.eye(3), M=np.eye(3), K1=np.eye(3))
    np.savez(tmp_path / "k.npz", K=np.eye(3), other=np.ones((2, 3)))
    (said,) = [n for n in inspect_file(tmp_path / "km.npz").notes if "matrices of a model" in n]
    assert said.startswith("K, M, K1 look like")
    assert not any("of a model" in n for n in inspect_file(tmp_path / "k.npz").notes)


def test_a_damaged_row_makes_no_time_history_of_frfs(tmp_path: Path) -> None:
    """The strangers' damaged tables were offered as times of unknown channels at 1 Hz."""
    lines = good_text().splitlines()
    sound = [line for line in _inspected(tmp_path, lines).block.splitlines() if "file" not in line]
    cells = lines[50].split(",")
    for spoilt in (",".join(cells[:7]), ",".join([*cells[:3], "OVL", *cells[4:]])):
        found = _inspected(tmp_path, [*lines[:50], spoilt, *lines[51:]])
        assert [line for line in found.block.splitlines() if "file" not in line] == sound
        assert any("line 51 is not a row of 11 numbers" in note for note in found.notes)
    table = np.loadtxt(lines[1:], delimiter=",")
    table[:, 3] = np.nan
    dead = _inspected(tmp_path, csv_text(table).splitlines())
    assert "acceleration, without a single number; 1993 missing" in dead.channels[2].text()


def _inspected(folder: Path, lines: list[str]) -> Inspection:
    (folder / "beam.csv").write_text("\n".join(lines) + "\n", encoding="utf-8")
    return inspect_file(folder / "beam.csv")


def test_a_table_of_nodes_is_told_from_recordings(tmp_path: Path) -> None:
    (tmp_path / "n.csv").write_text("id,x,y\n1,0,0\n2,0.4,0\n3,0.7,0\n")
    said = inspect_file(tmp_path / "n.csv").notes[-1]
    assert "id, x, y look like a table of nodes or elements" in said


def test_a_coherence_beside_is_taken_as_one(tmp_path: Path) -> None:
    coherence = np.full(F.size, 0.98)
    path = _csv(
        tmp_path / "a.csv",
        "f,real,imag,coherence",
        F,
        FLAT["re"][:, 0],
        FLAT["im"][:, 0],
        coherence,
    )
    found = pasted(path)
    assert isinstance(found, FrequencyResponse) and found.H.shape == (F.size, 1, 1)
    assert found.coherence is not None
    np.testing.assert_allclose(found.coherence, 0.98)
    view = inspect_file(path).channels[2]
    assert view.quantity == "coherence" and "clipped" not in view.text()


@pytest.mark.parametrize("name", ["Time", "Time [s]", "t", "time (ms)", "Zeit"])
def test_a_column_of_times_is_no_channel(tmp_path: Path, name: str) -> None:
    rate = 250.0
    t = np.arange(512) / rate * (1e3 if "ms" in name else 1.0)
    x = np.random.default_rng(3).normal(size=(512, 2))
    found = pasted(_csv(tmp_path / "a.csv", f"{name},acc 1 [m/s^2],acc 2 [m/s^2]", t, x))
    assert isinstance(found, TimeHistory) and found.rate == pytest.approx(rate)
    np.testing.assert_allclose(found.data, x, rtol=1e-9)


MODES = """mode,frequency_Hz,damping_pct,4:+X,8:-X,11:+Y
1,19.712,0.90,-0.3922,0.7897,0.5
2,68.044,0.85,0.2512,-0.3406,0.2
"""


def test_a_table_of_modes_with_a_column_for_each_dof(tmp_path: Path) -> None:
    (tmp_path / "modes.csv").write_text(MODES, encoding="utf-8")
    found = pasted(tmp_path / "modes.csv")
    assert isinstance(found, ModeTable) and found.shapes is not None
    assert [c.label for c in found.channels] == ["n4.x", "n8.x", "n11.y"]
    np.testing.assert_allclose(found.damping, [0.0090, 0.0085])
    np.testing.assert_allclose(found.shapes[0], [-0.3922, -0.7897, 0.5])
    np.testing.assert_array_equal(found.pairs, [0, 0])  # the column of numbers fixes no pairing


def test_complex_shapes_and_nodes_by_another_name(tmp_path: Path) -> None:
    text = "f,zeta,101:+X re,101:+X im,102:+X re,102:+X im\n10.0,0.01,1,0,0.5,0.1\n"
    (tmp_path / "m.csv").write_text(text, encoding="utf-8")
    head = (
        '[model]\ndofs = ["x"]\nnodes = [{ id = 5, x = 0.0 }, { id = 9, x = 1.0 }]\n'
        '[[model.elements]]\ntype = "spring"\ndof = "x"\n'
        "rows = [{ id = 1, nodes = [5], k = 1e3 }, { id = 2, nodes = [5, 9], k = 1e3 }]\n"
        '[[model.elements]]\ntype = "mass"\n'
        "rows = [{ id = 3, nodes = [5], m = 1.0 }, { id = 4, nodes = [9], m = 1.0 }]\n"
        '[[recordings]]\nkind = "modes"\nfile = "m.csv"\nnode_map = { 101 = 5, 102 = 9 }\n'
    )
    (tmp_path / "p.toml").write_text(head, encoding="utf-8")
    (found,) = load_recordings(load_problem(tmp_path / "p.toml"))
    assert isinstance(found, ModeTable) and [c.label for c in found.channels] == ["n5.x", "n9.x"]
    np.testing.assert_allclose(found.shapes, [[1.0, 0.5 + 0.1j]])


def test_our_own_table_of_modes(tmp_path: Path) -> None:
    text = (
        "frequency,frequency_std,damping,shape\n19.7,0.04,0.009,1 0.5 -0.2\n68.0,0.1,0.009,1 -1 2\n"
    )
    (tmp_path / "modes.csv").write_text(text, encoding="utf-8")
    found = pasted(tmp_path / "modes.csv")
    assert isinstance(found, ModeTable) and found.shapes is not None
    np.testing.assert_allclose(found.shapes, [[1, 0.5, -0.2], [1, -1, 2]])


def test_places_that_stand_in_are_called_placeholders_and_refused_once(tmp_path: Path) -> None:
    """A table of shapes without places: the block says so, and `check` says one fault of it."""
    (tmp_path / "modes.csv").write_text("frequency,shape\n19.7,1 0.5 -0.2\n", encoding="utf-8")
    block = inspect_file(tmp_path / "modes.csv").block
    assert "nodes and directions are placeholders, correct them" in block
    rows = ", ".join(f"{{ id = {k}, nodes = [{k}], k = 1e3 }}" for k in (1, 2, 3))
    lumps = ", ".join(f"{{ id = {k + 3}, nodes = [{k}], m = 1.0 }}" for k in (1, 2, 3))
    (tmp_path / "p.toml").write_text(
        '[model]\ndofs = ["x"]\nnodes = [{ id = 1, x = 0 }, { id = 2, x = 1 }, { id = 3, x = 2 }]\n'
        f'[[model.elements]]\ntype = "spring"\ndof = "x"\nrows = [{rows}]\n'
        f'[[model.elements]]\ntype = "mass"\nrows = [{lumps}]\n{block}',
        encoding="utf-8",
    )
    (fault,) = check_problem(tmp_path / "p.toml")
    assert fault.problem.startswith("channel 0 (and 2 more) reads DOF 'z'")
    assert fault.remedy == "Correct the dof of the channels, or add 'z' to model.dofs."


def _write(kind: str, folder: Path) -> Path:
    """FRFs or histories as another program writes them."""
    import h5py
    import pyuff
    import scipy.io

    path = folder / {"uff": "a.uff", "npz": "a.npz", "h5": "a.h5"}.get(kind, "a.mat")
    if kind == "uff":
        out = pyuff.UFF(str(path))
        sets = [
            pyuff.prepare_58(
                binary=1,
                func_type=4,
                rsp_node=node,
                rsp_dir=3,
                ref_node=5,
                ref_dir=3,
                data=H[:, k],
                x=F,
                id1="frf",
                abscissa_spacing=1,
                abscissa_min=F[0],
                abscissa_inc=0.5,
                ordinate_spec_data_type=12,
                orddenom_spec_data_type=13,
            )
            for k, node in enumerate((5, 9))
        ]
        out.write_sets(sets, mode="add")
    elif kind == "npz":
        np.savez(path, f=F, FRF=H)
    elif kind == "h5":
        with h5py.File(path, "w") as file:
            file["measurement/freq"], file["measurement/frf"] = F, H
    else:
        scipy.io.savemat(path, {"freq": F, "H1": H})
        if kind in ("blank", "zeros"):
            blob = path.read_bytes()
            path.write_bytes((b" " if kind == "blank" else b"\0") * 116 + blob[116:])
    return path


@pytest.mark.parametrize("kind", ["uff", "npz", "h5", "mat", "blank", "zeros"])
def test_files_of_other_writers(tmp_path: Path, kind: str) -> None:
    found = pasted(_write(kind, tmp_path))
    assert isinstance(found, FrequencyResponse)
    np.testing.assert_allclose(found.H[:, :, 0], H, rtol=1e-6)
    np.testing.assert_allclose(found.frequency, F)


def test_frequencies_and_hertz_make_a_table_of_responses(tmp_path: Path) -> None:
    for k, name in enumerate(("f_Hz", "f [Hz]", "Freq (Hz)", "frequency", "Hz", "line")):
        path = tmp_path / f"{k}.csv"
        head = f"{name},re_3z_10z,im_3z_10z,coh_3z_10z"
        rows = "\n".join(f"{x:g},{h.real},{h.imag},0.98" for x, h in zip(F, H[:, 0], strict=True))
        path.write_text(f"{head}\n{rows}\n")
        found = inspect_file(path)
        assert found.kind == "frf" and 'form = "real-imaginary", pair = 2' in found.block, name
    (tmp_path / "t.csv").write_text("factor,a\n" + "\n".join(f"{x},{x}" for x in range(9)))
    assert inspect_file(tmp_path / "t.csv").kind == "time"


def test_every_public_file(data_folder: Path, tmp_path: Path) -> None:
    """The block is valid and loads, or there is none and `inspect` says what the file holds."""
    seen: dict[str, str] = {}
    for path in sorted(data_folder.rglob("*")):
        if not path.is_file() or path.suffix.lower() in (".md", "") or path.stat().st_size > MOST:
            continue
        kind = f"{path.relative_to(data_folder).parts[0]}{path.suffix}{path.stem[:3]}"
        if kind in seen:  # one of each kind of file of a data set
            continue
        found = inspect_file(path)
        seen[kind] = found.kind
        if not found.block:
            assert found.kind == "arrays" and found.notes, path.name
            continue
        (tmp_path / path.name).symlink_to(path)
        recording = pasted(tmp_path / path.name)
        wanted = {"time": TimeHistory, "frf": FrequencyResponse, "modes": ModeTable}[found.kind]
        assert isinstance(recording, wanted), path.name
    assert len(seen) >= 8
