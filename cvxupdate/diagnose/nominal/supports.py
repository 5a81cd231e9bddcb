"""Supports: which DOFs are held, and the model with one of them set free."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from functools import cache

import numpy as np

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import PLAIN, Mesh
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.given import is_given
from cvxupdate.physics.place import Place, at
from cvxupdate.spec import Spec


def held_dofs(spec: Spec, model: Model) -> tuple[tuple[int, str], ...]:
    """(node, kind) of every held DOF of an active kind."""
    out: list[tuple[int, str]] = []
    for support in spec.model.supports:
        nodes: Sequence[int] = support.nodes if support.nodes != "all" else model.node_ids.tolist()
        out += [(int(n), d) for n in nodes for d in support.dofs if d in spec.model.dofs]
    return tuple(out)


def release_from(spec: Spec, mesh: Mesh = PLAIN) -> Callable[[int, str], Model]:
    """Builds the undamped nuisance model without one support DOF, each once: places of effects are
    asked for beside every hypothesis."""

    @cache
    def release(node: int, kind: str) -> Model:
        supports = []
        for s in spec.model.supports:
            nodes = [n.id for n in spec.model.nodes] if s.nodes == "all" else list(s.nodes)
            for n in nodes:
                kept = tuple(k for k in s.dofs if (n, k) != (node, kind))
                if kept:
                    supports.append(s.model_copy(update={"nodes": (n,), "dofs": kept}))
        text = spec.model.model_copy(update={"supports": tuple(supports)})
        freed = build_model(replace(spec, model=text, update=None))
        model, scatter = undamped(mesh.on(freed)), spec.diagnose.scatter
        return with_nuisance(model, scatter=scatter, theory=mesh.theory)

    return release


def regrown(released: Model, grown: Model) -> Model:
    """``grown`` (the nuisance model with effects added) on the DOFs of ``released`` (the nuisance
    model with a support set free)."""
    extra = [i for i, label in enumerate(grown.labels) if label not in released.place]
    labels = (*released.labels, *(grown.labels[i] for i in extra))
    place = {label: i for i, label in enumerate(labels)}
    to = np.array([*(place[label] for label in grown.labels), -1], dtype=np.int64)
    blocks = tuple(
        replace(
            b,
            dofs=np.where(b.dofs >= 0, to[b.dofs], released.blocks[k].dofs)
            if k < len(released.blocks)
            else to[b.dofs],
        )
        for k, b in enumerate(grown.blocks)
    )
    return replace(
        grown,
        labels=labels,
        dof_node=np.append(released.dof_node, grown.dof_node[extra]),
        dof_kind=np.append(released.dof_kind, grown.dof_kind[extra]),
        blocks=blocks,
    )


def on_the_file(
    effects: Sequence[Effect], nominal: Model, file: Model | None = None
) -> list[Effect]:
    """Those that stand on elements of the nominal model: none changes what another effect added.
    ``file``: the model as it came, where the nominal one was brought to a reference state; then
    they stand on its nodes too, ends that were opened under the numbers that they had."""
    known, standing = elements_of(file or nominal), elements_of(nominal)
    mine = [
        e
        for e in effects
        if known.issuperset(e.place.elements)
        and (e.change is None or standing.issuperset(e.change.members))
    ]
    if file is None:
        return mine
    old = _numbers(file, nominal)
    placed = [(e, tuple(old.get(n, -1) for n in e.place.nodes)) for e in mine]
    return [
        e if nodes == e.place.nodes else _renamed(e, replace(e.place, nodes=nodes))
        for e, nodes in placed
        if -1 not in nodes and (nodes == e.place.nodes or e.place.elements)
    ]


def _renamed(effect: Effect, place: Place) -> Effect:
    spot = effect.spot.replace(at(effect.place), at(place))
    return replace(effect, place=place, spot=spot)


def elements_of(model: Model) -> frozenset[int]:
    """The numbers of its elements, those of springs under points of sheets apart."""
    return frozenset(int(i) for b in model.blocks if not is_given(b) for i in b.ids)


def _numbers(file: Model, brought: Model) -> dict[int, int]:
    """The number in the file of each node of a model that was brought to a reference; further
    nodes have that of the node where they are."""

    def placed(model: Model) -> Iterator[tuple[int, tuple[float, ...]]]:
        for n, xyz in zip(model.node_ids.tolist(), model.xyz.tolist(), strict=True):
            yield n, tuple(xyz)

    out = {n: n for n, _ in placed(file)}
    where = {xyz: n for n, xyz in placed(file)}
    for n, xyz in placed(brought):
        if n not in out and xyz in where:
            out[n] = where[xyz]
    return out
