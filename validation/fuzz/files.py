"""Units, recordings and problem files, spoilt at random."""

from __future__ import annotations

import functools
import io
import json
import tempfile
import zipfile
from pathlib import Path

import numpy as np

from cvxupdate import study
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.recordings.units import parse_unit

ROOT = Path(__file__).resolve().parents[2]
ENDINGS = (".npz", ".npy", ".mat", ".h5", ".json", ".csv", ".txt", ".uff", ".xlsx", ".bin", "")
UNITS = [*"()/*^0123456789.-+eE %°µ", "m", "mm", "s", "N", "kN", "g", "kg", "Hz", "V", "rad"]
UNITS += ["lbf", "in", "ft", "**", "mV/g", "m/s^2"]
WORDS = [
    *("0", "-1", "1e308", "-1e308", "nan", "inf", "1e-300", "99999999999999999999", "''", '""'),
    *("[]", "{}", "[[]]", "true", '"x"', '"n1.x"', '"all"', '"../../x"', '"é"', "1979-05-27"),
    *("file", "nodes", "id", "x", "k", "m", "E", "dofs", "group", "type", "rows", "=", ",", "\n"),
]
PROBLEMS = ("tests/strangers/beam_modal", "tests/spec/good", "problems/chain10")
"""Folders of small problems; those that are not there are left out."""


def spoilt(blob: bytes, rng: np.random.Generator) -> bytes:
    """Some bytes flipped, a piece cut out, doubled, moved, or the end cut off."""
    out = bytearray(blob)
    for _ in range(int(rng.integers(1, 5))):
        if not out:
            break
        at, way = int(rng.integers(len(out))), int(rng.integers(5))
        size = int(rng.integers(1, 1 + min(64, len(out))))
        if way == 0:
            out[at] ^= 1 << int(rng.integers(8))
        elif way == 1:
            del out[at : at + size]
        elif way == 2:
            out[at:at] = out[at : at + size]
        elif way == 3:
            del out[at:]
        else:
            out[at : at + size] = rng.bytes(size)
    return bytes(out)


def unit_case(rng: np.random.Generator) -> None:
    """A text of pieces of units."""
    parse_unit("".join(rng.choice(UNITS, int(rng.integers(1, 9)))))


@functools.cache
def sound_files() -> tuple[tuple[str, bytes], ...]:
    """A small file of each format: (ending, bytes)."""
    data = np.random.default_rng(3).normal(size=(60, 3))
    out: list[tuple[str, bytes]] = []
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        np.savez(folder / "a.npz", data=data, fs=100.0)
        np.savez_compressed(folder / "b.npz", frequency=data[:, 0], H=data[:, 1:] + 1j)
        np.save(folder / "a.npy", data)
        np.savetxt(folder / "a.csv", data, delimiter=",", header="time,f [N],a [g]", comments="")
        np.savetxt(folder / "a.txt", data, header="mode frequency damping")
        (folder / "a.json").write_text(json.dumps({"data": data.tolist(), "fs": 100}))
        with zipfile.ZipFile(folder / "a.xlsx", "w") as archive:
            rows = "".join(
                "<row>" + "".join(f"<c><v>{v!r}</v></c>" for v in row) + "</row>"
                for row in data.tolist()
            )
            space = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
            archive.writestr(
                "xl/worksheets/sheet1.xml",
                f'<worksheet xmlns="{space}"><sheetData>{rows}</sheetData></worksheet>',
            )
        _with_libraries(folder, data)
        out += [(path.suffix, path.read_bytes()) for path in sorted(folder.iterdir())]
    return tuple(out)


def _with_libraries(folder: Path, data: np.ndarray) -> None:
    import h5py
    import pyuff
    from scipy.io import savemat

    savemat(folder / "a.mat", {"data": data, "fs": 100.0}, do_compression=True)
    savemat(folder / "b.mat", {"s": {"K": data, "name": "x"}})
    with h5py.File(folder / "a.h5", "w") as file:
        file["run1/data"] = data
    for binary in (0, 1):
        for node in (1, 2):
            pyuff.UFF(str(folder / f"a{binary}.uff")).write_sets(
                pyuff.prepare_58(
                    binary=binary,
                    func_type=4,
                    rsp_node=node,
                    rsp_dir=3,
                    ref_node=1,
                    ref_dir=3,
                    data=data[:, 0] + 1j * data[:, node],
                    x=1.0 + np.arange(len(data)),
                    id1="t",
                    rsp_ent_name="a",
                    ref_ent_name="b",
                    abscissa_spacing=1,
                    abscissa_spec_data_type=18,
                    ordinate_spec_data_type=12,
                    orddenom_spec_data_type=13,
                ),
                "add",
            )


def reader_case(rng: np.random.Generator) -> None:
    """A sound file, spoilt, perhaps under another ending: inspected."""
    files = sound_files()
    ending, blob = files[int(rng.integers(len(files)))]
    if rng.random() < 0.1:
        ending = str(rng.choice(ENDINGS))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"x{ending}"
        path.write_bytes(spoilt(blob, rng))
        inspect_file(path).text()


@functools.cache
def sound_problems() -> tuple[tuple[str, dict[str, bytes]], ...]:
    """(problem file, {name: bytes} of its folder)."""
    out = []
    for name in PROBLEMS:
        folder = ROOT / name
        for problem in sorted(folder.glob("*.toml")):
            beside = {p.name: p.read_bytes() for p in folder.iterdir() if p.is_file()}
            out.append((problem.name, beside))
    return tuple(out)


def problem_case(rng: np.random.Generator) -> None:
    """A problem file with words replaced, or a file beside it spoilt: checked as `check` does."""
    problems = sound_problems()
    name, beside = problems[int(rng.integers(len(problems)))]
    files = dict(beside)
    target = name if rng.random() < 0.8 else str(rng.choice(sorted(files)))
    files[target] = (
        _other_words(files[target], rng) if rng.random() < 0.7 else spoilt(files[target], rng)
    )
    with tempfile.TemporaryDirectory() as folder:
        for other, blob in files.items():
            (Path(folder) / other).write_bytes(blob)
        study.check(Path(folder) / name)


def _other_words(blob: bytes, rng: np.random.Generator) -> bytes:
    """Words of a text replaced by others, or by those of another place."""
    import re

    pieces = re.split(r'([\s,=\[\]{}"]+)', blob.decode("latin-1"))
    for _ in range(int(rng.integers(1, 4))):
        at = 2 * int(rng.integers((len(pieces) + 1) // 2))
        pieces[at] = str(rng.choice(WORDS)) if rng.random() < 0.7 else str(rng.choice(pieces))
    out = io.BytesIO("".join(pieces).encode("latin-1", "replace"))
    return out.getvalue()
