"""A search seen from outside: its fits, its steps, what was judged of it."""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field
from typing import Any
from unittest import mock

from cvxupdate.diagnose import pipeline
from cvxupdate.diagnose.judge import judge as judging
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.guide import Guide
from cvxupdate.diagnose.search.grown import NOTHING, Seen
from cvxupdate.diagnose.search.search import Found
from cvxupdate.diagnose.types import Evidence, Seed
from cvxupdate.physics.effect import Effect


@dataclass(frozen=True)
class Begun:
    """A fit of the search: of what, where it was in the levels, what it left, when (processor
    s)."""

    effects: tuple[Effect, ...]
    level: int
    effort: str
    misfit: float
    at: float


@dataclass
class Watched:
    """A search with all its fits, and what was made of it."""

    fits: list[Begun] = field(default_factory=list)
    progress: list[tuple[float, str]] = field(default_factory=list)
    evidence: Evidence | None = None
    found: Found = field(default_factory=Found)
    judgement: judging.Judgement | None = None
    began: float = field(default_factory=time.process_time)

    @property
    def now(self) -> float:
        """Processor seconds since it began."""
        return time.process_time() - self.began


@contextmanager
def watched() -> Iterator[list[Watched]]:
    """Searches and their fits, as they are made."""
    out: list[Watched] = []

    def search(evidence: Evidence, progress: Callable[[str], None], seen: Seen = NOTHING) -> Found:
        own = Watched(evidence=evidence)
        out.append(own)

        def heard(text: str) -> None:
            own.progress.append((own.now, text))
            progress(text)

        own.found = real_search(evidence, heard, seen)
        heard("judging")
        return own.found

    def judge(evidence: Evidence, found: Found) -> judging.Judgement:
        out[-1].judgement = real_judge(evidence, found)
        return out[-1].judgement

    def noting(real: Callable[..., Any]) -> Callable[..., Any]:
        def fitted(self: Any, seed: Seed, effort: str) -> Any:
            got = real(self, seed, effort)
            if out:
                misfit = (got[0] if isinstance(got, tuple) else got).misfit
                level = getattr(seed.setting, "level", 0)
                out[-1].fits.append(Begun(seed.effects, level, effort, misfit, out[-1].now))
            return got

        return fitted

    real_search, real_judge = pipeline.search, pipeline.judge
    with ExitStack() as stack:
        stack.enter_context(mock.patch.object(pipeline, "search", search))
        stack.enter_context(mock.patch.object(pipeline, "judge", judge))
        for kind, name in ((ResponseEvidence, "fitted"), (ModesEvidence, "fitted")):
            stack.enter_context(mock.patch.object(kind, name, noting(getattr(kind, name))))
        stack.enter_context(mock.patch.object(Guide, "taken", noting(Guide.taken)))
        yield out
