"""A space of shapes in which a model that moves with its parameters has its modes: what is computed
there does not grow with the model.

The modes of the model as it stands up to a multiple of the band; the static answers to forces at
chosen DOFs (residual attachment modes: Craig and Bampton 1968), where local changes act and sensors
hear; and of parameters on many DOFs the static answers to the forces that they make of the modes in
the band. Modes at other values are Ritz's: errors of shapes of first order are of second order in
eigenvalues.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factor, factorise
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, natural_modes
from cvxupdate.fe.recent import recent
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.fe.synthesis.projected import Projected, grown, projected
from cvxupdate.fe.synthesis.ritz import ritz
from cvxupdate.fe.synthesis.shapes import Found

BEYOND = 2.5  # modes are taken up to this many times the band
SHIFT = 0.05  # of the lowest flexible eigenvalue, by which a free structure has a static answer
SAME = 1e-8  # of a vector: what is left of it beside the others is rounding
TOLD = 1e-6  # of a vector: less of it beside the shapes is rounding, which scaling would make one
WHOLE = 100  # DOFs up to which every mode is taken
REST = 1e-12  # of the highest eigenvalue found: a motion that is hardly resisted
STILL = 1e-9  # of the lowest flexible eigenvalue: a motion that is not resisted
SPARE = 4  # modes more than are wanted that an inverse iteration carries: the last are least exact
FEW = 12  # DOFs of a change up to which it acts along unit forces


@dataclass(frozen=True)
class Space:
    """Shapes ``V`` (N, r) of a ``model`` around the parameter values ``at``; ``still``: eigenvalues
    below are none; ``wide`` the parameters that act on many DOFs; by which ``shift`` its stiffness
    has factors (None: it has every shape and needs none), and how many shapes are modes in the band
    (``near``), for `grown`; ``top`` (Hz) of the band, ``ports`` and parameters ``moving`` that it
    was made for, for `recentred`; ``root``: the space that it grew from, whose shapes are its first
    ones."""

    model: Model = field(repr=False)
    at: Real = field(repr=False)
    V: Real = field(repr=False)
    still: float
    wide: tuple[int, ...] = ()
    shift: float | None = None
    near: int = 0
    top: float = 0.0
    ports: Index = field(default_factory=lambda: np.zeros(0, dtype=np.int64), repr=False)
    moving: tuple[int, ...] = ()
    root: Space | None = field(default=None, repr=False)

    @recent
    def projected(self) -> Projected:
        """The model's matrices among the shapes, as parameters move."""
        root = self.root
        found = None if root is None else grown(root.projected, root.model, self.model, self.V)
        return projected(self.model, self.V) if found is None else found

    @cached_property
    def _factor(self) -> Factor:
        """Worked out where it is asked for: of most spaces of a search it is not, and it cannot be
        sent to another process."""
        m = self.model.matrices(self.at)
        return factorise(sp.csc_array(m.K + (self.shift or 0.0) * m.M), "the stiffness")

    @property
    def answered(self) -> tuple[int, ...]:
        """DOFs to a force at which its modes have the static answer."""
        return tuple(int(d) for d in self.ports)

    def far(self, p: Real, limit: float) -> bool:
        """Whether a parameter on many DOFs is further than that from where it was made."""
        wide = list(self.wide)
        return bool(np.any(np.abs(p[wide] - self.at[wide]) > limit))

    def grown(self, model: Model, moving: Sequence[int]) -> Space | None:
        """That of a model which is this one with further parameters, zero today, and hidden
        masses, from these shapes; None where it is another structure."""
        size, r = self.model.size, self.V.shape[1]
        extra = model.labels[size:]
        if self.shift is None or model.labels[:size] != self.model.labels:
            return None
        if any("@hidden" not in x for x in extra):
            return None
        M = model.matrices(model.zero()).M
        V = np.zeros((model.size, r + len(extra)))
        V[:size, :r] = self.V
        V[size:, r:] = np.diag(1.0 / np.sqrt(M.diagonal()[size:]))
        # what the old parameters do is among the shapes
        fresh = [j for j in moving if j >= len(self.model.parameters)]
        forces, wide = _pushes(model, model.zero(), fresh, V[:, : self.near])
        answers = np.zeros(forces.shape)
        answers[:size] = self._factor.solve(forces[:size])
        return replace(
            self,
            model=model,
            at=model.zero(),
            V=_independent(V, answers, M),
            wide=(*self.wide, *wide),
            moving=tuple(moving),
            root=self,
        )

    def recentred(self, at: Real) -> Space:
        """Around other values: its Ritz modes there, improved by one step of inverse iteration on
        all of them (Bathe 1996, 11.6), with the static answers anew. Lanczos's way to the same
        modes takes four times as long.

        Raises
        ------
        ModelError
            Where the model is no structure.
        """
        if self.shift is None and self.V.shape[1] >= self.model.size:
            return space_of(self.model, at, self.top, self.ports, self.moving)
        m, old = self.model.matrices(at), self.modes(at).modes
        values = old.eigenvalues
        wanted = int(np.sum(values <= (2.0 * np.pi * BEYOND * self.top) ** 2)) + SPARE
        lowest = float(values[old.rigid]) if old.rigid < len(values) else 1.0
        shift = SHIFT * lowest if old.rigid else 0.0
        factor = factorise(sp.csc_array(m.K + shift * m.M), "the stiffness")
        V = factor.solve(m.M @ old.shapes[:, :wanted])
        improved = ritz(V / np.linalg.norm(V, axis=0), m.K, m.M)
        if improved is None:  # sought anew
            return space_of(self.model, at, self.top, self.ports, self.moving)
        near = int(np.sum(values <= (2.0 * np.pi * 1.25 * self.top) ** 2)) + 1
        bare = replace(self, near=near, still=STILL * lowest, shift=shift, root=None)
        return _with_answers(bare, np.asarray(at, dtype=float), improved, m.M, factor)

    def matrices(self, p: Real) -> dict[str, Real]:
        """K, M, C and D at ``p``, (r, r) each."""
        return self.projected.matrices(self.model, p)

    def lowest(self) -> Real:
        """Frequencies (Hz) of its flexible modes at today's model."""
        return np.asarray(self.modes(self.model.zero()).modes.flexible().frequencies)

    def modes(self, p: Real) -> Found:
        """Every mode of the space at ``p``.

        Raises
        ------
        ModelError
            Where a mass is negative: no structure.
        """
        m = self.matrices(p)
        try:
            values, X = la.eigh(m["K"], m["M"], check_finite=False)
        except la.LinAlgError as error:
            raise ModelError(
                "the mass matrix has a negative eigenvalue. A mass parameter has gone too far: "
                "set its lower bound."
            ) from error
        quiet = np.abs(values) <= self.still
        order = np.argsort(~quiet, kind="stable")
        values, X, rigid = values[order], X[:, order], int(quiet.sum())
        values = np.where(quiet[order], 0.0, values)
        return Found(Modes(values, self.V @ X, rigid), X, m)


