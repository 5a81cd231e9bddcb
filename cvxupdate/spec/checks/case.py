"""What every check looks at: the parsed file and its look-up tables, built once."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property

from cvxupdate.keys import Loc
from cvxupdate.spec.elements import Block, Row
from cvxupdate.spec.grammar import Spec
from cvxupdate.spec.model import Node
from cvxupdate.spec.parameters import Target, expand_parameters, groups_of

ROWS: Loc = ("model", "elements")


@dataclass(frozen=True)
class Case:
    """A parsed problem file. ``damaged`` names the sections of which a part was left out because it
    has faults."""

    spec: Spec
    damaged: frozenset[str] = frozenset()

    @cached_property
    def nodes(self) -> dict[int, Node]:
        """Node number → node (the first of that number)."""
        return {node.id: node for node in reversed(self.spec.model.nodes)}

    @cached_property
    def labels(self) -> frozenset[str]:
        """DOF labels that matrix blocks list themselves."""
        return frozenset(
            label
            for _, _, row in self.rows()
            if isinstance(row.get("labels"), tuple)
            for label in row.get("labels")
        )

    @cached_property
    def open_nodes(self) -> bool:
        """Whether a matrix block brings nodes that only its file knows."""
        return any(isinstance(row.get("labels"), str) for _, _, row in self.rows())

    def has_node(self, number: int) -> bool:
        """Whether the node exists, as far as the text can tell."""
        return self.open_nodes or number in self.nodes or number in self.label_nodes

    @cached_property
    def label_nodes(self) -> frozenset[int]:
        """Nodes of the listed labels."""
        stems = (label.partition(".")[0][1:] for label in self.labels)
        return frozenset(int(s) for s in stems if s.isascii() and s.isdigit())

    @cached_property
    def groups(self) -> dict[str, list[int]]:
        """Group name → element numbers."""
        return groups_of(self.spec.model)

    @cached_property
    def elements(self) -> dict[int, tuple[Block, Row]]:
        """Element number → block and row."""
        return {row.id: (block, row) for _, block, row in self.rows()}

    @cached_property
    def targets(self) -> tuple[Target, ...]:
        """The parameters of [update], written out."""
        update = self.spec.update
        return expand_parameters(self.spec.model, update.parameters) if update is not None else ()

    @cached_property
    def names(self) -> tuple[str, ...] | None:
        """Names of the parameters; None when a row finds no element, which is a fault of its own,
        or where the matrices have names of their own."""
        update = self.spec.update
        complete = update is None or (
            len(self.targets_by_row) == len(update.parameters) and update.whole is None
        )
        return tuple(t.name for t in self.targets) if complete else None

    @cached_property
    def targets_by_row(self) -> dict[int, list[Target]]:
        """Row of ``parameters`` → the parameters it gives."""
        out: dict[int, list[Target]] = {}
        for target in self.targets:
            out.setdefault(target.row, []).append(target)
        return out

    def rows(self) -> Iterator[tuple[Loc, Block, Row]]:
        """Every element: its place, block and row."""
        for i, block in enumerate(self.spec.model.elements):
            rows: tuple[Row, ...] = block.rows
            for j, row in enumerate(rows):
                yield (*ROWS, i, "rows", j), block, row
