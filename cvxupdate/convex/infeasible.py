"""Whether a subset of clauses cannot hold together, and the multipliers that prove it.

For linear clauses the multipliers y of Farkas' lemma with Σ y = 1 form a polytope each vertex of
which has an irreducible infeasible set of rows as its support (Gleeson & Ryan 1990); the simplex
method returns a vertex. For conic clauses they are those of the elastic program (all clauses
relaxed by t, t least).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np
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


def canonical(clauses: Sequence[Clause], n: int) -> Clauses:
    """The clauses over n parameters, ready for any question about their subsets."""
    conic = {i: conic_block(i, c, n) for i, c in enumerate(clauses) if isinstance(c, ConicClause)}
    return Clauses(tuple(clauses), n, conic)


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
