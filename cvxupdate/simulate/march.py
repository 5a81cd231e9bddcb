"""From sample to sample in steps of a length that their errors decide, compiled (with
the laws: `kernel`)."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np

from cvxupdate.forces.compiled import compiled
from cvxupdate.simulate.kernel import Now, Scratch, Steps, accept, step
from cvxupdate.simulate.newton import Batch

GROW = 64.0  # a step is doubled where its error is this far below the limit: it grows by 2⁴ or more


class Record(NamedTuple):
    """What is kept at every sample: ``s`` (samples, 2 blocks), ``x``, ``v``, ``f`` (samples, m)."""

    s: Any
    x: Any
    v: Any
    f: Any


class Drive(NamedTuple):
    """At every sample: modal forces ``g`` (samples, 2 blocks), imposed motion of the far ends of
    elements as what it adds to x and v, ``off``, ``offv`` (samples, m)."""

    g: Any
    off: Any
    offv: Any


@compiled
def between(a: Any, k: int, part: float, out: Any) -> None:
    """``out`` = a at ``part`` of the way from row k to the next."""
    for i in range(a.shape[1]):
        out[i] = a[k, i] if part == 0.0 else (1.0 - part) * a[k, i] + part * a[k + 1, i]


@compiled
def moved(drive: Drive, k: int, part: float, dt: float, off: Any, offv: Any) -> None:
    """Imposed motion between samples: the cubic through displacements and velocities."""
    a, b = 1.0 - part, part
    for i in range(drive.off.shape[1]):
        x0, v0 = drive.off[k, i], drive.offv[k, i]
        x1 = drive.off[k + 1, i] if b > 0.0 else x0
        v1 = drive.offv[k + 1, i] if b > 0.0 else v0
        off[i] = a * a * (1.0 + 2.0 * b) * x0 + b * b * (1.0 + 2.0 * a) * x1
        off[i] += dt * a * b * (a * v0 - b * v1)
        offv[i] = 6.0 * a * b * (x1 - x0) / dt + a * (a - 2.0 * b) * v0 + b * (b - 2.0 * a) * v1


@compiled
def march(
    at: Steps,
    laws: Batch,
    drive: Drive,
    now: Now,
    room: Scratch,
    dt: float,
    control: Any,
    kept: Record,
) -> int:
    """From sample to sample; returns how many steps had no solution even at the finest level.

    ``control``: tolerance, coarsest level, the present level, length of the step before, largest
    velocity so far; the last three are carried on in place. ``control[5]`` counts steps.
    """
    finest, coarsest, failed = at.E.shape[0] - 1, int(control[1]), 0
    whole, m = 2**finest, len(now.f)
    l = int(control[2])
    ends = np.zeros((2, drive.g.shape[1]), dtype=drive.g.dtype)
    shift = np.zeros((2, m))
    for k in range(drive.g.shape[0] - 1):
        done = 0
        while done < whole:
            size = whole >> l
            h = dt * size / whole
            between(drive.g, k, done / whole, ends[0])
            between(drive.g, k, (done + size) / whole, ends[1])
            moved(drive, k, (done + size) / whole, dt, shift[0], shift[1])
            good, error = step(
                at, laws, now, room, l, h, control[3], ends[0], ends[1], shift[0], shift[1]
            )
            fastest = control[4]
            for i in range(m):
                fastest = max(fastest, abs(room.laws[4, i].real))
            limit = control[0] * fastest
            if l < finest and (not good or error > limit):
                l += 1
                continue
            failed += 0 if good else 1
            accept(at, laws, now, room, l, h)
            done += size
            control[3], control[4] = h, fastest
            control[5] += 1.0
            if l > coarsest and GROW * error < limit and done % (2 * size) == 0:
                l -= 1
        for i in range(len(now.s)):  # to assign whole rows is compiled twice as long
            kept.s[k + 1, i] = now.s[i]
        for i in range(m):
            kept.x[k + 1, i], kept.v[k + 1, i], kept.f[k + 1, i] = now.x[i], now.v[i], now.f[i]
    control[2] = l
    return failed
