"""Forces to which a space of shapes is to have the static answers, and what these say besides the
shapes that are there."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model

SAME = 1e-8  # of a vector: what is left of it beside the others is rounding
TOLD = 1e-6  # of a vector: less of it beside the shapes is rounding, which scaling would make one
FEW = 12  # DOFs of a change up to which it acts along unit forces


def units(size: int, dofs: Index) -> Real:
    """A unit force at each of some DOFs, (size, n)."""
    out = np.zeros((size, len(dofs)))
    out[dofs, np.arange(len(dofs))] = 1.0
    return out


def pushes(
    model: Model, at: Real, moving: Sequence[int], near: Real
) -> tuple[Real, tuple[int, ...]]:
    """Forces (N, n) of parameters: unit ones where they act on few DOFs, else those on the modes
    ``near``; the numbers of these parameters."""
    size, out, wide = len(near), [np.zeros((len(near), 0))], []
    phi = np.vstack([near, np.zeros((1, near.shape[1]))])
    for j in moving:
        blocks = model.derivative(j, at)
        used = np.unique(np.concatenate([[-1], *(b.dofs.reshape(-1) for b in blocks)]))
        used = used[used >= 0].astype(np.int64)
        if len(used) <= min(FEW, near.shape[1]):
            out.append(units(size, used))
            continue
        wide.append(j)
        for name in ("K", "M"):
            force = np.zeros((size + 1, near.shape[1]))
            for b in blocks:
                part = b.K if name == "K" else b.M
                if part is not None:
                    np.add.at(force, b.dofs, part @ phi[b.dofs])
            if np.any(force[:size]):
                out.append(force[:size])
    return np.hstack(out), tuple(wide)


def loosened(model: Model, moving: Sequence[int], free: Index) -> tuple[int, ...]:
    """Those parameters that act on DOFs ``free`` alone, which were held: the compliances of what
    holds them now."""
    own = {
        j: [model.blocks[t.block].dofs[t.rows] for t in model.parameters[j].targets] for j in moving
    }
    return tuple(
        j for j, dofs in own.items() if dofs and all(np.all(np.isin(d, free)) for d in dofs)
    )


def independent(V: Real, more: Real, M: sp.csc_array) -> Real:
    """V, whose columns are orthonormal in M, and what more says besides, so too."""
    if not more.shape[1]:
        return V
    for least in (0.0, TOLD):  # twice is enough (Giraud, Langou and Rozložník 2005)
        norms = np.sqrt(np.maximum(np.einsum("ij,ij->j", more, M @ more), 0.0))
        seen = norms > least
        more = more[:, seen] / norms[seen]
        more = more - V @ (V.T @ (M @ more))
    moved = more.T @ (M @ more)
    values, vectors = np.linalg.eigh((moved + moved.T) / 2.0)
    kept = values > SAME
    return np.hstack([V, more @ (vectors[:, kept] / np.sqrt(values[kept]))])
