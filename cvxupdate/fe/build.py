"""Spec → Model: the text of a problem file becomes blocks, DOFs and parameters."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements import (
    Beam2D,
    Beam3D,
    Dashpot,
    Entries,
    Gyroscopic,
    Mass,
    Plate,
    Rod,
    Spring,
    Term,
)
from cvxupdate.fe.elements.base import Element, Real
from cvxupdate.fe.elements.matrix import read_matrix, split
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.sections import Circle, General, Rectangle, Section
from cvxupdate.fe.select import select_parameters
from cvxupdate.fe.whole import with_entries
from cvxupdate.matfile import read_variables
from cvxupdate.spec import Spec, expand_parameters
from cvxupdate.spec import elements as se
from cvxupdate.spec import model as sm


@dataclass(frozen=True)
class _Batch:
    """Rows of one element class, before their DOFs are numbered."""

    kind: Element
    ids: list[int]
    groups: list[str]
    nodes: list[tuple[int, ...]]
    orientation: list[tuple[float, float, float]]
    properties: dict[str, list[float]]


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
    batches = list(_batches(text, active))
    given = list(_given(text, spec))
    place, node_ids, xyz, labels = _number(text, position, xyz, active, batches, given)
    blocks = [_block(b, text, position, xyz, active, place) for b in batches]
    blocks += _given_blocks(given, position, place, _loss(text))
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
        for (n, k), to in _first_of_ties(text, position).items()
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


def _batches(text: sm.Model, active: tuple[str, ...]) -> Iterable[_Batch]:
    """Rows gathered by element class: one batch for each (type, options, section shape, DOF)."""
    found: dict[Any, _Batch] = {}
    for block in text.elements:
        if isinstance(block, se.MatrixBlock):
            continue
        for row in block.rows:
            for kind in _kinds(block, row, text, active):
                batch = found.setdefault(kind, _Batch(kind, [], [], [], [], {}))
                batch.ids.append(row.id)
                batch.groups.append(row.group or "")
                batch.nodes.append(row.nodes)
                batch.orientation.append(
                    getattr(row, "axis", None)
                    or getattr(row, "orientation", None)
                    or (0.0, 0.0, 0.0)
                )
                for name, value in _properties(row, kind, text).items():
                    batch.properties.setdefault(name, []).append(value)
    return found.values()


def _kinds(block: Any, row: Any, text: sm.Model, active: tuple[str, ...]) -> list[Element]:
    if isinstance(row, se.SpringRow):
        return [Spring(d, len(row.nodes)) for d in row.directions]
    if isinstance(row, se.DashpotRow):
        return [Dashpot(d, len(row.nodes)) for d in row.directions]
    if isinstance(row, se.MassRow):
        return [Mass()]
    if isinstance(row, se.GyroscopicRow):
        return [Gyroscopic(len(row.nodes))]
    if isinstance(row, se.PlateRow):
        return [Plate(block.mass)]
    section = _section(text.sections[row.section])
    if block.type == "rod":
        return [Rod(section, block.mass)]
    if block.type == "beam2d":
        return [
            Beam2D(
                section,
                "xz" if "ry" in active and "rz" not in active else "xy",
                block.mass,
                block.rotary_inertia,
            )
        ]
    return [Beam3D(section, block.mass, block.rotary_inertia)]


def _section(text: Any) -> Section:
    known: dict[str, Section] = {"rectangle": Rectangle(), "circle": Circle(), "general": General()}
    return known[text.shape]


def _loss(text: sm.Model) -> dict[str, float]:
    damping = text.damping
    if isinstance(damping, sm.StructuralDamping):
        return {"eta": damping.eta}
    if isinstance(damping, sm.RayleighDamping):
        return {"alpha": damping.alpha, "beta": damping.beta}
    return {"alpha": damping.alpha} if isinstance(damping, sm.ModalDamping) else {}


def _properties(row: Any, kind: Element, text: sm.Model) -> dict[str, float]:
    out = {**COMMON, **_loss(text), **_own(row, text)}
    if isinstance(row, se.SpringRow):
        return {**out, "k": row.k}
    if isinstance(row, se.DashpotRow):
        return {**out, "c": row.c}
    if isinstance(row, se.MassRow):
        sign = -1.0 if row.taken_off else 1.0
        return {
            **out,
            "m": sign * row.m,
            "Ixx": sign * row.Ixx,
            "Iyy": sign * row.Iyy,
            "Izz": sign * row.Izz,
        }
    if isinstance(row, se.GyroscopicRow):
        return {**out, "Ip": row.Ip, "omega": row.omega}
    material, section = text.materials[row.material], text.sections[row.section]
    nu = material.nu if material.G is None else material.E / (2.0 * material.G) - 1.0
    out |= {"E": material.E, "nu": nu, "rho": material.rho}
    if isinstance(section, sm.PlateSection):
        return {
            **out,
            "thickness": section.thickness,
            "Dx": section.Dx,
            "Dy": section.Dy,
            "D1": section.D1,
            "Dxy": section.Dxy,
        }
    shear = (
        {"shear": 0.0, "kappa": shear_coefficient(section, nu)}
        if section.kappa is None
        else {"shear": 1.0, "kappa": section.kappa}
    )
    out |= {"A": 1.0, "Iy": 1.0, "Iz": 1.0, "J": 1.0, "N": row.N, **shear}
    if isinstance(section, sm.Rectangle):
        return {**out, "width": section.width, "height": section.height}
    if isinstance(section, sm.Circle):
        return {**out, "diameter": section.diameter, "wall": section.wall or 0.0}
    return {
        **out,
        "A": section.A,
        "Iy": section.Iy or 0.0,
        "Iz": section.Iz or 0.0,
        "J": section.J or 0.0,
    }


def _own(row: Any, text: sm.Model) -> dict[str, float]:
    """What an element says of itself: factors on its matrices, its loss factor (else that of its
    material)."""
    out = {word: getattr(row, f"{word}_factor", 1.0) for word in ("stiffness", "mass")}
    material = text.materials.get(getattr(row, "material", ""))
    eta = getattr(row, "eta", None)
    eta = eta if eta is not None or material is None else material.eta
    return out if eta is None else {**out, "eta": eta}


def shear_coefficient(section: Any, nu: float) -> float:
    """kappa of a section for which the file gives none: 5/6, or that of a round bar or tube (Cowper
    1966, hollow circle)."""
    if not isinstance(section, sm.Circle):
        return 5.0 / 6.0
    inner = 1.0 - 2.0 * section.wall / section.diameter if section.wall else 0.0
    ring = (1.0 + inner**2) ** 2
    return 6.0 * (1.0 + nu) * ring / ((7.0 + 6.0 * nu) * ring + (20.0 + 12.0 * nu) * inner**2)


@dataclass(frozen=True)
class _Given:
    """One matrix of a matrix row: which of K, M, C, D, its row's id and group, its labels and its
    entries."""

    matrix: str
    id: int
    group: str
    labels: tuple[tuple[int, int], ...]
    values: sp.csr_array
    own: dict[str, float]


def _given(text: sm.Model, spec: Spec) -> Iterable[_Given]:
    for block in text.elements:
        if not isinstance(block, se.MatrixBlock):
            continue
        for row in block.rows:
            for matrix, name in (
                ("K", row.stiffness),
                ("M", row.mass),
                ("C", row.damping),
                ("D", row.structural),
            ):
                if name is None:
                    continue
                own = name.lower().endswith((".mtx", ".npz"))
                path = spec.path.parent / name if own else row.file
                if path is None:
                    raise ModelError(
                        f"matrix row {row.id}: {name!r} names a variable, but no file is "
                        "given. Add `file`."
                    )
                values = read_matrix(path, None if own else name)
                yield _Given(
                    matrix,
                    row.id,
                    row.group or "",
                    _labels(row, path, values.shape[0]),
                    values,
                    _own(row, text),
                )


def _labels(row: se.MatrixRow, path: Any, size: int) -> tuple[tuple[int, int], ...]:
    """(node id, kind) of every row of a given matrix; "auto": row i is n<i>.x."""
    if row.labels == "auto":
        return tuple((i + 1, 0) for i in range(size))
    names: Sequence[str]
    if isinstance(row.labels, str):
        if path.suffix.lower() == ".npz":
            with np.load(path, allow_pickle=False) as data:
                names = (
                    [str(v) for v in np.atleast_1d(data[row.labels])] if row.labels in data else []
                )
        else:
            names = [text.strip() for text in read_variables(path).texts.get(row.labels, ())]
    else:
        names = row.labels
    if len(names) != size:
        raise ModelError(
            f"matrix row {row.id}: {len(names)} labels for a matrix of {size} rows. Give one "
            'label like "n6.y" for each.'
        )
    return tuple(parse_label(n) for n in names)


def parse_label(label: str) -> tuple[int, int]:
    """ "n6.y" → (6, 1).

    Raises
    ------
    ModelError
        When the label is not of that form.
    """
    node, _, kind = label.partition(".")
    if not node.startswith("n") or not node[1:].isdigit() or kind not in KINDS:
        raise ModelError(f'the DOF label {label!r} is not understood. Write it like "n6.y".')
    return int(node[1:]), KINDS.index(kind)


Place = dict[tuple[int, int], int]
_INERTIA = ("m", "m", "m", "Ixx", "Iyy", "Izz")


def _number(
    text: sm.Model,
    position: dict[int, int],
    xyz: Real,
    active: tuple[str, ...],
    batches: list[_Batch],
    given: list[_Given],
) -> tuple[Place, Index, Real, list[tuple[int, int]]]:
    """Free DOFs in the order of nodes and kinds: those that an element touches and no support
    holds."""
    node_ids = [n.id for n in text.nodes]
    extra = sorted({node for g in given for node, _ in g.labels} - set(position))
    for node in extra:  # DOFs of given matrices may have no drawn node
        position[node] = len(node_ids)
        node_ids.append(node)
    xyz = np.vstack([xyz, np.zeros((len(extra), 3))])
    touched: set[tuple[int, int]] = {(position[n], k) for g in given for n, k in g.labels}
    for batch in batches:
        kinds = [KINDS.index(d) for d in batch.kind.dofs if d in active]
        if isinstance(batch.kind, Mass):  # no inertia about an axis: no DOF of its own there
            amounts = [batch.properties[_INERTIA[k]] for k in kinds]
            touched |= {
                (position[n], k)
                for k, amount in zip(kinds, amounts, strict=True)
                for (n,), value in zip(batch.nodes, amount, strict=True)
                if value != 0.0
            }
            continue
        if not isinstance(batch.kind, Gyroscopic):  # it acts on what beams and masses have
            touched |= {(position[n], k) for nodes in batch.nodes for n in nodes for k in kinds}
    held = {
        (position[n], KINDS.index(d))
        for s in text.supports
        for n in (node_ids if s.nodes == "all" else s.nodes)
        for d in s.dofs
    }
    first = _first_of_ties(text, position)
    labels = sorted({first.get(t, t) for t in touched} - {first.get(h, h) for h in held})
    place = {label: i for i, label in enumerate(labels)}
    place |= {tied: place[to] for tied, to in first.items() if to in place}
    return place, np.array(node_ids, dtype=np.int64), xyz, labels


def _first_of_ties(
    text: sm.Model, position: dict[int, int]
) -> dict[tuple[int, int], tuple[int, int]]:
    """DOF of a tied node → the DOF it is the same as."""
    first: dict[tuple[int, int], tuple[int, int]] = {}
    for tie in text.ties:
        for kind in (KINDS.index(d) for d in tie.dofs):
            ends = [(position[n], kind) for n in tie.nodes]
            ends = [first.get(e, e) for e in ends]
            for e in ends[1:]:
                if e != ends[0]:
                    first |= {**{a: ends[0] for a, b in first.items() if b == e}, e: ends[0]}
    return first


def _block(
    batch: _Batch,
    text: sm.Model,
    position: dict[int, int],
    xyz: Real,
    active: tuple[str, ...],
    place: Place,
) -> Block:
    kind = batch.kind
    nodes = np.array([[position[n] for n in row] for row in batch.nodes], dtype=np.int64)
    points = xyz[nodes]
    keep = [i for i, d in enumerate(kind.dofs) if d in active]
    kinds = np.array([KINDS.index(kind.dofs[i]) for i in keep], dtype=np.int64)
    dofs = np.array(
        [[place.get((n, k), -1) for n in row for k in kinds] for row in nodes.tolist()],
        dtype=np.int64,
    )
    orientation = np.array(batch.orientation)
    unique, geometry = _distinct(points, orientation)
    try:
        terms = kind.terms(points[unique], orientation[unique])
    except ModelError as error:
        raise ModelError(f"elements {_span(batch.ids)}: {error}") from error
    columns = [n * len(kind.dofs) + i for n in range(kind.nodes) for i in keep]
    kept = tuple(
        Term(t.matrix, t.coefficient, np.ascontiguousarray(t.values[:, columns][:, :, columns]))
        for t in terms
    )
    kept = tuple(t for t in kept if np.any(t.values != 0.0))
    properties = {k: np.array(v, dtype=float) for k, v in batch.properties.items()}
    if kind.nodes == 2:
        properties["length"] = np.linalg.norm(points[:, 1] - points[:, 0], axis=1)
    return Block(
        kind,
        np.array(batch.ids, dtype=np.int64),
        tuple(batch.groups),
        dofs,
        np.tile(kinds, kind.nodes)[None],
        kept,
        geometry,
        properties,
        nodes,
    )


def _distinct(points: Real, orientation: Real) -> tuple[Index, Index]:
    """Elements of one shape and attitude share their matrices: (first of each shape, shape of each
    element)."""
    relative = (points - points[:, :1]).reshape(len(points), -1)
    size = np.abs(relative).max(axis=1, keepdims=True)
    size[size == 0.0] = 1.0
    decade = np.floor(
        np.log10(size)
    )  # twelve digits of each element's own size: a small one beside large ones keeps its own
    key = np.hstack(
        [np.round(np.hstack([relative / size, size / 10.0**decade, orientation]), 12), decade]
    )
    _, first, inverse = np.unique(key, axis=0, return_index=True, return_inverse=True)
    return first.astype(np.int64), inverse.reshape(-1).astype(np.int64)


def _given_blocks(
    given: list[_Given], position: dict[int, int], place: Place, loss: dict[str, float]
) -> list[Block]:
    """One block for each of K, M, C, D and entry size."""
    parts: dict[tuple[str, int], list[tuple[_Given, Index, Index, Real]]] = {}
    for g in given:
        dofs = np.array([place.get((position[n], k), -1) for n, k in g.labels], dtype=np.int64)
        kinds = np.array([k for _, k in g.labels], dtype=np.int64)
        for size, (at, values) in split(g.values, f"matrix row {g.id}").items():
            if len(at):
                parts.setdefault((g.matrix, size), []).append((g, dofs[at], kinds[at], values))
    blocks = []
    for (matrix, size), members in parts.items():
        ids = np.concatenate(
            [np.full(len(dofs), g.id, dtype=np.int64) for g, dofs, _, _ in members]
        )
        groups = tuple(g.group for g, dofs, _, _ in members for _ in range(len(dofs)))
        own = [({**COMMON, **loss, **g.own}, len(dofs)) for g, dofs, _, _ in members]
        properties = {k: np.concatenate([np.full(n, v[k]) for v, n in own]) for k in COMMON}
        dofs, kinds = np.vstack([m[1] for m in members]), np.vstack([m[2] for m in members])
        values = np.vstack([m[3] for m in members])
        blocks.append(
            Block(
                Entries(matrix, size),
                ids,
                groups,
                dofs,
                kinds,
                (Term(matrix, "one", values),),
                np.arange(len(ids)),
                properties,
            )
        )
    return blocks


def _span(ids: Sequence[int]) -> str:
    return str(ids[0]) if len(ids) == 1 else f"{min(ids)} to {max(ids)}"
