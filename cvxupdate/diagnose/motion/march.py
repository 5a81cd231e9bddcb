"""Many variants of one modal model with internal forces, marched over one recording at once.

Modes are carried from step to step by their exact propagators, the modal force straight in
between (first-order hold); the internal forces are found at the end of each step from
f = law(x⁰ − c f, v⁰ − d f), where x⁰ and v⁰ are what the motion would be without them there and
c, d what a unit of them does to it within the step. With one place that is a scalar equation, so
contact and stick need no smoothing: friction holds where |v⁰| ≤ d F, with the force v⁰ / d (the
set-valued law, Moreau 1988). A change of `cvxupdate.forces.scalar` needs a change here, too: the
machine code kept beside this module has those laws in it (last: x² beside x³). Only the places of
the internal forces are computed: what sensors say follows from the forces by receptances.
`cvxupdate.simulate` follows one model to a tolerance; this follows thirty variants at fixed steps,
for derivatives.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.forces.compiled import compiled
from cvxupdate.forces.kinds import FRICTION
from cvxupdate.forces.scalar import respond

Real = NDArray[np.float64]

TERMS, HALVINGS = 14, 6  # of the exponential series, and of the step before it
NEWTON, SWEEPS = 40, 60  # iterations at most at one place, rounds over several
CONVERGED = 1e-10  # of the force so far: converged


@dataclass(frozen=True)
class Variants:
    """``lam`` (b, r) in (rad/s)², ``slow`` (b, r) = 2ζω in 1/s; shapes at the drives ``drive`` (b,
    r, inputs) and at the places ``place`` (b, r, places); static flexibility beyond the modes
    between places and drives ``beside`` (places, inputs) and among places ``between`` (places,
    places), m/N; ``laws``: values (b, places, 4) of ``kinds`` (places,)."""

    lam: Real
    slow: Real
    drive: Real
    place: Real
    beside: Real
    between: Real
    kinds: NDArray[np.int64]
    values: Real


def propagators(lam: Real, slow: Real, step: float) -> Real:
    """(…, 2, 4): (η, hη̇) at the end of a step from (η, hη̇, F₀, F₁) at its beginning, for
    η̈ + slow η̇ + lam η = F(t) with F straight in between; by scaling and squaring, so that
    rigid-body and overdamped modes need no case of their own."""
    A = np.zeros((*lam.shape, 4, 4))
    A[..., 0, 1] = 1.0
    A[..., 1, 0], A[..., 1, 1], A[..., 1, 2] = -lam * step**2, -slow * step, step**2
    A[..., 2, 3] = 1.0
    size = float(np.abs(A).sum(axis=-1).max(initial=1.0))
    halvings = max(HALVINGS, int(np.ceil(np.log2(size))) + 1)
    A = A / 2.0**halvings
    E = np.broadcast_to(np.eye(4), A.shape).copy()
    term = E.copy()
    for k in range(1, TERMS):
        term = term @ A / k
        E = E + term
    for _ in range(halvings):
        E = E @ E
    out = E[..., :2, :].copy()
    out[..., 2] = E[..., :2, 2] - E[..., :2, 3]  # F(τ) = F₀ + τ (F₁ − F₀)
    return out


def marched(v: Variants, force: Real, rate: float) -> tuple[Real, Real, Real]:
    """Internal forces, motions and velocities at the places (b, samples, places), from rest, under
    ``force`` (samples, inputs) at ``rate`` Hz."""
    # modes last: the innermost loops run over them
    P = np.moveaxis(propagators(v.lam, v.slow, 1.0 / rate), 1, -1)
    drive, place = np.swapaxes(v.drive, 1, 2), np.swapaxes(v.place, 1, 2)
    shape = (len(v.lam), len(force), len(v.kinds))
    out = (np.zeros(shape), np.zeros(shape), np.zeros(shape))
    P, drive, place, beside, between, driven, values = (
        np.ascontiguousarray(a, dtype=float)
        for a in (P, drive, place, v.beside, v.between, force, v.values)
    )
    _march(P, drive, place, beside, between, driven, values, v.kinds, rate, *out)
    return out


def ready() -> None:
    """With the machine code of the march loaded: where it is not yet kept beside the modules it is
    made, once, in a quarter of a minute."""
    one, none = np.ones((1, 1)), np.zeros((1, 1))
    place, kinds = np.ones((1, 1, 1)), np.array([FRICTION], dtype=np.int64)
    marched(Variants(one, one, place, place, none, none, kinds, np.ones((1, 1, 4))), none, 1.0)


@compiled
def _force(kind: Any, p: Any, x: Any, v: Any, c: Any, d: Any, z: Any, w: Any, f: Any) -> Any:
    """Force at one place, from where it would be without: Newton's method from ``f``."""
    if kind == FRICTION:
        held = v / d if d > 0.0 else 0.0
        return min(max(held, -p[0]), p[0])
    for _ in range(NEWTON):
        g, kx, kv, _, _ = respond(kind, p, x - c * f, v - d * f, z, w)
        slope = 1.0 + c * kx + d * kv
        if slope < 0.1:
            slope = 0.1
        step = (g - f) / slope
        f = f + step
        if abs(step) <= CONVERGED * (abs(f) + 1e-30):
            break
    return f


