"""Method ``rfm`` from far-off starts: the band grows from its lowest lines upwards.

A model whose resonances lie several of their distances away (a coarse mesh, lumped masses) has
valleys in which one of its modes serves for a neighbour. The lowest modes are still near the
measured ones, and each further pair of lines finds a model that is right below it.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import FrfPoint
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.system import Array
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Iteration, LoopResult, Options

ADDED = 2
"""Lines that each stage adds: of a mode between two of them, one on either side."""
STEPS = 12
"""Iterations of a loop on a part of the band: where it ends is only the next start."""

Progress = Callable[[Iteration], None]


def fit_growing(
    model: Model,
    data: Sequence[FrfData],
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    kind: str = "auto",
    progress: Progress | None = None,
) -> LoopResult[FrfPoint]:
    """`fit_responses` from where force balances on ever more lines have led, all recordings at
    once; its history has their steps too, and its start is that of the model as it came.

    Raises
    ------
    ModelError
        When a line meets a natural frequency of the model as it stands.
    """
    p, history = model.zero(), list[Iteration]()
    order = [np.argsort(d.frequency) for d in data]
    for count in range(ADDED, max(len(d.frequency) for d in data), ADDED):
        part = [d.at(np.sort(o[:count])) for d, o in zip(data, order, strict=True)]
        short = replace(options, max_iterations=min(STEPS, options.max_iterations))
        try:
            loop = fit_responses(model, part, problem, choice, short, "flexibility", p, progress)
        except ModelError:
            break  # a start between is on a line; the whole band goes on from where we are
        if loop.status == "infeasible":
            return loop
        p = loop.point.p
        history += [replace(h, number=len(history) + i + 1) for i, h in enumerate(loop.history)]
    last = fit_responses(model, data, problem, choice, options, kind, p, progress)
    history += [replace(h, number=len(history) + i + 1) for i, h in enumerate(last.history)]
    return replace(last, start=_start(last, model.zero()), history=tuple(history))


def _start(loop: LoopResult[FrfPoint], p: Array) -> FrfPoint:
    """The rows of the loop's end at the model as it came."""
    return loop.point.residual.evaluate(p)
