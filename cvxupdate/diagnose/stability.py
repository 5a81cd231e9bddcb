"""Which words and places stay chosen when the recordings are resampled: a group-sparse convex
program, its path, and half-samples of the rows.

Stability selection (Meinshausen and Bühlmann 2010) in complementary pairs (Shah and Samworth 2013)
over the group lasso (Yuan and Lin 2006): all candidates of the first screening beside each other,
ordinary unknowns taken out, signs respected, blocks of frequency and sensors drawn at random.
"""

from __future__ import annotations

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from cvxupdate.convex import Bounds, CompiledStep, GroupL1, SolverChoice, StepProblem
from cvxupdate.diagnose.columns import columns_of
from cvxupdate.diagnose.residual import ResponsePoint
from cvxupdate.diagnose.screen import Score, left_over
from cvxupdate.diagnose.signals import Real

# candidates beside each other: the largest shares (sure independence screening; Fan and Lv 2008)
MOST = 40
PAIRS = 6  # of complementary halves
PATH = (0.6, 0.35, 0.2)  # weights, in shares of the one at which nothing moves
CHOSEN = 6  # candidates at most that a weight may let in: beyond, the path has gone too far
BLOCKS = 8  # of frequency in each recording
MOVED = 0.02  # of the largest group: that counts as moved
SEED = 20100


def stability(point: ResponsePoint, ranked: Sequence[Score]) -> list[tuple[Score, float]]:
    """The candidates with the largest shares, each with the part of the half-samples in which the
    path chooses it; most stable first."""
    best = sorted((s for s in ranked if s.share > 0.0), key=lambda s: -s.share)[:MOST]
    columns = [J for J in columns_of(point, [s.candidate for s in best]) if J is not None]
    if len(columns) != len(best) or not best:
        return []
    places = np.cumsum([0, *(J.shape[1] for J in columns)])
    names = tuple(f"{k}.{i}" for k, J in enumerate(columns) for i in range(J.shape[1]))
    groups = tuple(tuple(names[a:b]) for a, b in pairwise(places))
    lower = np.full(len(names), -np.inf)
    lower[[int(a) for a, s in zip(places, best, strict=False) if s.candidate.sign > 0]] = 0.0
    problem = StepProblem(
        regularisers=(GroupL1(1.0, groups),),
        constraints=(Bounds(lower, np.full(len(names), np.inf)),),
        columns=names,
    )
    step = CompiledStep(problem, len(names), SolverChoice())
    J = np.hstack(columns)
    counts = np.zeros(len(best))
    halves = _halves(point)
    for rows in halves:
        counts += _chosen(point, J, rows, step, problem, places)
    order = np.argsort(-counts, kind="stable")
    return [(best[k], float(counts[k] / len(halves))) for k in order]


def _halves(point: ResponsePoint) -> list[NDArray[np.bool_]]:
    """Random halves of the rows with their complements: blocks of frequency of each sensor and
    recording, real and imaginary parts together."""
    rng = np.random.default_rng(SEED)
    labels: list[NDArray[np.int64]] = []
    count = 0
    for signal in point.setting.signals:
        rows, sensors, cases = signal.Y.shape
        block = np.minimum(np.arange(rows) * BLOCKS // max(rows, 1), BLOCKS - 1)
        label = (
            count
            + (block[:, None, None] * sensors + np.arange(sensors)[None, :, None])
            + np.zeros((1, 1, cases), dtype=np.int64)
        )
        labels += [label.reshape(-1)] * 2
        count += BLOCKS * sensors
    of = np.concatenate(labels)
    out = []
    for _ in range(PAIRS):
        half = rng.permutation(count) < count // 2
        out += [half[of], ~half[of]]
    return out


def _chosen(
    point: ResponsePoint,
    J: Real,
    rows: NDArray[np.bool_],
    step: CompiledStep,
    problem: StepProblem,
    places: NDArray[np.int64],
) -> Real:
    """1 for each candidate that the path lets in on these rows."""
    left = left_over(point, rows)
    freed = left.freed(J[rows])
    norms = np.linalg.norm(freed, axis=0)
    usable = norms > 0.0
    scaled = freed / np.where(usable, norms, 1.0)
    size = float(np.linalg.norm(left.residual))
    if size == 0.0:
        return np.zeros(len(places) - 1)
    R, d, _ = problem.loss.reduce(scaled, left.residual / size)
    _, largest = problem.regularisers[0].weight_range(R, d, problem.columns)
    chosen = np.zeros(len(places) - 1)
    for share in PATH:
        found = step.solve_reduced(R, d, (share * largest,))
        if found.status != "optimal":
            break
        sizes = np.array([np.linalg.norm(found.p[a:b]) for a, b in pairwise(places)])
        moved = sizes > MOVED * sizes.max(initial=0.0)
        if moved.sum() > CHOSEN:
            break
        chosen[moved & (sizes > 0.0)] = 1.0
    return chosen
