"""Groups by stable subset selection: a few elements that differ from all the others."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.system import Array
from cvxupdate.update.grouping.seen import Groups, Seen

TIMES = 40
"""How often the selection is made on recordings with as much noise again."""
STABLE = 0.8
"""Part of those selections that an element must be in (Meinshausen and Bühlmann 2010 take 0.6 to
0.9)."""


def subset(known: Seen, start: Groups, row: Sequence[int]) -> Groups:
    """Each group of ``start`` that is selected in most trials, and one group of all the others of
    its row (``row[column]``).

    A trial adds noise of the rows' own scatter to the mismatch, takes out what one change of all
    elements of each row explains (and what any change of the columns not in ``start``), and
    selects by orthogonal least squares, forwards and then backwards, as long as χ² falls by more
    than the extended Bayesian information criterion asks (Chen and Chen 2008). Source of the
    selection: Lallement and Piranda (1990); Friswell, Penny and Garvey (1998).
    """
    A = np.stack([known.J[:, list(g)].sum(axis=1) for g in start], axis=1)
    of = np.array([row[g[0]] for g in start])
    others = np.setdiff1d(np.arange(known.J.shape[1]), [c for g in start for c in g])
    common = np.stack([A[:, of == r].sum(axis=1) for r in np.unique(of)], axis=1)
    common = np.column_stack([common, known.J[:, others]])
    rng, times = np.random.default_rng(0), np.zeros(len(start))
    for _ in range(TIMES):
        y = known.y + known.scatter * rng.standard_normal(len(known.y))
        times[_selected(A, common, y, known.scatter)] += 1
    chosen = times >= STABLE * TIMES
    rest = []
    for r in np.unique(of):
        members = [c for k, g in enumerate(start) if of[k] == r and not chosen[k] for c in g]
        rest += [tuple(sorted(members))] if members else []
    return tuple(sorted([*(g for k, g in enumerate(start) if chosen[k]), *rest]))


def _selected(A: Array, common: Array, y: Array, scatter: float) -> list[int]:
    """Columns of A (m, n) that the mismatch asks for beside the ``common`` ones."""
    m, n = A.shape
    price = scatter**2 * (np.log(m) + 2.0 * np.log(n))
    chosen: list[int] = []
    while len(chosen) < min(n, m - common.shape[1]) - 1:
        Q, _ = np.linalg.qr(np.column_stack([common, A[:, chosen]]))
        left, free = y - Q @ (Q.T @ y), A - Q @ (Q.T @ A)
        size = np.sum(free**2, axis=0)
        gain = np.where(size > 1e-12 * np.sum(A**2, axis=0), (left @ free) ** 2, 0.0)
        gain = gain / np.where(size > 0.0, size, 1.0)
        gain[chosen] = 0.0
        best = int(np.argmax(gain))
        if gain[best] <= price:
            break
        chosen.append(best)
    while chosen:
        without = [_chi2(A, common, y, [c for c in chosen if c != drop]) for drop in chosen]
        if min(without) - _chi2(A, common, y, chosen) > price:
            break
        chosen.pop(int(np.argmin(without)))
    return chosen


def _chi2(A: Array, common: Array, y: Array, chosen: Sequence[int]) -> float:
    Q, _ = np.linalg.qr(np.column_stack([common, A[:, list(chosen)]]))
    left = y - Q @ (Q.T @ y)
    return float(left @ left)
