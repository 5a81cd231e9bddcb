"""Motion as input: which recordings impose one, and the model with the bases that it moves.

A structure whose feet are moved is the same structure set free along that direction on a base so
heavy that it does not feel the structure: its acceleration a is that of a force m a on it. With
that, a recorded motion is a force like any other for every method of the package. (The large-mass
method: Léger, Idé and Paultre, "Multiple-support seismic analysis of large structures", Computers
& Structures 36 (1990) 1153.)
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

from cvxupdate.spec.grammar import Spec
from cvxupdate.spec.model import Base, Model, Support
from cvxupdate.spec.recordings import FrfRecording, Recording, TimeRecording

MOTION = ("displacement", "velocity", "acceleration")
ALONG = ("x", "y", "z")
Place = tuple[int, str]
"""Node and DOF kind."""


def imposed_at(recording: Recording) -> Iterator[Place]:
    """Where a recording imposes a translation, as it is declared."""
    if isinstance(recording, TimeRecording):
        for row in recording.channels or ():
            if row.imposed and row.node is not None and row.dof in ALONG:
                yield row.node, row.dof
    elif isinstance(recording, FrfRecording):
        for reference in recording.references or ():
            if reference.quantity in MOTION and reference.dof in ALONG:
                yield reference.node, reference.dof


def on_bases(spec: Spec) -> Spec:
    """The problem with a base for every imposed motion and no support along it; ``spec`` itself
    where none is imposed and no base is given."""
    bases = list(spec.model.bases)
    for node, dof in dict.fromkeys(p for r in spec.recordings for p in imposed_at(r)):
        if base_at(bases, node, dof) is None:
            together = _held(spec.model, dof)
            nodes = (node, *(n for n in together if n != node)) if node in together else (node,)
            bases.append(Base(nodes=nodes, dof=dof))  # type: ignore[arg-type]
    if not bases:
        return spec
    now = {"bases": tuple(bases), "supports": tuple(_without(spec.model, bases))}
    return replace(spec, model=spec.model.model_copy(update=now))


def base_at(bases: Sequence[Base], node: int, dof: str) -> Base | None:
    """The base that moves a node along a DOF."""
    return next((b for b in bases if b.dof == dof and node in b.nodes), None)


def _held(model: Model, dof: str) -> tuple[int, ...]:
    """The nodes that supports hold along a DOF."""
    every = [n for s in model.supports if dof in s.dofs for n in _nodes(model, s)]
    return tuple(dict.fromkeys(every))


def _nodes(model: Model, support: Support) -> tuple[int, ...]:
    return tuple(n.id for n in model.nodes) if support.nodes == "all" else support.nodes


def _without(model: Model, bases: Sequence[Base]) -> Iterator[Support]:
    """The supports without what the bases move."""
    moved = {(n, b.dof) for b in bases for n in b.nodes}
    for support in model.supports:
        if not any((n, d) in moved for n in _nodes(model, support) for d in support.dofs):
            yield support
            continue
        for node in _nodes(model, support):
            kept = tuple(d for d in support.dofs if (node, d) not in moved)
            if kept:
                yield Support(nodes=(node,), dofs=kept)
