"""Which clauses cannot hold together, the proof of it, and what the least relaxation would be.

The multipliers that prove a set of clauses infeasible (`infeasible`) are the first filter. A
deletion filter over the clauses (Chinneck & Dravnieks 1991) then makes the set irreducible: without
any one of them the rest can hold.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg

from .certificate import Farkas
from .constraints.clauses import Clause
from .infeasible import Clauses, Infeasible, canonical
from .relaxation import Relaxation, relaxations


@dataclass(frozen=True)
class Conflict:
    """Clauses that cannot hold together, irreducible; the numerical proof; ways out."""

    clauses: tuple[str, ...]
    proof: Farkas
    relaxation: tuple[Relaxation, ...]


def find_conflict(clauses: Sequence[Clause], n: int) -> Conflict | None:
    """The conflict among clauses over n parameters, or None when they can hold together (within
    1e-8, conic 1e-7)."""
    question = canonical(clauses, n)
    everything = tuple(range(len(clauses)))
    linear = tuple(i for i in everything if i not in question.conic)
    found, core = question.infeasible(linear), linear
    if found is None and question.conic:
        found, core = question.infeasible(everything), everything
    if found is None:
        return None
    core, found = _irreducible(question, core, found)
    return Conflict(tuple(clauses[i].name for i in core), found.proof, relaxations(question, core))


def _irreducible(
    question: Clauses, core: tuple[int, ...], found: Infeasible
) -> tuple[tuple[int, ...], Infeasible]:
    """Shrink an infeasible set of clauses until each one is needed."""
    if len(found.support) < len(core):
        again = question.infeasible(found.support)
        if again is not None:
            core, found = found.support, again
    needed = _needed_by_witness(question, core, found)
    while len(needed) < len(core):
        trial = next(i for i in core if i not in needed)
        rest = tuple(i for i in core if i != trial)
        smaller = question.infeasible(rest)
        if smaller is None:
            needed = needed | {trial}
        else:
            # A multiplier that carries only part of the rest drops several clauses at once.
            direct = tuple(i for i in rest if i in set(smaller.support) | needed)
            check = smaller if direct == rest else question.infeasible(direct)
            core, found = (direct, check) if check is not None else (rest, smaller)
    return core, found


def _needed_by_witness(
    question: Clauses, core: tuple[int, ...], found: Infeasible
) -> frozenset[int]:
    """Clauses of a large linear conflict proven needed by a point at which all the others hold.

    With y a vertex multiplier over rows A p ≤ b, the point with A p = b − δ e_r on the carried rows
    (δ = bᵀy / y_r < 0) breaks only row r of them; if it also keeps the clauses' other rows, r's
    clause is needed. One factorisation serves all.
    """
    if len(core) <= 20 or found.rows is None:
        return frozenset()
    rows, y = found.rows, found.y
    carried = np.flatnonzero(y > 1e-9 * y.max())
    if len(set(rows.owner[carried].tolist())) != carried.size:
        return frozenset()
    A, b = rows.A[carried].toarray(), rows.b[carried]
    targets = b[:, None] - np.diag(float(b @ y[carried]) / y[carried])
    points = scipy.linalg.lstsq(A, targets, lapack_driver="gelsy")[0]
    excess = np.asarray(rows.A @ points) - rows.b[:, None]
    excess[rows.owner[:, None] == rows.owner[carried][None, :]] = 0.0
    good = np.max(excess, axis=0) <= 1e-9 * max(1.0, float(np.max(np.abs(b))))
    return frozenset(int(i) for i in rows.owner[carried][good])
