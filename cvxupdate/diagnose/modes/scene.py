"""Where sizes of local effects are tried: nuisance parameters linearised, modes as a basis."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.settings import SHAPES_OFF
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import Matrices
from cvxupdate.fe.modes import Modes, natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.residual.another_pairing import shape_distances
from cvxupdate.residual.modal import ModalPoint


def assigned(likeness: Real) -> Index:
    """The assignment of largest sum in each of ``likeness`` (n, used, modes): (n, used)."""
    at = np.argmax(likeness, axis=2)
    twice = np.any(np.diff(np.sort(at, axis=1), axis=1) == 0, axis=1)
    for k in np.flatnonzero(twice):  # where each has its own best, that is it
        rows, columns = linear_sum_assignment(likeness[k], maximize=True)
        at[k] = columns[np.argsort(rows)]
    return at


@dataclass(frozen=True)
class Scene:
    """Where sizes are tried: ``point`` with the nuisance parameters linearised, ``Q`` (rows +
    parameters, parameters) orthonormal columns of what they and their priors explain, ``below`` the
    priors' residual, ``matrices`` and ``many`` modes of which the first are those of ``point``,
    ``used`` those that tables are paired with.

    ``values`` are rows of measured eigenvalues: (place in ``used``, (rad/s)², weight); ``shapes``
    measured ones: (place, DOFs, entries, deviations). ``A``: weighted derivatives by the nuisance
    parameters, (rows, parameters), with prior deviations ``scales``.
    """

    Q: Real
    below: Real
    matrices: Matrices
    many: Modes
    used: Index
    values: tuple[tuple[int, float, float], ...]
    shapes: tuple[tuple[int, Index, Real, Real], ...]
    total: float
    A: Real
    scales: Real

    def held(self, count: int) -> Scene:
        """With all but the first ``count`` parameters as they are."""
        A, scales = self.A[:, :count], self.scales[:count]
        Q, _ = np.linalg.qr(np.vstack([A, np.diag(1.0 / scales)]))
        return replace(self, Q=Q, below=self.below[:count], A=A, scales=scales)

    def softened(self, level: float) -> Scene:
        """As tables would have it whose frequencies are known to no better than ``level``
        (relative), and shapes to no better than `SHAPES_OFF` times that: valleys are as wide."""
        values, factors = [], []
        for place, measured, weight in self.values:
            own = 0.5 / (measured * weight)
            values.append((place, measured, 0.5 / (measured * float(np.hypot(own, level)))))
            factors.append(np.array([own / np.hypot(own, level)]))
        shapes = []
        for place, rows, x, std in self.shapes:
            wide = np.hypot(std, SHAPES_OFF * level * np.max(np.abs(x), initial=0.0))
            shapes.append((place, rows, x, wide))
            factors.append(std / wide)
        by = np.concatenate([np.zeros(0), *factors])[:, None]
        Q, _ = np.linalg.qr(np.vstack([by * self.A, np.diag(1.0 / self.scales)]))
        return replace(self, Q=Q, values=tuple(values), shapes=tuple(shapes))

    def left(self, eigenvalues: Real, entries: Sequence[Real]) -> Real:
        """Squared weighted residuals (n,) of n sets of other modes, freed of what the nuisance
        parameters can take up: ``eigenvalues`` (n, used) of those in ``used``, one by one, and for
        each of ``shapes`` the ``entries`` (n, DOFs) that the model has there."""
        places, measured, weights = (np.array([v[k] for v in self.values]) for k in range(3))
        parts = [weights * (measured - eigenvalues[:, places.astype(np.int64)])]
        for phi, (_, _, x, std) in zip(entries, self.shapes, strict=True):
            w = 1.0 / std**2
            size = np.maximum(np.sum(w * phi**2, axis=1), np.finfo(float).tiny)
            scale = np.sum(w * phi * x, axis=1) / size
            parts.append((x - phi * scale[:, None]) / std)
        r = np.hstack([*parts, np.broadcast_to(self.below, (len(eigenvalues), len(self.below)))])
        r = r - (r @ self.Q) @ self.Q.T
        return np.asarray(np.einsum("ij,ij->i", r, r))

    def nearest(self, at: Index, eigenvalues: Real, V: Real, tails: Sequence[Real]) -> Index:
        """Which of other modes the measured ones are, (n, used), by least weighted squares of
        eigenvalues (n, modes) and shapes ``V`` (n, basis, modes) in the basis of `mixed`; ``at``
        where nothing is measured."""
        cost = np.zeros((*at.shape, eigenvalues.shape[1]))
        for u, measured, weight in self.values:
            cost[:, u] += (weight * (eigenvalues - measured)) ** 2
        for (u, rows, x, std), tail in zip(self.shapes, tails, strict=True):
            q = V.shape[1] - tail.shape[2]
            phi = self.many.shapes[rows, :q] @ V[:, :q] + tail @ V[:, q:]
            cost[:, u] += shape_distances(phi, x, std)
        told = sorted({u for u, _, _ in self.values})
        out = at.copy()
        out[:, told] = assigned(-cost[:, told])
        return out

    def mixed(self, V: Real, tails: Sequence[Real]) -> list[Real]:
        """The entries of `left` of modes (n, basis, used) given in the basis of the first of
        ``many`` and of further shapes, whose entries ``tails`` (n, DOFs, r) are at each shape."""
        out = []
        for (u, rows, _, _), tail in zip(self.shapes, tails, strict=True):
            q = V.shape[1] - tail.shape[2]
            further = np.einsum("nr,nkr->nk", V[:, q:, u], tail)
            out.append(V[:, :q, u] @ self.many.shapes[rows, :q].T + further)
        return out


def scene_of(nominal: Fit, least: int) -> Scene:
    """A fit in the space of its model's own modes, ``least`` of them where there are as many."""
    at, model = nominal.point.matrices, nominal.setting.model
    count = min(model.size, max(least, len(nominal.point.modes.eigenvalues)))
    many = natural_modes(at.K, at.M, count, rigid_body_modes(model, at.K, at.M))
    return scene(nominal.point, nominal.setting.scales, many)


def scene(point: ModalPoint, scales: Real, many: Modes) -> Scene:
    """Linearise the nuisance parameters, with priors of deviation ``scales``, at ``point``."""
    A, _ = point.system().weighted()
    Q, _ = np.linalg.qr(np.vstack([A, np.diag(1.0 / scales)]))
    used = np.unique(np.concatenate([p for p in point.places]))
    used = used[used >= 0]
    where = {int(i): u for u, i in enumerate(used)}
    values = []
    for k, t in enumerate(point.residual.fit):
        for i, at in enumerate(point.places[k].tolist()):
            if at >= 0:
                measured = (2.0 * np.pi * float(t.frequency[i])) ** 2
                values.append(
                    (
                        where[at],
                        measured,
                        float(t.frequency[i] / (2.0 * measured * t.frequency_std[i])),
                    )
                )
    shapes = (
        [(where[at], rows, x, std) for _, _, at, rows, x, std in point.shape_rows()]
        if point.residual.shapes
        else []
    )
    bare = Scene(
        Q,
        -point.p / scales,
        point.matrices,
        many,
        used,
        tuple(values),
        tuple(shapes),
        0.0,
        np.asarray(A),
        scales,
    )
    entries = [point.modes.shapes[rows, used[u]][None] for u, rows, _, _ in shapes]
    return replace(bare, total=float(bare.left(point.modes.eigenvalues[used][None], entries)[0]))
