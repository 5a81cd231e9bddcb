"""A body between two nodes, which single words say in two: a heavier element, and something taken
off or put on at one of its ends. Together they have its mass and its middle."""

from __future__ import annotations

from collections.abc import Sequence
from itertools import product

import numpy as np

from cvxupdate.diagnose.judge.alternatives import nodes_of
from cvxupdate.diagnose.results import Finding
from cvxupdate.fe.model import Model
from cvxupdate.physics.added_mass import AddedMass
from cvxupdate.physics.joint_flexibility import is_beam
from cvxupdate.physics.mass_change import MassChange
from cvxupdate.physics.units import quantity


def one_body_lines(findings: Sequence[Finding], model: Model) -> list[str]:
    """A sentence for each such pair of findings whose middle lies on the element."""
    heavier, lumps = (
        [f for f in findings if f.physics == kind.name] for kind in (MassChange, AddedMass)
    )
    lines = (_line(one, other, model) for one, other in product(heavier, lumps))
    return [line for line in lines if line]


def _line(heavier: Finding, lump: Finding, model: Model) -> str:
    """Of one pair; empty where it is no such body."""
    elements, nodes = heavier.place.elements, lump.place.nodes
    length = _length(model, elements[0]) if len(elements) == len(nodes) == 1 else 0.0
    if not length or nodes[0] not in nodes_of(model, elements):
        return ""
    more = (heavier.parameters["factor"] - 1.0) * model.mass_of(elements[0])
    whole = more + lump.parameters["m"]
    if not 0.0 <= more * 0.5 / (whole or np.nan) <= 1.0:
        return ""
    return (
        f"The change of mass in element {elements[0]} and the mass at node {nodes[0]} are together "
        f"those of one body of {quantity(whole, 'kg')} on that element, "
        f"{quantity(0.5 * length * more / whole, 'm')} from node {nodes[0]} "
        f"({quantity(length, 'm')} long): it may well be one, for it need not hang at a node."
    )


def _length(model: Model, element: int) -> float:
    """Of a beam, m; 0 of other elements."""
    beams = (b for b in model.blocks if is_beam(b) and element in b.ids)
    return next((float(b.properties["length"][b.ids == element][0]) for b in beams), 0.0)
