"""Large semidefinite clauses by their sparsity: S ⪰ 0 with a chordal pattern is a sum of small
semidefinite blocks (Agler et al. 1988).

The pattern is filled by eliminating DOFs of least degree first; the maximal cliques of the filled
graph are the blocks, merged where that saves work (Vandenberghe and Andersen 2015, chs. 4, 9 and
14).
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

Index = NDArray[np.int64]


def cliques(pattern: Any, merge: int = 12) -> tuple[Index, ...]:
    """The maximal cliques (sorted DOF numbers) of a chordal extension of a symmetric sparse pattern
    (N, N).

    ``merge``: a clique is joined to its parent in the clique tree while that adds at most so many
    rows to either.
    """
    A = sp.csr_array(pattern)
    neighbours = [
        set(A.indices[A.indptr[i] : A.indptr[i + 1]].tolist()) - {i} for i in range(A.shape[0])
    ]
    for i, mine in enumerate(neighbours):
        for j in mine:
            neighbours[j].add(i)
    found, left, gone = [], set(range(len(neighbours))), set()
    buckets: dict[int, set[int]] = {}
    for i in left:
        buckets.setdefault(len(neighbours[i]), set()).add(i)
    while left:
        degree = min(d for d, b in buckets.items() if b)
        v = min(buckets[degree])
        around = neighbours[v]
        found.append(frozenset(around | {v}))
        buckets[degree].discard(v)
        for u in around:
            buckets[len(neighbours[u])].discard(u)
            neighbours[u] = (neighbours[u] | around) - {u, v}
            buckets.setdefault(len(neighbours[u]), set()).add(u)
        left.discard(v)
        gone.add(v)
    return tuple(np.array(sorted(c), dtype=np.int64) for c in _merged(_maximal(found), merge))


def _maximal(found: Sequence[frozenset[int]]) -> list[set[int]]:
    """Cliques that no other one holds; in elimination order a clique can only lie in an earlier
    one."""
    kept: list[set[int]] = []
    holding: dict[int, list[int]] = {}
    for clique in found:
        first = min(clique, key=lambda i: len(holding.get(i, ())))
        if not any(clique <= kept[k] for k in holding.get(first, ())):
            for i in clique:
                holding.setdefault(i, []).append(len(kept))
            kept.append(set(clique))
    return kept


def _merged(kept: list[set[int]], merge: int) -> list[set[int]]:
    """Join cliques along the clique tree (largest overlaps first) while the union stays small."""
    while True:
        where: dict[int, list[int]] = {}
        for k, clique in enumerate(kept):
            for i in clique:
                where.setdefault(i, []).append(k)
        used: set[int] = set()
        joined: list[set[int]] = []
        for k, clique in sorted(enumerate(kept), key=lambda pair: len(pair[1])):
            if k in used:
                continue
            best, most = -1, -1
            for j in {j for i in clique for j in where[i]} - used - {k}:
                common = len(clique & kept[j])
                if (
                    len(clique) - common <= merge
                    and len(kept[j]) - common <= merge
                    and common > most
                ):
                    best, most = j, common
            used.add(k)
            if best >= 0:
                used.add(best)
                joined.append(clique | kept[best])
            else:
                joined.append(clique)
        if len(joined) == len(kept):
            return joined
        kept = joined