@compiled
def _carried(
    P: Any, drive: Any, place: Any, force: Any, t: int, rate: Any, modes: Any, x0: Any, v0: Any
) -> None:
    """One step of all ``modes`` (4, r: η, hη̇, modal force, that at the end) under the forces at
    sample ``t``, and what the places do without internal forces there, added to ``x0``, ``v0``."""
    count = modes.shape[1]
    for r in range(count):
        modes[3, r] = 0.0
    for k in range(force.shape[1]):
        own = force[t, k]
        for r in range(count):
            modes[3, r] += drive[k, r] * own
    for r in range(count):
        e, u, begin, end = modes[0, r], modes[1, r], modes[2, r], modes[3, r]
        modes[0, r] = P[0, 0, r] * e + P[0, 1, r] * u + P[0, 2, r] * begin + P[0, 3, r] * end
        modes[1, r] = P[1, 0, r] * e + P[1, 1, r] * u + P[1, 2, r] * begin + P[1, 3, r] * end
        modes[2, r] = end
    for i in range(len(x0)):
        x, v = 0.0, 0.0
        for r in range(count):
            x += place[i, r] * modes[0, r]
            v += place[i, r] * modes[1, r]
        x0[i] += x
        v0[i] += v * rate


@compiled
def _without(x0: Any, c: Any, now: Any, i: int, all_: bool) -> Any:
    """Motion of place i less what the forces at the other places (or at all) do to it."""
    x = x0[i]
    for j in range(len(now)):
        if all_ or j != i:
            x -= c[i, j] * now[j]
    return x


@compiled
def _settled(
    kinds: Any, p: Any, x0: Any, v0: Any, c: Any, d: Any, z: Any, w: Any, now: Any
) -> None:
    """Forces at all places, round after round until they agree with one another."""
    for _ in range(SWEEPS):
        moved, largest = 0.0, 1e-30
        for i in range(len(now)):
            xi, vi = _without(x0, c, now, i, False), _without(v0, d, now, i, False)
            new = _force(kinds[i], p[i], xi, vi, c[i, i], d[i, i], z[i], w[i], now[i])
            moved, largest = max(moved, abs(new - now[i])), max(largest, abs(new))
            now[i] = new
        if len(now) == 1 or moved <= CONVERGED * largest:
            break


@compiled
def _pushed(P: Any, place: Any, now: Any, modes: Any) -> None:
    """What the internal forces of a step do to the modes at its end."""
    for i in range(len(now)):
        own = now[i]
        for r in range(modes.shape[1]):
            back = place[i, r] * own
            modes[0, r] -= P[0, 3, r] * back
            modes[1, r] -= P[1, 3, r] * back
            modes[2, r] -= back


