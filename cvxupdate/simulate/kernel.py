"""One step after another, compiled.

Between two instants the internal forces follow a parabola: their values at both ends and a bubble b
in the middle. The linear part answers to that exactly, s₁ = E s₀ + W₀ g₀ + W₁ g₁ + W_b b, so only
the forces at the end are unknown, one for each law, from a small system that is solved by Newton's
method with the consistent tangents (an exponential integrator: Hochbruck and Ostermann 2010; the
end is implicit, as in Newmark's method). Coulomb friction has no value at rest: its force is
constant over a step and follows from the velocity at the end, stick where a force within the limit
makes that zero (Moreau 1988), so a step in which it jumps is halved until the jump is located. The
bubble's change from step to step is the estimate of the error and decides the length: a power of
two of the sampling interval. A change of `cvxupdate.forces.scalar` needs a change here, too: the
machine code kept beside this module has those laws in it (last: x² beside x³).
"""

from __future__ import annotations

from typing import Any, NamedTuple

from cvxupdate.forces.compiled import compiled
from cvxupdate.forces.scalar import respond
from cvxupdate.simulate.newton import Batch, newton

CLOSE = 1e-12  # of the largest force: where Newton's iteration ends
ROUGH = 1e-4  # the same while the bubble is still that of the step before


class Steps(NamedTuple):
    """The linear part over a step of every length, first index the level: transition ``E`` and
    weights ``W0``, ``W1``, ``Wb`` (levels, blocks, 2, 2); how element displacements and velocities
    answer to forces at the end (``Dx``, ``Dv``, friction: over the step) and to bubbles (``Bx``,
    ``Bv``), (levels, m, m). ``pull``, ``x_rows``, ``v_rows`` (m, 2 blocks)."""

    E: Any
    W0: Any
    W1: Any
    Wb: Any
    Dx: Any
    Dv: Any
    Bx: Any
    Bv: Any
    pull: Any
    x_rows: Any
    v_rows: Any


class Now(NamedTuple):
    """What a step starts from, changed in place: modal state ``s``; of the laws ``z``, ``w``,
    ``f``, bubble ``b``, displacement ``x``, velocity ``v``, ``work`` done on them (J)."""

    s: Any
    z: Any
    w: Any
    f: Any
    b: Any
    x: Any
    v: Any
    work: Any


class Scratch(NamedTuple):
    """Room for a step's results before it is accepted."""

    s: Any
    g: Any
    laws: Any
    J: Any


@compiled
def through(E: Any, s: Any, out: Any) -> None:
    """``out`` = E s, block by block."""
    for k in range(E.shape[0]):
        a, b = s[2 * k], s[2 * k + 1]
        out[2 * k] = E[k, 0, 0] * a + E[k, 0, 1] * b
        out[2 * k + 1] = E[k, 1, 0] * a + E[k, 1, 1] * b


@compiled
def add(W: Any, g: Any, out: Any) -> None:
    """``out`` += W g, block by block."""
    for k in range(W.shape[0]):
        a, b = g[2 * k], g[2 * k + 1]
        out[2 * k] += W[k, 0, 0] * a + W[k, 0, 1] * b
        out[2 * k + 1] += W[k, 1, 0] * a + W[k, 1, 1] * b


@compiled
def less(pull: Any, f: Any, out: Any) -> None:
    """``out`` −= pull f."""
    for j in range(len(f)):
        if f[j] != 0.0:
            for k in range(len(out)):
                out[k] -= pull[j, k] * f[j]


@compiled
def rows_times(rows: Any, s: Any, offset: Any, out: Any) -> None:
    """``out`` = rows s + offset."""
    for i in range(rows.shape[0]):
        total = offset[i] + 0.0 * s[0]
        for k in range(rows.shape[1]):
            total += rows[i, k] * s[k]
        out[i] = total


@compiled
def bubbles(laws: Batch, now: Now, h: float, x: Any, v: Any, y: Any, b: Any, mid: Any) -> None:
    """``b``, how far the forces in the middle lie above the chord, and ``mid`` the states there.

    The middle of the motion is that of the cubic through both ends.
    """
    for i in range(len(y)):
        xm = 0.5 * (now.x[i] + x[i]) + 0.125 * h * (now.v[i] - v[i])
        vm = 1.5 * (x[i] - now.x[i]) / h - 0.25 * (now.v[i] + v[i])
        mid[0, i], mid[1, i] = now.z[i], now.w[i]
        b[i] = 0.0 * y[i]
        if not laws.hard[i]:
            f, _, _, mid[0, i], mid[1, i] = respond(
                laws.kinds[i], laws.p[i], xm, vm, now.z[i], now.w[i]
            )
            b[i] = f - 0.5 * (now.f[i] + y[i])


