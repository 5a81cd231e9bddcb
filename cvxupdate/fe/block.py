"""A block: many elements of one type, their matrices and derivatives as batches of small arrays."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.elements.base import Element, Exact, Real, Term, Values

Index = NDArray[np.int64]

# Every element has these besides its own: factors for the p-values of (3.22), loss factor, and
# Rayleigh's two coefficients.
COMMON = {"stiffness": 1.0, "mass": 1.0, "damping": 1.0, "eta": 0.0, "alpha": 0.0, "beta": 0.0}
LINEAR = {("stiffness",): "K", ("mass",): "M"}  # factors that move one matrix each, in proportion
STEP = 1e-30  # of complex-step differentiation: exact to rounding, no subtraction takes place


@dataclass(frozen=True)
class Dynamic:
    """The dynamic stiffness of exact elements: how its scalars follow from the frequency, and the
    patterns ``terms`` that they multiply, (g, d, d)."""

    law: Exact
    terms: tuple[Term, ...]

    def spread(self, scalars: Mapping[str, Values], geometry: Index) -> NDArray[np.complex128]:
        """Σ scalar (e,) · pattern, (e, d, d); ``geometry`` (e,) says which pattern."""
        d, count = self.terms[0].values.shape[1], len(geometry)
        each = np.empty((count, 2, len(self.terms)))  # real and imaginary: the patterns are real
        for i, t in enumerate(self.terms):
            value = np.asarray(scalars[t.coefficient])
            each[:, 0, i], each[:, 1, i] = value.real, value.imag
        out = np.empty((count, 2, d * d))
        for flat, rows in self._sets(geometry):
            out[rows] = each[rows] @ flat
        return np.asarray(out[:, 0] + 1j * out[:, 1]).reshape(count, d, d)

    def _sets(self, geometry: Index) -> Iterator[tuple[Real, Index | slice]]:
        """Patterns (terms, d²), and the rows that have them."""
        if len(self._flat) == 1:
            yield self._flat[0], slice(None)
            return
        order = np.argsort(geometry, kind="stable")
        ends = np.flatnonzero(np.diff(geometry[order])) + 1
        for rows in np.split(order, ends):
            yield self._flat[geometry[rows[0]]], rows

    @cached_property
    def _flat(self) -> Real:
        """Every geometry's patterns, (g, terms, d²)."""
        count = max(len(t.values) for t in self.terms)
        d = self.terms[0].values.shape[1]
        every = [np.broadcast_to(t.values, (count, d, d)).reshape(count, -1) for t in self.terms]
        return np.ascontiguousarray(np.stack(every, axis=1))

    def moving(self, what: str) -> NDArray[np.bool_]:
        """Where (g,) any pattern of ``what`` is left on the free DOF kinds."""
        some = [t.values for t in self.terms if t.coefficient.split(".")[0] == what]
        return np.any([np.any(v != 0.0, axis=(1, 2)) for v in some], axis=0) if some else _NEVER


_NEVER = np.zeros(1, dtype=bool)


