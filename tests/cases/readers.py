"""A file of every format, written by the library of that format or by hand; the contract of readers
runs over all of them."""

from __future__ import annotations

import json
import zipfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from cvxupdate.recordings.read.contents import Contents

DATA = np.random.default_rng(3).normal(size=(64, 3))


@dataclass(frozen=True)
class ReaderCase:
    """A format's word, the name of a file, what writes `DATA` into it, and where they are found."""

    format: str
    file: str
    write: Callable[[Path], None]
    values: Callable[[Contents], np.ndarray] = lambda contents: contents.arrays["data"]


def _hdf5(path: Path) -> None:
    import h5py

    with h5py.File(path, "w") as file:
        file["data"] = DATA


def _mat(path: Path) -> None:
    from scipy.io import savemat

    savemat(path, {"data": DATA})


def _xlsx(path: Path) -> None:
    rows = "".join(
        f'<row r="{i + 1}">'
        + "".join(f'<c r="{c}{i + 1}"><v>{v!r}</v></c>' for c, v in zip("ABC", row, strict=True))
        + "</row>"
        for i, row in enumerate(DATA.tolist())
    )
    space = "http://schemas.openxmlformats.org/spreadsheetml/2006/main"
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr(
            "xl/worksheets/sheet1.xml",
            f'<worksheet xmlns="{space}"><sheetData>{rows}</sheetData></worksheet>',
        )


def _uff(path: Path) -> None:
    import pyuff

    x = np.arange(len(DATA)) / 100.0
    sets = [
        pyuff.prepare_58(
            binary=0,
            func_type=1,
            rsp_node=node + 1,
            rsp_dir=1,
            ref_node=1,
            ref_dir=1,
            data=column,
            x=x,
            id1="time",
            rsp_ent_name="a",
            ref_ent_name="b",
            abscissa_spacing=1,
            abscissa_spec_data_type=17,
            ordinate_spec_data_type=12,
            orddenom_spec_data_type=0,
        )
        for node, column in enumerate(DATA.T)
    ]
    pyuff.UFF(str(path)).write_sets(sets, "overwrite")


CASES: tuple[ReaderCase, ...] = (
    ReaderCase("npz", "a.npz", lambda path: np.savez(path, data=DATA)),
    ReaderCase("hdf5", "a.h5", _hdf5),
    ReaderCase("mat", "a.mat", _mat),
    ReaderCase("xlsx", "a.xlsx", _xlsx),
    ReaderCase(
        "uff", "a.uff", _uff, lambda c: np.column_stack([f.values.real for f in c.functions])
    ),
    ReaderCase("json", "a.json", lambda p: p.write_text(json.dumps({"data": DATA.tolist()}))),
    ReaderCase(
        "text", "a.csv", lambda p: np.savetxt(p, DATA, delimiter=",", header="f,a,b", comments="")
    ),
)
