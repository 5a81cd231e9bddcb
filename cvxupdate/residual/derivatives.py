"""Derivatives of K and M with respect to all parameters of a model at once, and what modes need of
them.

Element matrices are sums of constant terms with scalar factors, so every derivative that a mode
needs is a bilinear form of those terms, computed once for all parameters, times derivatives of
factors. No element matrix is formed for any parameter, and none of size N × N. Where the parameters
are factors the derivatives are the same everywhere: then they are stacked once as sparse rows.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.block import STEP, Block
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import Model
from cvxupdate.residual.shape_rows import Index

CHUNK = 2_000_000  # numbers held at once for the forms of one term


@dataclass(frozen=True)
class TermDerivative:
    """One term of one block: d(factor)/dp_j = ``factors`` of the elements ``rows``, parameter after
    parameter as ``parameters`` (entries,) says."""

    block: Block
    matrix: str
    term: int
    rows: Index
    parameters: Index
    factors: Real


@dataclass(frozen=True)
class Derivatives:
    """∂K/∂p and ∂M/∂p of a model at one point for all ``count`` parameters, as factors of the
    elements' constant terms; ``stack`` the same as sparse rows, where they are worth assembling."""

    count: int
    terms: tuple[TermDerivative, ...]
    stack: Mapping[str, Stack] | None = None


@dataclass(frozen=True)
class Stack:
    """∂A/∂p_j of one matrix A for all parameters as sparse ``rows`` (r, N), those of each parameter
    together; row i belongs to the DOF ``dof[i]`` and to parameter ``parameter[i]``, rising."""

    rows: sp.csr_array
    dof: Index
    parameter: Index

    def forms(self, left: Real, right: Real, count: int) -> Real:
        """l_cᵀ ∂A/∂p_j r_c, (count, columns)."""
        out = np.zeros((count, max(left.shape[1], right.shape[1])))
        if len(self.dof):
            energy = left[self.dof] * (self.rows @ right)
            first = np.flatnonzero(np.diff(self.parameter, prepend=-1))
            out[self.parameter[first]] = np.add.reduceat(energy, first, axis=0)
        return out

    def pushes(self, shape: Real, count: int) -> Real:
        """∂A/∂p_j φ, (N, count)."""
        out = np.zeros((len(shape), count))
        out[self.dof, self.parameter] = self.rows @ shape
        return out


def stacked(derivatives: Derivatives, size: int) -> Derivatives:
    """The same, its matrices assembled as sparse rows: worth it where they serve at every point
    (``size`` DOFs)."""
    parts: dict[str, list[tuple[Index, Index, Real]]] = {"K": [], "M": []}
    for t in derivatives.terms:
        values = t.block.terms[t.term].values
        matrix = values[:1] if len(values) == 1 else values[t.block.geometry[t.rows]]
        data = t.factors[:, None, None] * matrix
        dofs = t.block.dofs[t.rows]
        row = np.broadcast_to(dofs[:, :, None], data.shape).reshape(-1)
        column = np.broadcast_to(dofs[:, None, :], data.shape).reshape(-1)
        owner = np.broadcast_to(t.parameters[:, None, None], data.shape).reshape(-1)
        flat = data.reshape(-1)
        ok = (row >= 0) & (column >= 0) & (flat != 0.0)
        parts[t.matrix].append((owner[ok] * size + row[ok], column[ok], flat[ok]))
    return replace(
        derivatives, stack={name: _stack(members, size) for name, members in parts.items()}
    )


