"""What a diagnosis may take: time, by the clock and of the processor, from its beginning, and
processes.

Of the processor the time of this thread counts, and of children that refit for it: other diagnoses
in one program, and a linear algebra library that waits in threads of its own, take nothing from it.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field
from typing import Any

from cvxupdate.diagnose.settings import BUDGET, CUT_SHORT, MOST_SURE, SHARED, WALL
from cvxupdate.forked import processor_time
from cvxupdate.parallel import processors

AFTERWARDS = 20.0  # s of computing, of what has begun, the judgement and the page


def most_sure(unfinished: bool) -> float:
    """The most confidence that may be stated of a search, or of one that time ended."""
    return CUT_SHORT if unfinished else MOST_SURE


@dataclass
class Budget:
    """``computing`` and ``clock`` in seconds; infinite: nothing is left undone. ``stopped`` says
    whether the search was ended by it, ``undone`` what was left and how much of it (0: all);
    ``jobs`` processes refit at a time."""

    computing: float = field(default_factory=lambda: BUDGET)
    clock: float = field(default_factory=lambda: WALL)
    stopped: bool = False
    undone: dict[str, int] = field(default_factory=dict)
    jobs: int = field(default_factory=processors)
    _processor: float = field(default_factory=processor_time)
    _began: float = field(default_factory=time.perf_counter)

    @staticmethod
    def of(thorough: bool, jobs: int | None = None) -> Budget:
        """The usual one, or none; ``jobs`` None: one process for each processor. Several compute
        more in the time that a diagnosis may take."""
        jobs = processors() if jobs is None else jobs
        usual = BUDGET * SHARED if jobs > 1 else BUDGET, WALL
        return Budget(*((math.inf, math.inf) if thorough else usual), jobs=jobs)

    @contextmanager
    def aside(self) -> Iterator[None]:
        """What is done meanwhile takes nothing from it."""
        used, passed = processor_time(), time.perf_counter()
        try:
            yield
        finally:
            self._processor += processor_time() - used
            self._began += time.perf_counter() - passed

    def part(self, fraction: float) -> Budget:
        """A fraction of it, that begins now."""
        return Budget(fraction * self.computing, fraction * self.clock, jobs=self.jobs)

    def rest(self, fraction: float) -> Budget:
        """The same, but no more than is left of it."""
        part = self.part(fraction)
        part.computing = min(part.computing, self.computing - self._used)
        part.clock = min(part.clock, self.clock - self._passed)
        return part

    @property
    def _used(self) -> float:
        return processor_time() - self._processor

    @property
    def _passed(self) -> float:
        return time.perf_counter() - self._began

    def leave(self, what: str, count: int = 0) -> None:
        """So many of something are left undone; none: all of it."""
        self.undone[what] = self.undone.get(what, 0) + count

    def over(self) -> bool:
        """Whether nothing new may begin; asked where something would."""
        self.stopped |= self._used > self.computing or self._passed > self.clock
        return self.stopped

    @property
    def says(self) -> str:
        """How long it may take."""
        if math.isinf(self.clock):
            return "as long as it needs (--thorough)"
        alone = self.computing / SHARED if self.jobs > 1 else self.computing
        minutes = math.ceil((alone + AFTERWARDS) / 60.0)
        return f"at most about {minutes} minutes on a machine of its own"

    @property
    def lines(self) -> list[str]:
        """What a reader of the diagnosis has to know."""
        if not self.stopped:
            return []
        count = {0: "", 1: "one of the "}
        parts = [f"{count.get(n, f'{n} ')}{what}" for what, n in self.undone.items()]
        left = f" Not tried: {'; '.join(parts)}." if parts else ""
        return [
            f"The time for one diagnosis ({self.computing:.0f} s of computing, {self.clock:.0f} s "
            f"by the clock) ended the search.{left} What was not tried may explain as much, so no "
            f"confidence above {100 * CUT_SHORT:.0f} % is stated. --thorough goes on."
        ]


class Timed:
    """Evidence whose search ends with the time for one diagnosis; by itself no other look at its
    recordings."""

    budget: Budget

    def by_modes(self, fewest: int = 0) -> Any:
        """None."""
        return None

    @property
    def hurried(self) -> bool:
        """Whether the time is over."""
        return self.budget.over()

    @property
    def jobs(self) -> int:
        """Processes."""
        return self.budget.jobs

    @property
    def unfinished(self) -> bool:
        """Whether that ended the search."""
        return self.budget.stopped

    def leave(self, what: str, count: int = 0) -> None:
        """For the reader."""
        self.budget.leave(what, count)
