"""A body between two nodes, which single words say in two: a heavier element, and something taken
off or put on at one of its ends. Together they have its mass and its middle."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.results import Finding
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.added_mass import AddedMass
from cvxupdate.physics.draft import node_of
from cvxupdate.physics.joint_flexibility import is_beam
from cvxupdate.physics.mass_change import MassChange
from cvxupdate.physics.place import TRANSLATIONS
from cvxupdate.physics.units import quantity


def one_body_lines(findings: Sequence[Finding], model: Model) -> list[str]:
    """A sentence for each such pair of findings whose middle lies on the element."""
    out = []
    for heavier in findings:
        if heavier.physics != MassChange.name or len(heavier.place.elements) != 1:
            continue
        (element,) = heavier.place.elements
        known = _beam(model, element)
        for lump in findings:
            if known is None or lump.physics != AddedMass.name or len(lump.place.nodes) != 1:
                continue
            own, length, ends = known
            (node,), m = lump.place.nodes, lump.parameters["m"]
            more = (heavier.parameters["factor"] - 1.0) * own
            whole = more + m
            if node not in ends or not 0.0 <= more * 0.5 / (whole or np.nan) <= 1.0:
                continue
            out.append(
                f"The change of mass in element {element} and the mass at node {node} are together "
                f"those of one body of {quantity(whole, 'kg')} on that element, "
                f"{quantity(0.5 * length * more / whole, 'm')} from node {node} "
                f"({quantity(length, 'm')} long): it may well be one, for it need not hang at a "
                "node."
            )
    return out


def _beam(model: Model, element: int) -> tuple[float, float, tuple[int, ...]] | None:
    """Mass (kg), length (m) and free end nodes of a beam; None of other elements."""
    for block in model.blocks:
        if not is_beam(block) or element not in block.ids:
            continue
        e = int(np.flatnonzero(block.ids == element)[0])
        M = np.asarray(block.combine(block.scalars(block.properties))["M"][e])
        codes = np.broadcast_to(block.direction, block.dofs.shape)[e]
        along = codes == min(c for c in codes if KINDS[c] in TRANSLATIONS)
        free = block.nodal[e][block.nodal[e] >= 0]
        ends = tuple(dict.fromkeys(node_of(model, int(d)) for d in free))
        return float(along @ M @ along), float(block.properties["length"][e]), ends
    return None
