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
from functools import cached_property, partial
from itertools import chain, islice

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.columns import stiffness_columns
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.factor import Factor, factorise
from cvxupdate.fe.model import DerivativeBlock, Matrices, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.recent import recent
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.fe.synthesis.attachment import independent, loosened, pushes, units
from cvxupdate.fe.synthesis.derivatives import Among, wide
from cvxupdate.fe.synthesis.parts import Projected
from cvxupdate.fe.synthesis.projected import alike, grown, projected
from cvxupdate.fe.synthesis.ritz import modes_up_to, ritz
from cvxupdate.fe.synthesis.shapes import Found

BEYOND = 2.5  # modes are taken up to this many times the band
SHIFT = 0.05  # of the lowest flexible eigenvalue, by which a free structure has a static answer
REST = 1e-12  # of the highest eigenvalue found: a motion that is hardly resisted
ROUNDING = 16.0 * float(np.finfo(float).eps)  # of the highest eigenvalue of a space
STILL = 1e-9  # of the lowest flexible eigenvalue: a motion that is not resisted
SPARE = 4  # modes more than are wanted that an inverse iteration carries: the last are least exact
HIDDEN = "@hidden"  # in the label of a DOF that no node of the file has
KNOWN = 2  # values of the parameters of which the modes are kept


