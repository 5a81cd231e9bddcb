"""Simulation in time of a structure with nonlinear elements.

The forces are straight between samples, as a recording says no more. How it is done stands in
`kernel.py`; accuracy is governed by ``tolerance``, the error that one step may leave in the
velocity of an element, relative to the largest so far.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike

from cvxupdate.errors import ConvergenceError, InputError
from cvxupdate.forces.laws import Laws, Number, Real
from cvxupdate.simulate.kernel import Now, Scratch
from cvxupdate.simulate.march import Drive, Record, march
from cvxupdate.simulate.newton import Batch
from cvxupdate.simulate.system import System
from cvxupdate.simulate.transition import transitions

TOLERANCE = 1e-5
"""Of a step's velocity; over a record errors add up to about this."""
REACH = 1.5
"""ω h at the coarsest step: the cubic that stands for the motion in a step needs four steps to a
period; the error decides where more are needed."""
FINER = 10
"""Halvings below the coarsest step: where a jump of friction is located, to a thousandth."""
CHUNK = 4_000_000
"""Numbers of modal states held at a time."""
STEP = 1e-30
"""Of the complex step."""


@dataclass(frozen=True)
class Simulated:
    """What a simulation says at every sample: ``displacement``, ``velocity``, ``acceleration``
    (samples, o) of the outputs; ``x``, ``v``, ``force`` (samples, m) of the elements; ``work`` (m,)
    done on them in J; ``states`` (samples, 2 blocks) where they were kept; ``steps`` taken."""

    displacement: Number
    velocity: Number
    acceleration: Number
    x: Number
    v: Number
    force: Number
    work: Number
    steps: int
    states: Number | None = None


@dataclass(frozen=True)
class Start:
    """Initial conditions of the modes: displacement ``q`` and velocity ``u`` (n,), mass-normalised;
    ``modal_start`` makes them of physical ones."""

    q: Real
    u: Real


def simulate(
    system: System,
    force: ArrayLike,
    rate: float,
    start: Start | None = None,
    offset: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
    keep: bool = False,
) -> Simulated:
    """The response to ``force`` (samples, r) in N, sampled at ``rate`` (Hz).

    ``offset`` (samples, m) in m is imposed motion of the far end of each element, taken off its x
    (a shaker's table, a rig). From rest unless ``start`` says else. ``keep`` keeps the modal
    states.

    Raises
    ------
    InputError
        Wrong shapes, or numbers that are not finite.
    ConvergenceError
        The forces of a step were not found, however short it was made.
    """
    p = _checked(force, system.drive.shape[1], "force")
    move = None if offset is None else _checked(offset, system.laws.size, "offset")
    if move is not None and len(move) != len(p):
        raise InputError(f"simulate: {len(p)} samples of force but {len(move)} of offset.")
    return _run(system, p, rate, start, move, tolerance, keep)


def sensitivities(
    system: System,
    force: ArrayLike,
    rate: float,
    wanted: Sequence[tuple[int, str]],
    start: Start | None = None,
    offset: ArrayLike | None = None,
    tolerance: float = TOLERANCE,
    quantity: str = "displacement",
) -> Real:
    """Derivatives (samples, o, wanted) of the outputs' ``quantity`` with respect to parameters of
    laws, each (law, name) as (3, "k3").

    They are those of the discrete solution, exact to rounding: the same steps by complex numbers
    (complex-step differentiation, Squire and Trapp 1998). Where an event moves, as a gap closes, it
    moves along; at a jump of friction the instant is held to the step in which it was located.
    """
    p = _checked(force, system.drive.shape[1], "force")
    move = None if offset is None else _checked(offset, system.laws.size, "offset")
    out = []
    for law, name in wanted:
        values = system.laws.values.astype(complex)
        values[system.laws.parameter(law, name)] += 1j * STEP
        moved = replace(system, laws=Laws(system.laws.kinds, values))
        run = _run(moved, p, rate, start, move, tolerance, False)
        out.append(np.imag(getattr(run, quantity)) / STEP)
    return np.stack(out, axis=-1)


def modal_start(system: System, M: Real, shapes: Real, q: ArrayLike, u: ArrayLike) -> Start:
    """Initial conditions from displacements and velocities (N,) with the mass matrix M (N, N) and
    the mass-normalised ``shapes`` (N, n) of the system's modes."""
    return Start(shapes.T @ (M @ np.asarray(q)), shapes.T @ (M @ np.asarray(u)))


def _checked(a: ArrayLike, columns: int, what: str) -> Real:
    out = np.asarray(a, dtype=float)
    if out.ndim != 2 or out.shape[1] != columns or len(out) < 2:
        raise InputError(
            f"simulate: {what} must be (samples, {columns}) with 2 samples or more; got "
            f"{out.shape}."
        )
    if not np.all(np.isfinite(out)):
        raise InputError(f"simulate: {what} has values that are not finite.")
    return out


