"""How much of a study is asked for."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Wish:
    """``draws`` of noise a level (None: as few as show the figure), the ``levels`` of noise (none:
    the study's own), ``every`` variant instead of the telling ones, or a ``quick`` look at one
    case: each part of the study once, as the tests take it."""

    draws: int | None = None
    levels: tuple[float, ...] = ()
    every: bool = False
    quick: bool = False
