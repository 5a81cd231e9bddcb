"""Spec → Model: the text of a problem file becomes blocks, DOFs and parameters."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.batches import block_of, gather, given_blocks
from cvxupdate.fe.elements.base import Surroundings
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model
from cvxupdate.fe.numbering import first_of_ties, number_dofs
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import select_parameters
from cvxupdate.fe.whole import with_entries
from cvxupdate.spec import Spec, expand_parameters
from cvxupdate.spec import model as sm


def build_model(spec: Spec) -> Model:
    """The model of a problem file, with its parameters (none where there is no [update] table).

    Raises
    ------
    ModelError
        For anything that only geometry or matrices show: zero length, a plate that is no rectangle,
        an unreadable matrix.
    """
    text = spec.model
    position = {n.id: i for i, n in enumerate(text.nodes)}
    xyz = np.array([[n.x, n.y, n.z] for n in text.nodes], dtype=float).reshape(-1, 3)
    active = tuple(k for k in KINDS if k in text.dofs)
    batches, given = gather(Surroundings(text, spec.path.parent))
    place, node_ids, xyz, labels = number_dofs(text, position, xyz, active, batches, given)
    blocks = [block_of(b, position, xyz, active, place) for b in batches]
    blocks += given_blocks(given, position, place)
    dof_node = np.array([node for node, _ in labels], dtype=np.int64)
    dof_kind = np.array([kind for _, kind in labels], dtype=np.int64)
    names = tuple(f"n{node_ids[n]}.{KINDS[k]}" for n, k in labels)
    damping = text.damping
    zeta: tuple[float, ...] = ()
    if isinstance(damping, sm.ModalDamping):
        zeta = damping.zeta if isinstance(damping.zeta, tuple) else (damping.zeta,)
    free = {label: name for label, name in zip(labels, names, strict=True)}
    ties = tuple(
        (f"n{node_ids[n]}.{KINDS[k]}", free[to])
        for (n, k), to in first_of_ties(text, position).items()
        if to in free
    )
    model = Model(names, node_ids, xyz, dof_node, dof_kind, tuple(blocks), (), zeta, ties)
    return _with_whole(spec, model.with_parameters(parameters_of(spec, model)))


def _with_whole(spec: Spec, model: Model) -> Model:
    """The entries of [update.whole] as further parameters."""
    whole = spec.update.whole if spec.update is not None else None
    if whole is None:
        return model
    bounds = spec.constraints.bounds
    lower = (
        whole.lower
        if whole.lower is not None
        else bounds.lower
        if bounds is not None and bounds.lower is not None
        else -np.inf
    )
    upper = (
        whole.upper
        if whole.upper is not None
        else bounds.upper
        if bounds is not None and bounds.upper is not None
        else np.inf
    )
    return with_entries(model, whole.matrices, whole.pattern, whole.symmetric, lower, upper)


def parameters_of(spec: Spec, model: Model) -> tuple[Parameter, ...]:
    """The parameters that the [update] table of ``spec`` asks for, on the elements of ``model``."""
    if spec.update is None:
        return ()
    bounds = spec.constraints.bounds
    lower = bounds.lower if bounds is not None and bounds.lower is not None else -np.inf
    upper = bounds.upper if bounds is not None and bounds.upper is not None else np.inf
    return select_parameters(
        expand_parameters(spec.model, spec.update.parameters), model, lower, upper
    )
