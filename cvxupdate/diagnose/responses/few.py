"""A fitted point as a change along few directions sees it: receptances from its directions to the
sensors and from the drives to them, and by how much they move the responses at any size."""

from __future__ import annotations

from dataclasses import dataclass, field
from functools import cached_property
from typing import Protocol

import numpy as np
import scipy.sparse as sp

from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.settings import OSCILLATOR_MASSES
from cvxupdate.fe.block import Index
from cvxupdate.fe.factor import Factored, factorise
from cvxupdate.fe.synthesis.pieces import Receptances, Response
from cvxupdate.fe.synthesis.products import times
from cvxupdate.fe.synthesis.space import SHIFT
from cvxupdate.physics.effect import Effect, HiddenOscillator
from cvxupdate.physics.low_rank import DIRECTIONS, LowRank

# sizes: from this much of the one that rules the receptance at its own place where that is largest,
# to this much of the typical one
REACH = (0.2, 10.0)
# ratio of two sizes, as narrow as a resonance is on the widest lines; how many at most
STEP, MOST = 1.5, 48
GIVEN = (0.1, 0.3, 0.6, 0.9, 0.97)  # how far what is joined rigidly gives way


class Measure(Protocol):
    """What is left of the recordings after a change of the model."""

    @property
    def total(self) -> float:
        """Without any."""

    def remaining(self, J: Real) -> Real:
        """(n,) after each of the weighted changes J (rows, n)."""


class Along(Protocol):
    """What `LowRank` says of a change in its own directions."""

    @property
    def used(self) -> Index:
        """DOFs (u,)."""

    @property
    def W(self) -> Real:
        """Directions (u, r)."""

    @property
    def weights(self) -> Real:
        """Λ's diagonal (r,)."""

    @property
    def behind(self) -> Real:
        """B's diagonal (r,)."""

    def at(self, sizes: Real, s: Complex) -> Complex:
        """A's diagonal (points, changes, r)."""


@dataclass(frozen=True)
class Tunings:
    """Changes along the same single direction, at every size each: (tuning, size)."""

    changes: tuple[LowRank, ...]

    @property
    def used(self) -> Index:
        """Of all of them."""
        return self.changes[0].used

    @property
    def W(self) -> Real:
        """Of all of them."""
        return self.changes[0].W

    @property
    def weights(self) -> Real:
        """Of all of them."""
        return self.changes[0].weights

    @property
    def behind(self) -> Real:
        """Nothing: none of them is set free."""
        return self.changes[0].behind

    def at(self, sizes: Real, s: Complex) -> Complex:
        """(points, tunings × sizes, 1)."""
        return np.concatenate([c.at(sizes, s) for c in self.changes], axis=1)


