"""Motions as input: imposed where something can be moved, once for each base."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import ClassVar

from cvxupdate.keys import Loc
from cvxupdate.spec.bases import ALONG, MOTION, base_at, on_bases
from cvxupdate.spec.checks.case import Case
from cvxupdate.spec.prepare import Complaint
from cvxupdate.spec.recordings import FrfRecording, TimeRecording

Found = tuple[Loc, int, str]
"""Where it is declared, and node and DOF kind."""


@dataclass(frozen=True)
class ImposedMotion:
    """What is imposed is a translation of the model's, and a recording says it once for each
    base."""

    needs: ClassVar[tuple[str, ...]] = ("nodes", "supports", "recordings")

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every imposed channel that is no motion, turns, or moves what another one moves."""
        bases = on_bases(case.spec).model.bases
        for i in range(len(case.spec.recordings)):
            seen: dict[int, Found] = {}
            for found in self._declared(case, i):
                if isinstance(found, Complaint):
                    yield found
                    continue
                loc, node, dof = found
                base = base_at(bases, node, dof)
                if base is None:
                    continue
                first = seen.setdefault(bases.index(base), found)
                if first is not found:
                    yield Complaint(
                        loc,
                        f"nodes {first[1]} and {node} stand on one base along {dof}, which has one "
                        "motion.",
                        "Impose one of the two channels, or give each its [[model.bases]].",
                    )

    def _declared(self, case: Case, i: int) -> Iterator[Found | Complaint]:
        recording = case.spec.recordings[i]
        for j, row in enumerate(recording.channels or ()):
            at: Loc = ("recordings", i, "channels", j)
            if not row.imposed:
                continue
            if not isinstance(recording, TimeRecording):
                yield Complaint(
                    (*at, "imposed"),
                    f"is said of a channel of kind {recording.kind}.",
                    "Of FRFs give `references` with the quantity of the motion; remove it here.",
                )
            elif row.quantity not in MOTION:
                yield Complaint(
                    (*at, "imposed"),
                    f"is said of a {row.quantity}.",
                    f"Impose a motion ({', '.join(MOTION)}); a force is an input anyway.",
                )
            elif row.node is not None and row.dof is not None:
                yield self._along((*at, "dof"), row.node, row.dof)
        if isinstance(recording, FrfRecording):
            for j, reference in enumerate(recording.references or ()):
                if reference.quantity in MOTION:
                    loc = ("recordings", i, "references", j, "dof")
                    yield self._along(loc, reference.node, reference.dof)

    def _along(self, loc: Loc, node: int, dof: str) -> Found | Complaint:
        if dof in ALONG:
            return loc, node, dof
        return Complaint(
            loc,
            f"imposes a rotation ({dof}); bases move along x, y or z.",
            "Impose the translations at two nodes instead.",
        )


@dataclass(frozen=True)
class BasePlaces:
    """A base carries nodes that exist, each along a direction once."""

    needs: ClassVar[tuple[str, ...]] = ("nodes",)

    def __call__(self, case: Case) -> Iterator[Complaint]:
        """Every node that does not exist or stands on two bases, every DOF that is not active."""
        model = case.spec.model
        taken: set[tuple[int, str]] = set()
        for i, base in enumerate(model.bases):
            at: Loc = ("model", "bases", i)
            if base.dof not in model.dofs:
                yield Complaint(
                    (*at, "dof"),
                    f"is '{base.dof}', but the active DOFs are {', '.join(model.dofs)}.",
                    f"Add '{base.dof}' to model.dofs, or correct the direction.",
                )
            for node in base.nodes:
                if not case.has_node(node):
                    yield Complaint(
                        (*at, "nodes"),
                        f"node {node} stands on a base, but does not exist.",
                        "Add the node to model.nodes, or correct the number.",
                    )
                elif (node, base.dof) in taken:
                    yield Complaint(
                        (*at, "nodes"),
                        f"node {node} stands on two bases along {base.dof}.",
                        "Name it once.",
                    )
                taken.add((node, base.dof))
