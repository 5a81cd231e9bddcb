"""The loops of the modal methods: shapes first where that is asked for, then all rows, and again
where another pairing fits better."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.convex import SolverChoice, StepProblem, WeightChoice
from cvxupdate.errors import ModelError
from cvxupdate.residual.another_pairing import another_pairing
from cvxupdate.residual.modal import ModalPoint, ModalResidual
from cvxupdate.residual.shape_rows import Index
from cvxupdate.system import Array
from cvxupdate.update.trust_region import Iteration, LoopResult, Options, iterate, objective_at

REPAIRINGS = 5  # how often the loop may go on with another pairing
# The shapes alone are fitted only to find the way: that far (decrease of the objective; fraction of
# the deviations), and for so many iterations, each of which may be several of `update.ahead`.
ROUGHLY, FIRST = 1e-2, 5
# Rows are known that well, as fractions of deviations of a percent or so (`fe.continued.EXACT`).
MET = 1e-5
PATIENCE = 15  # iterations; from random starts most fits take so many in all
RELEASES = 2  # how often parameters on their bounds are released
LOWER = 1e-4  # relative decrease of the objective by which another minimum is one
ON_BOUND = 1e-4  # of the distance between the bounds


def shapes_first(
    residual: ModalResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
    """`with_pairing` from where the shapes alone lead: (one loop with the whole history, notes).

    Frequencies that are far off pull a model into whatever valley mends them soonest; shapes do not
    see a common factor of the stiffnesses, so they settle the ratios first and leave the factor to
    the frequencies (a continuation in the weight of the eigenvalues).
    """
    rough = replace(
        options,
        tolerance=max(ROUGHLY, options.tolerance),
        met=ROUGHLY,
        max_iterations=min(FIRST, options.max_iterations),
    )
    first = iterate(residual.changed(only_shapes=True), problem, choice, rough, p0, progress)
    if first.status == "infeasible":
        return first, ()
    there = residual.changed(
        start=replace(residual.start, modes=first.point.modes, places=first.point.places),
    )
    begin = replace(first.point, residual=there)
    loop, notes = with_pairing(there, first.problem, choice, options, begin.p, progress, begin)
    done = len(first.history)
    said = (
        f"Iterations 1 to {done} fitted the shapes alone, so their objectives do not compare with "
        "those after them.",
    )
    begun = replace(first, start=replace(first.start, residual=residual))
    return _joined(begun, loop, first.weight or loop.weight), (*(said if done else ()), *notes)


def _joined(
    before: LoopResult[ModalPoint], after: LoopResult[ModalPoint], weight: WeightChoice | None
) -> LoopResult[ModalPoint]:
    """``after`` with the start and the history of what came ``before`` it."""
    done = len(before.history)
    later = (replace(h, number=done + h.number) for h in after.history)
    return replace(after, start=before.start, history=(*before.history, *later), weight=weight)


def begun_again(
    run: Callable[[Array], tuple[LoopResult[ModalPoint], tuple[str, ...]]],
    loop: LoopResult[ModalPoint],
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]] | None:
    """What ``run`` reaches from halfway between the end of a ``loop`` that came to none and the
    initial model, (loop with the whole history, notes); None where that is no lower.

    Where modes change places, shapes turn so fast that no step goes far, and a valley may lead
    along there for ever.
    """
    try:
        again, notes = run(0.5 * loop.point.p)
    except ModelError:
        return None
    before, after = (objective_at(l.problem, l.point) for l in (loop, again))
    if after >= before * (1.0 - LOWER):
        return None
    said = (
        f"After {len(loop.history)} iterations the objective hardly fell ({before:.4g}), so the "
        f"loop began again halfway to the initial model ({after:.4g}).",
    )
    return _joined(loop, again, loop.weight), (*said, *notes)


def released(
    run: Callable[[Array, LoopResult[ModalPoint]], tuple[LoopResult[ModalPoint], tuple[str, ...]]],
    loop: LoopResult[ModalPoint],
    lower: Array,
    upper: Array,
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
    """``loop``, or the lower one that ``run`` reaches from its end with the parameters on their
    bounds moved amid these (halfway to the initial model where a side is open): (loop with the
    whole history, notes).

    A corner of the bounds can be a minimum only because some parameters cannot go on, and which of
    them are there is an accident of the way. Once more as long as it pays, `RELEASES` times at
    most. Bounds (n,), infinite where there are none.
    """
    notes: tuple[str, ...] = ()
    for _ in range(RELEASES):
        p = loop.point.p
        width = np.where(np.isfinite(upper - lower), upper - lower, 1.0)
        held = (p <= lower + ON_BOUND * width) | (p >= upper - ON_BOUND * width)
        if loop.status != "converged" or not np.any(held):
            break
        before = objective_at(loop.problem, loop.point)
        amid = np.where(np.isfinite(upper - lower), (lower + upper) / 2.0, 0.5 * p)
        try:
            again, more = run(np.where(held, amid, p), loop)
        except ModelError:
            break
        after = objective_at(loop.problem, again.point)
        if after >= before * (1.0 - LOWER):
            break
        loop = _joined(loop, again, loop.weight)
        notes = (
            f"The end had {int(np.sum(held))} parameters on their bounds; taken off them they "
            f"led to a lower minimum (objective {before:.4g} → {after:.4g}).",
            *more,
        )
    return loop, notes


def with_pairing(
    residual: ModalResidual,
    problem: StepProblem,
    choice: SolverChoice,
    options: Options,
    p0: Array,
    progress: Callable[[Iteration], None] | None = None,
    begin: ModalPoint | None = None,
) -> tuple[LoopResult[ModalPoint], tuple[str, ...]]:
    """`iterate`, and again from its end where another pairing by frequency fits the updated model
    better: (one loop with the whole history, notes).

    At most `REPAIRINGS` times, within the iterations that are left. The start is the initial model
    in the final pairing.
    """
    loop = iterate(residual, problem, choice, options, p0, progress, begin=begin)
    notes: list[str] = []
    while (
        loop.status == "converged"
        and len(notes) < REPAIRINGS
        and len(loop.history) < options.max_iterations
    ):
        other = another_pairing(loop.point)
        if other is None:
            break
        before, after = (
            objective_at(loop.problem, q)
            for q in (loop.point, replace(loop.point, places=other.places))
        )
        if after >= before * (1.0 - 1e-3):
            break
        chain = loop.history
        again = iterate(
            residual.changed(start=other),
            loop.problem,
            choice,
            replace(options, max_iterations=options.max_iterations - len(chain)),
            loop.point.p,
            progress,
        )
        back = again.start
        for p in [*(h.p for h in reversed(chain) if h.accepted), loop.start.p]:
            back = back.residual.evaluate(np.array(p), back)
        notes.append(_repaired(loop.point, other.places, before, after))
        loop = replace(_joined(loop, again, loop.weight), start=back)
    return loop, tuple(notes)


def _repaired(point: ModalPoint, places: Sequence[Index], before: float, after: float) -> str:
    changed = [
        f"{table.frequency[i]:.5g} Hz"
        for table, old, new in zip(point.residual.fit, point.places, places, strict=False)
        for i in np.flatnonzero(old != new)
    ]
    return (
        f"After convergence another pairing of {', '.join(changed)} fitted the updated model "
        f"better (objective {before:.4g} → {after:.4g}), so the loop went on with it."
    )
