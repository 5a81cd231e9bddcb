"""What the non-linear effects share: elements whose force no matrix says, where they can stand, how
they are planted."""

from __future__ import annotations

from collections.abc import Hashable, Mapping, Sequence
from dataclasses import dataclass, replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements.base import Element, Real
from cvxupdate.fe.elements.bouc_wen import BoucWen
from cvxupdate.fe.elements.clearance import Clearance
from cvxupdate.fe.elements.cubic_spring import CubicSpring
from cvxupdate.fe.elements.friction import Friction
from cvxupdate.fe.elements.jenkins import Jenkins
from cvxupdate.fe.elements.quadratic_damper import QuadraticDamper
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.parameters import Parameter, Target
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import Draft, kind_of
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.facing import facing
from cvxupdate.physics.growth import dof_rows, new_ids
from cvxupdate.physics.place import ROTATIONS, TRANSLATIONS, Place
from cvxupdate.physics.planting import Planted
from cvxupdate.physics.storeys import storeys

SLIDERS = 5  # of an Iwan joint: straight pieces that are within 3 % of the limit of its curve
FEW_ENDS = 12  # DOFs that springs join: up to so many, every pair of them is a place
# Bounds of parameters relative to their first values: of what must stay above zero, and of what may
# change its sign.
ABOVE, EITHER = (-0.999, 1e3), (-20.0, 50.0)


def element_of(law: str, dof: str, nodes: int, sides: str) -> Element:
    """The element type of a law."""
    match law:
        case "cubic":
            return CubicSpring(dof, nodes)
        case "clearance":
            return Clearance(dof, nodes, sides="two" if sides == "two" else "one")
        case "friction":
            return Friction(dof, nodes)
        case "jenkins" | "iwan":
            return Jenkins(dof, nodes)
        case "bouc_wen":
            return BoucWen(dof, nodes)
    return QuadraticDamper(dof, nodes)


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """An internal force as an element of a problem file; sliders side by side as one."""
    kind, number = block.kind, int(block.ids[e])
    ends = block.dofs[e].tolist()
    nodes = [draft.end(model, d) for d in ends]
    if len(block.ids) > 1:
        if e == 0:
            row = {"id": number, "nodes": nodes, "dof": kind_of(model, ends[0])}
            group = draft.fresh_group("iwan", nodes[0])
            draft.put("iwan", {**row, "stiffnesses": [], "forces": [], "group": group})
        (joint,) = draft.model["elements"][-1]["rows"]
        joint["stiffnesses"].append(now["k"])
        joint["forces"].append(now["force"])
        return
    row = {"id": number, "nodes": nodes, "dof": kind_of(model, ends[0])}
    first = kind.properties[0]  # which a row must have
    row |= {k: now[k] for k in kind.properties if k == first or now[k] != 0.0}
    if isinstance(kind, Clearance):
        row["sides"] = kind.sides
    draft.put(kind.name, {**row, "group": draft.fresh_group(kind.name.replace("_", " "), nodes[0])})


@dataclass(frozen=True, eq=False)
class NonlinearForce:
    """A law at DOFs ``rows``, relative to whose first ``values`` its parameters are: empty until
    it is planted. ``positive`` says of which of its ``names`` that they must be above zero;
    ``fixed`` what else the law has, which is no unknown: of Iwan's the exponent of `spread`."""

    law: str
    rows: tuple[int, ...]
    names: tuple[str, ...]
    positive: tuple[bool, ...]
    sides: str = "one"
    side: int = 1
    values: tuple[float, ...] = ()
    fixed: tuple[tuple[str, float], ...] = ()

    @property
    def count(self) -> int:
        """Number of unknowns."""
        return len(self.names)

    @property
    def columns(self) -> int:
        """All are parameters of the model."""
        return len(self.names)

    @property
    def detail(self) -> tuple[Hashable, ...]:
        """Its unknowns, one- or two-sided, which side, and the law's form."""
        return (*self.names, self.sides, self.side, *self.fixed)

    def label(self, place: Place) -> str:
        """Where, for tables."""
        return f"at {place.short}"

    def tenable(self, values: Mapping[str, float], bottom: float, top: float) -> bool:
        """Whatever its size."""
        return True

    def plant(self, effect: Effect, model: Model, guess: Real, delay_unit: float) -> Planted:
        """On any model; its parameters begin at zero, relative to the sizes ``guess`` (SI; one
        unit where nothing says a size)."""
        values = self.values or tuple(float(g) or 1.0 for g in guess)
        return Planted(
            replace(effect, action=replace(self, values=values)),
            grown(model, self, values, effect),
            np.zeros(len(values)),
        )

    def moved(self, effect: Effect, context: SearchContext) -> Effect | None:
        """At the same DOFs of another model."""
        kind = effect.place.dof
        rows = tuple(context.model.place.get(f"n{n}.{kind}", -1) for n in effect.place.nodes)
        return None if min(rows) < 0 else replace(effect, action=replace(self, rows=rows))


