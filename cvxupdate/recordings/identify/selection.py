"""Automatic choice of poles from a stabilisation diagram: clusters that never hold two poles of one
order.

Orders are visited from the highest down. Every pole joins the nearest cluster that meets the
`Criteria`, each cluster taking at most one pole of an order, so two close modes cannot merge; a
pole that fits none opens a cluster. A cluster is a mode when it holds poles of at least
``fraction`` of the orders (and ``least`` of them). Its pole is the component-wise median.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.recordings.identify.model import Roots
from cvxupdate.recordings.identify.stabilisation import Criteria, Stabilisation, same
from cvxupdate.recordings.types import Complex

HIGHEST = 5  # orders of a cluster that say where it is


def _centre(members: list[int], pole: Complex) -> complex:
    p = pole[members]
    return complex(np.median(p.real) + 1j * np.median(p.imag))


def clusters(diagram: Stabilisation, c: Criteria) -> list[list[int]]:
    """Indices into the diagram of the poles of each cluster, whatever its size."""
    groups: list[list[int]] = []
    centres: list[complex] = []
    for order in np.unique(diagram.order)[::-1]:
        here = np.flatnonzero(diagram.order == order)
        if groups:
            # a cluster's place is that of its five highest orders, so that late, coarse poles do
            # not drag it; its participation is that of its last pole: of two modes at nearly one
            # frequency any mixture will do, and it turns from order to order
            centre = np.array(centres)
            shape = diagram.participation[[g[-1] for g in groups]]
            fits = same(diagram.pole[here], diagram.participation[here], centre, shape, c)
            distance = np.where(fits, np.abs(diagram.pole[here][:, None] - centre), np.inf)
        else:
            distance = np.full((here.size, 0), np.inf)
        taken: set[int] = set()
        joined: set[int] = set()
        for flat in np.argsort(distance, axis=None):
            i, g = divmod(int(flat), max(distance.shape[1], 1))
            if not np.isfinite(distance[i, g]):
                break
            if i not in joined and g not in taken:
                groups[g].append(int(here[i]))
                if len(groups[g]) <= HIGHEST:
                    centres[g] = _centre(groups[g], diagram.pole)
                taken.add(g)
                joined.add(i)
        alone = [int(k) for i, k in enumerate(here) if i not in joined]
        groups.extend([k] for k in alone)
        centres.extend(_centre([k], diagram.pole) for k in alone)
    return groups


def select(diagram: Stabilisation, c: Criteria) -> Roots:
    """One pole and participation for every cluster that is large enough, by increasing
    frequency."""
    needed = max(c.least, int(np.ceil(c.fraction * np.unique(diagram.order).size)))
    poles: list[complex] = []
    participation: list[Complex] = []
    for group in clusters(diagram, c):
        if len(group) < needed:
            continue
        centre = _centre(group, diagram.pole)
        nearest = group[int(np.argmin(np.abs(diagram.pole[group] - centre)))]
        poles.append(centre)
        participation.append(diagram.participation[nearest])
    references = diagram.participation.shape[1]
    rank = np.argsort(np.abs(np.array(poles, dtype=np.complex128)))
    values = np.array(poles, dtype=np.complex128)[rank]
    return Roots(values, np.array(participation, dtype=np.complex128).reshape(-1, references)[rank])
