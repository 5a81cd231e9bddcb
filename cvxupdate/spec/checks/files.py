"""Files that a problem file names."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import ClassVar

from cvxupdate.keys import Loc
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import MATRICES, MATRIX_FILES, from_files
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.tables import unusable


@dataclass(frozen=True)
class Datasets:
    """`dataset` stands beside `file`, and a recording that is not a table of modes has a file."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every data set without a file, and every recording without data."""
        for i, recording in enumerate(case.spec.recordings):
            if recording.file is None and recording.dataset is not None:
                yield Complaint(
                    ("recordings", i, "dataset"),
                    f"'{recording.dataset}' is given without a `file`.",
                    "Say which file of the data set.",
                )
            elif recording.file is None and recording.kind != "modes":
                yield Complaint(
                    ("recordings", i, "file"),
                    f"is missing: a {recording.kind} recording needs data.",
                    'Add file = "…", relative to the problem file.',
                )


@dataclass(frozen=True)
class MatrixSources:
    """A matrix row names a matrix, and a variable has a file to be in."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every row without a matrix, or without a file."""
        for loc, block, row in case.rows():
            if not from_files(block.type):
                continue
            named = [n for n in (getattr(row, key) for key in MATRICES) if n is not None]
            if not named:
                yield Complaint(
                    loc,
                    f"element {row.id} names no matrix.",
                    "Give `stiffness`, `mass`, `damping` or `structural`.",
                )
            elif row.get("file") is None and not all(_is_file(n) for n in named):
                yield Complaint(
                    (*loc, "file"),
                    f"is missing: element {row.id} names variables, but no file.",
                    "Give `file` on the row or on the block.",
                )


@dataclass(frozen=True)
class MissingFiles:
    """Every file is there and holds something."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every file that cannot be opened, once each."""
        said: set[tuple[Path, str | None]] = set()
        for loc, path, dataset in _files(case):
            if (path, dataset) in said:
                continue
            said.add((path, dataset))
            wrong = unusable(path, dataset)
            if wrong:
                yield Complaint(loc, *wrong)


def _files(case: Case) -> Iterator[tuple[Loc, Path, str | None]]:
    for i, recording in enumerate(case.spec.recordings):
        if recording.file is not None and not (recording.kind == "modes" and recording.rows):
            yield ("recordings", i, "file"), recording.file, recording.dataset
        if recording.kind == "modes" and isinstance(recording.covariance, Path):
            yield ("recordings", i, "covariance"), recording.covariance, recording.dataset
    for i, block in enumerate(case.spec.model.elements):
        if not from_files(block.type):
            continue
        for j, row in enumerate(block.rows):
            loc: Loc = ("model", "elements", i, "rows", j)
            if row.file is not None:
                shared = block.get("file") == row.file
                yield ((*loc[:3], "file") if shared else (*loc, "file")), row.file, row.dataset
            for key in MATRICES:
                name = getattr(row, key)
                if name is not None and _is_file(name):
                    yield (*loc, key), Path(name), row.dataset


def _is_file(name: str) -> bool:
    return name.lower().endswith(MATRIX_FILES)
