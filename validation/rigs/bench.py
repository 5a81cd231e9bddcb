"""The structure on the bench: a mesh much finer than the drawing's, with its rig and whatever is
concealed; matrices by group, so that material scatter is a factor on each.

Bars are textbook matrices on at least 80 elements (bars.py); plates are Ritz series (plates.py).
"""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from validation.rigs.bars import axes, inertia, stiffness
from validation.rigs.drawing import TRANSLATIONS, Drawing, Line
from validation.rigs.plates import KAPPA, Series, null_space

Real = NDArray[np.float64]
Op = Mapping[str, Any]
KINDS = ("x", "y", "z", "rx", "ry", "rz")
FINE = 80  # elements of the truth, at least
LEAST = 3  # parts of an analyst's element, at least
BODY = 1e-5  # of an element's m L²: a joint whose members are all loose still has an inertia


@dataclass(frozen=True)
class Structure:
    """(K, M) of each group as its material is nominal, of everything else (effects, rig), and
    dashpots (vector, c). ``at`` gives the vector of a node's DOF."""

    groups: Mapping[str, tuple[Real, Real]]
    other: tuple[Real, Real]
    dampers: tuple[tuple[Real, float], ...]
    at: Callable[[int, str], Real]

    def matrices(self, scatter: Mapping[str, tuple[float, float]]) -> tuple[Real, Real]:
        """K and M with factors (stiffness, mass) on groups; absent: 1."""
        K, M = self.other[0].copy(), self.other[1].copy()
        for group, (k, m) in self.groups.items():
            fk, fm = scatter.get(group, (1.0, 1.0))
            K += fk * k
            M += fm * m
        return K, M


@dataclass
class _Assembly:
    """Rows of labels and small matrices, before they are put together."""

    rows: dict[tuple[Any, ...], int] = field(default_factory=dict)
    small: list[tuple[str, str, list[int], Real]] = field(default_factory=list)

    def row(self, *label: Any) -> int:
        return self.rows.setdefault(label, len(self.rows))

    def add(self, group: str, which: str, rows: list[int], values: Any) -> None:
        self.small.append((group, which, rows, np.atleast_2d(np.asarray(values, dtype=float))))

    def spring(self, group: str, rows: list[int], k: float) -> None:
        pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
        self.add(group, "K", rows, k if len(rows) == 1 else k * pair)


