"""Changes of the parameters that change no matrix of the model, whatever is recorded.

An element's K, M, C and D are few scalars of its properties: E, G and rho × t with A, I and J ÷ t
leave a beam as it was; the K of a plate sees E h³ and nu, its M rho h (thesis 8.2, 8.4). What
recordings cannot tell apart besides is a matter of the recordings (`update.covariance`); this is of
the model alone, so it is said of each element or group in one sentence.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
from scipy.sparse.csgraph import connected_components

from cvxupdate.fe.block import STEP
from cvxupdate.fe.elements.base import Values
from cvxupdate.fe.model import Model
from cvxupdate.system import Array

NOTHING = 1e-10
"""Of the largest scalar change: below, a change is none."""
LARGEST = 400
"""Parameters that hang together at most: beyond, the null space says nothing readable."""


@dataclass(frozen=True)
class Invisible:
    """``direction`` (n,) of p along which no matrix of the model changes, to first order at p;
    ``says`` it in words."""

    direction: Array
    says: str


def invisible(model: Model, p: Array) -> tuple[Invisible, ...]:
    """A basis of the changes of p that no recording of any kind can see, each of as few parameters
    as may be.

    Only parameters that move the same elements can trade so; ``p`` (n,) is where the scalars are
    differentiated.
    """
    properties = model.properties(p)
    out: list[Invisible] = []
    for members in _together(model):
        if len(members) < 2 or len(members) > LARGEST:
            continue
        changes = {j: _changes(model, j, properties) for j in members}
        keys = sorted({key for change in changes.values() for key in change})
        place = {key: i for i, key in enumerate(keys)}
        J = np.zeros((len(keys), len(members)))
        for column, j in enumerate(members):
            for key, value in changes[j].items():
                J[place[key], column] = value
        for direction in _sparse_null(J):
            full = np.zeros(len(model.parameters))
            full[members] = direction
            out.append(Invisible(full, _says(model, full, p)))
    return tuple(out)


def _changes(
    model: Model, j: int, properties: Sequence[Mapping[str, Values]]
) -> dict[tuple[int, int, str, int], float]:
    """d(scalar)/dp_j relative to the scalar's size, by (block, row, matrix, term)."""
    out: dict[tuple[int, int, str, int], float] = {}
    for t in model.parameters[j].targets:
        block = model.blocks[t.block]
        local: dict[str, Values] = {
            k: v[t.rows].astype(complex) for k, v in properties[t.block].items()
        }
        for name, scale in zip(t.properties, t.scales, strict=True):
            local[name] = local[name] + 1j * STEP * scale
        for matrix, term, factor in block.scalars(local):
            size = np.abs(np.real(factor))
            change = np.imag(factor) / STEP / np.where(size == 0.0, 1.0, size)
            for row, value in zip(t.rows.tolist(), change.tolist(), strict=True):
                if value != 0.0:
                    out[t.block, row, matrix, term] = value
    return out


def _together(model: Model) -> list[list[int]]:
    """Parameters by the elements that they share."""
    elements: dict[tuple[int, int], int] = {}
    rows, columns = [], []
    for j, parameter in enumerate(model.parameters):
        for t in parameter.targets:
            for row in t.rows.tolist():
                rows.append(j)
                columns.append(elements.setdefault((t.block, row), len(elements)))
    n = len(model.parameters)
    shared = sp.csr_array((np.ones(len(rows)), (rows, columns)), shape=(n, max(len(elements), 1)))
    count, label = connected_components(shared @ shared.T, directed=False)
    return [np.flatnonzero(label == c).tolist() for c in range(count)]


def _sparse_null(J: Array) -> Array:
    """The null space of J (m, n) as rows in reduced echelon form, which keeps each to the
    parameters that it needs; the smallest part of each is 1 or −1."""
    size = np.abs(J).max(initial=0.0)
    null = la.null_space(J, rcond=NOTHING).T if size > 0.0 else np.eye(J.shape[1])
    rows = np.array(null)
    for i in range(len(rows)):
        rest = np.abs(rows[i:])
        free = [c for c in range(rows.shape[1]) if rest[:, c].max() > 1e-8]
        pivot = free[0]
        best = i + int(np.argmax(rest[:, pivot]))
        rows[[i, best]] = rows[[best, i]]
        rows[i] /= rows[i, pivot]
        others = np.arange(len(rows)) != i
        rows[others] -= rows[others, pivot][:, None] * rows[i]
    rows[np.abs(rows) < 1e-8] = 0.0
    for row in rows:
        row /= np.abs(row[row != 0.0]).min()
    return rows


def _says(model: Model, direction: Array, p: Array) -> str:
    """The sentence: powers of one factor t where every parameter multiplies its property."""
    moved = np.flatnonzero(direction).tolist()
    # a part of p that is a factor 1 + p changes by d(1 + p)/(1 + p)
    powers = direction[moved] / (1.0 + p[moved])
    powers = powers / np.abs(powers).min()
    names = [model.parameters[j].name for j in moved]
    whole = np.abs(2.0 * powers - np.round(2.0 * powers)).max() < 1e-6
    if whole and all(model.parameters[j].nominal != 0.0 or _factor(model, j) for j in moved):
        up = [_power(n, "×", k) for n, k in zip(names, powers, strict=True) if k > 0]
        down = [_power(n, "÷", -k) for n, k in zip(names, powers, strict=True) if k < 0]
        change = _list(up + down)
    else:
        change = _list([f"{n} {d:+.3g}" for n, d in zip(names, direction[moved], strict=True)])
    return (
        f"{change} change no matrix of the model: no recording of any kind can tell, so only "
        "what this leaves alone is determined"
    )


def _factor(model: Model, j: int) -> bool:
    """Whether parameter j is a factor 1 + p on what it moves."""
    return model.parameters[j].of in ("stiffness", "mass", "damping")


def _power(name: str, sign: str, power: float) -> str:
    exponent = {1.0: "", 2.0: "²", 3.0: "³"}.get(round(2.0 * power) / 2.0, f"^{power:.3g}")
    return f"{name} {sign} t{exponent}"


def _list(names: Sequence[str]) -> str:
    return names[0] if len(names) == 1 else ", ".join(names[:-1]) + " and " + names[-1]