@dataclass(frozen=True)
class Few:
    """``weights`` of the rows of every signal, ``modal`` receptances (points, modes) of every
    response, the structure's mass (kg); ``kept``: spectra that were worked out last, ``still``:
    static answers of what may be set free."""

    point: ResponsePoint
    weights: tuple[Real, ...]
    modal: tuple[Complex, ...]
    heavy: float
    kept: dict[bytes, tuple[Spectrum, ...]] = field(default_factory=dict)
    still: dict[bytes, Real] = field(default_factory=dict)

    @classmethod
    def of(cls, point: ResponsePoint) -> Few:
        """Of a point."""
        return cls(
            point,
            tuple(1.0 / s.scale() for s in point.setting.signals),
            tuple(_modal_receptance(point, r) for r in point.responses),
            float(point.setting.model.total_mass()),
        )

    def sizes(self, effect: Effect, change: LowRank) -> Real:
        """Sizes to try, in order."""
        if isinstance(effect.action, HiddenOscillator):
            return self.heavy * np.array(OSCILLATOR_MASSES)
        s = self.point.responses[0].signal.s
        diagonal = np.einsum("sii,i->si", self._at(change, self.modal[0]), change.weights)
        own = np.abs(change.f(s)[:, None] * diagonal).max(axis=1)
        largest, typical = max(float(own.max()), 1e-300), max(float(np.median(own)), 1e-300)
        reach = REACH[0] / largest, REACH[1] / typical
        steps = np.geomspace(*reach, min(MOST, 2 + int(np.log(reach[1] / reach[0]) / np.log(STEP))))
        if effect.change is not None and effect.change.series:
            # a compliance beside the place's own: what is joined rigidly gives way at most wholly
            gamma = np.unique(np.concatenate([steps[steps < 1.0], GIVEN]))
            alone = gamma / (1.0 - gamma)
            if len(change.weights) == 1:
                return np.asarray(alone)
            # an edge, or a row of feet, gives way as a whole long after each place by itself has
            decades = np.log10(max(effect.limits[1] / alone[-1], 1.0))
            together = np.geomspace(alone[-1], effect.limits[1], 1 + int(2.0 * decades))[1:-1]
            return np.concatenate([alone, together])
        p = steps if effect.sign > 0 else np.concatenate([-steps[::-1], steps])
        return p[(p > effect.limits[0]) & (p < effect.limits[1])]

    def rows(self, change: LowRank, sizes: Real) -> Real:
        """Weighted change of every row for each size, (rows, sizes)."""
        parts = []
        many = len(change.weights) > DIRECTIONS
        spectra = self._spectra(change) if many else ()
        pieces = (self.point.responses, self.modal, self.point.green, self.weights)
        for k, (r, own, g, w) in enumerate(zip(*pieces, strict=True)):
            if many:
                moved = spectra[k].moved(change, sizes, r.signal.s)
            else:
                moved = _moved(change, sizes, r, self._at(change, own), g)
            parts += self._weighted(r, w, moved)
        return np.vstack(parts)

    def _spectra(self, change: LowRank) -> tuple[Spectrum, ...]:
        """Of every response; kept, for effects that differ in their tuning alone follow one
        another."""
        key = change.W.tobytes() + change.weights.tobytes() + change.used.tobytes()
        if key not in self.kept:
            pieces = zip(self.point.responses, self.modal, self.point.green, strict=True)
            found = (Spectrum.of(change, r, self._at(change, own), g) for r, own, g in pieces)
            self.kept.clear()
            self.kept[key] = tuple(found)
        return self.kept[key]

    def tuned(self, changes: Tunings, sizes: Real) -> Real:
        """The same for each of several changes along one direction, (rows, changes × sizes)."""
        parts = []
        pieces = (self.point.responses, self.modal, self.point.green, self.weights)
        for r, own, g, w in zip(*pieces, strict=True):
            parts += self._weighted(r, w, _along_one(changes, sizes, r, self._at(changes, own), g))
        return np.vstack(parts)

    def _weighted(self, r: Response, w: Real, moved: Complex) -> list[Real]:
        """Real and imaginary rows of responses' changes (points, sensors, cases, sizes)."""
        points, sensors, cases, count = moved.shape
        flat = self.point.faulty(r.signal, moved.reshape(points, sensors, cases * count))
        rows = r.rows(flat).reshape(-1, sensors, cases, count)
        weighted = (w[..., None] * rows).reshape(-1, count)
        return [weighted.real, weighted.imag]

    def _at(self, change: Along, modal: Complex) -> Complex:
        """Receptances Wᵀ G W (points, r, r)."""
        phi = change.W.T @ self.point.modes.shapes[change.used]
        r, m = phi.shape
        pairs = (phi[:, None, :] * phi[None, :, :]).reshape(r * r, m).T
        both = modal.real @ pairs + 1j * (modal.imag @ pairs)
        return np.asarray(both.reshape(len(modal), r, r) + self._still(change, phi))

    def _still(self, change: Along, phi: Real) -> Real:
        """The static answer (r, r) of what is not among the modes ``phi`` (r, modes), for what is
        set free: its own stiffness all but cancels against that, along an edge of fine elements to
        a thousandth. Zero where the modes are asked for such answers already."""
        if not np.any(change.behind) or self._answered.issuperset(change.used.tolist()):
            return np.zeros((len(phi), len(phi)))
        key = change.used.tobytes() + change.W.tobytes()
        if key not in self.still:
            factor, shift = self._factor
            W = np.zeros((self.point.setting.model.size, len(phi)))
            W[change.used] = change.W
            own = np.maximum(self.point.modes.eigenvalues, 0.0) + shift
            self.still[key] = W.T @ factor.solve(W) - (phi / own) @ phi.T
        return self.still[key]

    @cached_property
    def _answered(self) -> frozenset[int]:
        """DOFs to whose forces the modes have the static answer; all where they are complete."""
        shapes, size = self.point.setting.shapes, self.point.modes.shapes.shape
        return frozenset(range(size[0])) if size[1] >= size[0] else frozenset(shapes.answered)

    @cached_property
    def _factor(self) -> tuple[Factored, float]:
        """Of K + shift M, which a free structure needs."""
        setting, modes = self.point.setting, self.point.modes
        m = setting.model.matrices(self.point.p[: len(setting.model.parameters)])
        shift = SHIFT * float(modes.eigenvalues[modes.rigid]) if modes.rigid else 0.0
        return factorise(sp.csc_array(m.K + shift * m.M), "the stiffness"), shift