@dataclass(frozen=True)
class Block:
    """Elements of one type.

    ``ids`` (n,), ``groups`` n names, ``dofs`` (n, d) places among the free DOFs (−1: fixed),
    ``direction`` the DOF kind of each column (0..5 = x..rz), (1, d) where all elements agree, else
    (n, d), ``terms`` geometric factors (g, d, d), ``geometry`` (n,) which of the g factors an
    element uses, ``properties`` one value per element, ``nodes`` (n, k) places among the model's
    nodes (None: not from drawn nodes), ``own`` how many columns, the first, are DOFs of these
    (None: all; `cvxupdate.fe.analysis` has others), ``parts`` in how many parts an edge is divided
    (a line's ``length`` is that of a part), ``exact`` its dynamic stiffness, where that is more
    than its matrices.
    """

    kind: Element
    ids: Index
    groups: tuple[str, ...]
    dofs: Index
    direction: Index
    terms: tuple[Term, ...]
    geometry: Index
    properties: Mapping[str, Real]
    nodes: Index | None = None
    own: int | None = None
    parts: int = 1
    exact: Dynamic | None = None

    @property
    def is_base(self) -> bool:
        """Whether it stands for what moves the structure (`cvxupdate.fe.bases`) and is no part of
        it."""
        return self.kind.name == "base"

    @property
    def nodal(self) -> Index:
        """``dofs`` of the elements' own nodes, node by node."""
        return self.dofs[:, : self.own]

    def scalars(self, properties: Mapping[str, Values]) -> list[tuple[str, int, Values]]:
        """(matrix, term, factor (elements,)) for K, M, C and D.

        The p-values of stiffness, mass and damping are independent (3.22): a stiffness p-value
        leaves D alone, while a physical parameter (E, I, h …) carries the loss factor with it.
        """
        c = self.kind.coefficients(properties)
        p = properties
        lossy, rayleigh_m, rayleigh_k = (bool(p[k].any()) for k in ("eta", "alpha", "beta"))
        out: list[tuple[str, int, Values]] = []
        for i, term in enumerate(self.terms):
            v = c[term.coefficient]
            if term.matrix == "K":
                out.append(("K", i, p["stiffness"] * v))
                if lossy:
                    out.append(("D", i, p["damping"] * p["eta"] * v))
                if rayleigh_k:
                    out.append(("C", i, p["damping"] * p["beta"] * v))
            elif term.matrix == "M":
                out.append(("M", i, p["mass"] * v))
                if rayleigh_m:
                    out.append(("C", i, p["damping"] * p["alpha"] * v))
            else:
                out.append((term.matrix, i, p["damping"] * v))
        return out

    def combine(
        self, scalars: list[tuple[str, int, Any]], rows: Index | None = None
    ) -> dict[str, NDArray[Any]]:
        """Element matrices {"K": (e, d, d), …} from scalars of all elements or of ``rows``."""
        geometry = self.geometry if rows is None else self.geometry[rows]
        out: dict[str, NDArray[Any]] = {}
        for matrix, i, factor in scalars:
            values = self.terms[i].values
            shared = values[0][None] if len(values) == 1 else values[geometry]
            part = factor[:, None, None] * shared
            out[matrix] = out[matrix] + part if matrix in out else part
        return out

    def moves(self, names: tuple[str, ...], assumed: Mapping[str, float]) -> bool:
        """Whether any of the properties ``names`` changes any matrix, with the properties
        ``assumed`` where they are zero today."""
        local: dict[str, Values] = {
            k: np.where(v == 0.0, assumed.get(k, 0.0), v).astype(complex)
            for k, v in self.properties.items()
        }
        for name in names:
            local[name] = local[name] + 1j * STEP * np.where(
                local[name] == 0.0, 1.0, local[name].real
            )
        return any(bool(np.any(np.imag(f) != 0.0)) for _, _, f in self.scalars(local))

    def derivative(
        self, properties: Mapping[str, Values], rows: Index, names: tuple[str, ...], scales: Real
    ) -> dict[str, Real]:
        """d(element matrices)/dp of ``rows`` where property names[i] moves by scales[i] · p; each
        (r, d, d), zero ones left out."""
        return self.combine(self.rates(properties, rows, names, scales), rows)

    def rates(
        self, properties: Mapping[str, Values], rows: Index, names: tuple[str, ...], scales: Real
    ) -> list[tuple[str, int, Real]]:
        """The same as (matrix, term, d(factor)/dp (r,)): what `scalars` has, zero ones left
        out."""
        if names in LINEAR:  # a factor on K or M: no complex step is needed
            local = {k: v[rows] for k, v in properties.items()}
            c = self.kind.coefficients(local)
            plain = [
                (t.matrix, i, scales[0] * np.asarray(c[t.coefficient]))
                for i, t in enumerate(self.terms)
                if t.matrix == LINEAR[names]
            ]
            return [(m, i, f) for m, i, f in plain if np.any(f != 0.0)]
        local = {k: v[rows].astype(complex) for k, v in properties.items()}
        for name, scale in zip(names, scales, strict=True):
            local[name] = local[name] + 1j * STEP * scale
        parts = [(m, i, np.imag(f) / STEP) for m, i, f in self.scalars(local)]
        return [(m, i, f) for m, i, f in parts if np.any(f != 0.0)]

    def dynamic_stiffness(
        self, omega: complex, properties: Mapping[str, Values]
    ) -> NDArray[np.complex128]:
        """Z(ω) of exact elements, (n, d, d); ω in rad/s."""
        return self.dynamic_stiffnesses(np.array([omega]), properties)[0]

    def dynamic_stiffnesses(
        self, omega: NDArray[np.complex128], properties: Mapping[str, Values]
    ) -> NDArray[np.complex128]:
        """Z at every one of ``omega`` (f,), (f, n, d, d): all elements at all of them at once."""
        exact, count = self._exact(), len(omega)
        every = {k: np.tile(v, count) for k, v in properties.items()}
        scalars = exact.law.dynamic_stiffness(np.repeat(omega, len(self.ids)), every)
        found = exact.spread(
            {k: np.asarray(v) for k, v in scalars.items()}, np.tile(self.geometry, count)
        )
        return found.reshape(count, len(self.ids), *found.shape[1:])

    def dynamic_change(
        self,
        omega: complex,
        properties: Mapping[str, Values],
        rows: Index,
        moves: Mapping[str, Real],
    ) -> NDArray[np.complex128]:
        """∂Z(ω)/∂p of ``rows`` (r,; an element may come again), (r, d, d), where property ``name``
        of row i moves by moves[name][i] · p."""
        return self.dynamic_changes(np.array([omega], dtype=complex), properties, rows, moves)[0]

    def dynamic_changes(
        self,
        omega: NDArray[np.complex128],
        properties: Mapping[str, Values],
        rows: Index,
        moves: Mapping[str, Real],
    ) -> NDArray[np.complex128]:
        """`dynamic_change` at every one of ``omega`` (f,), (f, r, d, d): all rows at all of them at
        once."""
        exact, count = self._exact(), len(omega)
        local = {k: np.tile(v[rows], count) for k, v in properties.items()}
        moved = {k: np.tile(v, count) for k, v in moves.items()}
        found = exact.law.change(np.repeat(omega, len(rows)), local, moved)
        every = exact.spread(
            {k: np.asarray(d) for k, (_, d) in found.items()}, np.tile(self.geometry[rows], count)
        )
        return every.reshape(count, len(rows), *every.shape[1:])

    def clamped_below(self, omega: Real, properties: Mapping[str, Values]) -> Index:
        """How many natural frequencies of the elements with their nodes held lie below each of ω
        (f,), (f,)."""
        exact, count = self._exact(), len(omega)
        every = {k: np.tile(v, count) for k, v in properties.items()}
        total = np.zeros(count, dtype=np.int64)
        for what, counts in exact.law.clamped_below(np.repeat(omega, len(self.ids)), every).items():
            moving = exact.moving(what)
            live = moving if len(moving) > 1 else np.broadcast_to(moving, len(self.terms[0].values))
            total += counts.reshape(count, -1)[:, live[self.geometry]].sum(axis=1)
        return total

    def _exact(self) -> Dynamic:
        if self.exact is None:
            raise ModelError(f"{self.kind.name} elements have no dynamic stiffness of their own.")
        return self.exact
