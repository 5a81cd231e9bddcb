"""Many starts of one fit: in parallel (`cvxupdate.parallel`) and kept as they finish; the minima
they reach are judged in `cvxupdate.update.basins`."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.parallel import Where, spread
from cvxupdate.system import Array


@dataclass(frozen=True)
class StartEnd:
    """Where one start ended: its ``number`` (0: the nominal model), ``objective``, ``p``, the
    loop's ``status`` and ``iterations``, ``seconds`` of processor time."""

    number: int
    objective: float
    p: tuple[float, ...]
    status: str
    iterations: int
    seconds: float


def random_starts(model: Model, count: int, seed: int) -> Array:
    """Uniformly random points inside the bounds, (count, n).

    Raises
    ------
    InputError
        When a parameter has no bounds to be random between.
    """
    lower = np.array([q.lower for q in model.parameters])
    upper = np.array([q.upper for q in model.parameters])
    free = [
        q.name
        for q, a, b in zip(model.parameters, lower, upper, strict=True)
        if not np.isfinite(b - a)
    ]
    if free:
        raise InputError(
            f"update.starts: {', '.join(free[:5])} has no bounds to draw random starts from. Give "
            "lower and upper."
        )
    return np.asarray(np.random.default_rng(seed).uniform(lower, upper, (count, len(lower))))


@dataclass(frozen=True)
class Kept:
    """Ends that are written down one by one, so that an interrupted run goes on where it was:
    ``file`` (None: nowhere) holds a line for each, with the ``mark`` of what was fitted."""

    file: Path | None
    mark: str

    def read(self) -> dict[int, StartEnd]:
        """The ends of this very problem that are there already; damaged lines are left out."""
        if self.file is None or not self.file.is_file():
            return {}
        out = {}
        for line in self.file.read_text(encoding="utf-8").splitlines():
            try:
                row = json.loads(line)
                if row.pop("mark") == self.mark:
                    end = StartEnd(**{**row, "p": tuple(row["p"])})
                    out[end.number] = end
            except (ValueError, TypeError, KeyError, AttributeError):
                continue
        return out

    def add(self, end: StartEnd) -> None:
        """Write one down."""
        if self.file is None:
            return
        try:
            self.file.parent.mkdir(parents=True, exist_ok=True)
            with self.file.open("a", encoding="utf-8") as out:
                out.write(json.dumps({"mark": self.mark, **asdict(end)}) + "\n")
        except OSError as error:
            raise InputError(
                f"{self.file}: finished starts cannot be written there ({error.strerror}). Give "
                "another --out."
            ) from error


def mark_of(*parts: bytes) -> str:
    """A name for what is fitted: the same bytes, the same name."""
    digest = hashlib.sha256()
    for part in parts:
        digest.update(len(part).to_bytes(8, "little") + part)
    return digest.hexdigest()


Task = tuple[int, Array]
Solve = Callable[[int, Array], StartEnd]


@dataclass(frozen=True)
class Many:
    """How many starts are run: by ``open_(path)``, which gives what solves one, ``where`` (None: in
    as many processes as there are processors; without ``open_`` in this one), kept in the file
    ``keep``, with ``progress`` told (done, of)."""

    where: Where | None = None
    keep: Path | None = None
    progress: Callable[[int, int], None] | None = None
    open_: Callable[[str], Solve] | None = None


def run_starts(
    tasks: Sequence[Task],
    open_: Callable[..., Solve],
    arguments: Mapping[str, Any],
    kept: Kept,
    where: Where | None = None,
    progress: Callable[[int, int], None] | None = None,
) -> tuple[StartEnd, ...]:
    """Every task solved, by number; those that ``kept`` has already are not solved again.

    ``open_(**arguments)`` gives the function that solves one; each process calls it once.
    """
    done = {n: e for n, e in kept.read().items() if n in {number for number, _ in tasks}}
    left = [task for task in tasks if task[0] not in done]
    for end in spread(left, open_, arguments, where or Where()):
        done[end.number] = end
        kept.add(end)
        if progress is not None:
            progress(len(done), len(tasks))
    return tuple(done[number] for number in sorted(done))


def timed(
    number: int, p: Array, solve: Callable[[Array], tuple[float, Array, str, int]]
) -> StartEnd:
    """One start with its processor time."""
    begin = time.process_time()
    objective, end, status, iterations = solve(p)
    seconds = time.process_time() - begin
    return StartEnd(number, objective, tuple(end.tolist()), status, iterations, seconds)
