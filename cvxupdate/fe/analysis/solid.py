"""What Kirchhoff's theory of plates leaves out of a solid sheet, to first order in its thickness.

Near a free edge the twisting stresses need the width of about a thickness to close, so that a sheet
of width b twists with b − 0.63 h (Saint-Venant's rectangle: Timoshenko and Goodier, art. 109): each
metre of a rim has the negative torsional stiffness 0.105 G h⁴. That holds of twist that varies
slowly along it: waves of less than about three thicknesses it would make unstable, so that it acts
between points of the rim that are far enough apart, and of a rim of shorter elements on the whole
of each. Rotary inertia lowers
frequencies by the square of thickness over wave length. So does deformation in shear, by which a
sheet lags behind its bending, D / κGh ∇²w (Mindlin 1951): of a free motion, where bending balances
inertia, the mass ρh ∫ (w − ½ D / κGh ∇²w)² dA does as much. (Of free plates by a Legendre series of
Mindlin's theory, 16 and 25 thicknesses wide, the first eight frequencies agree within 0.3 and
0.07 %; they are up to 1.6 % lower than with rotary inertia alone.)

A face that is clamped cannot become thinner where the sheet bends, so that within about a
thickness of it the sheet is stiffer, as if the clamp reached in by a part of the thickness; how far
depends on the clamp (a cover plate, a weld) too. Along a clamped edge the curvature across is the
only one; its square there is a term of its own, nothing unless the property ``clamp`` is moved.
"""

from __future__ import annotations

import itertools
from collections.abc import Sequence

import numpy as np

from cvxupdate.fe.analysis.edges import Edge
from cvxupdate.fe.analysis.parts import Fine, summed
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.elements.plate import edge_curvature, lagging

TERMS = (
    ("K", "rim"),
    ("M", "turning"),
    ("K", "clampx"),
    ("K", "clampy"),
    ("M", "lag"),
    ("M", "lagged"),
)
"""Matrix and coefficient of each."""
LAG, TURNING = "lag", "turning"
"""The properties that say how much of shear (and of rims, where it closes), and of rotary inertia,
a sheet has: 1, or nothing, as Kirchhoff's."""
ACROSS = 1e-6  # of an edge: a right angle
# Thicknesses between points of a rim: from 1.4 on no shape of them has a negative stiffness (0.105
# G h⁴ k against D, k = π over their distance); at a corner, and where the structure is thicker than
# its model, it needs some more.
APART = 3.0


def beyond(fine: Fine, block: Block, rows: Index, dofs: Index, edges: Sequence[Edge]) -> list[Real]:
    """The `TERMS` of one element on the ``dofs`` (n,) of its parts, ``rows`` of a block."""
    held = [_held(fine, block, rows, dofs, edges, axis) for axis in (0, 1)]
    thick = float(np.real(block.properties["thickness"][rows[0]]))
    rim = _rim(fine, dofs, edges, thick) + _twist(fine, block, rows, dofs, edges, thick)
    corners = fine.model.xyz[_nodes(block, rows)]
    lag = summed(block, rows, dofs, lagging(corners))
    bent = [t for t in block.terms if t.coefficient in ("Dx", "Dy", "D1")]
    squared = [summed(block, rows, dofs, t.values[block.geometry[rows]]) for t in bent]
    return [rim, _turning(fine, block, rows, dofs), *held, lag, np.sum(squared, axis=0)]


