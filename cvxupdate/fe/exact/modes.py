"""Natural modes of models with exact members, none missed (Wittrick and Williams 1971).

The number of natural frequencies below ω is that of the members with their nodes held, which is
known in closed form, and the negative pivots of Z(ω). It is bisected until each mode, or each group
of repeated ones, stands alone; then the linear eigenproblem Z(ω₀) x = −δ ∂Z/∂ω² x of a point nearby
converges as Newton's method does, and the count has the last word. A mode that moves no node at
all (between clamped ends, all alike) is counted too; its shape on the nodes is zero.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import scipy.linalg as la
import scipy.sparse as sp
import scipy.sparse.linalg as spla
from numpy.typing import NDArray

from cvxupdate.errors import ModelError
from cvxupdate.fe.exact.correction import Beyond
from cvxupdate.fe.factor import factored
from cvxupdate.fe.model import Matrices

Real = NDArray[np.float64]

CLOSE = 1e-11
"""Relative accuracy of a frequency: rounding of Z, not of ω, decides it."""
ALIKE = 1e-9
"""Relative distance at which frequencies are taken together, with shapes that span theirs."""
SMALL = 40
"""DOFs up to which the pivots of Z are its eigenvalues."""
DENSE = 400
"""DOFs up to which the linear eigenproblem is solved whole."""
NEAR = 0.02
"""Relative width of a bracket in ω from which Newton's steps are taken."""
STEPS = 60
SECTIONS = 12
"""Points at which a bracket is divided at a time, where the members are few."""
LOWEST = 1e-2
"""Of the first natural frequency of the Taylor series: below it only rigid bodies move, and far
below it rounding of Z would count for them."""
HIGHEST = 1e12


