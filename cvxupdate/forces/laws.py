"""Laws of internal force: what an element between two DOFs, or a DOF and ground, does beyond K and
C.

x (m or rad) is how far the element's second end moves from its first, or its only DOF from ground,
v the rate of it; a positive force opposes positive x. A `Laws` is a batch: every method runs over
all of them at once.

| law | force | source |
|---|---|---|
| `linear` | k x + c v | |
| `cubic` | k3 x³ + k2 x·abs(x) + even x² | Worden and Tomlinson 2001, section 2.2 |
| `clearance` | k (x − gap) in contact | the same, section 2.2 |
| `friction` | force · sgn(v) in slip, whatever holds it in stick | Coulomb |
| `jenkins` | spring and slider in series | Jenkin 1922; Iwan 1966, J. Appl. Mech. 33 |
| `iwan` | Jenkins elements in parallel | Iwan 1966 |
| `bouc_wen` | force · u with u from a differential equation | Wen 1976, J. Eng. Mech. Div. 102 |
| `quadratic` | c2 abs(v) v | Worden and Tomlinson 2001, section 2.2 |
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from cvxupdate.errors import ModelError
from cvxupdate.forces.kinds import (
    BOTH,
    BOUC_WEN,
    CLEARANCE,
    CUBIC,
    FRICTION,
    JENKINS,
    LINEAR,
    QUADRATIC,
)

Real = NDArray[np.float64]
Number = NDArray[Any]  # real, or complex for a complex step

NAMES = ("linear", "cubic", "clearance", "friction", "jenkins", "bouc_wen", "quadratic")
"""By kind."""
PARAMETERS: Mapping[str, tuple[str, ...]] = {
    "linear": ("k", "c"),
    "cubic": ("k3", "k2", "even"),
    "clearance": ("k", "gap"),
    "friction": ("force",),
    "jenkins": ("k", "force", "play"),
    "bouc_wen": ("k", "force", "n", "gamma"),
    "quadratic": ("c2",),
}
"""What the columns of ``values`` are called, law by law."""


@dataclass(frozen=True)
class State:
    """What laws with memory remember, (laws,) each: ``z`` where the slider stands (m) or Bouc–Wen's
    u (1); ``w`` where the element was (m), for Bouc–Wen."""

    z: Number
    w: Number


@dataclass(frozen=True)
class Response:
    """``force`` (laws,), its derivatives ``stiffness`` ∂f/∂x and ``damping`` ∂f/∂v with the state
    at the beginning held, and the ``state`` at the end."""

    force: Number
    stiffness: Number
    damping: Number
    state: State


@dataclass(frozen=True)
class Laws:
    """m laws: ``kinds`` (m,) numbers into `NAMES`; ``values`` (m, 4) their parameters in the order
    of `PARAMETERS` (for a clearance the third is the side of contact: 1, −1, or 0 for both)."""

    kinds: NDArray[np.int64]
    values: Number

    @property
    def size(self) -> int:
        """m."""
        return len(self.kinds)

    @property
    def set_valued(self) -> NDArray[np.bool_]:
        """Which of them have a force at rest that only equilibrium decides."""
        return self.kinds == FRICTION

    def start(self, x: ArrayLike = 0.0) -> State:
        """The state without a past: sliders and elements at ``x``, no force."""
        kind = np.result_type(self.values, x)
        place = np.broadcast_to(np.asarray(x, dtype=kind), (self.size,))
        slides = self.kinds == JENKINS
        return State(np.where(slides, place, 0.0).astype(kind), place.copy())

    def respond(self, x: Number, v: Number, state: State) -> Response:
        """Forces at x, v (m,) after a straight move from ``state``."""
        kind = np.result_type(self.values, x, v, state.z)
        out = np.zeros((self.size, 5), dtype=kind)
        here, rate, z, w = (_as(kind, a) for a in (x, v, state.z, state.w))
        _loops().once(self.kinds, _as(kind, self.values), here, rate, z, w, out)
        return Response(out[:, 0], out[:, 1], out[:, 2], State(out[:, 3], out[:, 4]))

    def force(self, x: Number, v: Number, state: State) -> Number:
        """`respond`'s forces alone (m,), N or N·m."""
        return self.respond(x, v, state).force

    def trace(self, x: Number, v: Number, state: State | None = None) -> tuple[Number, State]:
        """Forces (samples, m) along a path x, v (samples, m), and the state at its end."""
        kind = np.result_type(self.values, x, v)
        first = self.start(x[0]) if state is None else state
        z, w = np.array(first.z, dtype=kind), np.array(first.w, dtype=kind)
        out = np.zeros(np.shape(x), dtype=kind)
        values, path, rate = (_as(kind, a) for a in (self.values, x, v))
        _loops().walk(self.kinds, values, path, rate, z, w, out)
        return out, State(z, w)

    def stored(self, x: Number, state: State) -> Number:
        """Energy (m,) in J that can be had back."""
        kind = np.result_type(self.values, x, state.z)
        out = np.zeros(self.size, dtype=kind)
        values, here, z, w = (_as(kind, a) for a in (self.values, x, state.z, state.w))
        _loops().all_stored(self.kinds, values, here, z, w, out)
        return out

    def events(self, x: Real, v: Real, state: State) -> Real:
        """(m, 3): functions whose zeros are events, NaN where a law has none: contact (above 0
        inside), reversal (the velocity, of laws whose force depends on its sign), slip (above 0
        where the spring's force would exceed the limit)."""
        out = np.full((self.size, 3), np.nan)
        k, second, third = self.values.real[:, 0], self.values.real[:, 1], self.values.real[:, 2]
        gaps = self.kinds == CLEARANCE
        one_sided = np.where(third < 0.0, second - x, x - second)
        out[gaps, 0] = np.where(third == BOTH, np.abs(x) - second, one_sided)[gaps]
        turning = np.isin(self.kinds, (FRICTION, JENKINS, BOUC_WEN))
        out[turning, 1] = np.asarray(v)[turning]
        sliders = self.kinds == JENKINS
        bent = np.maximum(np.abs(x - np.real(state.z)) - 0.5 * third, 0.0)
        out[sliders, 2] = (k * bent - second)[sliders]
        return out

    def take(self, rows: ArrayLike) -> Laws:
        """Some of them."""
        return Laws(self.kinds[np.asarray(rows)], self.values[np.asarray(rows)])

    def parameter(self, law: int, name: str) -> tuple[int, int]:
        """Where a parameter of a law stands in ``values``.

        Raises
        ------
        ModelError
            The law has no such parameter.
        """
        own = PARAMETERS[NAMES[self.kinds[law]]]
        if name not in own:
            raise ModelError(f"{NAMES[self.kinds[law]]} has no {name!r}. It has {', '.join(own)}.")
        return law, own.index(name)


