"""Which clauses cannot hold together, the proof of it, and what the least relaxation would be.

For linear clauses the multipliers y of Farkas' lemma with Σ y = 1 form a polytope each vertex of
which has an irreducible infeasible set of rows as its support (Gleeson & Ryan 1990); the simplex
method returns a vertex. A deletion filter over the clauses (Chinneck & Dravnieks 1991) then makes
the set of clauses irreducible: without any one of them the rest can hold. For conic clauses the
multipliers of the elastic program (all clauses relaxed by t, t least) serve as the first filter.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg
import scipy.sparse as sp

from ..system import Array
from .blocks import Block, assemble, conic_block, linear_block
from .certificate import Farkas, farkas
from .constraints.clauses import Clause, ConicClause, LinearClause
from .matrix_form import ConeProgram
from .solvers.clarabel import solve as clarabel
from .solvers.common import SolverChoice

# Clauses that miss one another by less than this (relative to their limits) are not called a
# conflict.
TOLERANCE = 1e-8
CONIC_TOLERANCE = 1e-7
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


@dataclass(frozen=True)
class Conflict:
    """Clauses that cannot hold together, irreducible; the numerical proof; ways out."""

    clauses: tuple[str, ...]
    proof: Farkas
    relaxation: tuple[Relaxation, ...]


@dataclass(frozen=True, eq=False)
class Infeasible:
    """A subset found infeasible: the clauses that carry multipliers, and the proof."""

    support: tuple[int, ...]
    proof: Farkas
    rows: Block | None = None
    y: Array = field(default_factory=lambda: np.zeros(0))


@dataclass(frozen=True, eq=False)
class Clauses:
    """All clauses of a question, the conic ones canonicalised once."""

    all: tuple[Clause, ...]
    n: int
    conic: dict[int, Block]

    def blocks(self, numbers: Sequence[int]) -> list[Block]:
        """The blocks of a subset."""
        linear = [(i, c) for i in numbers if isinstance(c := self.all[i], LinearClause)]
        first = (
            [linear_block([i for i, _ in linear], [c for _, c in linear], self.n)] if linear else []
        )
        return first + [self.conic[i] for i in numbers if i in self.conic]

    def infeasible(self, numbers: Sequence[int]) -> Infeasible | None:
        """Whether the subset cannot hold together; None when it can."""
        if any(i in self.conic for i in numbers):
            return _conic_infeasible(self.blocks(numbers), self.n)
        blocks = self.blocks(numbers)
        return _linear_infeasible(blocks[0]) if blocks else None


def find_conflict(clauses: Sequence[Clause], n: int) -> Conflict | None:
    """The conflict among clauses over n parameters, or None when they can hold together (within
    1e-8, conic 1e-7)."""
    question = Clauses(
        tuple(clauses),
        n,
        {i: conic_block(i, c, n) for i, c in enumerate(clauses) if isinstance(c, ConicClause)},
    )
    everything = tuple(range(len(clauses)))
    linear = tuple(i for i in everything if i not in question.conic)
    found, core = question.infeasible(linear), linear
    if found is None and question.conic:
        found, core = question.infeasible(everything), everything
    if found is None:
        return None
    core, found = _irreducible(question, core, found)
    return Conflict(tuple(clauses[i].name for i in core), found.proof, _relaxations(question, core))


def _linear_infeasible(block: Block) -> Infeasible | None:
    """A vertex of the Farkas multipliers: least bᵀy over Aᵀy = 0, Σ y = 1, y ≥ 0."""
    from scipy.optimize import linprog

    m = block.b.size
    if m == 0:
        return None
    equalities = sp.vstack([block.A.T, sp.csr_array(np.ones((1, m)))]).tocsr()
    right = np.zeros(equalities.shape[0])
    right[-1] = 1.0
    answer = linprog(
        block.b,
        A_eq=equalities,
        b_eq=right,
        method="highs-ds",
        options={"primal_feasibility_tolerance": 1e-10, "dual_feasibility_tolerance": 1e-10},
    )
    if answer.x is None:
        return None
    y = np.maximum(answer.x, 0.0)
    carried = y > 1e-9 * y.max()
    size = max(1.0, float(np.max(np.abs(block.b[carried]))))
    if not float(block.b @ y) < -TOLERANCE * size:
        return None
    nothing = np.zeros(block.A.shape[1])
    program = ConeProgram(
        sp.csc_array((nothing.size, nothing.size)),
        nothing,
        sp.csc_array(block.A),
        block.b,
        block.cones,
    )
    return Infeasible(
        tuple(sorted(set(map(int, block.owner[carried])))), farkas(program, y), block, y
    )


def _conic_infeasible(blocks: Sequence[Block], n: int) -> Infeasible | None:
    """The elastic program: all clauses relaxed by one t, t least; infeasible when t stays above
    0."""
    owners = {int(i): 0 for block in blocks for i in block.owner}
    elastic = assemble(blocks, n, owners, np.ones(1))
    raw = clarabel(elastic.program, SolverChoice(tolerance=1e-10))
    if not np.all(np.isfinite(raw.x)):
        return None
    sizes = elastic.multipliers(raw.z)
    largest = max(sizes.values())
    carried = np.abs(raw.z) > 1e-6 * largest
    if raw.x[-1] <= CONIC_TOLERANCE * max(
        1.0, float(np.max(np.abs(elastic.program.b[carried]), initial=0.0))
    ):
        return None
    hard = assemble(blocks, n, {}, np.zeros(0))
    proof = farkas(hard.program, raw.z[elastic.owner >= 0])
    return Infeasible(tuple(sorted(i for i, size in sizes.items() if size > 1e-6 * largest)), proof)


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


def _relaxations(question: Clauses, core: tuple[int, ...]) -> tuple[Relaxation, ...]:
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