@dataclass(frozen=True)
class Counter:
    """Z(ω) of an undamped model, and how many natural frequencies lie below ω."""

    m: Matrices
    beyond: Beyond
    known: dict[float, int] = field(default_factory=dict)

    def stiffness(self, omega: float) -> sp.csc_array:
        """Z(ω), real."""
        more = self.beyond.data(1j * omega).real
        return self._with(self.m.K.data - omega**2 * self.m.M.data + more)

    def slope(self, omega: float) -> sp.csc_array:
        """−∂Z/∂ω² at ω, positive definite between the poles."""
        return self._with(self.m.M.data + self.beyond.slope(omega))

    def below(self, omega: float) -> int:
        """J(ω).

        Raises
        ------
        ModelError
            Where the pivots of Z cannot be counted.
        """
        if omega not in self.known:
            self.survey(np.array([omega]))
        return self.known[omega]

    def survey(self, omega: Real) -> None:
        """Count below every one of ``omega`` (f,): a few members take as long at all of them as at
        one."""
        for some in np.array_split(omega, -(-len(omega) // self.beyond.together)):
            self.beyond.foresee(1j * some.astype(complex))
            clamped = self.beyond.clamped_below(some)
            for w, held in zip(some.tolist(), clamped.tolist(), strict=True):
                self.known[w] = held + _negatives(self.stiffness(w))

    def around(self, number: int, low: float) -> tuple[float, float | None]:
        """The nearest ω ≥ ``low`` counted so far below and above mode ``number``."""
        under = [w for w, n in self.known.items() if n < number and w >= low]
        over = [w for w, n in self.known.items() if n >= number and w > low]
        return max(under, default=low), min(over, default=None)

    def _with(self, data: Real) -> sp.csc_array:
        return sp.csc_array((data, self.m.K.indices, self.m.K.indptr), shape=self.m.K.shape)


def _negatives(Z: sp.csc_array) -> int:
    if Z.shape[0] > SMALL:
        try:
            found = factored(Z, "the dynamic stiffness").negatives()
        except ModelError:
            found = None
        if found is not None:
            return found
    whole = Z.toarray()
    scale = 1.0 / np.sqrt(np.maximum(np.abs(whole).max(axis=1), np.finfo(float).tiny))
    return int(np.sum(la.eigvalsh(whole * scale[:, None] * scale) < 0.0))


def exact_modes(m: Matrices, rigid: Real, count: int, first: float) -> tuple[Real, Real]:
    """ω² of the lowest ``count`` flexible modes, (count,), and their shapes (N, count) with unit
    modal mass φᵀ (−∂Z/∂ω²) φ.

    Parameters
    ----------
    rigid : (N, r) rigid-body motions, mass-normalised; only their number counts.
    first : about the first natural frequency (rad/s), to begin with.

    Raises
    ------
    ModelError
        For a motion without stiffness that is no rigid-body motion, or negative stiffness.
    """
    if m.beyond is None:
        raise ModelError("exact modes need exact members. Use the modes of K and M.")
    counter = Counter(m, m.beyond.undamped())
    r = rigid.shape[1]
    low = LOWEST * first
    if counter.below(low) != r:
        raise ModelError(
            f"the model has {counter.below(low)} motions without stiffness, of which {r} are "
            "rigid-body modes. Add the missing element or support, or correct the property that "
            "is below zero."
        )
    values: list[float] = []
    shapes: list[Real] = []
    while len(values) < count:
        number = r + len(values) + 1
        floor = low  # the mode before lies just below, and is not to be found again
        low, high, top = _bracket(counter, number, low, max(first, 2.0 * low))
        omega, x = _refined(counter, number, (floor, low, high), top - number + 1)
        values += [omega**2] * x.shape[1]
        shapes.append(x)
        low = _above(counter.below, r + len(values), omega)
    return np.array(values[:count]), np.hstack([np.zeros((m.K.shape[0], 0)), *shapes])[:, :count]


def _bracket(counter: Counter, number: int, low: float, guess: float) -> tuple[float, float, int]:
    """(ω below mode ``number``, ω above it, how many are below that), by doubling and division
    until it stands alone or the bracket is narrow."""
    many = min(SECTIONS, counter.beyond.together)
    low, high = counter.around(number, low)
    while high is None:
        if guess > HIGHEST:
            raise ModelError("the model has fewer natural frequencies than were asked for.")
        counter.below(guess)
        low, high = counter.around(number, low)
        guess *= 2.0
    while (counter.below(high) > number and high - low > ALIKE * high) or high - low > NEAR * high:
        spread = np.geomspace if high > 4.0 * low else np.linspace
        counter.survey(np.asarray(spread(low, high, many + 2))[1:-1])
        low, high = _sides(counter, number, low, high)
    return low, high, counter.below(high)


def _sides(counter: Counter, number: int, low: float, high: float) -> tuple[float, float]:
    under, over = counter.around(number, low)
    return under, high if over is None else over


def _above(below: Callable[[float], int], number: int, omega: float) -> float:
    """The first ω tried at which a mode found at ``omega``, the ``number``-th, is counted."""
    step = CLOSE
    while below(omega * (1.0 + step)) < number:
        step *= 2.0
        if step > NEAR:
            raise ModelError(
                f"the count of natural frequencies does not rise at {omega:.6g} rad/s, where one "
                "was found: the dynamic stiffness is too badly scaled. Check units and sections."
            )
    return omega * (1.0 + step)


def _refined(
    counter: Counter, number: int, within: tuple[float, float, float], together: int
) -> tuple[float, Real]:
    """ω of the mode(s) between (floor, low, high) and their shapes (N, k): Newton's steps inside
    the bracket and its rounding but never below the floor, bisection where one leaves it."""
    floor, low, high = within
    omega, margin = (low + high) / 2.0, ALIKE * high
    for _ in range(STEPS):
        step = _newton(counter, omega, together)
        if step is not None:
            new, x = step
            inside = max(floor, low - margin) <= new <= high + margin
            if inside and abs(new - omega) <= CLOSE * omega:
                return new, _normal(counter, new, x)
            if inside:
                omega = new
                continue
        if high - low <= CLOSE * high:
            break
        middle = (low + high) / 2.0
        if counter.below(middle) >= number:
            high = middle
        else:
            low = middle
        omega = (low + high) / 2.0
    return omega, np.zeros((counter.m.K.shape[0], together))


def _newton(counter: Counter, omega: float, together: int) -> tuple[float, Real] | None:
    """The mean of the ``together`` nearest roots of the eigenproblem linear at ω, and their
    vectors; None where it has none."""
    Z, S = counter.stiffness(omega), counter.slope(omega)
    try:
        if Z.shape[0] > DENSE:
            values, x = spla.eigsh(Z, together, S, sigma=0.0)
        else:
            values, x = la.eigh(Z.toarray(), S.toarray())
    except (np.linalg.LinAlgError, spla.ArpackError, RuntimeError):
        return None
    nearest = np.argsort(np.abs(values))[:together]
    square = omega**2 + float(np.mean(values[nearest]))
    return (float(np.sqrt(square)), x[:, nearest]) if square > 0.0 else None


def _normal(counter: Counter, omega: float, x: Real) -> Real:
    """Shapes of unit modal mass, orthogonal in it."""
    S = counter.slope(omega)
    L = la.cholesky(x.T @ (S @ x), lower=True)
    return np.asarray(la.solve_triangular(L, x.T, lower=True).T)
