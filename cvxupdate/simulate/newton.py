"""The forces at the end of a step: Newton's method on one unknown for each law, compiled
(what calls the laws is compiled with them: `kernel`)."""

from __future__ import annotations

from typing import Any, NamedTuple

from cvxupdate.forces.compiled import compiled
from cvxupdate.forces.scalar import respond

MOST_ITERATIONS = 40
DAMPED = 12  # iterations after which Newton's step is halved: piecewise linear laws may cycle


class Batch(NamedTuple):
    """The laws: ``kinds`` (m,), parameters ``p`` (m, 4), whether they are Coulomb's, ``hard``."""

    kinds: Any
    p: Any
    hard: Any


@compiled
def solve(J: Any, r: Any) -> None:
    """J⁻¹ r in place of r, by elimination with pivots."""
    n = len(r)
    for c in range(n):
        best = c
        for i in range(c + 1, n):
            if abs(J[i, c]) > abs(J[best, c]):
                best = i
        if best != c:
            for k in range(n):
                J[c, k], J[best, k] = J[best, k], J[c, k]
            r[c], r[best] = r[best], r[c]
        for i in range(c + 1, n):
            if J[i, c] != 0.0:
                factor = J[i, c] / J[c, c]
                for k in range(c, n):
                    J[i, k] -= factor * J[c, k]
                r[i] -= factor * r[c]
    for c in range(n - 1, -1, -1):
        for k in range(c + 1, n):
            r[c] -= J[c, k] * r[k]
        r[c] /= J[c, c]


@compiled
def equations(
    laws: Batch, z: Any, w: Any, x: Any, v: Any, y: Any, Dx: Any, Dv: Any, out: Any, J: Any
) -> None:
    """Residuals ``out[0]`` of y = f(x, v) and their derivatives; states at the end in ``out[1:3]``.

    Friction: v = 0 as long as y is within the limit, else y at the limit (Alart and Curnier 1991).
    """
    m = len(y)
    for i in range(m):
        if laws.hard[i]:
            most, reach = laws.p[i, 0], y[i] + v[i] / Dv[i, i]
            sticks = abs(reach.real) <= most.real
            sign = 1.0 if reach.real > 0.0 else -1.0
            out[0, i] = -v[i] / Dv[i, i] if sticks else y[i] - sign * most
            out[1, i], out[2, i] = z[i], w[i]
            for j in range(m):
                J[i, j] = Dv[i, j] / Dv[i, i] if sticks else 0.0
            J[i, i] = 1.0
            continue
        f, kx, kv, out[1, i], out[2, i] = respond(laws.kinds[i], laws.p[i], x[i], v[i], z[i], w[i])
        out[0, i] = y[i] - f
        for j in range(m):
            J[i, j] = kx * Dx[i, j] + kv * Dv[i, j]
        J[i, i] += 1.0


@compiled
def newton(
    laws: Batch,
    z: Any,
    w: Any,
    xp: Any,
    vp: Any,
    y: Any,
    Dx: Any,
    Dv: Any,
    out: Any,
    J: Any,
    x: Any,
    v: Any,
    close: float,
) -> bool:
    """The forces y at the end of a step, and x, v there; False where none were found."""
    m, last = len(y), False
    for turn in range(MOST_ITERATIONS):
        for i in range(m):
            x[i], v[i] = xp[i], vp[i]
            for j in range(m):
                x[i] -= Dx[i, j] * y[j]
                v[i] -= Dv[i, j] * y[j]
        equations(laws, z, w, x, v, y, Dx, Dv, out, J)
        if last:
            return True
        solve(J, out[0])
        scale, moved = 0.0, 0.0
        for i in range(m):
            y[i] -= out[0, i] * (0.5 if turn >= DAMPED else 1.0)
            scale, moved = max(scale, abs(y[i].real)), max(moved, abs(out[0, i].real))
        if not moved < 1e300:
            return False
        last = moved <= close * scale  # once more: x and v, and the imaginary part, at this y
    return False