@compiled
def jump(most: float, before: float, after: float) -> bool:
    """Whether friction changes at once: it turns, or what slipped sticks."""
    return (before * after < 0.0 and abs(after) >= most) or abs(before) >= most > abs(after)


@compiled
def error_of(laws: Batch, now: Now, h: float, last: float, y: Any, b: Any, Dv: Any) -> float:
    """The error of a step in velocity: what the bubble's change would do, and for friction what
    happens at a jump."""
    worst, ratio = 0.0, (h / last) ** 2
    for i in range(len(y)):
        own = 0.0
        for j in range(len(y)):
            if not laws.hard[j]:
                own += abs(Dv[i, j] * (b[j] - ratio * now.b[j]).real)
                continue
            most, before, after = laws.p[j, 0].real, now.f[j].real, y[j].real
            if jump(most, before, after):
                own += abs(Dv[i, j] * (after - before))
        worst = max(worst, own)
    return worst


@compiled
def step(
    at: Steps,
    laws: Batch,
    now: Now,
    room: Scratch,
    l: int,
    h: float,
    last: float,
    g0: Any,
    g1: Any,
    off: Any,
    offv: Any,
) -> tuple[bool, float]:
    """A step of level ``l`` from ``now`` into ``room``: whether it has a solution, its error."""
    n, m = len(now.s), len(now.f)
    xp, vp, y, x = room.laws[0], room.laws[1], room.laws[2], room.laws[3]
    v, b, start = room.laws[4], room.laws[5], room.laws[6]
    out, mid, shifted = room.laws[7:10], room.laws[10:12], room.laws[12:14]
    for j in range(m):
        start[j] = 0.0 * now.f[j] if laws.hard[j] else now.f[j]
        y[j] = now.f[j]
        b[j] = now.b[j] * (h / last) ** 2
        mid[0, j], mid[1, j] = now.z[j], now.w[j]
    for k in range(n):
        room.g[k] = g0[k]
    less(at.pull, start, room.g)
    through(at.E[l], now.s, room.s)
    add(at.W0[l], room.g, room.s)
    add(at.W1[l], g1, room.s)
    rows_times(at.x_rows, room.s, off, xp)
    rows_times(at.v_rows, room.s, offv, vp)
    for turn in range(2):
        for i in range(m):
            shifted[0, i], shifted[1, i] = xp[i], vp[i]
            for j in range(m):
                shifted[0, i] -= at.Bx[l, i, j] * b[j]
                shifted[1, i] -= at.Bv[l, i, j] * b[j]
        if not newton(
            laws,
            mid[0],
            mid[1],
            shifted[0],
            shifted[1],
            y,
            at.Dx[l],
            at.Dv[l],
            out,
            room.J,
            x,
            v,
            ROUGH if turn == 0 else CLOSE,
        ):
            return False, 0.0
        if turn == 0:
            bubbles(laws, now, h, x, v, y, b, mid)
    return True, error_of(laws, now, h, last, y, b, at.Dv[l])


@compiled
def accept(at: Steps, laws: Batch, now: Now, room: Scratch, l: int, h: float) -> None:
    """The step in ``room`` becomes ``now``."""
    n, m = len(now.s), len(now.f)
    y, x, v, b = room.laws[2], room.laws[3], room.laws[4], room.laws[5]
    z, w, total = room.laws[8], room.laws[9], room.laws[0]
    for j in range(m):
        if laws.hard[j]:
            now.work[j] += y[j] * (x[j] - now.x[j])
        else:
            vm = 1.5 * (x[j] - now.x[j]) / h - 0.25 * (now.v[j] + v[j])
            fm = b[j] + 0.5 * (now.f[j] + y[j])
            now.work[j] += h / 6.0 * (now.f[j] * now.v[j] + 4.0 * fm * vm + y[j] * v[j])
    for part in range(3):  # what ends with y, what starts, the bubbles
        for k in range(n):
            room.g[k] = 0.0 * now.s[0]
        for j in range(m):
            total[j] = b[j] if part == 2 else y[j]
            if part == 1 and not laws.hard[j]:  # only friction acts over the whole step
                total[j] = 0.0 * y[j]
        less(at.pull, total, room.g)
        add(at.W1[l] if part == 0 else at.W0[l] if part == 1 else at.Wb[l], room.g, room.s)
    for k in range(n):
        now.s[k] = room.s[k]
    for j in range(m):
        now.z[j], now.w[j], now.f[j], now.b[j] = z[j], w[j], y[j], b[j]
        now.x[j], now.v[j] = x[j], v[j]