def _held(
    fine: Fine, block: Block, rows: Index, dofs: Index, edges: Sequence[Edge], axis: int
) -> Real:
    """1/m: the squared curvature along the local x (``axis`` 0) or y, along clamped edges across
    it."""
    nodes = _nodes(block, rows)
    xyz = fine.model.xyz[nodes]
    values = np.zeros((len(rows), *block.terms[0].values.shape[1:]))
    for edge in edges:
        along = xyz[:, (1, 3)[axis]] - xyz[:, 0]
        if not edge.clamped or np.any(abs(along @ edge.axes[0]) > ACROSS * edge.axes[3]):
            continue
        for end in (0, 1):
            r = xyz[:, 0] + end * along - edge.start
            off = np.linalg.norm(r - np.outer(r @ edge.axes[0], edge.axes[0]), axis=1)
            on = np.flatnonzero(off < ACROSS * edge.axes[3])
            values[on] += edge_curvature(xyz[on], axis, end)
    return summed(block, rows, dofs, values)


def _rim(fine: Fine, dofs: Index, edges: Sequence[Edge], thick: float) -> Real:
    """1/m: a chain of bars in torsion along each free edge of a sheet so ``thick``."""
    out = np.zeros((len(dofs), len(dofs)))
    place = {
        (int(node), int(kind)): i
        for i, (node, kind) in enumerate(zip(fine.node[dofs], fine.kind[dofs], strict=True))
    }
    for edge in edges:
        e, _, _, length = edge.axes
        if not (edge.rim and edge.turns) or length < APART * thick:
            continue
        ends = {edge.a, edge.b}
        at = {edge.a: 0.0, edge.b: 1.0}
        between = {n for n, _ in place if n in fine.made and set(fine.made[n].weights) == ends}
        at |= {n: fine.made[n].weights[edge.b] for n in between}
        line = _spread(sorted(at, key=lambda n: at[n]), APART * thick / length)
        for one, two in itertools.pairwise(line):
            turn = np.zeros(len(dofs))
            for node, sign in ((one, -1.0), (two, 1.0)):
                for k in range(3):
                    if (node, 3 + k) in place:
                        turn[place[node, 3 + k]] += sign * e[k]
            out -= np.outer(turn, turn) / ((at[two] - at[one]) * length)
    return out


def _twist(
    fine: Fine, block: Block, rows: Index, dofs: Index, edges: Sequence[Edge], thick: float
) -> Real:
    """1/m: the same of free edges too short for that: of each the mean over the element."""
    (term,) = (t for t in block.terms if t.coefficient == "Dxy")
    nodes = _nodes(block, rows)
    area = float(_areas(fine.model.xyz[nodes]).sum())
    short = [e.axes[3] for e in edges if e.rim and e.turns and e.axes[3] < APART * thick]
    whole = summed(block, rows, dofs, term.values[block.geometry[rows]])  # of 4 w_xy²
    return np.asarray(-sum(short) / (4.0 * area) * whole)


def _areas(corners: Real) -> Real:
    """Of parallelograms with corners (parts, 4, 3)."""
    one, other = corners[:, 1] - corners[:, 0], corners[:, 3] - corners[:, 0]
    return np.asarray(np.linalg.norm(np.cross(one, other), axis=1))


def _spread(line: Sequence[int], apart: float) -> Sequence[int]:
    """Evenly chosen points of an evenly divided line, so far apart as a part of it or more; its
    ends at least."""
    parts = len(line) - 1
    step = next((k for k in range(1, parts) if parts % k == 0 and k >= apart * parts), parts)
    return line[::step]


def _turning(fine: Fine, block: Block, rows: Index, dofs: Index) -> Real:
    """m²: the area that turns with each rotation about an axis in the sheet."""
    model, area = fine.model, np.zeros(len(dofs))
    sizes = _areas(model.xyz[_nodes(block, rows)])
    own = block.dofs[rows]
    felt = (own >= 0) & (model.dof_kind[own] >= 3)
    at = np.searchsorted(dofs, own[felt])
    np.add.at(area, at, np.broadcast_to(sizes[:, None] / 4.0, own.shape)[felt])
    return np.diag(area)


def _nodes(block: Block, rows: Index) -> Index:
    """Of the parts of an element, (parts, 4)."""
    return np.zeros((0, 4), dtype=np.int64) if block.nodes is None else block.nodes[rows]