@dataclass(frozen=True)
class Space:
    """Shapes ``V`` (N, r) of a ``model`` around the parameter values ``at``; ``still``: eigenvalues
    below are none; ``wide`` the parameters that act on many DOFs, ``loose`` the compliances of what
    was held; by which ``shift`` its stiffness
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
    loose: tuple[int, ...] = ()

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

    @cached_property
    def _dofs(self) -> list[list[int]]:
        """How many DOFs each target of every parameter moves."""
        dofs = [b.dofs for b in self.model.blocks]
        each = self.model.parameters
        return [[len(np.unique(dofs[t.block][t.rows])) for t in q.targets] for q in each]

    def derivatives(self, p: Real, X: Real) -> tuple[tuple[DerivativeBlock | Among, ...], ...]:
        """Of every parameter of the model at ``p``: element blocks where it moves few DOFs, else
        what it does among the modes with coordinates ``X`` (r, low)."""
        values, low, each = self.model.properties(p), X.shape[1], self.model.parameters
        far = [any(wide(n, low) for n in counts) for counts in self._dofs]
        every = [q.targets if many else () for q, many in zip(each, far, strict=True)]
        among = (
            Among(tuple(None if (A := rate.get(k)) is None else X.T @ A @ X for k in "KMCD"))
            for rate in self.projected.rates(self.model, values, list(chain(*every)))
        )
        return tuple(
            tuple(islice(among, len(targets))) if targets else self.model.derivative(j, p, values)
            for j, targets in enumerate(every)
        )

    def far(self, p: Real, limit: float) -> bool:
        """Whether a parameter on many DOFs is further than that from where it was made, or the
        logarithm of a compliance (and of what it is in series with): beside what gives way all
        modes are others, by 0.3 % of their frequencies where an edge is set free."""
        wide, loose = list(self.wide), list(self.loose)
        one, other = (np.log1p(np.maximum(x[loose], 0.0)) for x in (p, self.at))
        moved = np.concatenate([p[wide] - self.at[wide], one - other])
        return bool(np.any(np.abs(moved) > limit))

    def grown(self, model: Model, moving: Sequence[int]) -> Space | None:
        """That of a model which is this one with further parameters, zero today, hidden masses
        and DOFs that were held and are set free, from these shapes and, of each of those DOFs, the
        static answer to its motion (constraint modes: Craig and Bampton 1968); None where it is
        another structure."""
        size, r = self.model.size, self.V.shape[1]
        if self.shift is None or model.labels[:size] != self.model.labels:
            return None
        if not alike(self.model, model):
            return None
        hidden = [i for i in range(size, model.size) if HIDDEN in model.labels[i]]
        free = np.setdiff1d(np.arange(size, model.size), hidden)
        M = model.matrices(model.zero()).M
        V = np.zeros((model.size, r + len(hidden)))
        V[:size, :r] = self.V
        V[hidden, np.arange(r, r + len(hidden))] = 1.0 / np.sqrt(M.diagonal()[hidden])
        # what the old parameters do is among the shapes
        fresh = [j for j in moving if j >= len(self.model.parameters)]
        loose = loosened(model, fresh, free)  # what they do is answered by motions of what is free
        others = [j for j in fresh if j not in loose]
        forces, wide = pushes(model, model.zero(), others, V[:, : self.near])
        forces = np.hstack([forces[:size], -stiffness_columns(model, free)[:size]])
        answers = np.zeros((model.size, forces.shape[1]))
        answers[:size] = self._factor.solve(forces)
        answers[free, np.arange(forces.shape[1] - len(free), forces.shape[1])] = 1.0
        return replace(
            self,
            model=model,
            at=model.zero(),
            V=independent(V, answers, M),
            wide=(*self.wide, *wide),
            loose=(*self.loose, *loose),
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
        anew = partial(space_of, self.model, at, self.top, self.ports, self.moving)
        if self.shift is None and self.V.shape[1] >= self.model.size:
            return anew()
        m, old = self.model.matrices(at), self.modes(at).modes
        lowest = float(old.eigenvalues[old.rigid]) if old.rigid < len(old.eigenvalues) else 1.0
        shift = SHIFT * lowest if old.rigid else 0.0
        factor = factorise(sp.csc_array(m.K + shift * m.M), "the stiffness")
        bare = replace(self, at=np.asarray(at, float), still=STILL * lowest, shift=shift, root=None)
        return bare._improved(m, factor, old.eigenvalues, old.shapes) or anew()

    def opened(self, model: Model, ports: Index, moving: Sequence[int]) -> Space | None:
        """That of a model as it stands which is this one with further DOFs, of what is set free on
        springs that are rigid as yet or of hidden masses: its modes, the static answers to forces
        at those DOFs, and one step as in `recentred`. None where it is another structure."""
        place = np.array([model.place.get(x, -1) for x in self.model.labels], dtype=np.int64)
        further = np.setdiff1d(np.arange(model.size), place)
        if self.shift is None or np.any(place < 0) or not len(further):
            return None
        at = model.zero()
        m, old = model.matrices(at), self.modes(self.model.zero()).modes
        factor = factorise(sp.csc_array(m.K + self.shift * m.M), "the stiffness")
        wanted = self._wanted(old.eigenvalues)
        pushed = factor.solve(units(model.size, further))
        before = np.zeros((model.size, wanted))
        before[place] = old.shapes[:, :wanted]
        V = ritz(np.hstack([before, pushed / np.linalg.norm(pushed, axis=0)]), m.K, m.M)
        if V is None:
            return None
        values = np.einsum("im,im->m", V, m.K @ V)
        bare = replace(self, model=model, at=at, ports=ports, moving=tuple(moving), root=None)
        held = [i for i in further if HIDDEN not in model.labels[i]]
        bare = replace(bare, loose=loosened(model, moving, np.array(held, dtype=np.int64)))
        return bare._improved(m, factor, values, V)

    def _wanted(self, eigenvalues: Real) -> int:
        """How many modes an inverse iteration carries."""
        return int(np.sum(eigenvalues <= (2.0 * np.pi * BEYOND * self.top) ** 2)) + SPARE

    def _improved(self, m: Matrices, factor: Factor, values: Real, V: Real) -> Space | None:
        """With modes nearly ``V`` (eigenvalues ``values``) after an inverse iteration, and the
        static answers; None where they are alike to rounding."""
        V = factor.solve(m.M @ V[:, : self._wanted(values)])
        improved = ritz(V / np.linalg.norm(V, axis=0), m.K, m.M)
        if improved is None:
            return None
        near = int(np.sum(values <= (2.0 * np.pi * 1.25 * self.top) ** 2)) + 1
        return _with_answers(replace(self, near=near), self.at, improved, m.M, factor)

    def matrices(self, p: Real) -> dict[str, Real]:
        """K, M, C and D at ``p``, (r, r) each."""
        return self.projected.matrices(self.model, p)

    def lowest(self) -> Real:
        """Frequencies (Hz) of its flexible modes at today's model: those of the space that it grew
        from, where nothing swings that did not (what is set free is rigid as yet)."""
        old = 0 if self.root is None else self.root.model.size
        if self.root is not None and not any(HIDDEN in x for x in self.model.labels[old:]):
            return self.root.lowest()
        return np.asarray(self.modes(self.model.zero()).modes.flexible().frequencies)

    @recent
    def _known(self) -> dict[bytes, Found]:
        """What was found last: a fit begins where another ended, and is judged where it ends."""
        return {}

    def modes(self, p: Real) -> Found:
        """Every mode of the space at ``p``.

        Raises
        ------
        ModelError
            Where a mass is negative: no structure.
        """
        key = np.asarray(p, dtype=float).tobytes()
        if key not in self._known:
            found = self._modes(p)
            while len(self._known) >= KNOWN:
                self._known.pop(next(iter(self._known)))
            self._known[key] = found
        return self._known[key]

    def _modes(self, p: Real) -> Found:
        m = self.matrices(p)
        try:
            values, X = la.eigh(m["K"], m["M"], check_finite=False)
        except la.LinAlgError as error:
            raise ModelError(
                "the mass matrix has a negative eigenvalue. A mass parameter has gone too far: "
                "set its lower bound."
            ) from error
        # no eigenvalue is known to better than the rounding of the highest, a static answer's
        quiet = np.abs(values) <= max(self.still, ROUNDING * float(values[-1]))
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
    modes = modes_up_to(m.K, m.M, BEYOND * top, rigid)
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
    forces, wide = pushes(bare.model, at, bare.moving, V[:, : bare.near])
    answers = factor.solve(np.hstack([units(bare.model.size, bare.ports), forces]))
    V = independent(V, answers, M)
    return replace(bare, at=at, V=V, wide=tuple(j for j in wide if j not in bare.loose))
