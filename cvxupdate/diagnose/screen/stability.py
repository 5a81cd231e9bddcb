"""Which effects and places stay chosen when the recordings are resampled: a group-sparse convex
program, its path, and half-samples of the rows.

Stability selection (Meinshausen and Bühlmann 2010) in complementary pairs (Shah and Samworth 2013)
over the group lasso (Yuan and Lin 2006): all candidates of the first screening beside each other,
nuisance parameters taken out, signs respected, blocks of frequency and sensors drawn at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cvxupdate.convex import Bounds, CompiledStep, GroupL1, SolverChoice, StepProblem
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.screen.projection import Projection
from cvxupdate.diagnose.types import Evidence, Real, Score

# candidates beside each other: the largest explained fractions (sure independence screening; Fan
# and Lv 2008)
MOST = 40
PATH = (0.6, 0.35, 0.2)  # weights, as fractions of the one at which nothing moves
CHOSEN = 6  # candidates at most that a weight may let in: beyond, the path has gone too far
MOVED = 0.02  # of the largest group: that counts as moved


def stability(evidence: Evidence, fit: Fit, scores: Sequence[Score]) -> list[tuple[Score, float]]:
    """The candidates with the largest explained fractions, each with the part of the half-samples
    in which the path chooses it; most stable first. None where the rows are too few to halve."""
    halves = evidence.halves(fit)
    best = sorted((s for s in scores if s.fraction > 0.0), key=lambda s: -s.fraction)[:MOST]
    if not halves or not best:
        return []
    columns = [J for J in evidence.columns(fit, [s.effect for s in best]) if J is not None]
    if len(columns) != len(best):
        return []
    places = np.cumsum([0, *(J.shape[1] for J in columns)])
    names = tuple(f"{k}.{i}" for k, J in enumerate(columns) for i in range(J.shape[1]))
    groups = tuple(tuple(names[a:b]) for a, b in pairwise(places))
    lower = np.full(len(names), -np.inf)
    lower[[int(a) for a, s in zip(places, best, strict=False) if s.effect.sign > 0]] = 0.0
    problem = StepProblem(
        regularisers=(GroupL1(1.0, groups),),
        constraints=(Bounds(lower, np.full(len(names), np.inf)),),
        columns=names,
    )
    step = CompiledStep(problem, len(names), SolverChoice())
    at, J = evidence.linearised(fit), np.hstack(columns)
    counts = np.zeros(len(best))
    for rows in halves:
        counts += _chosen(Projection.of(at, rows), J[rows], step, problem, places)
    order = np.argsort(-counts, kind="stable")
    return [(best[k], float(counts[k] / len(halves))) for k in order]


def _chosen(
    left: Projection,
    J: Real,
    step: CompiledStep,
    problem: StepProblem,
    places: NDArray[np.int64],
) -> Real:
    """1 for each candidate that the path lets in; J (rows, n) are their columns on these rows."""
    freed = left.freed(J)
    norms = np.linalg.norm(freed, axis=0)
    usable = norms > 0.0
    scaled = freed / np.where(usable, norms, 1.0)
    size = float(np.linalg.norm(left.residual))
    if size == 0.0:
        return np.zeros(len(places) - 1)
    R, d, _ = problem.loss.reduce(scaled, left.residual / size)
    _, largest = problem.regularisers[0].weight_range(R, d, problem.columns)
    chosen = np.zeros(len(places) - 1)
    for part in PATH:
        found = step.solve_reduced(R, d, (part * largest,))
        if found.status != "optimal":
            break
        sizes = np.array([np.linalg.norm(found.p[a:b]) for a, b in pairwise(places)])
        moved = sizes > MOVED * sizes.max(initial=0.0)
        if moved.sum() > CHOSEN:
            break
        chosen[moved & (sizes > 0.0)] = 1.0
    return chosen
