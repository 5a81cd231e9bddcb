"""What a quality check says."""

from __future__ import annotations

from dataclasses import dataclass

ALPHA = 1e-3
"""False-alarm rate of every check on every channel (or pair of channels) of a clean recording, at
most."""


@dataclass(frozen=True)
class Finding:
    """One finding: which check, which channel(s), a sentence, and the statistic with the threshold
    that it crossed.

    ``value`` is the size of the fault in its own unit (a factor, seconds, a count), NaN where it
    has none.
    """

    check: str
    channel: str
    says: str
    statistic: float
    threshold: float
    value: float = float("nan")