def _levels(system: System, dt: float) -> int:
    """The coarsest level: ω h ≤ `REACH` for the modes that the elements see."""
    rates = np.abs(np.linalg.eigvals(system.A)).max(axis=1) if len(system.A) else np.zeros(0)
    seen = np.abs(system.pull).reshape(len(system.A), 2, -1).max(axis=(1, 2), initial=0.0)
    top = float(rates[seen > 1e-8 * seen.max(initial=0.0)].max(initial=0.0))
    return max(0, int(np.ceil(np.log2(max(top * dt / REACH, 1e-9)))))


def _run(
    system: System,
    force: Real,
    rate: float,
    start: Start | None,
    offset: Real | None,
    tolerance: float,
    keep: bool,
) -> Simulated:
    dt, m, kind = 1.0 / rate, system.laws.size, system.laws.values.dtype
    first = _levels(system, dt)
    at = transitions(system, dt, first + FINER + 1)
    off = np.zeros((len(force), m)) if offset is None else -offset
    offv = np.gradient(off, dt, axis=0) if offset is not None else off
    s = _state(system, start).astype(kind)
    laws = Batch(system.laws.kinds, system.laws.values, system.laws.set_valued)
    now = _begin(system, s, off[0], offv[0])
    room = Scratch(
        np.zeros_like(s), np.zeros_like(s), np.zeros((14, m), kind), np.zeros((m, m), kind)
    )
    control = np.array([tolerance, first, first, dt / 2**first, 0.0, 0.0])
    parts, held, failed = [], [], 0
    length = max(2, CHUNK // max(1, len(s)))
    for begin in range(0, len(force) - 1, length):
        rows = slice(begin, min(begin + length + 1, len(force)))
        drive = Drive(
            force[rows] @ system.drive.T,
            np.ascontiguousarray(off[rows]),
            np.ascontiguousarray(offv[rows]),
        )
        kept = _record(now, len(drive.g))
        failed += march(at, laws, drive, now, room, dt, control, kept)
        drop = 0 if begin == 0 else 1
        parts.append([a[drop:] for a in _outputs(system, force[rows], kept)])
        held.append(kept.s[drop:] if keep else kept.s[:0])
    if failed:
        raise ConvergenceError(
            f"simulate: the internal forces of {failed} of {int(control[5])} steps were not found, "
            f"the shortest {dt / 2 ** (first + FINER):.3g} s long. A contact may be far stiffer "
            "than the structure, or a softening spring have no equilibrium: check its parameters."
        )
    y, u, a, x, v, f = (np.concatenate(c) for c in zip(*parts, strict=True))
    states = np.concatenate(held) if keep else None
    return Simulated(y, u, a, x, v, f, now.work.copy(), int(control[5]), states)


def _state(system: System, start: Start | None) -> Real:
    if start is None:
        return np.zeros(2 * len(system.A))
    n = system.modes
    if len(start.q) != n or len(start.u) != n:
        raise InputError(f"simulate: the start must have {n} modes; got {len(start.q)}.")
    return system.states(start.q, start.u)


def _begin(system: System, s: Number, off: Real, offv: Real) -> Now:
    """The first instant: laws without a past at the place where they are; friction not yet at
    work."""
    x, v = system.x_rows @ s + off, system.v_rows @ s + offv
    past = system.laws.start()
    answer = system.laws.respond(x, v, past)
    zero = np.zeros(system.laws.size, dtype=s.dtype)
    f = np.where(system.laws.set_valued, 0.0, answer.force).astype(s.dtype)
    z, w = answer.state.z.astype(s.dtype), answer.state.w.astype(s.dtype)
    return Now(
        s, z, w, f, zero.copy(), np.asarray(x, dtype=s.dtype), np.asarray(v, dtype=s.dtype), zero
    )


def _record(now: Now, samples: int) -> Record:
    out = Record(
        *(np.zeros((samples, len(a)), dtype=now.s.dtype) for a in (now.s, now.x, now.v, now.f))
    )
    out.s[0], out.x[0], out.v[0], out.f[0] = now.s, now.x, now.v, now.f
    return out


def _outputs(system: System, force: Real, kept: Record) -> list[Number]:
    rate = np.einsum("bij,tbj->tbi", system.A, kept.s.reshape(len(kept.s), -1, 2))
    rate = rate.reshape(kept.s.shape) + force @ system.drive.T - kept.f @ system.pull.T
    return [
        kept.s @ system.y_rows.T,
        kept.s @ system.yv_rows.T,
        rate @ system.yv_rows.T,
        kept.x,
        kept.v,
        kept.f,
    ]
