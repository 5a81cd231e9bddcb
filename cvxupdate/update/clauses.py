"""The physical clauses of [constraints] as parts of the convex step: definiteness, inertia, modes,
symmetry, budget, smoothness."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
import scipy.sparse as sp

from cvxupdate.convex import (
    Budget,
    Connectivity,
    Constraint,
    ElementMass,
    Equations,
    MatrixInequality,
    Smooth,
    Symmetric,
    Tied,
)
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.parameters import P_VALUES
from cvxupdate.fe.rigid import free_motions, pins
from cvxupdate.fe.whole import NONZERO
from cvxupdate.recordings.load import load_recordings
from cvxupdate.recordings.types import ModeTable
from cvxupdate.residual.ceam import CeamResidual
from cvxupdate.residual.ceam_modes import assigned_modes
from cvxupdate.spec import Spec
from cvxupdate.spec.parameters import groups_of, rows_of
from cvxupdate.system import Array

MASS_WORDS = ("mass", "rho", "m")
AXES = ("x", "y", "z")
SAME_PLACE = 1e-6  # of the size of the structure: nodes nearer than that are one place


def physical_constraints(spec: Spec, model: Model) -> list[Constraint]:
    """Every physical clause that the problem file asks for, over the parameters of ``model``.

    Raises
    ------
    InputError
        When a clause does not fit: a matrix that is not linear in the parameters, a mode or group
        that is not there, a plane of no symmetry.
    """
    c = spec.constraints
    out: list[Constraint] = []
    if (
        c.total_mass is not None
        and spec.update is not None
        and spec.update.whole is not None
        and "M" in spec.update.whole.matrices
    ):
        raise InputError(
            "constraints.total_mass: a whole mass matrix has a mass in every direction. Take "
            "inertia = { }, which keeps all of them."
        )
    if c.mass_positive is not None:
        names = tuple(q.name for q in model.parameters if q.of in MASS_WORDS)
        if c.mass_positive.elements and names:
            out.append(ElementMass(names, c.mass_positive.floor))
        if c.mass_positive.matrix:
            out.append(matrix_inequality(model, "M", c.mass_positive.floor))
    if c.stiffness_positive is not None:
        if c.stiffness_positive.rigid_modes:
            out += rigid_modes_kept(model)
        if c.stiffness_positive.matrix:
            out.append(
                matrix_inequality(
                    model, "K", c.stiffness_positive.floor, c.stiffness_positive.rigid_modes
                )
            )
    if c.inertia is not None:
        out += inertia(spec, model)
    if c.modes:
        out += modes_reproduced(spec, model)
    tied = [*mirrored(spec, model), *tied_groups(spec, model)]
    if tied:
        out.append(Tied(tuple(tied)))
    if c.symmetry is not None:
        out += symmetric_entries(spec, model)
    if c.connectivity is not None:
        zero = tuple(
            q.name
            for q in model.parameters
            if q.of not in P_VALUES and abs(q.nominal) <= NONZERO * abs(q.unit_size)
        )
        out += [Connectivity(zero)] if zero else []
    if c.budget is not None:
        out.append(Budget(c.budget.at_most, c.budget.norm))
    if c.smoothness is not None:
        out.append(Smooth(neighbours(spec, model), c.smoothness.at_most))
    return out


def symmetric_entries(spec: Spec, model: Model) -> list[Constraint]:
    """(i, j) and (j, i) of every whole matrix are equal; nothing where one parameter stands for
    both, as for every element."""
    whole = spec.update.whole if spec.update is not None else None
    if whole is None or whole.symmetric:
        return []
    return [Symmetric(matrix, model.labels) for matrix in dict.fromkeys(whole.matrices)]


def derivative_matrices(
    model: Model, name: str, what: str
) -> tuple[sp.csc_array, tuple[sp.csc_array, ...]]:
    """The matrix ``name`` ("K" or "M") at p = 0 and its derivative by every parameter; InputError
    when it is not linear in them."""
    zero = model.zero()
    base = getattr(model.matrices(zero), name)
    out = []
    for j in range(len(model.parameters)):
        rows, cols, data = [], [], []
        for b in model.derivative(j, zero):
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
        out.append(
            sp.csc_array(
                (
                    np.concatenate([*data, none]),
                    (
                        np.concatenate([*rows, none]).astype(int),
                        np.concatenate([*cols, none]).astype(int),
                    ),
                ),
                shape=base.shape,
            )
        )
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
    return base, tuple(out)


def matrix_inequality(
    model: Model, name: str, floor: float, kept: bool = False
) -> MatrixInequality:
    """The assembled matrix stays positive (semi)definite.

    Where every K(p) lets the rigid-body modes R free, K(p) R = 0, no K(p) is definite and a solver
    finds no interior: K ⪰ 0 then says the same as K ⪰ 0 of the structure held in a statically
    determinate way, which has one (facial reduction, Borwein and Wolkowicz 1981). With a floor the
    inequality is confined to the motions beside the rigid-body modes.
    """
    what, key = (
        ("the assembled mass matrix", "mass_positive")
        if name == "M"
        else ("the assembled stiffness matrix", "stiffness_positive")
    )
    base, parts = derivative_matrices(model, name, f"constraints.{key}")
    label = f"{what} stays positive {'definite' if floor > 0 else 'semidefinite'}" + (
        f" (eigenvalues at least {floor:g})" if floor > 0 else ""
    )
    R = _free(model, base) if name == "K" else np.zeros((model.size, 0))
    if not R.shape[1]:
        return MatrixInequality(base, parts, label, floor)
    if floor > 0.0:
        return MatrixInequality(
            base, parts, label, floor, np.linalg.svd(R, full_matrices=True)[0][:, R.shape[1] :]
        )
    if kept or not _resisting(parts, R).size:
        held = pins(R, (model.dof_kind >= 3).astype(float))
        rest = np.setdiff1d(np.arange(model.size), held)
        base, parts = base[rest][:, rest], tuple(d[rest][:, rest] for d in parts)
    return MatrixInequality(base, parts, label, floor)


def _resisting(parts: Sequence[sp.csc_array], R: Array) -> Array:
    """The rows of A p = 0 that say K(p) R = 0 ((rows, n) of length 1, each entry that is rounding a
    zero); empty where it holds for every p.

    Length 1, because rows in newtons differ 1e5 times in a frame that is soft out of its plane: the
    soft ones would drown in the rounding of the stiff ones.
    """
    A = (
        np.column_stack([np.asarray(d @ R).ravel() for d in parts])
        if parts
        else np.zeros((R.size, 0))
    )
    size = np.array([float(abs(d).max()) if d.nnz else 1.0 for d in parts])
    A = np.where(np.abs(A) > 1e-9 * size[None, :], A, 0.0)
    A = A[np.any(A != 0.0, axis=1)]
    return np.asarray(A / np.linalg.norm(A, axis=1, keepdims=True))


def _free(model: Model, K: sp.csc_array) -> Array:
    return (
        np.zeros((model.size, 0))
        if any(b.kind.name == "matrix" for b in model.blocks)
        else free_motions(model, K)
    )


def rigid_modes_kept(model: Model) -> list[Constraint]:
    """K(p) Φ_R = 0 for the motions that the model does not resist today."""
    base, parts = derivative_matrices(model, "K", "constraints.stiffness_positive")
    R = _free(model, base)
    if not R.shape[1]:
        return []
    A = _resisting(parts, R)
    return (
        [Equations(A, np.zeros(len(A)), "rigid-body modes stay free (K Phi_R = 0)")]
        if len(A)
        else []
    )


def inertia(spec: Spec, model: Model) -> list[Constraint]:
    """Total mass, centre of gravity and moments of inertia, kept or set (Caesar 1986). Supports are
    let go for the purpose: they carry mass too."""
    asked = spec.constraints.inertia
    if asked is None:
        return []
    given = spec.update is not None and spec.update.whole is not None
    loose = (
        spec.update
        if not given or spec.update is None
        else spec.update.model_copy(update={"whole": None})
    )
    whole = build_model(
        replace(spec, update=loose, model=spec.model.model_copy(update={"supports": ()}))
    )
    if any(b.kind.name == "matrix" for b in whole.blocks):
        raise InputError(
            "constraints.inertia: matrices from another program have no geometry to take the "
            "inertia from. Leave the clause out."
        )
    base, parts = derivative_matrices(whole, "M", "constraints.inertia")
    moved, parts = (
        (model, derivative_matrices(model, "M", "constraints.inertia")[1])
        if given
        else (whole, parts)
    )  # entries at supports do not move
    R = rigid_columns(whole, np.zeros(3))
    J = R.T @ (base @ R)
    axis = int(np.argmax(np.diag(J)[:3] > 0))
    mass = float(J[axis, axis])
    now = first_moments(J) / mass
    centre = np.where(np.isnan(now), 0.0, now) if asked.centre is None else np.array(asked.centre)
    R = rigid_columns(whole, centre)
    S = rigid_columns(moved, centre)
    J, dJ = R.T @ (base @ R), np.array([S.T @ (d @ S) for d in parts])
    out: list[Constraint] = []
    if asked.mass is not None or asked.conserve:
        target = mass if asked.mass is None else asked.mass
        word = "kept at" if asked.mass is None else "set to"
        # Elements have one mass in every direction; entries of a whole matrix have to be told.
        ways = [(a, b) for a in range(3) for b in range(a, 3)] if given else [(axis, axis)]
        left = np.array([(target if a == b and J[a, a] > 0 else 0.0) - J[a, b] for a, b in ways])
        out.append(
            Equations(
                np.array([dJ[:, a, b] for a, b in ways]),
                left,
                f"total mass {word} {target:.6g} kg",
                unit="kg",
            )
        )
    if asked.centre is not None or asked.conserve:
        rows = [(a, 3 + b) for a in range(3) for b in range(3)]
        A, b = np.array([dJ[:, i, j] for i, j in rows]), -np.array([J[i, j] for i, j in rows])
        where = ", ".join(f"{v:.4g}" for v in centre)
        out.append(
            Equations(
                A,
                b,
                f"centre of gravity {'kept at' if asked.centre is None else 'set to'} ({where}) m",
                unit="kg m",
            )
        )
    if asked.moments is not None or asked.conserve:
        wanted = np.diag(J)[3:] if asked.moments is None else np.array(asked.moments)
        rows = [(3 + a, 3 + a) for a in range(3)]
        A, b = np.array([dJ[:, i, j] for i, j in rows]), wanted - np.diag(J)[3:]
        if asked.moments is None:
            rows = [(3 + a, 3 + b) for a in range(3) for b in range(a + 1, 3)]
            A, b = np.vstack([A, [dJ[:, i, j] for i, j in rows]]), np.append(b, np.zeros(3))
        words = ", ".join(f"{v:.4g}" for v in wanted)
        out.append(
            Equations(
                A,
                b,
                f"moments of inertia {'kept at' if asked.moments is None else 'set to'} "
                f"({words}) kg m^2",
                unit="kg m^2",
            )
        )
    return out


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


def first_moments(J: Array) -> Array:
    """m (x, y, z) from the coupling of translations and rotations about the origin; NaN where the
    DOF kinds do not show it."""
    out = np.full(3, np.nan)
    # translation a against rotation b: e_a . (e_b x r)
    for a, b, k, sign in (
        (0, 1, 2, 1),
        (1, 0, 2, -1),
        (0, 2, 1, -1),
        (2, 0, 1, 1),
        (1, 2, 0, 1),
        (2, 1, 0, -1),
    ):
        if J[a, a] > 0.0 and np.isnan(out[k]):
            out[k] = sign * J[a, 3 + b]
    return out


def modes_reproduced(spec: Spec, model: Model) -> list[Constraint]:
    """Chosen measured modes exactly, or within their deviations (a second-order cone).

    An incomplete shape is expanded by the model as it stands, its unmeasured entries as uncertain
    as they are large. That leaves a clause ``within`` deviations meaning, locally; an exact one
    would hold the shape of a model that is about to be changed, and is refused.
    """
    tables = [
        r for r in load_recordings(spec) if isinstance(r, ModeTable) and r.origin.use == "fit"
    ]
    rows = [(t, i) for t in tables for i in range(len(t.frequency))]
    out: list[Constraint] = []
    for asked in spec.constraints.modes:
        if asked.mode > len(rows):
            raise InputError(
                f"constraints.modes: mode = {asked.mode}, but only {len(rows)} modes are fitted."
            )
        table, i = rows[asked.mode - 1]
        if table.shapes is None:
            raise InputError(
                f"constraints.modes: mode {asked.mode} ({table.frequency[i]:.5g} Hz) has no "
                "shape, so its equation of motion is not known."
            )
        one = replace(
            table,
            frequency=table.frequency[i : i + 1],
            frequency_std=table.frequency_std[i : i + 1],
            damping=table.damping[i : i + 1],
            damping_std=table.damping_std[i : i + 1],
            shapes=table.shapes[i : i + 1],
            pairs=table.pairs[i : i + 1],
            shape_std=None
            if table.shape_std is None
            else np.broadcast_to(table.shape_std, np.shape(table.shapes))[i : i + 1],
        )
        residual = CeamResidual(model, assigned_modes(model, [one]), "null-space", model.zero())
        if not residual.exact and asked.within is None:
            raise InputError(
                f"constraints.modes: mode {asked.mode} was not measured at every DOF. "
                "Expanded by the model that is to be corrected, its shape is wrong where "
                "nothing was measured, and an exact clause would keep it wrong. Give "
                "`within`, in standard deviations, or measure the other DOFs."
            )
        system = residual.evaluate(model.zero()).system()
        name = f"mode {asked.mode} ({table.frequency[i]:.5g} Hz)"
        if asked.within is None:
            out.append(Equations(system.A, system.b, f"{name} reproduced exactly"))
        else:
            share = 1.0 / np.sqrt(len(system.b))
            out.append(
                Equations(
                    share * system.A,
                    share * system.b,
                    f"{name} reproduced within {asked.within:g} standard deviations",
                    asked.within,
                )
            )
    return out


def _elements(spec: Spec) -> dict[int, Array]:
    """Element number → coordinates of its nodes (k, 3)."""
    place = {n.id: (n.x, n.y, n.z) for n in spec.model.nodes}
    return {
        row.id: np.array([place[n] for n in row.nodes if n in place])
        for _, row in rows_of(spec.model)
        if hasattr(row, "nodes")
    }


def mirrored(spec: Spec, model: Model) -> list[tuple[str, ...]]:
    """Names of parameters whose elements are mirror images, pair by pair, for every plane."""
    if not spec.constraints.mirror:
        return []
    places = _elements(spec)
    size = float(np.ptp(model.xyz, axis=0).max()) or 1.0

    def key(of: str, points: Array) -> tuple[object, ...]:
        return (
            of,
            tuple(
                sorted(
                    tuple(np.round(p / (SAME_PLACE * size)).astype(int).tolist()) for p in points
                )
            ),
        )

    out: list[tuple[str, ...]] = []
    for mirror in spec.constraints.mirror:
        known = {
            key(q.of, np.vstack([places[e] for e in q.elements])): q.name
            for q in model.parameters
            if q.elements
        }
        found = 0
        for q in model.parameters:
            if not q.elements:
                continue
            points = np.vstack([places[e] for e in q.elements]).copy()
            axis = AXES.index(mirror.plane)
            points[:, axis] = 2.0 * mirror.at - points[:, axis]
            other = known.get(key(q.of, points))
            if other is not None and other != q.name:
                found += 1
                if q.name < other:
                    out.append((q.name, other))
        if not found:
            raise InputError(
                f"constraints.mirror: no two parameters are mirror images in {mirror.plane} = "
                f"{mirror.at:g}. Correct the plane."
            )
    return out


def tied_groups(spec: Spec, model: Model) -> list[tuple[str, ...]]:
    """For every tied_groups row the names of the parameters of its property whose elements lie in
    its groups."""
    groups = groups_of(spec.model)
    out: list[tuple[str, ...]] = []
    for row in spec.constraints.tied_groups:
        unknown = [g for g in row.groups if g not in groups]
        if unknown:
            raise InputError(
                f"constraints.tied_groups: there is no element group {', '.join(unknown)}; "
                f"the groups are {', '.join(groups)}."
            )
        inside = {e for g in row.groups for e in groups[g]}
        names = tuple(
            q.name
            for q in model.parameters
            if q.of == row.of and q.elements and set(q.elements) <= inside
        )
        if len(names) < 2:
            raise InputError(
                f"constraints.tied_groups: {len(names)} parameter(s) of {row.of} lie in "
                f"{', '.join(row.groups)}; two or more can be tied."
            )
        out.append(names)
    return out


def neighbours(spec: Spec, model: Model) -> tuple[tuple[str, str], ...]:
    """Pairs of parameters of one property whose elements share a node."""
    nodes = {row.id: set(row.nodes) for _, row in rows_of(spec.model) if hasattr(row, "nodes")}
    touched = [
        (q, set().union(*(nodes.get(e, set()) for e in q.elements)) if q.elements else set())
        for q in model.parameters
    ]
    pairs: Sequence[tuple[str, str]] = [
        (a.name, b.name)
        for (a, at), (b, other) in combinations(touched, 2)
        if a.of == b.of and at & other
    ]
    if not pairs:
        raise InputError(
            "constraints.smoothness: no two parameters of one property have elements that "
            "share a node. Leave the clause out."
        )
    return tuple(pairs)
