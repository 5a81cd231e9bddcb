"""Excel workbooks (.xlsx): the numbers of each sheet, read as the zipped XML that they are."""

from __future__ import annotations

import io
import re
import xml.etree.ElementTree as ElementTree
import zipfile
from array import array
from collections.abc import Iterator
from pathlib import Path

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import AnyArray, Contents, Format, Options
from cvxupdate.unpacking import must_be_believable

_NS = "{http://schemas.openxmlformats.org/spreadsheetml/2006/main}"
_LIMIT = 2**28  # bytes of one sheet's XML
_CELLS = 10**7


def _rows(archive: zipfile.ZipFile, name: str, where: str) -> Iterator[ElementTree.Element]:
    """The rows of a sheet, one at a time: its tree takes some twenty times the room of its text."""
    member = archive.getinfo(name)
    if member.file_size > _LIMIT:
        raise RecordingError(
            f"{where}: {name} is larger than {_LIMIT // 2**20} MB. Export the sheet as CSV."
        )
    must_be_believable(member.compress_size, member.file_size, f"{where}: {name}")
    text = archive.read(name)
    if b"<!DOCTYPE" in text or b"<!ENTITY" in text:  # entities can grow without bound
        raise RecordingError(
            f"{where}: {name} declares entities, which a workbook does not need. Export the "
            "sheet as CSV."
        )
    parents: list[ElementTree.Element] = []
    for event, element in ElementTree.iterparse(io.BytesIO(text), ("start", "end")):
        if event == "start":
            parents.append(element)
            continue
        parents.pop()
        if element.tag == f"{_NS}row":
            yield element
            for parent in parents[-1:]:
                parent.clear()


def _column(reference: str) -> int:
    letters = re.match(r"[A-Z]{1,3}", reference)
    value = 0
    for letter in letters[0] if letters else "A":
        value = 26 * value + ord(letter) - 64
    return value - 1


def read_xlsx(path: Path, options: Options) -> Contents:
    """One array per sheet (``"sheet1"`` …, also ``"data"`` for the first), NaN where a cell is not
    a number; text is left out."""
    arrays: dict[str, AnyArray] = {}
    with zipfile.ZipFile(path) as archive:
        sheets = sorted(
            (
                name
                for name in archive.namelist()
                if re.fullmatch(r"xl/worksheets/sheet\d+\.xml", name)
            ),
            key=lambda name: int(re.findall(r"\d+", name)[-1]),
        )
        for name in sheets:
            ys, xs, numbers = array("q"), array("q"), array("d")
            for y, line in enumerate(_rows(archive, name, str(path))):
                for x, cell in enumerate(line.iter(f"{_NS}c")):
                    value = cell.find(f"{_NS}v")
                    if value is not None and value.text and cell.get("t", "n") == "n":
                        place = cell.get("r", "")
                        ys.append(y)
                        xs.append(_column(place) if place else x)
                        numbers.append(float(value.text))
            if not numbers:
                continue
            rows, columns = max(ys) + 1, max(xs) + 1
            if rows * columns > _CELLS:
                raise RecordingError(
                    f"{path}: {name} spans {rows} x {columns} cells. Export the part with the "
                    "numbers as CSV."
                )
            table = np.full((rows, columns), np.nan)
            table[np.asarray(ys), np.asarray(xs)] = numbers
            table = table[~np.all(np.isnan(table), axis=1)][:, ~np.all(np.isnan(table), axis=0)]
            arrays[f"sheet{re.findall(r'[0-9]+', name)[-1]}"] = table
    if not arrays:
        raise RecordingError(f"{path}: no sheet of this workbook holds numbers.")
    return Contents(str(path), "xlsx", {"data": next(iter(arrays.values())), **arrays})


XLSX = Format("xlsx", (".xlsx",), lambda head: head.startswith(b"PK\x03\x04"), read_xlsx)
