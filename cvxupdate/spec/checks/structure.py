"""Mechanisms that the text alone shows; those that only the matrices show are found by the FE
layer."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.elements import from_files, text_of
from cvxupdate.spec.model import Tie
from cvxupdate.spec.prepare import Complaint


@dataclass(frozen=True)
class LooseNodes:
    """Every node belongs to an element, or is held in all active DOFs."""

    needs: ClassVar[tuple[str, ...]] = ("nodes", "elements", "supports")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every node without an element."""
        if any(from_files(block.type) for block in case.spec.model.elements):
            return
        used = {node for _, _, row in case.rows() for node in row.get("nodes", ())}
        held = _held(case)
        for i, node in enumerate(case.spec.model.nodes):
            if node.id not in used and node.id not in held:
                yield Complaint(
                    ("model", "nodes", i),
                    f"node {node.id} belongs to no element: the model is a mechanism.",
                    "Join it to the structure, hold all its DOFs, or remove it.",
                )


@dataclass(frozen=True)
class UnheldMasses:
    """A node that carries a lumped mass is joined to something."""

    needs: ClassVar[tuple[str, ...]] = ("elements", "supports")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every lump that only floats."""
        if any(from_files(block.type) for block in case.spec.model.elements):
            return
        joined = {
            node
            for _, block, row in case.rows()
            if text_of(block).joins
            for node in row.get("nodes", ())
        }
        held = _held(case)
        for loc, _, row in case.rows():
            node = row.get("nodes", (None,))[0]
            if row.get("m") is not None and node not in joined and node not in held:
                yield Complaint(
                    (*loc, "nodes"),
                    f"mass {row.id} at node {node} is joined to nothing: the model is a mechanism.",
                    "Join the node by a spring, rod or beam.",
                )


@dataclass(frozen=True)
class Ties:
    """Tied nodes exist, are different, and lie at one point; but a node of springs and lumps alone
    may carry others along translations: a fixture."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every tie that is none."""
        for i, tie in enumerate(case.spec.model.ties):
            at = ("model", "ties", i, "nodes")
            if len(set(tie.nodes)) < len(tie.nodes):
                yield Complaint(
                    at, f"names a node twice: {list(tie.nodes)}.", "Name each node once."
                )
            unknown = [n for n in tie.nodes if n not in case.nodes]
            for node in unknown:
                yield Complaint(
                    at,
                    f"node {node} is tied, but does not exist.",
                    "Add the node to model.nodes, or correct the number.",
                )
            points = {
                (n.x, n.y, n.z) for n in (case.nodes[k] for k in tie.nodes if k in case.nodes)
            }
            if not unknown and len(points) > 1 and not self._carries(case, tie):
                yield Complaint(
                    at,
                    f"nodes {list(tie.nodes)} do not lie at one point.",
                    "Give them the same coordinates, or join them by an element.",
                )

    def _carries(self, case: Case, tie: Tie) -> bool:
        """Whether the first node is that of a fixture."""
        every = [row.get("nodes", ()) for _, _, row in case.rows()]
        mine = [nodes for nodes in every if tie.nodes[0] in nodes]
        alone = bool(mine) and all(len(nodes) == 1 for nodes in mine)
        return alone and not {"rx", "ry", "rz"} & set(tie.dofs)


@dataclass(frozen=True)
class Preloads:
    """An axial preload stands on a beam."""

    needs: ClassVar[tuple[str, ...]] = ()

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every rod with one: it would hang on it like a string, which a rod element does not
        know."""
        for loc, block, row in case.rows():
            if row.get("N", 0.0) != 0.0 and "N" not in text_of(block).changes:
                yield Complaint(
                    (*loc, "N"),
                    f"{block.type} {row.id} has a preload, which only beams can carry.",
                    "Make it a beam2d or beam3d.",
                )


def _held(case: Case) -> set[int]:
    """Nodes of which every active DOF is held."""
    model = case.spec.model
    kinds: dict[int, set[str]] = {}
    for support in model.supports:
        for node in [n.id for n in model.nodes] if support.nodes == "all" else support.nodes:
            kinds.setdefault(node, set()).update(support.dofs)
    return {node for node, dofs in kinds.items() if set(model.dofs) <= dofs}
