"""Ways out of a conflict: the least by which clauses must give for all to hold together."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from ..system import Array
from .blocks import assemble
from .constraints.clauses import Clause, ConicClause, LinearClause
from .infeasible import Clauses
from .matrix_form import ConeProgram
from .solvers.clarabel import solve as clarabel
from .solvers.common import SolverChoice

# At most so many clauses of a conflict are tried one by one for a relaxation.
TRIED = 12


@dataclass(frozen=True)
class Relaxation:
    """A way out: by how much ``clause`` would have to give (in its own unit), and the sentence that
    says so.

    ``alone`` is True when this one relaxation makes all clauses hold together, False when the
    listed ones must all be made.
    """

    clause: str
    amount: float
    says: str
    alone: bool = True


def relaxations(question: Clauses, core: tuple[int, ...]) -> tuple[Relaxation, ...]:
    """For each clause of the conflict the least it must give for all to hold, the relatively
    smallest first.

    A conflict of many limits on single parameters also gets the amount by which all of them
    together must give. When no clause can do it alone (there are several conflicts), one least set
    that does it together.
    """
    width = [
        len(c.on) if isinstance(c := question.all[i], LinearClause) else question.n + 1
        for i in core
    ]
    tried = [core[k] for k in sorted(range(len(core)), key=lambda k: -width[k])[:TRIED]]
    found = [
        (item.amount / _size(question.all[i]), item)
        for i in tried
        for item in _relax(question, {i: 0}, alone=True)
    ]
    singles = tuple(i for i, w in zip(core, width, strict=True) if w == 1)
    if len(singles) > 3:
        found += [
            (item.amount / _size(question.all[singles[0]]), item)
            for item in _relax(question, dict.fromkeys(singles, 0), alone=True)
        ]
    if found:
        return tuple(item for _, item in sorted(found, key=lambda pair: pair[0]))
    return tuple(_relax(question, {i: i for i in range(len(question.all))}, alone=False))


def _size(clause: Clause) -> float:
    """The size of a clause's limits, 1 where they are 0."""
    limits = (
        [0.0]
        if isinstance(clause, ConicClause)
        else np.abs(np.concatenate([clause.lower, clause.upper]))
    )
    return float(np.max(limits, where=np.isfinite(limits), initial=0.0)) or 1.0


def _relax(question: Clauses, slacks: dict[int, int], alone: bool) -> list[Relaxation]:
    """Least total slack that makes all clauses hold, clause i giving by slack number slacks[i];
    empty when none does."""
    k = max(slacks.values()) + 1
    cost = (
        np.array([1 / _size(question.all[i]) for i in sorted(slacks)[:k]]) if k > 1 else np.ones(1)
    )
    elastic = assemble(question.blocks(range(len(question.all))), question.n, slacks, cost)
    x = _minimum(elastic.program)
    if x is None:
        return []
    p, amounts = x[: question.n], x[x.size - k :]
    if len(slacks) > 1 and k == 1:
        name = f"{len(slacks)} limits on single parameters"
        says = f"all clauses can hold if each of the {name} named gives way by {amounts[0]:.4g}"
        return [Relaxation(name, float(amounts[0]), says)]
    least = 1e-6 * float(np.max(amounts))
    return [
        Relaxation(
            question.all[i].name,
            float(amounts[s]),
            _words(question.all[i], float(amounts[s]), p, alone),
            alone,
        )
        for i, s in slacks.items()
        if amounts[s] > least
    ]


def _minimum(program: ConeProgram) -> Array | None:
    """A minimiser of a linear cone program; a vertex when there are linear rows only."""
    from scipy.optimize import linprog

    if program.cones.beyond_qp:
        raw = clarabel(program, SolverChoice(tolerance=1e-10))
        return raw.x if raw.status == "optimal" else None
    zero = program.cones.zero
    answer = linprog(
        program.q,
        A_ub=program.A[zero:],
        b_ub=program.b[zero:],
        A_eq=program.A[:zero] if zero else None,
        b_eq=program.b[:zero] if zero else None,
        bounds=(None, None),
        method="highs-ds",
    )
    return np.asarray(answer.x) if answer.status == 0 else None


def _words(clause: Clause, amount: float, p: Array, alone: bool) -> str:
    start = (
        "all clauses can hold if"
        if alone
        else "all clauses can hold if, with every other one named here,"
    )
    unit = f" {clause.unit}" if clause.unit else ""
    how = f"gives way by {amount:.4g}{unit}"
    if isinstance(clause, LinearClause) and clause.lower.size == 1:
        low, high = float(clause.lower[0]), float(clause.upper[0])
        value = float((clause.C @ p[list(clause.on)])[0])
        side, sign, limit = ("upper", 1, high) if value > high else ("lower", -1, low)
        moved = limit + sign * amount
        new = 0.0 if abs(moved) < 1e-9 * max(amount, abs(limit)) else moved
        if low != high:
            how = f"has its {side} limit at {new:.4g}{unit} instead of {limit:.4g}{unit}"
        else:
            how = f"is let go by {sign * amount:+.4g}{unit}"
    return f'{start} "{clause.name}" {how}'
