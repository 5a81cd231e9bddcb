"""The model: blocks of elements, free DOFs with labels, parameters. Frozen; every method takes the
parameter values ``p``."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from copy import copy
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import scipy.sparse as sp
from numpy.typing import ArrayLike, NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.exact.correction import Beyond, Member
from cvxupdate.fe.generic.use import FamilyUse
from cvxupdate.fe.labels import KINDS as KINDS
from cvxupdate.fe.parameters import Parameter


@dataclass(frozen=True)
class Matrices:
    """Global matrices over the free DOFs, sparse (CSC), sharing one pattern: M q'' + C q' + (K + i
    D) q = f.

    ``beyond`` is what exact members add to Z(s) = K + iD + sC + s²M, which then is their Taylor
    series; None where there are none.
    """

    K: sp.csc_array
    M: sp.csc_array
    C: sp.csc_array
    D: sp.csc_array
    beyond: Beyond | None = None


@dataclass(frozen=True)
class DerivativeBlock:
    """Part of a parameter's derivative: free ``dofs`` (e, d), −1 where fixed, and dK, dM, dC, dD
    (e, d, d), None where zero."""

    dofs: Index
    K: Real | None
    M: Real | None
    C: Real | None
    D: Real | None


@dataclass(frozen=True)
class Model:
    """A structure.

    ``labels`` N names of the free DOFs ("n6.y"); ``node_ids``, ``xyz`` (nodes, 3) and ``dof_node``,
    ``dof_kind`` (N,) place them; ``modal_damping`` fractions of critical per mode (empty: none),
    used beside C where given, and the share of them that is ``hysteretic``; ``ties`` further names
    of free DOFs: ("n9.z", "n6.z") says that node 9 moves along z as node 6 does; ``families`` are
    the generic elements among the parameters.
    """

    labels: tuple[str, ...]
    node_ids: Index
    xyz: Real
    dof_node: Index
    dof_kind: Index
    blocks: tuple[Block, ...]
    parameters: tuple[Parameter, ...] = ()
    modal_damping: tuple[float, ...] = ()
    ties: tuple[tuple[str, str], ...] = ()
    families: tuple[FamilyUse, ...] = ()
    hysteretic: float = 0.0

    @property
    def size(self) -> int:
        """Number of free DOFs N."""
        return len(self.labels)

    @cached_property
    def place(self) -> Mapping[str, int]:
        """Label → place among the free DOFs; tied DOFs too."""
        own = {label: i for i, label in enumerate(self.labels)}
        return own | {tied: own[label] for tied, label in self.ties if label in own}

    def with_parameters(self, parameters: Sequence[Parameter]) -> Model:
        """The same structure with other parameters."""
        return replace(self, parameters=tuple(parameters))

    def zero(self) -> Real:
        """The parameter values of the model as it stands: zeros."""
        return np.zeros(len(self.parameters))

    def properties(self, p: ArrayLike | None = None) -> list[dict[str, Values]]:
        """Property values of every block at ``p``; complex where ``p`` is."""
        values = np.zeros(len(self.parameters)) if p is None else np.asarray(p)
        out: list[dict[str, Values]] = [dict(b.properties) for b in self.blocks]
        dtype, own = np.result_type(values, float), set()  # own: copied already
        for value, parameter in zip(values, self.parameters, strict=True):
            if value == 0.0 and not np.iscomplexobj(values):
                continue
            for t in parameter.targets:
                for name, scale in zip(t.properties, t.scales, strict=True):
                    if (t.block, name) not in own:
                        out[t.block][name] = out[t.block][name].astype(dtype)
                        own.add((t.block, name))
                    out[t.block][name][t.rows] += scale * value
        return out

    def matrices(self, p: ArrayLike | None = None) -> Matrices:
        """K, M, C, D at ``p`` (complex ``p`` gives complex matrices, for complex-step checks)."""
        props = self.properties(p)
        dtype = complex if p is not None and np.iscomplexobj(p) else float
        data = {m: np.zeros(len(self._pattern.indices), dtype=dtype) for m in "KMCD"}
        members = []
        for block, values, inverse in zip(self.blocks, props, self._pattern.inverse, strict=True):
            batches = block.combine(block.scalars(values))
            for matrix, batch in batches.items():
                flat = batch.reshape(-1)[inverse.keep]
                data[matrix] += _count(inverse.places, flat, len(data[matrix]))
            if block.exact is not None:
                members.append(Member(block, values, batches, inverse.keep, inverse.places))
        filled = {m: self._pattern.fill(d) for m, d in data.items()}
        if not members:
            return Matrices(**filled)
        beyond = Beyond(tuple(members), self._pattern.indices, self._pattern.indptr)
        return Matrices(**filled, beyond=beyond)

    @property
    def exact(self) -> bool:
        """Whether any element has a dynamic stiffness beyond its matrices."""
        return any(b.exact is not None for b in self.blocks)

    def derivative(
        self,
        j: int,
        p: ArrayLike | None = None,
        properties: list[dict[str, Values]] | None = None,
    ) -> tuple[DerivativeBlock, ...]:
        """Element blocks of ∂K, ∂M, ∂C, ∂D with respect to parameter ``j`` at ``p``, whose
        ``properties`` may be at hand."""
        return self._derivative(j, self.properties(p) if properties is None else properties)

    def derivatives(self, p: ArrayLike | None = None) -> tuple[tuple[DerivativeBlock, ...], ...]:
        """`derivative` for every parameter, the properties at ``p`` formed once."""
        props = self.properties(p)
        return tuple(self._derivative(j, props) for j in range(len(self.parameters)))

    def _derivative(self, j: int, props: list[dict[str, Values]]) -> tuple[DerivativeBlock, ...]:
        out = []
        for t in self.parameters[j].targets:
            block = self.blocks[t.block]
            d = block.derivative(props[t.block], t.rows, t.properties, t.scales)
            if d:
                out.append(
                    DerivativeBlock(
                        block.dofs[t.rows], d.get("K"), d.get("M"), d.get("C"), d.get("D")
                    )
                )
        return tuple(out)

    def total_mass(self, p: ArrayLike | None = None) -> float:
        """Mass in kg, supports included: what a translation carries, of each element along the
        first axis in which it has mass. Bases that move the structure are no part of it."""
        return float(
            sum(
                self._pushed(b, b.combine(b.scalars(v))["M"])
                for b, v in zip(self.blocks, self.properties(p), strict=True)
                if any(t.matrix == "M" for t in b.terms) and not b.is_base
            )
        )

    def mass_of(self, element: int) -> float:
        """Of one element, kg, likewise."""
        mass = 0.0
        for b, v in zip(self.blocks, self.properties(), strict=True):
            rows = np.flatnonzero(b.ids == element)
            if len(rows) and any(t.matrix == "M" for t in b.terms):
                mass += self._pushed(b, b.combine(b.scalars(v))["M"][rows], rows)
        return mass

    def mass_gradient(self, p: ArrayLike | None = None) -> Real:
        """d(total mass)/dp, (parameters,), kg."""
        props = self.properties(p)
        out = np.zeros(len(self.parameters))
        for j, parameter in enumerate(self.parameters):
            for t in parameter.targets:
                block = self.blocks[t.block]
                d = block.derivative(props[t.block], t.rows, t.properties, t.scales)
                if "M" in d:
                    out[j] += self._pushed(block, d["M"], t.rows)
        return out

    def _pushed(self, block: Block, masses: Real, rows: Index | None = None) -> float:
        """What element masses (e, d, d) oppose to a unit translation."""
        r = (block.direction == self._axis(block)).astype(float)
        if rows is not None and len(r) > 1:
            r = r[rows]
        return float(
            np.einsum("eij,ei,ej->", masses, *(np.broadcast_to(r, masses.shape[:2]),) * 2).real
        )

    def _axis(self, block: Block) -> int:
        """The first translation a block knows; given matrices hold the entries of one matrix in
        several blocks, so they go together."""
        given = block.kind.name == "matrix"
        alike = (
            [
                b
                for b in self.blocks
                if b.kind.name == "matrix" and any(t.matrix == "M" for t in b.terms)
            ]
            if given
            else [block]
        )
        first = min(int(b.direction.min()) for b in alike)
        return first if first < 3 else -1  # rotations alone carry no mass

    @cached_property
    def _pattern(self) -> _Pattern:
        return _pattern(self.blocks, self.size)


@dataclass(frozen=True)
class _Scatter:
    keep: NDArray[np.bool_]
    places: Index


@dataclass(frozen=True)
class _Pattern:
    """The shared sparsity pattern and where each entry of each block goes."""

    indices: Index
    indptr: Index
    inverse: tuple[_Scatter, ...]

    @cached_property
    def empty(self) -> sp.csc_array:
        """The pattern with nothing in it."""
        size = len(self.indptr) - 1
        return sp.csc_array(
            (np.zeros(len(self.indices)), self.indices, self.indptr), shape=(size, size)
        )

    def fill(self, data: NDArray[Any]) -> sp.csc_array:
        """With ``data``: a copy of what was checked once, since the check costs more than the
        matrices of a small model."""
        out = copy(self.empty)
        out.data = data
        return out


def _count(places: Index, values: NDArray[Any], length: int) -> NDArray[Any]:
    if np.iscomplexobj(values):
        return np.asarray(
            np.bincount(places, values.real, length) + 1j * np.bincount(places, values.imag, length)
        )
    return np.bincount(places, values, length)


def _pattern(blocks: Sequence[Block], size: int) -> _Pattern:
    if size == 0:
        raise ModelError(
            "the model has no free degree of freedom. Remove a support, or activate a DOF "
            "kind in model.dofs."
        )
    keys, keeps = [], []
    for b in blocks:
        i = np.broadcast_to(b.dofs[:, :, None], (*b.dofs.shape, b.dofs.shape[1])).reshape(-1)
        j = np.broadcast_to(b.dofs[:, None, :], (*b.dofs.shape, b.dofs.shape[1])).reshape(-1)
        keep = (i >= 0) & (j >= 0)
        keeps.append(keep)
        keys.append(j[keep] * size + i[keep])
    joined = np.concatenate(
        [*keys, np.arange(size, dtype=np.int64) * (size + 1)]
    )  # the diagonal is always there
    unique, inverse = np.unique(joined, return_inverse=True)
    indptr = np.searchsorted(unique, np.arange(size + 1, dtype=np.int64) * size)
    ends = np.cumsum([len(k) for k in keys])
    places = np.split(inverse, ends)[: len(keys)]
    return _Pattern(
        (unique % size).astype(np.int64),
        indptr.astype(np.int64),
        tuple(
            _Scatter(k, np.asarray(v, dtype=np.int64)) for k, v in zip(keeps, places, strict=True)
        ),
    )
