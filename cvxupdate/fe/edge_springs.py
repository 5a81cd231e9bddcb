"""Springs that hold the edge of a sheet all along (``edge`` of a spring row), on a finer mesh."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any, Protocol

import numpy as np

from cvxupdate.fe.elements.spring import SpringRow
from cvxupdate.fe.terms import Real


class Made(Protocol):
    """A node that was made between ``weights`` of others, where so many ``sheets`` meet."""

    @property
    def weights(self) -> Mapping[int, float]:
        """By nodes of the file."""

    @property
    def sheets(self) -> int:
        """One on the rim."""


def divided_springs(
    rows: list[SpringRow],
    made: Mapping[int, Made],
    xyz: Mapping[int, Real],
    held: Mapping[int, frozenset[str]],
) -> list[SpringRow]:
    """Rows for the nodes of the file and for those ``made`` between them and supports of their
    kind: each node has the length of edge that is its own, and of what springs give for each metre
    there is between two nodes the mean, of compliance as of what supports give (`analysis.rims`).
    """
    sprung: dict[tuple[int, str], list[SpringRow]] = {}
    for r in rows:
        for own_kind in r.directions:
            sprung.setdefault((r.nodes[0], own_kind), []).append(r)
    edges = _edges(made)
    own = dict.fromkeys(sprung, 0.0)  # metres, each between nodes of the file
    fine = dict.fromkeys(sprung, 0.0)  # likewise between those of the finer mesh
    between = []
    for ends, inner in edges.items():
        length = float(np.linalg.norm(np.subtract(*(xyz[n] for n in ends))))
        for kind in {k for _, k in sprung}:
            here = [n for n in ends if (n, kind) in sprung]
            if not all_along([(n, kind) in sprung for n in ends], [kind in held[n] for n in ends]):
                continue
            for n in here:
                own[n, kind] += length / 2.0
                fine[n, kind] += length / 2.0 / (len(inner) + 1)
            between.append((kind, here, inner, length / (len(inner) + 1)))
    out: list[SpringRow] = []
    for (n, kind), some in sprung.items():
        share = fine[n, kind] / own[n, kind] if own[n, kind] else 1.0
        out += [_row(row, n, kind, share * row.k) for row in some]
    for kind, here, inner, length in between:
        for node, weights in inner:
            soft = sum(weights[n] for n in here)
            at = [(sum(row.k for row in sprung[n, kind]), n) for n in here]
            each = (k / own[n, kind] * weights[n] for k, n in at)
            out.append(_row(sprung[here[0], kind][0], node, kind, length * sum(each) / soft**2))
    return out


def all_along(sprung: Iterable[bool], held: Iterable[bool]) -> bool:
    """Whether springs hold an edge all along, by its ends: both, or one and a support the other."""
    ends = list(zip(sprung, held, strict=True))
    return any(a for a, _ in ends) and all(a or b for a, b in ends)


def _row(row: SpringRow, node: int, kind: str, k: float) -> SpringRow:
    change: dict[str, Any] = {"nodes": (node,), "dof": kind, "dofs": None, "k": k}
    return row.model_copy(update=change)


def _edges(made: Mapping[int, Made]) -> dict[frozenset[int], list[tuple[int, Mapping[int, float]]]]:
    """The nodes made on each edge of the rim."""
    out: dict[frozenset[int], list[tuple[int, Mapping[int, float]]]] = {}
    for node, m in made.items():
        if m.sheets == 1 and len(m.weights) == 2:
            out.setdefault(frozenset(m.weights), []).append((node, m.weights))
    return out
