"""Many starts of one fit: in parallel (`cvxupdate.parallel`), kept as they finish, and judged by
the minima they reach."""

from __future__ import annotations

import hashlib
import json
import time
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np

from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.parallel import Where, spread
from cvxupdate.system import Array

HIGHER = 0.01
"""Two ends are one minimum where the straight way between them is nowhere higher than both by more
than this fraction: nobody calls a model better for less (a step in that direction is judged by the
same figure in the published comparison of problems/real/smu-modal-data)."""
ON_THE_WAY = (0.25, 0.5, 0.75)


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


@dataclass(frozen=True)
class Basin:
    """A minimum: its lowest ``objective``, the ``starts`` that ended there, and where ``p``."""

    objective: float
    starts: tuple[int, ...]
    p: tuple[float, ...]


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


def basins(ends: Iterable[StartEnd], objective: Callable[[Array], float]) -> tuple[Basin, ...]:
    """The different minima among ``ends``, lowest first; ``objective`` is asked on the straight way
    between two ends, inf where the model is no structure."""
    found: list[list[StartEnd]] = []
    for end in sorted(ends, key=lambda e: e.objective):
        if not np.isfinite(end.objective):
            continue
        own = next((b for b in found if _one_valley(b[0], end, objective)), None)
        if own is None:
            found.append([end])
        else:
            own.append(end)
    return tuple(Basin(b[0].objective, tuple(sorted(e.number for e in b)), b[0].p) for b in found)


def _one_valley(a: StartEnd, b: StartEnd, objective: Callable[[Array], float]) -> bool:
    """Whether no ridge stands between two ends of which ``a`` is the lower, and ``b`` is no shelf
    far above it."""
    limit = (1.0 + HIGHER) * b.objective
    if b.objective > (1.0 + HIGHER) * a.objective:
        return False
    x, y = np.array(a.p), np.array(b.p)
    return all(objective(x + t * (y - x)) <= limit for t in ON_THE_WAY)


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


def starts_report(ends: Sequence[StartEnd], minima: Sequence[Basin]) -> dict[str, Any]:
    """Plain data: how many starts, what became of each, the minima found (``share`` of the starts
    that ended in each, within 1 % of its objective)."""
    seconds = [e.seconds for e in ends]
    return {
        "count": len(ends),
        "seconds_median": float(np.median(seconds)) if seconds else None,
        "ends": [{k: v for k, v in asdict(e).items() if k != "p"} for e in ends],
        "minima": [
            {
                "objective": b.objective,
                "share": len(b.starts) / len(ends),
                "starts": list(b.starts),
                "p": list(b.p),
            }
            for b in minima
        ],
    }


def starts_notes(report: Mapping[str, Any]) -> tuple[str, ...]:
    """What the many starts say, in a sentence; nothing where there were none."""
    if not report:
        return ()
    minima = report["minima"]
    if not minima:
        return ("None of the starts led to a model that is a structure.",)
    best = minima[0]
    others = f"; the next lowest is {minima[1]['objective']:.5g}" if len(minima) > 1 else ""
    return (
        f"{len(best['starts'])} of {report['count']} starts ended in the lowest minimum found "
        f"(objective {best['objective']:.5g}), of {len(minima)} different ones{others}. A start "
        f"took {report['seconds_median']:.2g} s of processor time (median).",
    )


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