def _modal_receptance(point: ResponsePoint, r: Response) -> Complex:
    """1 over the dynamic stiffness of every mode (points, modes); damping that couples modes is
    left out."""
    s = r.signal.s[:, None]
    lam = np.maximum(point.modes.eigenvalues, 0.0)
    return np.asarray(1.0 / (s**2 + point.loss.viscous(lam) * s + point.loss.stiffness(lam)))


def _sides(change: Along, r: Response, g: Receptances) -> tuple[Complex, Complex]:
    """Receptances from the directions to the sensors, and from the drives to them."""
    left, right = (times(change.W.T, x[change.used]) for x in (g.left, g.right))
    return left * r.drive[:, None], right


def _along_one(change: Along, sizes: Real, r: Response, G: Complex, g: Receptances) -> Complex:
    """The responses' change (points, sensors, cases, sizes) along one direction."""
    left, right = _sides(change, r, g)
    amount = change.at(sizes, r.signal.s)[:, :, 0]
    factor = amount / (1.0 + amount * G[:, 0, 0, None])
    outer = left[0][:, :, None, None] * right[0][:, None, :, None]
    return np.asarray(-outer * factor[:, None, None, :])


def _moved(change: LowRank, sizes: Real, r: Response, G: Complex, g: Receptances) -> Complex:
    """The responses' change (points, sensors, cases, sizes)."""
    if len(change.weights) == 1:
        return _along_one(change, sizes, r, G, g)
    left, right = _sides(change, r, g)
    one = 1.0 / (sizes * change.f(r.signal.s)[:, None])  # (points, sizes)
    inverse = _inverse(
        np.diag(1.0 / change.weights) * one[:, :, None, None]
        + (G + np.diag(change.behind))[:, None]
    )
    return np.asarray(-np.einsum("ips,pgij,jpc->pscg", left, inverse, right, optimize=True))


def _inverse(A: Complex) -> Complex:
    """Of matrices (…, r, r); two rows in closed form, ten times as fast."""
    if A.shape[-1] != 2:
        return np.asarray(np.linalg.inv(A))
    (a, b), (c, d) = np.moveaxis(A, (-2, -1), (0, 1))
    det = a * d - b * c
    if np.any(det == 0.0):
        raise np.linalg.LinAlgError("Singular matrix")
    out = np.empty(A.shape, dtype=complex)
    out[..., 0, 0], out[..., 0, 1], out[..., 1, 0], out[..., 1, 1] = d, -b, -c, a
    out /= det[..., None, None]
    return out


@dataclass(frozen=True)
class Spectrum:
    """All sizes at one cost: (Λ⁻¹ a + G)⁻¹ = Λ V (a + μ)⁻¹ V⁻¹ with G Λ = V μ V⁻¹. ``mu`` (points,
    r), what V makes of the sides: ``left`` (points, sensors, r), ``right`` (points, r, cases)."""

    mu: Complex
    left: Complex
    right: Complex

    @classmethod
    def of(cls, change: LowRank, r: Response, G: Complex, g: Receptances) -> Spectrum:
        """Of a response."""
        left, right = _sides(change, r, g)
        mu, V = np.linalg.eig((G + np.diag(change.behind)) * change.weights)
        turned = np.einsum("ips,i,pij->psj", left, change.weights, V, optimize=True)
        solved = np.linalg.solve(V, np.moveaxis(right, 0, 1))
        return cls(np.asarray(mu, dtype=complex), turned, np.asarray(solved, dtype=complex))

    def moved(self, change: LowRank, sizes: Real, s: Complex) -> Complex:
        """The response's change (points, sensors, cases, sizes)."""
        one = 1.0 / (sizes * change.f(s)[:, None])  # (points, sizes)
        factor = 1.0 / (one[:, :, None] + self.mu[:, None, :])
        return np.asarray(
            -np.einsum("psj,pgj,pjc->pscg", self.left, factor, self.right, optimize=True)
        )
