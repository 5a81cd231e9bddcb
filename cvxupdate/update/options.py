"""How a loop of convex steps goes, and where it ends."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np

from cvxupdate.convex import CompiledStep
from cvxupdate.system import Array
from cvxupdate.update.trial import Trial

EXACT = 1e-10  # of the stated deviations: a residual below is rounding


class Leader(Protocol):
    """What goes ahead of the model that is updated (`cvxupdate.update.ahead`)."""

    def lead(
        self,
        residual: Any,
        compiled: CompiledStep,
        here: Any,
        value: float,
        radius: Array,
        options: Options,
    ) -> Trial[Any]:
        """A point that is better than ``here``, with the objective ``value``, if all goes well."""


@dataclass(frozen=True)
class Options:
    """``tolerance``: relative decrease of the objective below which the loop ends; ``radius``:
    first trust region, in units of p.

    ``relative`` (one for each parameter, empty: none): those whose trust region is in fractions of
    their present factor 1 + p, the multiplicative form of (3.50). ``line_search`` along each step
    (3.52); ``second_order`` terms along it. ``widths`` (one for each parameter, empty: 1) are units
    of the trust region for parameters of unlike ranges. ``growing`` (one for each parameter,
    empty: none): those whose trust region grows with them, for they may be far from 0.
    ``shortest``: of steps that fit equally well the shortest (2.101). ``met``: the fraction of
    their deviations to which the rows are known, ``still`` a step (of the trust region's unit) that
    is rounding. ``ahead`` may go on where a step leads. ``known`` (n,) is a minimum found before:
    where a step leads back to it, no objective below ``below``, the loop ends. ``patience``: of so
    many iterations that together lower the objective by less than a tenth the last is the last.
    """

    tolerance: float = 1e-6
    max_iterations: int = 30
    radius: float = 0.3
    relative: tuple[bool, ...] = ()
    line_search: bool = False
    second_order: bool = False
    widths: tuple[float, ...] = ()
    growing: tuple[bool, ...] = ()
    shortest: bool = False
    met: float = EXACT
    still: float = 0.0
    ahead: Leader | None = None
    known: tuple[float, ...] = ()
    below: float = 0.0
    patience: int | None = None

    def unit(self, p: Array) -> Array:
        """What one unit of the trust region is at ``p`` (n,)."""
        if self.widths:
            return np.array(self.widths)
        if self.growing:
            return np.where(self.growing, 1.0 + np.abs(p), 1.0)
        return np.where(self.relative, np.abs(1.0 + p), 1.0) if self.relative else np.ones(len(p))
