"""∂Z/∂p between two sets of vectors, for all parameters at once: element blocks times the vectors'
rows, never a full matrix."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.block import Block, Index
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.parameters import P_VALUES

Field = NDArray[Any]
CHUNK = 4096  # elements at a time: the gathered rows stay in the cache
MANY = 4  # elements of a parameter from which it is worth a product of its own
ENTRIES = 400_000  # gathered entries of several lines at a time, for the same reason
HELD = 500_000  # complex entries of exact elements kept for lines to come (8 MB)


@dataclass(frozen=True)
class ExactChange:
    """∂Z of exact elements of one block: ``rows`` (e,) whose ``properties`` move by ``moves``."""

    block: Block
    properties: Mapping[str, Values]
    rows: Index
    moves: Mapping[str, Real]
    _held: dict[float, Field] = field(default_factory=dict, compare=False)

    def foresee(self, omega: Real) -> None:
        """Form ∂Z at lines to come together, where that is little enough to keep: a few elements
        take as long at a hundred lines as at one."""
        d = self.block.dofs.shape[1]
        if len(omega) * len(self.rows) * d * d <= HELD:
            every = self.at(omega, slice(None))
            self._held.update(zip(omega.tolist(), every, strict=True))

    def one(self, omega: float, some: slice) -> Field:
        """∂Z (e, d, d) at one line."""
        if omega in self._held:
            return np.asarray(self._held[omega][some])
        return np.asarray(self.at(np.array([omega]), some)[0])

    @property
    def damped(self) -> bool:
        """Whether anything of theirs takes out energy."""
        lossy = ("eta", "alpha", "beta")
        return any(np.any(self.properties[k] != 0.0) or k in self.moves for k in lossy)

    def at(self, omega: Real, some: slice) -> Field:
        """∂Z (f, e, d, d) at each of ω (f,) rad/s, real where nothing is damped."""
        moves = {k: v[some] for k, v in self.moves.items()}
        points = omega.astype(complex)
        out = self.block.dynamic_changes(points, self.properties, self.rows[some], moves)
        return out if self.damped else out.real


@dataclass(frozen=True)
class Part:
    """Elements of one size: ``dofs`` (e, d), the size of the model where fixed; ``column`` (e,)
    rising; dK, dM, dC, dD (e, d, d) or None."""

    dofs: Index
    column: Index
    K: Real | None
    M: Real | None
    C: Real | None
    D: Real | None
    exact: ExactChange | None = None

    @property
    def damped(self) -> bool:
        """Whether its derivative is complex."""
        lossy = self.exact is not None and self.exact.damped
        return lossy or self.C is not None or self.D is not None

    def stiffness(self, omega: float, some: slice) -> Field:
        """∂Z (e, d, d) of ``some`` elements at ω (rad/s)."""
        out: Field = np.zeros((1, 1, 1))
        if self.K is not None:
            out = self.K[some]
        if self.M is not None:
            out = out - omega**2 * self.M[some]
        if self.C is not None:
            out = out + 1j * omega * self.C[some]
        if self.D is not None:
            out = out + 1j * self.D[some]
        return out if self.exact is None else self.exact.one(omega, some)


@dataclass(frozen=True)
class Derivatives:
    """∂Z/∂p_j for ``count`` parameters, as element blocks."""

    parts: tuple[Part, ...]
    count: int

    @property
    def damped(self) -> bool:
        """Whether any derivative is complex."""
        return any(part.damped for part in self.parts)

    def foresee(self, omega: Real) -> None:
        """What `between` will be asked for at ``omega`` (f,) rad/s, formed together where that
        saves time."""
        for part in self.parts:
            if part.exact is not None:
                part.exact.foresee(omega)

    def between(self, omega: float, left: Field, right: Field) -> Field:
        """leftᵀ (∂Z/∂p_j) right for left (N, n) and right (N, r): (n, r, parameters)."""
        kind = np.result_type(left, right, complex if self.damped else float)
        out = np.zeros((self.count, left.shape[1], right.shape[1]), dtype=kind)
        left, right = (
            np.vstack([v, np.zeros((1, v.shape[1]), dtype=v.dtype)]) for v in (left, right)
        )
        for part in self.parts:
            for first in range(0, len(part.column), CHUNK):
                some = slice(first, first + CHUNK)
                dofs, column = part.dofs[some], part.column[some]
                push = part.stiffness(omega, some) @ right[dofs]
                each = left[dofs].transpose(0, 2, 1) @ push
                starts = np.flatnonzero(np.diff(column, prepend=-1))
                out[column[starts]] += np.add.reduceat(each, starts, axis=0)
        return np.moveaxis(out, 0, 2)

    def over_lines(self, omega: Real, X: Field, left: Index, right: Index) -> Field:
        """X[:, k, left]ᵀ (∂Z/∂p_j) X[:, k, right] at every line k: (f, n, r, parameters).

        ``omega`` (f,) rad/s; ``X`` (N + 1, f, k) with a last row of zeros, ``left`` (n,) and
        ``right`` (r,) among its k columns. The matrices of each element meet the fields of all
        lines in one product.
        """
        lines, n, r = len(omega), len(left), len(right)
        kind = np.result_type(X, complex if self.damped else float)
        out = np.zeros((self.count, lines, n, r), dtype=kind)
        square = (omega**2)[:, None]
        for part in self.parts:
            step = max(1, ENTRIES // (part.dofs.shape[1] * lines * X.shape[2]))
            for first in range(0, len(part.column), step):
                some = slice(first, first + step)
                local = X[part.dofs[some]]  # (e, d, f, k)
                driven = local[..., right]
                if part.exact is not None:
                    _add(
                        out,
                        part.column[some],
                        local[..., left],
                        _each_line(part.exact, omega, some, driven),
                    )
                    continue
                flat = driven.reshape(*driven.shape[:2], lines * r)
                push: Field = np.zeros((1, 1, 1, 1))
                if part.K is not None:
                    push = _times(part.K[some], flat).reshape(driven.shape)
                if part.M is not None:
                    push = push - square * _times(part.M[some], flat).reshape(driven.shape)
                if part.C is not None:
                    push = push + 1j * omega[:, None] * _times(part.C[some], flat).reshape(
                        driven.shape
                    )
                if part.D is not None:
                    push = push + 1j * _times(part.D[some], flat).reshape(driven.shape)
                _add(out, part.column[some], local[..., left], push)
        return np.moveaxis(out, 0, 3)


def _each_line(exact: ExactChange, omega: Real, some: slice, driven: Field) -> Field:
    """∂Z times the fields of every line, (e, d, f, r): matrices that differ from line to line, all
    formed together."""
    push = exact.at(omega, some) @ driven.transpose(2, 0, 1, 3)
    return np.asarray(push.transpose(1, 2, 0, 3))


def _add(out: Field, column: Index, left: Field, push: Field) -> None:
    """out[j] += Σ leftᵀ push over the elements of parameter j, line by line; ``left`` (e, d, f, n),
    ``push`` (e, d, f, r), ``column`` (e,) rising.

    Parameters of many elements take one product each, those of few are summed after a product for
    every element.
    """
    starts = np.flatnonzero(np.diff(column, prepend=-1))
    if len(column) < MANY * len(starts):
        each = left.transpose(0, 2, 3, 1) @ push.transpose(0, 2, 1, 3)
        out[column[starts]] += np.add.reduceat(each, starts, axis=0)
        return
    for first, last in zip(starts.tolist(), [*starts[1:].tolist(), len(column)], strict=True):
        a, b = (x[first:last].reshape(-1, *x.shape[2:]) for x in (left, push))
        out[column[first]] += a.transpose(1, 2, 0) @ b.transpose(1, 0, 2)


def _times(matrices: Real, fields: Field) -> Field:
    """Real (e, d, d) @ (e, d, k); complex fields as twice as many real columns."""
    if np.iscomplexobj(fields):
        pairs = np.ascontiguousarray(fields).view(float)
        return np.ascontiguousarray(matrices @ pairs).view(complex)
    return np.asarray(matrices @ fields)


def constant(model: Model) -> bool:
    """Whether the derivatives are the same at every p: nothing but p-values, each a factor on one
    matrix of its elements, and entries of element matrices."""
    linear = all(q.of in P_VALUES or q.of == "generic" for q in model.parameters)
    return linear and not model.exact


def derivatives(model: Model, p: Real) -> Derivatives:
    """The derivatives of ``model`` at ``p``, gathered by element size."""
    properties = model.properties(p)
    exact = [
        _exact(model, number, properties[number])
        for number, block in enumerate(model.blocks)
        if block.exact is not None
    ]
    found: dict[tuple[Any, ...], list[tuple[int, DerivativeBlock]]] = {}
    for j, parameter in enumerate(model.parameters):
        for t in parameter.targets:
            block = model.blocks[t.block]
            if block.exact is not None:
                continue
            d = block.derivative(properties[t.block], t.rows, t.properties, t.scales)
            if d:
                b = DerivativeBlock(
                    block.dofs[t.rows], d.get("K"), d.get("M"), d.get("C"), d.get("D")
                )
                key = (b.dofs.shape[1], *(getattr(b, m) is not None for m in "KMCD"))
                found.setdefault(key, []).append((j, b))
    return Derivatives(
        (*(_part(m, model.size) for m in found.values()), *(e for e in exact if len(e.column))),
        len(model.parameters),
    )


def _part(members: Sequence[tuple[int, DerivativeBlock]], size: int) -> Part:
    dofs = np.concatenate([b.dofs for _, b in members])
    column = np.concatenate([np.full(len(b.dofs), j, dtype=np.int64) for j, b in members])

    def joined(name: str) -> Real | None:
        return (
            np.concatenate([getattr(b, name) for _, b in members])
            if getattr(members[0][1], name) is not None
            else None
        )

    return Part(
        np.where(dofs < 0, size, dofs), column, joined("K"), joined("M"), joined("C"), joined("D")
    )


def _exact(model: Model, number: int, properties: Mapping[str, Values]) -> Part:
    """The exact elements of a block under every parameter that moves them: one part, so that a line
    takes one evaluation."""
    block = model.blocks[number]
    targets = [
        (j, t) for j, q in enumerate(model.parameters) for t in q.targets if t.block == number
    ]
    none = np.zeros(0, dtype=np.int64)
    rows = np.concatenate([none, *(t.rows for _, t in targets)])
    column = np.concatenate([none, *(np.full(len(t.rows), j) for j, t in targets)])
    moves: dict[str, Real] = {}
    first = 0
    for _, t in targets:
        for name, scale in zip(t.properties, t.scales, strict=True):
            moves.setdefault(name, np.zeros(len(rows)))[first : first + len(t.rows)] += scale
        first += len(t.rows)
    dofs = block.dofs[rows]
    change = ExactChange(block, properties, rows, moves)
    return Part(np.where(dofs < 0, model.size, dofs), column, None, None, None, None, change)
