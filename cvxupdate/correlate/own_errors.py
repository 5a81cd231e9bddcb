"""The error of each recording by itself."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from cvxupdate.correlate.response_error import stated_errors
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording


@dataclass(frozen=True)
class OwnError:
    """``recording`` and its ``use``, the ``metric`` of its kind (of a table of modes the mean
    frequency error in per cent), ``before`` and ``after``."""

    recording: str
    use: str
    metric: str
    before: float
    after: float


class ErrorPair(Protocol):
    """A measured mode with its frequency errors in per cent."""

    @property
    def recording(self) -> str:
        """Name of the table."""

    @property
    def use(self) -> str:
        """fit or hold-out."""

    @property
    def error_before(self) -> float:
        """As it came."""

    @property
    def error_after(self) -> float:
        """As updated."""


def own_errors(
    model: Model, recordings: Sequence[Recording], p: Sequence[float], modes: Sequence[ErrorPair]
) -> tuple[OwnError, ...]:
    """Errors of the tables of modes that ``modes`` come from, and of the recordings of responses,
    with the model as it came and at ``p``."""
    errors = [[getattr(m, key) for m in modes] for key in ("error_before", "error_after")]
    before = stated_errors(model, recordings)
    after = stated_errors(model, recordings, np.array(p)) if before else ()
    return (
        *of_modes([(m.recording, m.use) for m in modes], *errors),
        *(
            OwnError(b.recording, b.use, b.metric, b.value, a.value)
            for b, a in zip(before, after, strict=True)
        ),
    )


def of_modes(
    tables: Sequence[tuple[str, str]], before: Sequence[float], after: Sequence[float]
) -> tuple[OwnError, ...]:
    """Mean frequency errors of each table of modes: (table, use) and errors in per cent of every
    mode."""
    out = []
    for name, use in dict.fromkeys(tables):
        mine = [k for k, table in enumerate(tables) if table == (name, use)]
        means = [float(np.mean([abs(e[k]) for k in mine])) for e in (before, after)]
        out.append(OwnError(name, use, "frequency_error_percent_mean", means[0], means[1]))
    return tuple(out)
