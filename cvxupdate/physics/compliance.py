"""Springs of a problem file, and what is rigid in the model and gives way: an element given by its
compliance, so that zero means rigid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

from cvxupdate.fe.block import Block
from cvxupdate.fe.elements import Term
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import Model
from cvxupdate.physics.draft import Draft, kind_of, not_negative

SOFTEST = 1e4  # upper bound of a compliance, in units of that of its place
WRITTEN = 0.01  # of its unit: less is none
RIGID = 1e4  # what gives way begins this much stiffer than the structure around it
# Name of a `Compliance` times a matrix: the part of the springs spread along an edge that stands
# for one support there, the support's own DOF first.
EDGE = "edge_compliance"


@dataclass(frozen=True)
class Compliance:
    """A spring given by its compliance: k = 1 / (a₀ + a)."""

    nodes: int
    dof: str
    name: str = "compliance"
    properties: tuple[str, ...] = ("a",)

    @property
    def dofs(self) -> tuple[str, ...]:
        """The DOF kind it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the block is made with its term."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """k in N/m or N·m/rad."""
        return {"k": 1.0 / (properties["a0"] + properties["a"])}


def write_edge(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """As a spring of the edge at the node."""
    k = now["share"] / (now["a0"] + now["a"]) * now["stiffness"]
    own = replace(block, dofs=block.dofs[:, :1])
    put_spring(draft, model, own, e, k, "a", "soft support", edge=True)


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A soft support or an opened joint as a spring, with its share of those that go together."""
    what = "joint" if block.dofs.shape[1] == 2 else "soft support"
    if block.groups[e] and now["a"] < WRITTEN * RIGID * now["a0"]:
        return  # a sheet that gives way where it is held, by as good as nothing
    share = float(block.terms[0].values[block.geometry[e], 0, 0])
    k = share / (now["a0"] + now["a"]) * now["stiffness"]
    put_spring(draft, model, block, e, k, "a", what)


def put_spring(
    draft: Draft,
    model: Model,
    block: Block,
    e: int,
    k: float,
    of: str,
    what: str,
    edge: bool = False,
) -> None:
    """A spring row; ``of`` is the property of the model that its stiffness stands for; ``edge``: it
    holds an edge with others, all along."""
    ends, number = block.dofs[e].tolist(), int(block.ids[e])
    nodes, dof = [draft.end(model, d) for d in ends], kind_of(model, ends[0])
    if draft.held(nodes[0], dof):
        draft.release(nodes[0], dof)
    group = draft.fresh_group(what, nodes[0])
    row = {"id": number, "nodes": nodes, "dof": dof, "k": not_negative(number, "k", k)}
    row |= {"edge": True} if edge else {}
    draft.put("spring", {**row, "group": group})
    draft.known[number, of] = (number, "k")
