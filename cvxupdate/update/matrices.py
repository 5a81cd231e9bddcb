"""Assembled matrices over the parameters, and the structure without supports as a rigid body."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cvxupdate.convex import RigidBody
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec
from cvxupdate.system import Array


def derivative_matrices(
    model: Model, name: str, what: str
) -> tuple[sp.csc_array, tuple[sp.csc_array, ...]]:
    """The matrix ``name`` ("K" or "M") at p = 0 and its derivative by every parameter; InputError
    when it is not linear in them."""
    zero = model.zero()
    base = getattr(model.matrices(zero), name)
    out = tuple(_derivative(model, name, j, base.shape) for j in range(len(model.parameters)))
    probe = np.linspace(0.01, 0.03, len(out)) * np.where(np.arange(len(out)) % 2, -1.0, 1.0)
    expected = base + sum(
        (v * d for v, d in zip(probe, out, strict=True)), sp.csc_array(base.shape)
    )
    # Sparse maximum of a difference; the base sets the scale of rounding.
    if abs(getattr(model.matrices(probe), name) - expected).max() > 1e-9 * abs(base).max():
        raise InputError(
            f"{what}: the {'stiffness' if name == 'K' else 'mass'} is not linear in the "
            "parameters (a dimension such as a height or a thickness is free). Free "
            "p-values, E, rho or k instead, so that the clause stays convex."
        )
    return base, out


def _derivative(model: Model, name: str, number: int, shape: tuple[int, int]) -> sp.csc_array:
    rows, cols, data = [], [], []
    for b in model.derivative(number, model.zero()):
        matrix = getattr(b, name)
        if matrix is None:
            continue
        i = np.broadcast_to(b.dofs[:, :, None], matrix.shape).ravel()
        k = np.broadcast_to(b.dofs[:, None, :], matrix.shape).ravel()
        keep = (i >= 0) & (k >= 0)
        rows.append(i[keep])
        cols.append(k[keep])
        data.append(matrix.ravel()[keep])
    none = np.zeros(0)
    places = (
        np.concatenate([*rows, none]).astype(int),
        np.concatenate([*cols, none]).astype(int),
    )
    return sp.csc_array((np.concatenate([*data, none]), places), shape=shape)


def rigid_body(spec: Spec, model: Model) -> RigidBody:
    """The structure of ``spec`` without its supports.

    Raises
    ------
    InputError
        When matrices from another program have no geometry, or M is not linear in the parameters.
    """
    update = spec.update
    given = update is not None and update.whole is not None
    loose = update if not given or update is None else update.model_copy(update={"whole": None})
    whole = build_model(
        replace(spec, update=loose, model=spec.model.model_copy(update={"supports": ()}))
    )
    what = "constraints.inertia"
    if any(b.kind.name == "matrix" for b in whole.blocks):
        raise InputError(
            f"{what}: matrices from another program have no geometry to take the inertia from. "
            "Leave the clause out."
        )
    base, parts = derivative_matrices(whole, "M", what)
    moved, parts = (
        (model, derivative_matrices(model, "M", what)[1]) if given else (whole, parts)
    )  # entries at supports do not move

    def inertia(centre: Array) -> tuple[Array, Array]:
        R, S = rigid_columns(whole, centre), rigid_columns(moved, centre)
        return R.T @ (base @ R), np.array([S.T @ (d @ S) for d in parts])

    return RigidBody(inertia, given)


def rigid_columns(model: Model, centre: Array) -> Array:
    """Unit translations along x, y, z and unit rotations about the axes through ``centre``, on the
    free DOFs, (N, 6)."""
    r = model.xyz[model.dof_node] - centre
    R = np.zeros((model.size, 6))
    for axis in range(3):
        R[model.dof_kind == axis, axis] = 1.0
        turn = np.cross(np.eye(3)[axis], r)
        for k in range(3):
            R[model.dof_kind == k, 3 + axis] = turn[model.dof_kind == k, k]
        R[model.dof_kind == 3 + axis, 3 + axis] = 1.0
    return R
