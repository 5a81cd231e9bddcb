"""Groups by stable subset selection: a few elements that differ from all the others."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.system import Array
from cvxupdate.update.grouping.seen import INVISIBLE, Groups, Seen

TIMES = 40
"""How often the selection is made on recordings with as much noise again."""
STABLE = 0.8
"""Part of those selections that an element must be in (Meinshausen and Bühlmann 2010 take 0.6 to
0.9)."""
DEPENDENT = 1e-8
"""Of a column squared: what others leave of it, below which it is a combination of them."""
AS_GOOD = 1e-6
"""Of the largest gain: the first column that gains as much is taken, or rounding would choose among
elements that no recording tells apart."""


def subset(known: Seen, start: Groups, row: Sequence[int]) -> Groups:
    """Each group of ``start`` that is selected, and one group of all the others of its row
    (``row[column]``).

    A selection takes out what one change of all elements of each row explains (and what any change
    of the columns not in ``start``), and selects by orthogonal least squares, forwards and then
    backwards, as long as χ² falls by more than the extended Bayesian information criterion asks
    (Chen and Chen 2008). What most selections with noise of the rows' own scatter added have in
    common is taken, and what the recordings as they are ask for beside it.

    Rows that trade changes which no recording can see (E h³ and ρh are seen of E, h and ρ) have no
    such common change that could be told: there it is selected like any other column, and where it
    is not, the others of the row keep the value of the file and are in no group.

    Source of the selection: Lallement and Piranda (1990); Friswell, Penny and Garvey (1998).
    """
    of = np.array([row[g[0]] for g in start])
    single = np.stack([known.J[:, list(g)].sum(axis=1) for g in start], axis=1)
    rows = np.unique(of)
    common = np.stack([single[:, of == r].sum(axis=1) for r in rows], axis=1)
    trades = np.array(
        [_trades(known, [c for g in start if row[g[0]] == r for c in g]) for r in rows]
    )
    others = np.setdiff1d(np.arange(known.J.shape[1]), [c for g in start for c in g])
    ways = _ways(single, common, trades, known.J[:, others], known.y)
    price = known.scatter**2 * (np.log(len(known.y)) + 2.0 * np.log(len(start)))
    rng, times = np.random.default_rng(0), np.zeros(len(start) + len(rows))
    for _ in range(TIMES):
        noise = known.scatter * rng.standard_normal(len(known.y))
        times[_selected(ways, noise, price)] += 1
    stable = np.flatnonzero(times >= STABLE * TIMES).tolist()
    chosen = set(_selected(ways, np.zeros(len(known.y)), price, stable))
    whole = [r for k, r in enumerate(rows.tolist()) if len(start) + k in chosen]
    rest = []
    for r, trade in zip(rows.tolist(), trades.tolist(), strict=True):
        members = [c for k, g in enumerate(start) if of[k] == r and k not in chosen for c in g]
        rest += [tuple(sorted(members))] if members and (not trade or r in whole) else []
    return tuple(sorted([*(start[k] for k in chosen if k < len(start)), *rest]))


def _trades(known: Seen, columns: Sequence[int]) -> bool:
    """Whether a change that no recording can see moves these columns."""
    return bool(np.abs(known.silent[list(columns)]).max(initial=0.0) > INVISIBLE)


@dataclass(frozen=True, eq=False)
class _Way:
    """Candidates ``X`` (m, n) and mismatch ``y``, where what ``taken`` columns Q explain is taken
    out of both; a model with ``extra`` parameters beside those selected."""

    X: Array
    y: Array
    Q: Array
    extra: int


def _ways(
    single: Array, common: Array, trades: NDArray[np.bool_], others: Array, y: Array
) -> list[_Way]:
    """With a common change of each row beside what is selected, and without any: which elements
    differ depends on what they differ from."""
    out = []
    for free, extra in (
        (others, 0),
        (np.column_stack([others, common[:, ~trades]]), int(np.sum(~trades))),
    ):
        Q = la.orth(free) if free.shape[1] else np.zeros((len(y), 0))
        offered = common * trades if extra or trades.all() else 0.0 * common
        X = np.column_stack([single, offered])
        out.append(_Way(X - Q @ (Q.T @ X), y - Q @ (Q.T @ y), Q, extra))
    return out


def _selected(
    ways: Sequence[_Way], noise: Array, price: float, kept: Sequence[int] = ()
) -> list[int]:
    """The selection of the way that pays best on the mismatch with ``noise``, which holds those to
    be ``kept``."""
    found = []
    for way in ways:
        y = way.y + noise - way.Q @ (way.Q.T @ noise)
        chosen = _forwards(way, y, price, kept)
        chosen, left = _backwards(way.X, y, price, chosen, set(kept))
        found.append((left + price * (len(chosen) + way.extra), chosen))
    return min(found, key=lambda f: f[0])[1]


def _forwards(way: _Way, y: Array, price: float, kept: Sequence[int]) -> list[int]:
    """Columns by orthogonal least squares, as long as one gains more than the ``price``."""
    m, n = way.X.shape
    size0, free, left = np.sum(way.X**2, axis=0), way.X.copy(), y.copy()
    chosen: list[int] = []

    def take(column: int) -> None:
        nonlocal left
        chosen.append(column)
        q = free[:, column] / np.linalg.norm(free[:, column])
        free[:] -= np.outer(q, q @ free)
        left = left - q * (q @ left)

    for column in kept:
        if np.sum(free[:, column] ** 2) > DEPENDENT * size0[column]:
            take(column)
    while len(chosen) < min(n, m - way.Q.shape[1]) - 1:
        size = np.sum(free**2, axis=0)
        open_ = size > DEPENDENT * size0
        gain = np.where(open_, (left @ free) ** 2 / np.where(open_, size, 1.0), 0.0)
        gain[chosen] = 0.0
        if gain.max() <= price:
            break
        take(int(np.flatnonzero(gain >= (1.0 - AS_GOOD) * gain.max())[0]))
    return chosen


def _backwards(
    X: Array, y: Array, price: float, chosen: list[int], kept: set[int]
) -> tuple[list[int], float]:
    """What stays of the ``chosen`` when those that gain less than the ``price`` are left out, one
    after another, but not the ``kept``; and χ² then."""
    while True:
        inverse = np.linalg.pinv(X[:, chosen])
        best = inverse @ y
        loss = best**2 / np.sum(inverse**2, axis=1)
        loss[[c in kept for c in chosen]] = np.inf
        if loss.min(initial=np.inf) > price:
            return chosen, float(np.sum((y - X[:, chosen] @ best) ** 2))
        chosen = [c for k, c in enumerate(chosen) if k != int(np.argmin(loss))]
