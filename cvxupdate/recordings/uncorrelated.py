"""Tables of modes for what takes their deviations alone."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

from cvxupdate.recordings.types import ModeTable, Recording

METHODS = ("frequencies", "sensitivity", "minimum-variance")
"""Those that take a table's whole covariance."""
SAYS = (
    f"the correlations in its covariance count in the methods {', '.join(METHODS)}; here its "
    "deviations alone do"
)


def uncorrelated(recordings: Sequence[Recording]) -> tuple[Recording, ...]:
    """The recordings with the deviations of every table's covariance, and a remark that the rest of
    it does not count."""
    return tuple(
        replace(r, covariance=None, origin=replace(r.origin, remarks=(*r.origin.remarks, SAYS)))
        if isinstance(r, ModeTable) and r.covariance is not None
        else r
        for r in recordings
    )
