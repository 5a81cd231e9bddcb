"""What the page draws of tables of modes."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.shown import ModeError, Shown, places
from cvxupdate.physics.effect import Effect
from cvxupdate.residual.modal import ModalPoint


def modes_shown(
    before: ModalPoint, after: ModalPoint, scores: Sequence[tuple[Effect, float]] = ()
) -> Shown:
    """From the comparison with mode tables before and after; both have the same tables."""
    out = []
    for k, table in enumerate(after.residual.tables):
        f, g = (point.frequencies(k) for point in (before, after))
        out += [
            ModeError(float(x), table.origin.use, float(a / x - 1.0), float(b / x - 1.0))
            for x, a, b in zip(table.frequency, f, g, strict=True)
        ]
    return Shown((), (), tuple(out), *places(scores))
