"""Groups by clusters of sensitivities: what the recordings do not tell apart is joined."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np

from cvxupdate.update.grouping.seen import Groups, Seen

AT_ONCE = 0.02
"""Of the groups: how many are joined before the deviations are taken anew."""


def clusters(
    known: Seen,
    start: Groups,
    row: Sequence[int],
    resolution: Sequence[float],
    may_join: Callable[[tuple[int, ...], tuple[int, ...]], bool] = lambda one, other: True,
) -> Groups:
    """The groups ``start``, joined until the p of each is known to ``resolution[column]``.

    The group that is known least joins the one whose sensitivity makes the smallest angle with its
    own, of the same row (``row[column]``) and where they ``may_join``; one that may join none stays
    as it is. Source: Shahverdi, Mares, Wang and Mottershead, *Clustering of parameter
    sensitivities* (2009), who cut the tree of cosine distances by eye; here the recordings' own
    deviations cut it.
    """
    groups, stuck = list(start), set[tuple[int, ...]]()
    while True:
        std = known.deviations(tuple(groups))
        worst = [groups[k] for k in np.argsort(-std) if std[k] > resolution[groups[k][0]]]
        worst = [g for g in worst if g not in stuck]
        if not worst:
            return tuple(sorted(groups))
        for group in worst[: max(1, int(AT_ONCE * len(groups)))]:
            if group not in groups:  # joined by another meanwhile
                continue
            others = [
                g
                for g in groups
                if g != group and row[g[0]] == row[group[0]] and may_join(g, group)
            ]
            if not others:
                stuck.add(group)
                continue
            nearest = max(others, key=lambda g: known.alike(g, group))
            groups = [g for g in groups if g not in (group, nearest)]
            groups.append(tuple(sorted((*group, *nearest))))
