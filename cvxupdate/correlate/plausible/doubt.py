"""What is probably a mistake of whoever wrote the problem file."""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Doubt:
    """One sentence on one probable mistake.

    ``check`` names what was looked at, ``recording`` and ``channel`` where it shows ("" where it is
    the model's, or every channel's), ``value`` its size (a factor; NaN where it has none). A
    ``fatal`` one leaves nothing that could be compared or fitted.
    """

    check: str
    says: str
    recording: str = ""
    channel: str = ""
    value: float = float("nan")
    fatal: bool = False
