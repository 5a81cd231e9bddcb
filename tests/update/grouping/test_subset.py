"""Stable subset selection where some changes are seen by no recording, as of E, h and ρ."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.system import LinearSystem
from cvxupdate.update.grouping.seen import Seen, seen
from cvxupdate.update.grouping.subset import subset

COUNT = 9
E, H, RHO = (np.arange(COUNT) + k * COUNT for k in range(3))
ROW = [0] * COUNT + [1] * COUNT + [2] * COUNT
SINGLE = tuple((k,) for k in range(3 * COUNT))


def products(p: np.ndarray) -> np.ndarray:
    """E h³ and ρ h of every element."""
    f = 1.0 + p
    return np.concatenate([f[E] * f[H] ** 3, f[RHO] * f[H]])


def slope(p: np.ndarray) -> np.ndarray:
    """The derivative of `products` by complex step."""
    moved = p[:, None] + 1e-30j * np.eye(len(p))
    return np.stack([products(q).imag / 1e-30 for q in moved.T], axis=1)  # type: ignore[type-var]


def recorded(truth: np.ndarray, at: np.ndarray, noise: float = 0.0) -> Seen:
    """What recordings that see mixtures of the products' logarithms say ``at`` p."""
    rng = np.random.default_rng(5)
    mix = 1e3 * rng.standard_normal((60, 2 * COUNT))
    A = mix @ (slope(at) / products(at)[:, None])
    b = mix @ (np.log(products(truth)) - np.log(products(at)))
    y = A @ at + b + noise * rng.standard_normal(60)
    names = tuple(f"p{k}" for k in range(3 * COUNT))
    system = LinearSystem(A, y, np.ones(60), names, tuple(map(str, range(60))))
    silent = []
    for k in range(COUNT):
        d = np.zeros(3 * COUNT)
        d[[E[k], H[k], RHO[k]]] = [-3.0, 1.0, -1.0]
        silent.append(d * (1.0 + at))
    return seen(system, range(3 * COUNT), False, at, [True] * (3 * COUNT), silent)


def errors() -> np.ndarray:
    """One property of five elements, two of one."""
    p = np.zeros(3 * COUNT)
    p[H[[1, 4]]], p[E[6]], p[RHO[[2, 7]]] = -0.13, -0.08, 0.12
    p[H[8]], p[E[8]] = 0.2, -0.1
    return p


@pytest.mark.parametrize("noise", [0.0, 1.0])
def test_the_property_in_error_and_no_other(noise: float) -> None:
    """One change is simpler than two: h alone, not E and ρ together. Of two errors of one element
    any two of its three properties are as good; the others keep the file's value."""
    at = 0.9 * errors()
    groups = subset(recorded(errors(), at, noise), SINGLE, ROW)
    assert all(len(g) == 1 for g in groups)
    found = {g[0] for g in groups}
    eighth = {E[8], H[8], RHO[8]}
    assert found - eighth == {H[1], H[4], E[6], RHO[2], RHO[7]}
    assert len(found & eighth) == 2


def test_what_no_recording_sees_is_no_deviation() -> None:
    """One element's E h³ and ρ h are known however E, h and ρ are counted: the deviations are those
    of the shortest solution. A column that these recordings leave out is open."""
    known = recorded(errors(), np.zeros(3 * COUNT))
    found = known.deviations(SINGLE)
    inverse = np.linalg.pinv(known.J, rcond=1e-9)
    assert np.allclose(found, known.scatter * np.linalg.norm(inverse, axis=1))
    J = known.J.copy()
    J[:, E[0]] = 0.0
    blind = Seen(J, known.y, known.scatter, known.silent)
    assert blind.deviations(SINGLE)[E[0]] > 1e3


def test_a_common_change_is_found_where_it_can_be_told() -> None:
    """Every E 10 % off and one h more: a group of all E, and that h."""
    p = np.zeros(3 * COUNT)
    p[E], p[H[3]] = -0.1, 0.15
    groups = subset(recorded(p, p, 1.0), SINGLE, ROW)
    assert (int(H[3]),) in groups
    assert any(set(g) == set(E.tolist()) for g in groups)
    assert len(groups) == 2