def _stack(members: Sequence[tuple[Index, Index, Real]], size: int) -> Stack:
    none = np.zeros(0, dtype=np.int64)
    key = np.concatenate([none, *(k for k, _, _ in members)])
    column = np.concatenate([none, *(c for _, c, _ in members)])
    data = np.concatenate([np.zeros(0), *(d for _, _, d in members)])
    unique, place = np.unique(key, return_inverse=True)
    rows = sp.csr_array(sp.coo_array((data, (place, column)), shape=(len(unique), size)))
    return Stack(rows, unique % size, unique // size)


def derivatives_of(model: Model, p: Real) -> Derivatives:
    """Derivatives at ``p`` (n,), by complex step on the factors (exact to rounding); parameters
    that move the same property go together."""
    properties = model.properties(p)
    together: dict[tuple[int, tuple[str, ...]], list[tuple[int, Index, Real]]] = {}
    for j, parameter in enumerate(model.parameters):
        for t in parameter.targets:
            together.setdefault((t.block, t.properties), []).append((j, t.rows, t.scales))
    out = []
    for (number, names), members in together.items():
        block = model.blocks[number]
        rows = np.concatenate([r for _, r, _ in members])
        owner = np.concatenate([np.full(len(r), j, dtype=np.int64) for j, r, _ in members])
        scales = np.concatenate([s for _, _, s in members], axis=1)
        local: dict[str, Values] = {
            k: v[rows].astype(complex) for k, v in properties[number].items()
        }
        for name, scale in zip(names, scales, strict=True):
            local[name] = local[name] + 1j * STEP * scale
        for matrix, i, factor in block.scalars(local):
            change = np.imag(factor) / STEP
            live = change != 0.0
            if matrix in "KM" and np.any(live):
                out.append(TermDerivative(block, matrix, i, rows[live], owner[live], change[live]))
    return Derivatives(len(model.parameters), tuple(out))


def padded(shapes: Real) -> Real:
    """Shapes with a row of zeros at the end, so that the place −1 of a held DOF reads 0."""
    return np.vstack([shapes, np.zeros((1, shapes.shape[1]))])


def forms(left: Real, right: Real, derivatives: Derivatives) -> tuple[Real, Real]:
    """l_cᵀ ∂K/∂p_j r_c and l_cᵀ ∂M/∂p_j r_c, each (columns, parameters), of the columns of ``left``
    and ``right`` (N, columns) or (N, 1)."""
    if derivatives.stack is not None:
        K, M = (derivatives.stack[x].forms(left, right, derivatives.count) for x in "KM")
        return K.T, M.T
    l, r = padded(left), padded(right)
    columns = max(l.shape[1], r.shape[1])
    out = {"K": np.zeros((derivatives.count, columns)), "M": np.zeros((derivatives.count, columns))}
    for t in derivatives.terms:
        values = t.block.terms[t.term].values
        step = max(1, CHUNK // (values.shape[1] * columns))
        for first in range(0, len(t.rows), step):
            part = slice(first, first + step)
            dofs = t.block.dofs[t.rows[part]]
            matrix = values[0] if len(values) == 1 else values[t.block.geometry[t.rows[part]]]
            energy = np.einsum(
                "edc,edc->ec",
                np.broadcast_to(l[dofs], (*dofs.shape, columns)),
                np.broadcast_to(matrix @ r[dofs], (*dofs.shape, columns)),
            )
            np.add.at(out[t.matrix], t.parameters[part], t.factors[part, None] * energy)
    return out["K"].T, out["M"].T


def pushes(shape: Real, derivatives: Derivatives) -> tuple[Real, Real]:
    """∂K/∂p_j φ and ∂M/∂p_j φ, each (N, parameters)."""
    N = len(shape)
    if derivatives.stack is not None:
        K, M = (derivatives.stack[x].pushes(shape, derivatives.count) for x in "KM")
        return K, M
    r = np.append(shape, 0.0)
    out = {name: np.zeros((N + 1, derivatives.count)) for name in "KM"}
    for t in derivatives.terms:
        values = t.block.terms[t.term].values
        dofs = t.block.dofs[t.rows]
        matrix = values[0] if len(values) == 1 else values[t.block.geometry[t.rows]]
        push = t.factors[:, None] * (matrix @ r[dofs][..., None])[..., 0]
        where = np.where(dofs < 0, N, dofs)
        np.add.at(out[t.matrix], (where, t.parameters[:, None]), push)
    return out["K"][:N], out["M"][:N]