def build(
    d: Drawing, ops: Sequence[Op], shear: bool = False, rotary: bool = True, coarse: bool = False
) -> Structure:
    """The structure of a drawing with changes. ``shear``: Timoshenko or Mindlin; ``coarse``: bars
    on the analyst's own mesh."""
    if d.plate is not None:
        return _plate(d, ops, shear, rotary)
    factors: dict[int, tuple[float, float]] = {}
    for o in ops:
        for e in o["elements"] if o["do"] == "factor" else ():
            k, m = factors.get(e, (1.0, 1.0))
            factors[e] = (k * o["fk"], m * o["fm"])
    released = {(o["element"], o["node"]): o for o in ops if o["do"] == "release"}
    a = _Assembly()
    for n in d.nodes:
        for dof in d.dofs:
            a.row(n, dof)
    parts = 1 if coarse else max(LEAST, -(-FINE // max(1, len(d.lines))))
    for line in d.lines:
        _line(a, d, line, parts, factors.get(line.id, (1.0, 1.0)), released, shear, rotary)
    for s in d.springs:
        stiff = s.k * factors.get(s.id, (1.0, 1.0))[0]
        a.spring(s.group, [a.row(n, s.dof) for n in s.nodes], stiff)
    for x in d.lumps:
        for dof in (k for k in d.dofs if k in TRANSLATIONS):
            a.add(x.group, "M", [a.row(x.node, dof)], x.m * factors.get(x.id, (1.0, 1.0))[1])
    held, dampers = set(d.held), []
    for o in ops:
        dampers += _apply(a, d, o, held)
    return _reduced(a, d, held, dampers)


def _apply(a: _Assembly, d: Drawing, o: Op, held: set[tuple[int, str]]) -> list[Any]:
    """One change of a structure of bars or springs; gives its dashpots as (labels, c)."""
    own = "" if "group" not in o else str(o["group"])
    if o["do"] == "mass":
        for dof in (k for k in d.dofs if k in TRANSLATIONS):
            a.add(own, "M", [a.row(o["node"], dof)], o["m"])
    elif o["do"] == "ground":
        held.discard((o["node"], o["dof"]))
        a.spring(own, [a.row(o["node"], o["dof"])], o["k"])
    elif o["do"] == "fixture":
        for node in o["nodes"]:
            for dof in d.dofs:
                held.discard((node, dof))
                turns = dof not in TRANSLATIONS
                a.add(own, "M", [a.row(node, dof)], o["J"] if turns else o["m"])
                a.spring(own, [a.row(node, dof)], o["kr"] if turns else o["k"])
    elif o["do"] == "hidden":
        rows = [a.row(o["node"], o["dof"]), a.row("hidden", o["node"], o["dof"])]
        a.add(own, "M", [rows[1]], o["m"])
        a.spring(own, rows, o["k"])
        return [(rows, o["c"])]
    elif o["do"] == "dashpot":
        return [([a.row(o["node"], o["dof"])], o["c"])]
    elif o["do"] == "release":
        ends = ("end", o["element"], o["node"])
        line = next(e for e in d.lines if e.id == o["element"])
        body = BODY * d.rho * d.sections[line.section].A * d.length(line) ** 3
        for dof in (k for k in d.dofs if k not in TRANSLATIONS):
            a.spring(own, [a.row(o["node"], dof), a.row(*ends, dof)], o["k"])
            a.add(own, "M", [a.row(o["node"], dof)], body)
    elif o["do"] != "factor":
        raise ValueError(f"{o['do']} is no change of a structure of bars")
    return []


def _reduced(
    a: _Assembly, d: Drawing, held: set[tuple[int, str]], dampers: Sequence[Any]
) -> Structure:
    size, gone = len(a.rows), {a.rows[h] for h in held if h in a.rows}
    keep = np.array([i for i in range(size) if i not in gone])
    names = [*d.groups(), ""]
    full = {(g, w): np.zeros((size, size)) for g in names for w in "KM"}
    for group, which, rows, values in a.small:
        full[group, which][np.ix_(rows, rows)] += values
    cut = {k: v[np.ix_(keep, keep)] for k, v in full.items()}
    places = {label: i for i, label in enumerate(l for l, r in a.rows.items() if r not in gone)}

    def at(node: int, dof: str) -> Real:
        out = np.zeros(len(keep))
        if (node, dof) in places:
            out[places[node, dof]] = 1.0
        return out

    vectors = []
    for rows, c in dampers:
        b = np.zeros(size)
        b[rows] = [1.0, -1.0][: len(rows)]
        vectors.append((b[keep], float(c)))
    return Structure(
        {g: (cut[g, "K"], cut[g, "M"]) for g in names if g},
        (cut["", "K"], cut["", "M"]),
        tuple(vectors),
        at,
    )


# -------------------------------------------------------------------------------------------- bars


def _line(
    a: _Assembly,
    d: Drawing,
    e: Line,
    parts: int,
    factor: tuple[float, float],
    released: Mapping[tuple[int, int], Op],
    shear: bool,
    rotary: bool,
) -> None:
    start, end = (np.array(d.nodes[n]) for n in e.nodes)
    keep = [KINDS.index(k) for k in d.dofs]
    index = [*keep, *(6 + k for k in keep)]
    s, h = d.sections[e.section], d.length(e) / parts
    G = d.E / (2.0 * (1.0 + d.nu))
    T = np.kron(np.eye(4), axes(end - start))
    stiff = (d.E * s.A, d.E * s.Iy, d.E * s.Iz, G * s.J)
    GAs = KAPPA * G * s.A if shear else np.inf
    phi = (12.0 * stiff[1] / (GAs * h**2), 12.0 * stiff[2] / (GAs * h**2))
    K = T.T @ stiffness(*stiff, h, GAs) @ T
    M = T.T @ inertia(d.rho * s.A, d.rho * s.Iy, d.rho * s.Iz, h, rotary, phi) @ T
    for k in range(parts):
        rows: list[int] = []
        for step in (k, k + 1):
            if 0 < step < parts:
                rows += [a.row("fine", e.id, step, dof) for dof in d.dofs]
                continue
            node = e.nodes[0] if step == 0 else e.nodes[1]
            for dof in d.dofs:
                loose = (e.id, node) in released and dof not in TRANSLATIONS
                label = ("end", e.id, node, dof) if loose else (node, dof)
                rows.append(a.row(*label))
        a.add(e.group, "K", rows, factor[0] * K[np.ix_(index, index)])
        a.add(e.group, "M", rows, factor[1] * M[np.ix_(index, index)])


# ------------------------------------------------------------------------------------------- plates


def _plate(d: Drawing, ops: Sequence[Op], shear: bool, rotary: bool) -> Structure:
    p = d.plate
    if p is None:
        raise ValueError("the drawing holds no plate")
    series = Series(p, shear)

    def point(node: int, dof: str) -> Real:
        x, y, _ = d.nodes[node]
        return series.functional(x, y, dof)

    groups = {g: series.matrices(e, d.E, d.nu, d.rho, rotary) for g, e in d.groups().items()}
    K, M = np.zeros((series.size,) * 2), np.zeros((series.size,) * 2)
    extra: list[tuple[Op, Real]] = []  # hidden masses behind their points
    dampers: list[tuple[Real, float]] = []
    held = {h for h in d.held if not p.edge or d.nodes[h[0]][0] > 0.0}
    give = "turn" if any(o["do"] == "edge" for o in ops) else ""
    for o in ops:
        if o["do"] == "factor":
            k, m = series.matrices(o["elements"], d.E, d.nu, d.rho, rotary)
            K += (o["fk"] - 1.0) * k
            M += (o["fm"] - 1.0) * m
        elif o["do"] == "mass":
            M += o["m"] * _square(point(o["node"], "z"))
        elif o["do"] == "ground":
            held.discard((o["node"], o["dof"]))
            K += o["k"] * _square(point(o["node"], o["dof"]))
        elif o["do"] == "edge":
            K += series.edge_springs(o["k"])
        elif o["do"] == "fixture":
            give = "body"
            heave, pitch = (series.functional(0.0, p.b / 2.0, dof) for dof in ("z", "ry"))
            K += o["k"] * _square(heave) + o["kr"] * _square(pitch)
            M += o["m"] * _square(heave) + o["J"] * _square(pitch)
        elif o["do"] == "hidden":
            extra.append((o, point(o["node"], o["dof"])))
        elif o["do"] == "dashpot":
            dampers.append((point(o["node"], o["dof"]), o["c"]))
        else:
            raise ValueError(f"{o['do']} is no change of a plate")
    rows = [*series.clamped(give)] if p.edge else []
    rows += [point(n, dof) for n, dof in sorted(held)]
    T = null_space(np.array(rows), series.size)
    return _finished(T, groups, (K, M), dampers, extra, point)


def _square(v: Real) -> Real:
    return np.outer(v, v)


def _finished(
    T: Real,
    groups: Mapping[str, tuple[Real, Real]],
    other: tuple[Real, Real],
    dampers: list[tuple[Real, float]],
    extra: list[tuple[Op, Real]],
    point: Callable[[int, str], Real],
) -> Structure:
    """Restricted to what supports leave free; hidden masses appended."""
    n, more = T.shape[1], len(extra)

    def wide(A: Real) -> Real:
        return np.pad(T.T @ A @ T, ((0, more), (0, more)))

    def vector(v: Real) -> Real:
        return np.concatenate([T.T @ v, np.zeros(more)])

    K, M = (wide(A) for A in other)
    vectors = [(vector(b), c) for b, c in dampers]
    for i, (o, v) in enumerate(extra):
        b = vector(v)
        b[n + i] = -1.0
        K += o["k"] * np.outer(b, b)
        M[n + i, n + i] = o["m"]
        vectors.append((b, o["c"]))
    return Structure(
        {g: (wide(k), wide(m)) for g, (k, m) in groups.items()},
        (K, M),
        tuple(vectors),
        lambda node, dof: vector(point(node, dof)),
    )