def _loops() -> Any:
    """The compiled loops; the compiler loads with the first of them that is wanted."""
    from cvxupdate.forces import scalar

    return scalar


def join(parts: Sequence[Laws]) -> Laws:
    """All laws of ``parts``, in order."""
    if not parts:
        return Laws(np.zeros(0, dtype=np.int64), np.zeros((0, 4)))
    return Laws(np.concatenate([p.kinds for p in parts]), np.concatenate([p.values for p in parts]))


def linear(k: ArrayLike, c: ArrayLike = 0.0) -> Laws:
    """Springs k (N/m) with dashpots c (N·s/m) beside them."""
    return _laws(LINEAR, k, c)


def cubic(k3: ArrayLike, k2: ArrayLike = 0.0, even: ArrayLike = 0.0) -> Laws:
    """k3 (N/m³), above 0 hardening, below softening; k2 (N/m²) of x|x|; ``even`` (N/m²) of x²,
    which stiffens one way and softens the other."""
    return _laws(CUBIC, k3, k2, even)


def clearance(k: ArrayLike, gap: ArrayLike, sides: Literal["one", "two"] = "one") -> Laws:
    """Contact of stiffness k (N/m) beyond ``gap`` (m). One-sided: where x is above a gap of 0 or
    more, or below a negative one. Two-sided: where |x| is above it.

    Raises
    ------
    ModelError
        A negative stiffness, or a negative gap on both sides.
    """
    _least("clearance", 0.0, k=k)
    side: Any = 0.0
    if sides == "two":
        _least("clearance on both sides", 0.0, gap=gap)
    else:
        side = np.where(np.signbit(np.asarray(gap, dtype=float)), -1.0, 1.0)
    return _laws(CLEARANCE, k, gap, side)


def friction(force: ArrayLike) -> Laws:
    """Coulomb friction of the given force (N)."""
    _least("friction", 0.0, force=force)
    return _laws(FRICTION, force)


def jenkins(k: ArrayLike, force: ArrayLike, play: ArrayLike = 0.0) -> Laws:
    """Spring k (N/m), slider that gives way at ``force`` (N), and a free play (m, its whole width)
    in series: after a reversal the force falls to zero, stays there over ``play``, and grows
    again."""
    _least("jenkins", 0.0, force=force, play=play)
    _least("jenkins", np.finfo(float).tiny, k=k)
    return _laws(JENKINS, k, force, play)


def iwan(k: ArrayLike, force: ArrayLike) -> Laws:
    """Jenkins elements in parallel at one place: k (n,) and slip forces (n,), none negative. The
    loop's initial stiffness is Σk, its limit Σ force (Iwan 1966)."""
    return jenkins(np.atleast_1d(k), np.atleast_1d(force))


def bouc_wen(k: ArrayLike, force: ArrayLike, n: ArrayLike = 1.0, gamma: ArrayLike = 0.5) -> Laws:
    """Initial stiffness k (N/m), limit ``force`` (N), sharpness n ≥ 1, and γ of 0.5 to 1: at 0.5
    unloading begins with k (Wen 1976 with A = k, β = 1 − γ, scaled to the limit)."""
    _least("bouc_wen", np.finfo(float).tiny, k=k, force=force)
    _least("bouc_wen", 1.0, n=n)
    _least("bouc_wen", 0.5, gamma=gamma)
    return _laws(BOUC_WEN, k, force, n, gamma)


def quadratic(c2: ArrayLike) -> Laws:
    """c2 (N·s²/m²) of |v|v."""
    return _laws(QUADRATIC, c2)


def _laws(kind: int, *columns: ArrayLike) -> Laws:
    rows = np.broadcast_arrays(*(np.atleast_1d(np.asarray(c)) for c in columns))
    values = np.zeros((len(rows[0]), 4), dtype=np.result_type(*rows, float))
    for j, column in enumerate(rows):
        values[:, j] = column
    return Laws(np.full(len(values), kind, dtype=np.int64), values)


def _least(law: str, least: float, **values: ArrayLike) -> None:
    for name, value in values.items():
        low = float(np.min(np.real(np.asarray(value))))
        if not low >= least:
            words = "above 0" if 0.0 < least < 1e-300 else f"{least:g} or more"
            raise ModelError(f"{law}: {name} must be {words}; got {low:g}.")


def _as(kind: Any, a: ArrayLike) -> Number:
    return np.ascontiguousarray(a, dtype=kind)