@compiled
def _softness(P: Any, place: Any, between: Any, rate: Any) -> Any:
    """What a unit of each force does to the motion and to the velocity of each place in a step."""
    c, d = between.copy(), np.zeros_like(between)
    for i in range(len(place)):
        for j in range(len(place)):
            for r in range(place.shape[1]):
                both = place[i, r] * place[j, r]
                c[i, j] += P[0, 3, r] * both
                d[i, j] += P[1, 3, r] * both * rate
    return c, d


@compiled
def _alone(
    P: Any,
    drive: Any,
    place: Any,
    beside: Any,
    between: Any,
    force: Any,
    kind: int,
    p: Any,
    rate: Any,
    f: Any,
    x: Any,
    v: Any,
) -> None:
    """One variant with one place, which most have: nothing but scalars between the modes."""
    count, inputs = P.shape[2], force.shape[1]
    e, u, begin, end = np.zeros(count), np.zeros(count), np.zeros(count), np.zeros(count)
    for k in range(inputs):
        for r in range(count):
            begin[r] += drive[k, r] * force[0, k]
    c, d, now, z, w = between, 0.0, 0.0, 0.0, 0.0
    for r in range(count):
        c += P[0, 3, r] * place[r] ** 2
        d += P[1, 3, r] * place[r] ** 2 * rate
    for t in range(1, len(force)):
        x0, v0 = 0.0, 0.0
        for r in range(count):
            end[r] = 0.0
        for k in range(inputs):
            own = force[t, k]
            x0 += beside[k] * own
            for r in range(count):
                end[r] += drive[k, r] * own
        for r in range(count):
            a, b = e[r], u[r]
            e[r] = P[0, 0, r] * a + P[0, 1, r] * b + P[0, 2, r] * begin[r] + P[0, 3, r] * end[r]
            u[r] = P[1, 0, r] * a + P[1, 1, r] * b + P[1, 2, r] * begin[r] + P[1, 3, r] * end[r]
            begin[r] = end[r]
            x0 += place[r] * e[r]
            v0 += place[r] * u[r]
        v0 *= rate
        now = _force(kind, p, x0, v0, c, d, z, w, now)
        x0 -= c * now
        v0 -= d * now
        if kind != FRICTION:
            _, _, _, z, w = respond(kind, p, x0, v0, z, w)
        f[t, 0], x[t, 0], v[t, 0] = now, x0, v0
        for r in range(count):
            back = place[r] * now
            e[r] -= P[0, 3, r] * back
            u[r] -= P[1, 3, r] * back
            begin[r] -= back


@compiled
def _march(
    P: Any,
    drive: Any,
    place: Any,
    beside: Any,
    between: Any,
    force: Any,
    values: Any,
    kinds: Any,
    rate: Any,
    f: Any,
    x: Any,
    v: Any,
) -> None:
    places = len(kinds)
    x0, v0 = np.zeros(places), np.zeros(places)
    for b in range(len(drive)):
        Pb, drives, ends, laws = P[b], drive[b], place[b], values[b]
        if places == 1:
            own = (ends[0], beside[0], between[0, 0], force, kinds[0], laws[0], rate)
            _alone(Pb, drives, *own, f[b], x[b], v[b])
            continue
        modes = np.zeros((4, drive.shape[2]))
        for k in range(force.shape[1]):
            for r in range(modes.shape[1]):
                modes[2, r] += drives[k, r] * force[0, k]
        z, w, now = np.zeros(places), np.zeros(places), np.zeros(places)
        c, d = _softness(Pb, ends, between, rate)
        for t in range(1, len(force)):
            for i in range(places):
                x0[i], v0[i] = 0.0, 0.0
                for k in range(force.shape[1]):
                    x0[i] += beside[i, k] * force[t, k]
            _carried(Pb, drives, ends, force, t, rate, modes, x0, v0)
            _settled(kinds, laws, x0, v0, c, d, z, w, now)
            for i in range(places):
                xi, vi = _without(x0, c, now, i, True), _without(v0, d, now, i, True)
                if kinds[i] != FRICTION:
                    _, _, _, z[i], w[i] = respond(kinds[i], laws[i], xi, vi, z[i], w[i])
                f[b, t, i], x[b, t, i], v[b, t, i] = now[i], xi, vi
            _pushed(Pb, ends, now, modes)
