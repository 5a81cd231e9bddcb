"""What the constraints and regularisers of a problem file may ask of its model
(`cvxupdate.convex.Context`)."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Any

import numpy as np

from cvxupdate.convex import FamilyBlocks, MassLaw, ModeRows, RigidBody
from cvxupdate.errors import InputError
from cvxupdate.fe.block import Index
from cvxupdate.fe.generic.use import FamilyUse
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES
from cvxupdate.fe.rigid import free_motions, pins
from cvxupdate.fe.whole import NONZERO
from cvxupdate.recordings.types import ModeTable, Recording
from cvxupdate.spec import Spec
from cvxupdate.spec.parameters import groups_of, rows_of
from cvxupdate.system import Array
from cvxupdate.update.matrices import derivative_matrices, rigid_body
from cvxupdate.update.mode_rows import mode_rows

AXES = ("x", "y", "z")
SAME_PLACE = 1e-6  # of the size of the structure: nodes nearer than that are one place


@dataclass(frozen=True, eq=False)
class ModelContext:
    """The answers of a problem file, its model and its recordings; nothing is computed before it is
    asked for."""

    spec: Spec
    model: Model
    recordings: Sequence[Recording]

    @property
    def columns(self) -> tuple[str, ...]:
        """Names of the parameters."""
        return tuple(q.name for q in self.model.parameters)

    @property
    def labels(self) -> tuple[str, ...]:
        """Labels of the free DOFs."""
        return self.model.labels

    @property
    def bounds(self) -> tuple[Array, Array]:
        """Those of the parameters."""
        return (
            np.array([q.lower for q in self.model.parameters]),
            np.array([q.upper for q in self.model.parameters]),
        )

    def changing(self, *of: str) -> tuple[str, ...]:
        """Names of the parameters that change one of these properties."""
        return tuple(q.name for q in self.model.parameters if q.of in of)

    def absent(self) -> tuple[str, ...]:
        """Names of the parameters whose property or entry is 0 in the model."""
        return tuple(
            q.name
            for q in self.model.parameters
            if q.of not in P_VALUES and abs(q.nominal) <= NONZERO * abs(q.unit_size)
        )

    def neighbours(self) -> tuple[tuple[str, str], ...]:
        """By the nodes that the file gives the elements, held ones too."""
        nodes = {row.id: set(row.get("nodes", ())) for _, row in rows_of(self.spec.model)}
        touched = [
            (q, set().union(*(nodes.get(e, set()) for e in q.elements)) if q.elements else set())
            for q in self.model.parameters
        ]
        return tuple(
            (a.name, b.name)
            for (a, at), (b, other) in combinations(touched, 2)
            if a.of == b.of and at & other
        )

    def coupled(self) -> tuple[tuple[str, str], ...]:
        """By the nodes that have a free DOF."""
        model = self.model
        places: dict[str, list[tuple[str, frozenset[int]]]] = {}
        for q in model.parameters:
            dofs = np.concatenate(
                [model.blocks[t.block].dofs[t.rows].reshape(-1) for t in q.targets]
            )
            places.setdefault(q.of, []).append(
                (q.name, frozenset(model.dof_node[dofs[dofs >= 0]].tolist()))
            )
        out = []
        for members in places.values():
            at: dict[int, list[int]] = {}
            for i, (_, nodes) in enumerate(members):
                for node in nodes:
                    at.setdefault(node, []).append(i)
            pairs = {pair for touching in at.values() for pair in combinations(touching, 2)}
            out += [(members[i][0], members[j][0]) for i, j in sorted(pairs)]
        return tuple(out)

    def mirror_images(self, plane: str, at: float) -> tuple[tuple[str, ...], ...]:
        """By the places of their elements' nodes; InputError where no two are mirror images."""
        places = self._places
        known = {_key(q.of, self._grid(_points(places, q.elements))): q.name for q in self._placed}
        axis = AXES.index(plane)
        out = []
        for q in self._placed:
            points = _points(places, q.elements)
            points[:, axis] = 2.0 * at - points[:, axis]
            other = known.get(_key(q.of, self._grid(points)))
            if other is not None and other != q.name:
                out.append((q.name, other))
        if not out:
            raise InputError(
                f"constraints.mirror: no two parameters are mirror images in {plane} = {at:g}. "
                "Correct the plane."
            )
        return tuple(pair for pair in out if pair[0] < pair[1])

    @property
    def _placed(self) -> list[Any]:
        return [q for q in self.model.parameters if q.elements]

    @cached_property
    def _places(self) -> dict[int, Array]:
        """Element number → coordinates of its nodes (k, 3)."""
        place = {n.id: (n.x, n.y, n.z) for n in self.spec.model.nodes}
        return {
            row.id: np.array([place[n] for n in row.get("nodes") if n in place])
            for _, row in rows_of(self.spec.model)
            if row.get("nodes") is not None
        }

    def _grid(self, points: Array) -> Array:
        size = float(np.ptp(self.model.xyz, axis=0).max()) or 1.0
        return np.asarray(np.round(points / (SAME_PLACE * size)).astype(int))

    def inside(self, groups: Sequence[str], of: str) -> tuple[str, ...]:
        """Names of the parameters of one property whose elements lie in these element groups;
        InputError for a group that is not known."""
        known = groups_of(self.spec.model)
        unknown = [g for g in groups if g not in known]
        if unknown:
            raise InputError(
                f"constraints.tied_groups: there is no element group {', '.join(unknown)}; "
                f"the groups are {', '.join(known)}."
            )
        members = {e for g in groups for e in known[g]}
        return tuple(q.name for q in self._placed if q.of == of and set(q.elements) <= members)

    def whole(self) -> tuple[str, ...]:
        """Whole matrices that are parameters, entry by entry."""
        whole = self.spec.update.whole if self.spec.update is not None else None
        return () if whole is None else tuple(dict.fromkeys(whole.matrices))

    def unsymmetric(self) -> tuple[str, ...]:
        """Whole matrices whose entries (i, j) and (j, i) are two parameters."""
        whole = self.spec.update.whole if self.spec.update is not None else None
        return () if whole is None or whole.symmetric else self.whole()

    def mass(self) -> MassLaw:
        """The total mass, in kg."""
        model = self.model
        gradient = model.mass_gradient(model.zero())
        bend = model.mass_gradient(np.full(len(gradient), 0.01)) - gradient
        linear = not np.any(np.abs(bend) > 1e-9 * np.abs(gradient).max(initial=0.0))
        return MassLaw(gradient, model.total_mass(model.zero()), linear)

    @cached_property
    def _matrices(self) -> dict[str, tuple[Any, tuple[Any, ...]]]:
        return {}

    def matrix(self, name: str, asked_by: str) -> tuple[Any, tuple[Any, ...]]:
        """The assembled matrix and its derivatives."""
        if name not in self._matrices:
            self._matrices[name] = derivative_matrices(self.model, name, asked_by)
        return self._matrices[name]

    def free_motions(self) -> Array:
        """Rigid-body motions of the model; none are known for matrices from another program."""
        if any(b.kind.name == "matrix" for b in self.model.blocks):
            return np.zeros((self.model.size, 0))
        return free_motions(self.model, self.model.matrices(self.model.zero()).K)

    def pins(self, motions: Array) -> Index:
        """Rotations are held last."""
        return pins(motions, (self.model.dof_kind >= 3).astype(float))

    def body(self) -> RigidBody:
        """The structure without its supports."""
        return rigid_body(self.spec, self.model)

    def families(self) -> tuple[FamilyBlocks, ...]:
        """Generic elements; elements whose places are not known have no inertia to keep."""
        return tuple(family_blocks(use) for use in self.model.families)

    def mode(self, number: int, exactly: bool) -> ModeRows:
        """A measured mode of the recordings that are fitted."""
        tables = [r for r in self.recordings if isinstance(r, ModeTable) and r.origin.use == "fit"]
        return mode_rows(self.model, tables, number, exactly)


def family_blocks(use: FamilyUse) -> FamilyBlocks:
    """One family for the convex step."""
    family = use.families[0]
    bodies = []
    for own, shape in zip(use.families, use.shapes, strict=True):
        if use.matrix == "M" and shape is not None:
            R = shape.rigid
            today = R.T @ own.member(np.diag(own.values)) @ R
            change = np.array([R.T @ own.unit(i, j) @ R for i, j in own.entries])
            bodies.append((today, change))
    return FamilyBlocks(
        use.name,
        use.columns,
        family.entries,
        family.classes,
        np.diag(family.nominal),
        tuple(bodies),
    )


def _points(places: dict[int, Array], elements: Sequence[int]) -> Array:
    return np.vstack([places[e] for e in elements])


def _key(of: str, grid: Array) -> tuple[object, ...]:
    return (of, tuple(sorted(tuple(p.tolist()) for p in grid)))
