"""What models to centre lines leave out of a frame: where members meet at an angle they overlap,
and the part of each that lies within the other hardly bends.

The energy of bending within half a depth of a corner counts 1 + p times, d = √(12 I / A), which
is the depth of a rectangle: as if the end were rigid over p of that length, for small p. Tests
compare it with short members that are rigid.
"""

from __future__ import annotations

import itertools
from typing import Any

import numpy as np

from cvxupdate.fe.analysis.parts import summed
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.sections import section_constants

STRAIGHT = 0.98  # cosine of two members above which one goes on as the other: 11 degrees


def corner_nodes(file: Model) -> frozenset[int]:
    """Places among the model's nodes where beams meet at an angle."""
    at: dict[int, list[Real]] = {}
    for block in file.blocks:
        if block.nodes is None or "corner" not in block.kind.properties:
            continue
        for a, b in block.nodes.tolist():
            along = file.xyz[b] - file.xyz[a]
            along = along / np.linalg.norm(along)
            at.setdefault(a, []).append(along)
            at.setdefault(b, []).append(-along)
    return frozenset(
        n for n, ways in at.items() if any(_angle(x, y) for x, y in itertools.combinations(ways, 2))
    )


def _angle(x: Real, y: Real) -> bool:
    """Whether two directions away from a node are no straight line."""
    return bool(abs(float(x @ y)) < STRAIGHT)


def corner_names(block: Block) -> tuple[tuple[str, str], ...]:
    """Matrix and coefficient of each term of `corner_terms`."""
    return tuple(("K", f"corner{axis}") for axis in _axes(block))


def _axes(block: Block) -> list[str]:
    if "corner" not in block.kind.properties:
        return []
    known = {t.coefficient for t in block.terms}
    return [axis for axis in "yz" if f"EI{axis}.0" in known]


def corner_terms(
    block: Block, rows: Index, dofs: Index, ends: tuple[bool, bool], length: float
) -> list[Real]:
    """The stiffness of what lies within half a depth of a corner, (n, n) on the ``dofs`` of the
    parts ``rows`` of one member of a ``length`` (m), for a unit of each coefficient; ``ends``:
    which are at corners."""
    section: Any = getattr(block.kind, "section", None)
    out = []
    for axis in _axes(block):
        term = next(k for k, t in enumerate(block.terms) if t.coefficient == f"EI{axis}.0")
        c = section_constants(section, {k: v[rows[:1]] for k, v in block.properties.items()})
        depth = float(np.sqrt(12.0 * c["I" + axis][0] / c["A"][0]))
        reach = len(rows) * min(0.5, 0.5 * depth / length)  # in parts
        values = block.terms[term].values[block.geometry[rows]]
        bent = np.zeros_like(values)
        for k in range(int(np.ceil(reach))):
            covered = min(1.0, reach - k)
            for part, (low, high), end in (
                (k, (0.0, covered), ends[0]),
                (len(rows) - 1 - k, (1.0 - covered, 1.0), ends[1]),
            ):
                if end:
                    bent[part] += _between(block, values[part], low, high)
        out.append(summed(block, rows, dofs, bent))
    return out


def _between(block: Block, whole: Real, low: float, high: float) -> Real:
    """Of the energy of bending of one part, ``whole`` (d, d), what is between ``low`` and ``high``
    (0 to 1) of its length.

    Its curvature a + b (2ξ − 1) has two vectors, a of equal and opposite rotations of the ends, and
    b with translations; they are orthogonal, and so the eigenvectors of aaᵀ + bbᵀ/3. Where the
    first end alone turns, they have opposite signs.
    """
    values, vectors = np.linalg.eigh(whole)
    pair = vectors[:, -2:] * np.sqrt(values[-2:])
    turns = block.direction[0] >= 3
    bare = np.abs(pair[~turns]).max(axis=0)  # translations: none of a
    a, b = pair[:, int(np.argmin(bare))], np.sqrt(3.0) * pair[:, int(np.argmax(bare))]
    first = turns & (np.arange(len(turns)) < len(turns) // 2)
    b = -b if float(a[first] @ b[first]) > 0.0 else b
    x = np.array([2.0 * low - 1.0, 2.0 * high - 1.0])
    m = [float(np.diff(x ** (k + 1))[0]) / (2.0 * (k + 1)) for k in range(3)]
    both = np.outer(a, b)
    return np.asarray(m[0] * np.outer(a, a) + m[1] * (both + both.T) + m[2] * np.outer(b, b))
