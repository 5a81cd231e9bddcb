"""Clauses as blocks of cone rows, so that any subset of them becomes a cone program without
compiling again.

A block holds A p + aux a + slack t + s = b with s in its cones; ``slack`` is how a common
relaxation t enters.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array
from .constraints.clauses import ConicClause, LinearClause, stack
from .matrix_form import ConeProgram, Cones, cone_program


@dataclass(frozen=True, eq=False)
class Block:
    """Cone rows: ``A`` (m, n), ``aux`` (m, a), ``slack`` (m,), ``b`` (m,), ``owner`` (m,) the
    clause number of each row."""

    A: Any
    aux: Any
    slack: Array
    b: Array
    cones: Cones
    owner: Any

    def segments(self) -> list[Any]:
        """The row numbers of zero, nonneg, soc, psd and exp rows."""
        c = self.cones
        sizes = [c.zero, c.nonneg, sum(c.soc), sum(k * (k + 1) // 2 for k in c.psd), 3 * c.exp]
        edges = np.concatenate([[0], np.cumsum(sizes)])
        return [np.arange(a, b) for a, b in pairwise(edges)]


def linear_block(numbers: Sequence[int], clauses: Sequence[LinearClause], n: int) -> Block:
    """Linear clauses as rows of the nonnegative cone, an equality as two, each row scaled to a
    largest coefficient of 1.

    The slack enters in the clause's own unit.
    """
    rows = stack(clauses, n)
    size = (
        np.ones(rows.upper.size)
        if rows.C.nnz == 0
        else np.asarray(abs(rows.C).max(axis=1).todense()).ravel()
    )
    scale = 1 / np.where(size > 0, size, 1.0)
    C = sp.csr_array(sp.diags_array(scale) @ rows.C)
    below, above = np.isfinite(rows.upper), np.isfinite(rows.lower)
    A = sp.csr_array(sp.vstack([C[below], -C[above]]))
    b = np.concatenate([(scale * rows.upper)[below], -(scale * rows.lower)[above]])
    owner = np.asarray(numbers, dtype=int)[np.concatenate([rows.owner[below], rows.owner[above]])]
    slack = -np.concatenate([scale[below], scale[above]])
    return Block(A, sp.csr_array((b.size, 0)), slack, b, Cones(nonneg=b.size), owner)


def conic_block(number: int, clause: ConicClause, n: int) -> Block:
    """One conic clause in canonical form."""
    import cvxpy as cp

    p, slack = cp.Variable(n), cp.Variable()
    problem = cp.Problem(cp.Minimize(slack), [*clause.constraints(p, slack)])
    program, (at, t) = cone_program(problem, p, slack)
    inside = np.arange(at, at + n)
    others = np.setdiff1d(np.arange(program.q.size), np.append(inside, t))
    A = sp.csr_array(program.A)
    return Block(
        A[:, inside],
        A[:, others],
        A[:, [t]].toarray().ravel(),
        program.b,
        program.cones,
        np.full(program.b.size, number),
    )


@dataclass(frozen=True, eq=False)
class Assembled:
    """A cone program over [p, auxiliaries, slacks]; ``owner`` (rows,) clause numbers, −1 for the
    rows t ≥ 0."""

    program: ConeProgram
    owner: Any
    slacks: int

    def multipliers(self, z: Array) -> dict[int, float]:
        """The largest multiplier of each clause."""
        found: dict[int, float] = {}
        for number, value in zip(self.owner, np.abs(z), strict=True):
            if number >= 0:
                found[int(number)] = max(found.get(int(number), 0.0), float(value))
        return found


def assemble(blocks: Sequence[Block], n: int, relaxed: Mapping[int, int], cost: Array) -> Assembled:
    """Put blocks together: minimise cost · t, the clause ``number`` relaxed by t[relaxed[number]],
    t ≥ 0."""
    k = cost.size
    own = Block(
        sp.csr_array((k, n)),
        sp.csr_array((k, 0)),
        np.zeros(k),
        np.zeros(k),
        Cones(nonneg=k),
        np.full(k, -1),
    )
    everything = [*blocks, own]
    widths = [block.aux.shape[1] for block in everything]
    starts = np.concatenate([[n], n + np.cumsum(widths)])
    parts: list[Any] = []
    for block, start in zip(everything, starts, strict=False):
        column = np.array([relaxed.get(int(i), -1) for i in block.owner], dtype=int)
        has = column >= 0
        slack = sp.csr_array(
            (block.slack[has], (np.flatnonzero(has), column[has])), shape=(block.b.size, k)
        )
        if block is own:
            slack = -sp.eye_array(k, format="csr")
        left, right = int(start) - n, int(starts[-1]) - int(start) - block.aux.shape[1]
        gap = [sp.csr_array((block.b.size, left)), block.aux, sp.csr_array((block.b.size, right))]
        parts.append(sp.csr_array(sp.hstack([block.A, *gap, slack])))
    rows, b, owner = [], [], []
    for kind in range(5):
        for block, part in zip(everything, parts, strict=True):
            chosen = block.segments()[kind]
            rows.append(part[chosen])
            b.append(block.b[chosen])
            owner.append(block.owner[chosen])
    cones = Cones(
        sum(x.cones.zero for x in everything),
        sum(x.cones.nonneg for x in everything),
        tuple(i for x in everything for i in x.cones.soc),
        tuple(i for x in everything for i in x.cones.psd),
        sum(x.cones.exp for x in everything),
    )
    size = int(starts[-1]) + k
    q = np.concatenate([np.zeros(int(starts[-1])), cost])
    program = ConeProgram(
        sp.csc_array((size, size)), q, sp.csc_array(sp.vstack(rows)), np.concatenate(b), cones
    )
    return Assembled(program, np.concatenate(owner), k)