def grown(model: Model, action: NonlinearForce, values: Sequence[float], effect: Effect) -> Model:
    """The model with one element more (of Iwan's law its sliders), and a parameter for each figure
    of the law."""
    place = effect.place
    kind = element_of(action.law, str(place.dof), len(action.rows), action.sides)
    shares = spread(action.fixed[0][1]) if action.law == "iwan" else {}
    count = len(next(iter(shares.values()), (1.0,)))
    ids = new_ids(model, count)
    parts = {n: shares.get(n, np.ones(1)) for n in action.names}
    others = {k: v for k, v in action.fixed if k in kind.properties}
    properties = {
        **{k: np.full(count, v) for k, v in COMMON.items()},
        **{k: np.full(count, others.get(k, 0.0)) for k in kind.properties},
        **{n: v * parts[n] for n, v in zip(action.names, values, strict=True)},
    }
    code = KINDS.index(str(place.dof))
    block = Block(
        kind,
        ids,
        ("",),
        np.array([action.rows] * count),
        np.array([[code] * len(action.rows)] * count),
        (),
        np.zeros(count, dtype=np.int64),
        properties,
    )
    number = len(model.blocks)
    wider = replace(model, blocks=(*model.blocks, block))
    units = {q.name: q.unit for q in effect.figures}
    fresh = [
        Parameter(
            f"{effect.physics}@{place.short}.{name}",
            name,
            (Target(number, np.arange(count), (name,), value * parts[name][None]),),
            *effect.limits,
            value,
            value,
            units[name],
            tuple(ids.tolist()),
            None,
        )
        for name, value in zip(action.names, values, strict=True)
    ]
    return wider.with_parameters((*wider.parameters, *fresh))


def spread(chi: float) -> dict[str, Real]:
    """Parts (sliders,) of the whole stiffness and of the whole force that each slider of an Iwan
    joint has: equal stiffnesses, and as many slip distances at x as x to the power ``chi`` says
    (Iwan 1966, chi = 0: a parabola; Segalman 2005, J. Appl. Mech. 72: between −1 and 0)."""
    slips = ((np.arange(SLIDERS) + 0.5) / SLIDERS) ** (1.0 / (1.0 + chi))
    return {"k": np.full(SLIDERS, 1.0 / SLIDERS), "force": slips / slips.sum()}


def places(context: SearchContext) -> list[tuple[tuple[int, ...], Place]]:
    """(DOF rows, place) where a law can act: every free translation against ground, and every
    rotation that springs or dashpots are about; between the ends of springs along or about one
    direction, every pair of them where they are few; between nodes of parts that face each other,
    and across the members of a frame between their corners."""
    model = context.model
    rows = dof_rows(model, TRANSLATIONS)
    out: list[tuple[tuple[int, ...], Place]] = [
        ((row,), Place(nodes=(node,), dof=kind)) for row, node, kind in rows
    ]
    rows_of = {(node, kind): row for row, node, kind in rows}
    corners = storeys(model)
    across = [tuple(int(model.node_ids[n]) for n in pair) for pair in facing(model)]
    for kind in (*TRANSLATIONS, *ROTATIONS):
        ends: set[int] = set()
        joined: set[tuple[int, int]] = set()
        for block in model.blocks:
            if block.kind.name not in ("spring", "dashpot") or KINDS[block.direction[0, 0]] != kind:
                continue
            ends.update(int(d) for d in block.dofs.reshape(-1) if d >= 0)
            if block.dofs.shape[1] == 2:
                joined.update((int(a), int(b)) for a, b in block.dofs if a >= 0 and b >= 0)
        if kind in ROTATIONS:
            turning = {row: node for row, node, _ in dof_rows(model, (kind,))}
            out += [((d,), Place(nodes=(turning[d],), dof=kind)) for d in sorted(ends & {*turning})]
        pairs = set(joined)
        if len(ends) <= FEW_ENDS:
            pairs |= {p for p in combinations(sorted(ends), 2) if p[::-1] not in joined}
        near = [(rows_of.get((a, kind), -1), rows_of.get((b, kind), -1)) for a, b in across]
        for p in (*near, *((a, b) for a, b, way in corners if way == kind)):
            pairs |= set() if min(p) < 0 or p in pairs or p[::-1] in pairs else {p}
        for a, b in sorted(pairs):
            nodes = tuple(int(model.node_ids[model.dof_node[d]]) for d in (a, b))
            if nodes[0] != nodes[1]:
                out.append(((a, b), Place(nodes=nodes, dof=kind)))
    return out


def direction(model: Model, rows: Sequence[int]) -> NDArray[np.float64]:
    """(N,): +1 at the second of two DOFs and −1 at the first, or +1 at the only one."""
    out = np.zeros(model.size)
    for d, sign in zip(rows, (1.0,) if len(rows) == 1 else (-1.0, 1.0), strict=True):
        out[d] += sign
    return out
