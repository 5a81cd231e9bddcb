"""One law of internal force at one instant, for real and complex numbers alike.

Branches look at real parts only, so that a complex step gives derivatives (Squire and Trapp 1998).
Every law has four parameters in a row of ``p`` and two state variables ``z``, ``w``, of which it
uses what it needs. Its answer is (force, ∂force/∂x, ∂force/∂v, z, w): the state at the end of the
step, the derivatives of the force there, the state at the beginning held (the consistent tangent of
a return mapping, Simo and Hughes 1998, chapter 1).
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cvxupdate.forces.compiled import compiled
from cvxupdate.forces.kinds import (
    BOTH,
    BOUC_WEN,
    CLEARANCE,
    CUBIC,
    FRICTION,
    JENKINS,
    QUADRATIC,
)

Answer = tuple[Any, Any, Any, Any, Any]
SATURATED = 24.0  # ξ of one move after which Bouc–Wen's u is at its limit to 1e-10


@compiled
def size_of(a: Any) -> Any:
    """|a| with the sign taken from the real part."""
    return a if a.real >= 0.0 else -a


@compiled
def linear(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """k x + c v: a spring and a dashpot."""
    zero = 0.0 * (x + v)
    return p[0] * x + p[1] * v, p[0] + zero, p[1] + zero, z, w


@compiled
def cubic(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """k3 x³ + k2 x|x| + even x²."""
    a, zero = size_of(x), 0.0 * (x + v)
    force = p[0] * x * x * x + p[1] * x * a + p[2] * x * x
    return force, 3.0 * p[0] * x * x + 2.0 * p[1] * a + 2.0 * p[2] * x, zero, z, w


@compiled
def clearance(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """Stiffness times how far x has gone beyond the gap; never a pull."""
    k, gap, side, zero = p[0], p[1], p[2].real, 0.0 * (x + v)
    if side != BOTH:  # a signed gap: contact above it, or below it
        deep = (x - gap) if (x - gap).real * side > 0.0 else 0.0 * x
    elif x.real > gap.real:
        deep = x - gap
    elif x.real < -gap.real:
        deep = x + gap
    else:
        deep = 0.0 * x
    touches = 1.0 if deep.real != 0.0 else 0.0
    return k * deep, k * touches + zero, zero, z, w


@compiled
def friction(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """Force · sgn(v), 0 at rest: what a slider does while it slips."""
    zero = 0.0 * (x + v)
    sign = 1.0 if v.real > 0.0 else -1.0 if v.real < 0.0 else 0.0
    return sign * p[0] + zero, zero, zero, z, w


@compiled
def jenkins(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """A spring in series with a slider and, where ``play`` is given, with a free play.

    z is where the slider stands: the spring is bent by what x − z exceeds half of the play.
    """
    k, most, half, zero = p[0], p[1], 0.5 * p[2], 0.0 * (x + v)
    bent = x - z
    sign = 1.0 if bent.real >= 0.0 else -1.0
    deep = sign * bent - half
    if deep.real <= 0.0:
        return k * zero, k * zero, zero, z, w
    if (k * deep).real <= most.real:
        return sign * k * deep, k + zero, zero, z, w
    return sign * most + zero, zero, zero, x - sign * (most / k + half), w


@compiled
def power(a: Any, n: Any) -> Any:
    """a**n of a ≥ 0, 0 at 0."""
    return a**n if a.real > 1e-150 else 0.0 * a


@compiled
def bouc_wen_slope(u: Any, n: Any, gamma: Any, sign: float) -> Any:
    """du/dξ on a branch where x moves in the direction of ``sign``."""
    way = 1.0 - gamma + gamma * (1.0 if u.real >= 0.0 else -1.0) * sign
    return 1.0 - power(size_of(u), n) * way


@compiled
def bouc_wen_branch(u: Any, path: Any, n: float) -> Any:
    """u in the direction of the motion after ξ = ``path``, from ``u``, for γ = 1/2: straight to
    zero, then 1 − (1 − u) e^{−ξ} for n = 1, tanh (ξ + artanh u) for n = 2."""
    if u.real < 0.0:
        if path.real <= -u.real:
            return u + path
        path, u = path + u, 0.0 * (u + path)
    if n == 1.0:
        return 1.0 - (1.0 - u) * np.exp(-path)
    fall = np.exp(-2.0 * path)
    t = (1.0 - fall) / (1.0 + fall)
    return (u + t) / (1.0 + u * t)


@compiled
def bouc_wen(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """Force · u with du/dξ = 1 − |u|ⁿ (1 − γ + γ sgn(u ẋ)), ξ = k x / force.

    z is u, w is x at the beginning; along a branch the law is free of time, so it is integrated
    over ξ: in closed form where it has one, else by the classical Runge–Kutta rule.
    """
    k, most, n, gamma = p[0], p[1], p[2], p[3]
    path = k * (x - w) / most
    sign = 1.0 if path.real >= 0.0 else -1.0
    if abs(path.real) > SATURATED:  # u is at its limit, whatever is beyond
        path = sign * SATURATED + 0.0 * path
    if gamma == 0.5 and (n == 1.0 or n == 2.0):
        u = sign * bouc_wen_branch(sign * z, sign * path, n.real)
    else:
        parts = int(np.ceil(abs(path.real) * max(1.0, n.real) / 0.1)) + 1
        d, u = path / parts, z + 0.0 * path
        for _ in range(parts):
            a = bouc_wen_slope(u, n, gamma, sign)
            b = bouc_wen_slope(u + 0.5 * d * a, n, gamma, sign)
            c = bouc_wen_slope(u + 0.5 * d * b, n, gamma, sign)
            e = bouc_wen_slope(u + d * c, n, gamma, sign)
            u = u + d / 6.0 * (a + 2.0 * b + 2.0 * c + e)
    zero = 0.0 * (x + v)
    return most * u, k * bouc_wen_slope(u, n, gamma, sign), zero, u, x + zero


@compiled
def quadratic(p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """|v| v times c2."""
    a, zero = size_of(v), 0.0 * (x + v)
    return p[0] * a * v, zero, 2.0 * p[0] * a, z, w


@compiled
def respond(kind: int, p: Any, x: Any, v: Any, z: Any, w: Any) -> Answer:
    """The answer of a law of any kind."""
    if kind == CUBIC:
        return cubic(p, x, v, z, w)
    if kind == CLEARANCE:
        return clearance(p, x, v, z, w)
    if kind == FRICTION:
        return friction(p, x, v, z, w)
    if kind == JENKINS:
        return jenkins(p, x, v, z, w)
    if kind == BOUC_WEN:
        return bouc_wen(p, x, v, z, w)
    if kind == QUADRATIC:
        return quadratic(p, x, v, z, w)
    return linear(p, x, v, z, w)


@compiled
def stored(kind: int, p: Any, x: Any, z: Any, w: Any) -> Any:
    """Energy that could be had back, J (of Bouc–Wen: along the elastic branch, force²/2k)."""
    if kind == CUBIC:
        a = size_of(x)
        return p[0] * a * a * a * a / 4.0 + (p[1] * a * a * a + p[2] * x * x * x) / 3.0
    if kind in (FRICTION, QUADRATIC):
        return 0.0 * x
    f = respond(kind, p, x, 0.0 * x, z, x + 0.0 * w)[0]
    return 0.5 * f * f / p[0] if p[0].real != 0.0 else 0.0 * f


@compiled
def walk(kinds: Any, p: Any, x: Any, v: Any, z: Any, w: Any, force: Any) -> None:
    """Forces along a path (samples, laws); the state is carried on in place."""
    for t in range(x.shape[0]):
        for i in range(x.shape[1]):
            f, _, _, z[i], w[i] = respond(kinds[i], p[i], x[t, i], v[t, i], z[i], w[i])
            force[t, i] = f


@compiled
def once(kinds: Any, p: Any, x: Any, v: Any, z: Any, w: Any, out: Any) -> None:
    """Answers of all laws at one instant, ``out`` (laws, 5)."""
    for i in range(len(kinds)):
        f, kx, kv, z1, w1 = respond(kinds[i], p[i], x[i], v[i], z[i], w[i])
        out[i, 0], out[i, 1], out[i, 2], out[i, 3], out[i, 4] = f, kx, kv, z1, w1


@compiled
def all_stored(kinds: Any, p: Any, x: Any, z: Any, w: Any, out: Any) -> None:
    """Stored energies of all laws."""
    for i in range(len(kinds)):
        out[i] = stored(kinds[i], p[i], x[i], z[i], w[i])
