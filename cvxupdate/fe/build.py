"""Spec → Model: the text of a problem file becomes blocks, DOFs and parameters."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.fe.bases import base_blocks, moving
from cvxupdate.fe.batches import GivenMatrix, block_of, gather, given_blocks
from cvxupdate.fe.elements.base import Surroundings
from cvxupdate.fe.generic.change import with_families
from cvxupdate.fe.generic.members import with_members
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model
from cvxupdate.fe.numbering import first_of_ties, number_dofs
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import select_parameters
from cvxupdate.fe.whole import with_entries
from cvxupdate.spec import Spec, Target, expand_parameters, members_of
from cvxupdate.spec import model as sm


def build_model(spec: Spec) -> Model:
    """The model of a problem file, with its parameters (none where there is no [update] table).

    Raises
    ------
    ModelError
        For anything that only geometry or matrices show: zero length, a plate that is no rectangle,
        an unreadable matrix.
    """
    spec = on_its_bases(spec)
    text = spec.model
    position = {n.id: i for i, n in enumerate(text.nodes)}
    xyz = np.array([[n.x, n.y, n.z] for n in text.nodes], dtype=float).reshape(-1, 3)
    active = tuple(k for k in KINDS if k in text.dofs)
    batches, given = gather(Surroundings(text, spec.path.parent))
    place, node_ids, xyz, labels = number_dofs(text, position, xyz, active, batches, given)
    blocks = [block_of(b, position, xyz, active, place) for b in batches]
    blocks += given_blocks(given, position, place) + base_blocks(text, position, place)
    dof_node = np.array([node for node, _ in labels], dtype=np.int64)
    dof_kind = np.array([kind for _, kind in labels], dtype=np.int64)
    names = tuple(f"n{node_ids[n]}.{KINDS[k]}" for n, k in labels)
    damping = text.damping
    zeta: tuple[float, ...] = ()
    share = 0.0
    if isinstance(damping, sm.ModalDamping):
        share = damping.hysteretic
        zeta = damping.zeta if isinstance(damping.zeta, tuple) else (damping.zeta,)
    free = {label: name for label, name in zip(labels, names, strict=True)}
    ties = tuple(
        (f"n{node_ids[n]}.{KINDS[k]}", free[to])
        for (n, k), to in first_of_ties(text, position).items()
        if to in free
    )
    model = Model(
        names, node_ids, xyz, dof_node, dof_kind, tuple(blocks), (), zeta, ties, hysteretic=share
    )
    members = [(row, members_of(text, row)) for row in text.families]
    model = with_members(model, members, given) if members else model
    model = model.with_parameters(parameters_of(spec, model))
    return _with_whole(spec, _with_generic(spec, model, given))


def on_its_bases(spec: Spec) -> Spec:
    """The problem with everything that moves the structure in place (`cvxupdate.fe.bases`)."""
    return moving(spec, lambda bare: build_model(bare).total_mass())


def _with_whole(spec: Spec, model: Model) -> Model:
    """The entries of [update.whole] as further parameters."""
    whole = spec.update.whole if spec.update is not None else None
    if whole is None:
        return model
    lower, upper = (
        own if own is not None else common
        for own, common in zip((whole.lower, whole.upper), _limits(spec), strict=True)
    )
    return with_entries(model, whole.matrices, whole.pattern, whole.symmetric, lower, upper)


def parameters_of(spec: Spec, model: Model) -> tuple[Parameter, ...]:
    """The parameters that the [update] table of ``spec`` asks for, on the elements of ``model``."""
    plain = [t for t in _targets(spec) if t.family is None]
    return select_parameters(plain, model, *_limits(spec))


def _with_generic(spec: Spec, model: Model, given: Sequence[GivenMatrix]) -> Model:
    """The families of element matrices as further parameters."""
    generic = [t for t in _targets(spec) if t.family is not None]
    return with_families(model, generic, given, *_limits(spec)) if generic else model


def _targets(spec: Spec) -> tuple[Target, ...]:
    rows = spec.update.parameters if spec.update is not None else ()
    return expand_parameters(spec.model, rows)


def _limits(spec: Spec) -> tuple[float, float]:
    """The bounds of [constraints]."""
    bounds = spec.constraints.bounds
    lower = bounds.lower if bounds is not None and bounds.lower is not None else -np.inf
    upper = bounds.upper if bounds is not None and bounds.upper is not None else np.inf
    return lower, upper
