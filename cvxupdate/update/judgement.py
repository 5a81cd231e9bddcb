"""What makes a good fit doubtful beside the fit itself: parameters on their bounds, parameters that
the recordings fix only together, shapes that were given up for frequencies."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.fe.parameters import Parameter
from cvxupdate.update.covariance import Uncertainty
from cvxupdate.update.result import Correlation, Judgement, ModeResult, Updated

TIED = 1.0 - 1e-9
PAIRS = 10  # named at most, strongest first
WHOLE = 200  # parameters up to which the whole matrix is kept
MOST_ON_BOUNDS = 1.0 / 3.0
"""Part of the parameters on bounds from which the bounds are the answer, not the recordings."""
GIVEN_UP = 0.01
"""Fall of a MAC that counts: tests of one structure that are repeated differ by less."""


def correlation_of(known: Uncertainty, parameters: Sequence[Parameter]) -> Correlation | None:
    """Correlations of the parameters that the recordings determine; None of fewer than two."""
    std = np.sqrt(np.maximum(np.diag(known.covariance), 0.0))
    there = np.flatnonzero(np.isfinite(known.std) & (std > 0.0))
    if len(there) < 2:
        return None
    names = tuple(parameters[i].name for i in there.tolist())
    size = std[there]
    r = np.clip(known.covariance[np.ix_(there, there)] / np.outer(size, size), -1.0, 1.0)
    i, j = np.triu_indices(len(names), 1)
    # those that a clause ties are one by request; what the data tie for good is undetermined
    apart = np.where(np.abs(r[i, j]) < TIED, np.abs(r[i, j]), -1.0)
    order = [k for k in np.argsort(-apart, kind="stable")[:PAIRS].tolist() if apart[k] >= 0.0]
    return Correlation(
        names,
        tuple(tuple(row) for row in r.tolist()) if len(names) <= WHOLE else (),
        tuple((names[i[k]], names[j[k]], float(r[i[k], j[k]])) for k in order),
    )


def judgement(updated: Updated) -> Judgement:
    """What to hold against an update that came to an end; nothing of one that is infeasible."""
    if updated.status == "infeasible":
        return Judgement(0, len(updated.parameters), (), ())
    on = sum(q.at_bound for q in updated.parameters)
    lost = tuple(m for m in updated.modes if _given_up(m))
    doubts = []
    if on > 1 and on >= MOST_ON_BOUNDS * len(updated.parameters):
        doubts.append(
            f"{on} of {len(updated.parameters)} parameters ended on a bound, so the bounds decide "
            "the answer as much as the recordings do: the model lacks something that these "
            "parameters cannot be. Ask `diagnose` what."
        )
    if lost:
        doubts.append(_shapes(lost))
    return Judgement(on, len(updated.parameters), tuple(_named(m) for m in lost), tuple(doubts))


def _given_up(m: ModeResult) -> bool:
    if m.mac_before is None or m.mac_after is None:
        return False
    return m.mac_after < m.mac_before - GIVEN_UP


def _named(m: ModeResult) -> dict[str, object]:
    return {
        "measured": m.measured,
        "use": m.use,
        "mac_before": m.mac_before,
        "mac_after": m.mac_after,
        "error_before": m.error_before,
        "error_after": m.error_after,
    }


def _shapes(lost: Sequence[ModeResult]) -> str:
    worst = min(lost, key=lambda m: (m.mac_after or 0.0) - (m.mac_before or 0.0))
    others = f" (and of {len(lost) - 1} more)" if len(lost) > 1 else ""
    text = (
        f"The MAC of the mode at {worst.measured:.5g} Hz{others} fell from "
        f"{worst.mac_before:.3f} to {worst.mac_after:.3f}"
    )
    if worst.error_after < worst.error_before:
        return (
            f"{text} while its frequency came nearer: the frequencies were bought with the shapes, "
            "which a right model does not need. Fit the shapes as well, or free what the model "
            "lacks."
        )
    return f"{text}: the update makes this mode another one. Fit the shapes as well."
