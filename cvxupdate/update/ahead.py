"""Steps that a small model takes ahead of the large one: many for one of its own, where modes and
derivatives of shapes cost far more than anything else."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from cvxupdate.convex import CompiledStep
from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Real
from cvxupdate.residual.modal_point import ModalPoint
from cvxupdate.residual.modal_reduced import ReducedModal, reduced_modal
from cvxupdate.system import Array
from cvxupdate.update.trial import GOOD, POOR, Residual, Trial, objective_at, tried
from cvxupdate.update.trust_region import Options, iterate

WIDE = 64  # columns of the basis at most beside those of the latest point: its own modes cost, too
FARTHEST = 1.0  # reach at most, in units of the trust region: the whole range of a parameter
NEAREST = 1e-3  # reach below which no step is worth going ahead
# Decrease of the objective that a step must promise, and steps, after which the small model has led
# enough: the large one has its own steps for the rest.
ROUGHLY, MOST = 0.1, 8


@dataclass
class Ahead:
    """What one way through the parameters has learnt, and how far (``reach``) a small model made of
    it is trusted; ``blocks`` are vectors (N, k), those of the latest point first."""

    reach: float
    blocks: list[list[Real]] = field(default_factory=list)
    latest: ModalPoint | None = None

    def lead(
        self,
        residual: Residual[ModalPoint],
        compiled: CompiledStep,
        here: ModalPoint,
        value: float,
        radius: Array,
        options: Options,
    ) -> Trial[ModalPoint]:
        """Where the small model about ``here``, with the objective ``value``, comes to an end,
        tried by the large one; nothing (inf) where there is none."""
        nothing: Trial[ModalPoint] = Trial(None, np.inf)
        unit = options.unit(here.p)
        small = self._small(here, unit)
        if small is None:
            return nothing
        own = replace(
            options,
            tolerance=max(ROUGHLY, options.tolerance),
            max_iterations=MOST,
            radius=self.reach,
            ahead=None,
            known=(),
        )
        try:
            loop = iterate(small, compiled.problem, compiled.solver, own, here.p)
        except ModelError:
            return nothing
        distance = float(np.max(np.abs(loop.point.p - here.p) / unit))
        promised = value - objective_at(compiled.problem, loop.point, here.p)
        if promised <= 0.0 or distance == 0.0:
            return nothing
        trial = tried(residual, compiled.problem, loop.point.point, loop.point.p, here.p)
        self._judge(distance, promised, value - trial.objective)
        if trial.point is not None:
            self.blocks.insert(0, [trial.point.modes.shapes])
        return trial

    def _small(self, here: ModalPoint, unit: Array) -> ReducedModal | None:
        """The small model about ``here``, whose own vectors are learnt first."""
        if self.reach < NEAREST or not here.residual.reducible:
            return None
        if self.latest is not here:
            own = [here.modes.shapes, *here.solutions]
            same = self.blocks and self.blocks[0][0] is here.modes.shapes
            self.blocks[: 1 if same else 0] = [own]
            self.latest = here
        wide, vectors = 0, []
        for k, block in enumerate(self.blocks):
            wide += sum(x.shape[1] for x in block)
            if k and wide > WIDE:
                del self.blocks[k:]
                break
            vectors += block
        return reduced_modal(here, vectors, self.reach, unit)

    def _judge(self, distance: float, promised: float, kept: float) -> None:
        """Trust the small model less far where it ``kept`` little of what it ``promised``."""
        if kept < POOR * promised:
            self.reach = 0.25 * distance
        elif kept > GOOD * promised:
            self.reach = min(max(self.reach, 2.0 * distance), FARTHEST)