def space_of(model: Model, at: Real, top: float, ports: Index, moving: Sequence[int]) -> Space:
    """Around a model ``at`` parameter values: its modes up to `BEYOND` times ``top`` (Hz), the
    static answers at ``ports``, and for the parameters ``moving`` (numbers) those to what they make
    of the modes up to ``top``.

    Raises
    ------
    ModelError
        Where the model is no structure.
    """
    m = model.matrices(at)
    rigid = rigid_body_modes(model, m.K, m.M)
    modes = _modes(m.K, m.M, BEYOND * top, rigid)
    values = modes.eigenvalues
    resisted = values[values > REST * values.max(initial=0.0)]
    lowest = float(resisted[0]) if len(resisted) else 1.0
    near = modes.rigid + int(np.sum(modes.flexible().frequencies < 1.25 * top)) + 1
    at, V = np.asarray(at, dtype=float), modes.shapes
    bare = Space(model, at, V, STILL * lowest, (), None, near, top, ports, tuple(moving))
    if V.shape[1] >= model.size:
        return bare
    shift = SHIFT * lowest if len(resisted) < len(values) else 0.0
    factor = factorise(sp.csc_array(m.K + shift * m.M), "the stiffness")
    return _with_answers(replace(bare, shift=shift), at, V, m.M, factor)


def _with_answers(bare: Space, at: Real, V: Real, M: sp.csc_array, factor: Factor) -> Space:
    """Modes V, orthonormal in M, with the static answers that a space was asked for."""
    forces, wide = _pushes(bare.model, at, bare.moving, V[:, : bare.near])
    answers = factor.solve(np.hstack([_units(bare.model.size, bare.ports), forces]))
    V = _independent(V, answers, M)
    return replace(bare, at=at, V=V, wide=wide)


def _modes(K: sp.csc_array, M: sp.csc_array, top: float, rigid: Real) -> Modes:
    count = K.shape[0] if K.shape[0] <= WHOLE else 40
    while True:
        modes = natural_modes(K, M, min(count, K.shape[0]), rigid)
        if count >= K.shape[0] or (len(modes.frequencies) and modes.frequencies[-1] > top):
            return modes
        count *= 2


def _units(size: int, dofs: Index) -> Real:
    out = np.zeros((size, len(dofs)))
    out[dofs, np.arange(len(dofs))] = 1.0
    return out


def _pushes(
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
            out.append(_units(size, used))
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


def _independent(V: Real, more: Real, M: sp.csc_array) -> Real:
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
