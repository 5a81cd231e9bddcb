"""The short list for tables of modes: what a word at a place explains at its best size, however large.

A support moves a mode by as much as it likes but its first derivative does not know that: to first order a roller shifts every frequency in proportion to
the deflection there, while a stiff one turns the deflection into a node. So words that act on few DOFs are taken at finite sizes, in the space of the
model's own modes (Ritz; Fox and Kapoor 1968 is the limit of a small size), and only the ordinary parameters are linearised.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy.linalg import LinAlgError, eigh
from scipy.optimize import linear_sum_assignment

from cvxupdate.diagnose.signals import Real
from cvxupdate.fe.block import Index
from cvxupdate.fe.modes import Modes
from cvxupdate.physics.base import Candidate
from cvxupdate.residual.modal import ModalPoint

BASIS = 48  # modes that span what a local change can do to the lowest ones
SIZES = 16  # tried on each side, in geometric progression


@dataclass(frozen=True)
class Effort:
    """``sizes`` tried on each side, ``finer`` ones between the neighbours of the best, in a basis of ``modes``."""

    sizes: int
    finer: int
    modes: int


FULL, QUICK = Effort(SIZES, 5, BASIS), Effort(6, 0, 20)
MANY = 150  # local candidates above which a quick pass chooses those that are looked at closely


@dataclass(frozen=True)
class Scene:
    """Where sizes are tried: ``point`` with the ordinary parameters linearised, ``Q`` (rows + parameters, parameters) orthonormal columns of what they and
    their priors explain, ``below`` the priors' residual, ``many`` modes of which the first are those of ``point``, ``used`` those that tables are paired with.

    ``values`` are rows of measured eigenvalues: (place in ``used``, (rad/s)², weight); ``shapes`` measured ones: (place, DOFs, entries, deviations).
    """

    Q: Real
    below: Real
    many: Modes
    used: Index
    values: tuple[tuple[int, float, float], ...]
    shapes: tuple[tuple[int, Index, Real, Real], ...]
    total: float

    def left(self, eigenvalues: Real, shapes: Real) -> float:
        """Squared weighted residual of other modes (those in ``used``, one by one; shapes (N, used)), freed of what the ordinary parameters can take up."""
        parts = [np.array([weight * (measured - eigenvalues[u]) for u, measured, weight in self.values])]
        for u, rows, x, std in self.shapes:
            phi, w = shapes[rows, u], 1.0 / std**2
            parts.append((x - phi * (np.sum(w * phi * x) / np.sum(w * phi**2))) / std)
        r = np.concatenate([*parts, self.below])
        r = r - self.Q @ (self.Q.T @ r)
        return float(r @ r)


@dataclass(frozen=True)
class Step:
    """A size tried: the squared residual left, the modes in the basis and where the paired ones went."""

    left: float
    size: float
    V: Real
    at: Index


def scene(point: ModalPoint, scales: Real, many: Modes) -> Scene:
    """Linearise the ordinary parameters, with priors of deviation ``scales``, at ``point``."""
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
                values.append((where[at], measured, float(t.frequency[i] / (2.0 * measured * t.frequency_std[i]))))
    shapes = [(where[at], rows, x, std) for _, _, at, rows, x, std in point._shape_rows()] if point.residual.shapes else []
    bare = Scene(Q, -point.p / scales, many, used, tuple(values), tuple(shapes), 0.0)
    return replace(bare, total=bare.left(point.modes.eigenvalues[used], point.modes.shapes[:, used]))


def local(c: Candidate) -> bool:
    """Whether the word is one parameter on a few DOFs, so that it may be large."""
    return c.extra == 1 and bool(c.place.nodes) and len(c.tangent) == 1 and c.grow is not None


def scan(where: Scene, candidates: Sequence[Candidate]) -> dict[int, tuple[float, float]]:
    """For each local candidate (by its number): (squared residual left, best size)."""
    which = [k for k, c in enumerate(candidates) if local(c)]
    out = {k: best_size(where, candidates[k], QUICK) for k in which} if len(which) > MANY else {}
    return out | {k: best_size(where, candidates[k], FULL) for k in (sorted(out, key=lambda k: out[k][0])[:MANY] if out else which)}


def best_size(where: Scene, c: Candidate, effort: Effort) -> tuple[float, float]:
    """(squared residual that is left, size) of a local word at the best of its sizes."""
    enough = max(where.many.rigid + effort.modes, int(where.used.max(initial=0)) + 7)  # margin for modes that cross
    basis = where.many.shapes[:, :enough]
    phi = np.vstack([basis, np.zeros((1, basis.shape[1]))])
    K, M = np.zeros((basis.shape[1],) * 2), np.zeros((basis.shape[1],) * 2)
    for b in c.tangent[0]:
        for part, into in ((b.K, K), (b.M, M)):
            if part is not None:
                at = phi[b.dofs]
                into += np.einsum("eiq,eij,ejr->qr", at, part, at, optimize=True)
    inverse = c.report[0][2] == "inverse"
    first = Step(np.inf, 0.0, np.eye(basis.shape[1]), where.used)
    best = (np.inf, 0.0)
    for side in _sides(c, effort.sizes):
        steps = [first, *_trace(where, basis, K, M, side, first, inverse)]
        k = int(np.argmin([s.left for s in steps]))
        if k == 0:
            continue
        ends = steps[k - 1].size or 0.3 * steps[k].size, steps[min(k + 1, len(steps) - 1)].size
        finer = np.sign(ends[0]) * np.geomspace(abs(ends[0]), abs(ends[1]), effort.finer + 2)[1:-1]
        for s in (steps[k], *_trace(where, basis, K, M, finer, steps[k - 1], inverse)):
            best = min(best, (s.left, s.size))
    return best


def _sides(c: Candidate, count: int) -> list[Real]:
    """Sizes from small to large, on each side that the word may take."""
    lower, upper = c.limits
    sides = [np.geomspace(1e-3, upper, count)] if upper > 1e-3 else []
    if lower < -1e-3 and c.sign <= 0:
        sides.append(-np.geomspace(1e-3, -lower, count))
    return sides


def _trace(where: Scene, basis: Real, K: Real, M: Real, sizes: Real, before: Step, inverse: bool) -> list[Step]:
    """Modes followed from size to size; ends where more mass is taken off than there is."""
    stiff, heavy = np.diag(where.many.eigenvalues[: basis.shape[1]]), np.eye(basis.shape[1])
    out: list[Step] = []
    for p in sizes:
        effective = p / (1.0 + p) if inverse else p  # a compliance in series with the stiffness of its surroundings
        mass = heavy + effective * M
        try:
            lam, V = eigh(stiff + effective * K, mass)
        except LinAlgError:
            break
        rows, columns = linear_sum_assignment((before.V[:, before.at].T @ mass @ V) ** 2, maximize=True)
        at = columns[np.argsort(rows)]
        left = where.left(lam[at], basis @ V[:, at] if where.shapes else basis[:, at])
        if not where.shapes:  # modes that veer change their shapes and keep their order: either may be what the table means
            left = min(left, where.left(lam[where.used], basis[:, where.used]))
        before = Step(left, float(p), V, at)
        out.append(before)
    return out
