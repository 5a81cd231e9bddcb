"""What is expected to be listed still: by refits written out, and by what must be so."""

import numpy as np
import pytest

from cvxupdate.diagnose.apart.worth import Products, Scale


def columns(rng, rows: int, nuisance: int = 3, effects: int = 4):
    return rng.standard_normal((rows, nuisance + effects))


def of(C, channels: int = 1) -> Products:
    return Products(C.T @ C, float(len(C)), channels)


def scale(effects: int = 4, **changed) -> Scale:
    usual = {
        "modes": 5,
        "misfit": 0.5,
        "likely": np.full(effects, 1.0 / effects),
        "unknowns": np.ones(effects),
        "priors": np.array([4.0, 0.25, 1.0]),
    }
    return Scale(**{**usual, **changed})


def test_a_gap_is_what_the_best_refit_of_the_other_leaves_of_old_and_new_rows() -> None:
    """min over nuisance parameters d (with their priors) and a size q of ‖s - N d - q t‖² + ‖d‖²_P,
    by least squares on all rows."""
    rng = np.random.default_rng(4)
    old, new = columns(rng, 30), columns(rng, 20)
    both = np.vstack([old, new])
    known, at = of(old, 2) + of(new, 3), scale()
    gaps = at.gaps(known)
    for i in range(4):
        for j in range(4):
            N, s, t = both[:, :3], both[:, 3 + i], both[:, 3 + j]
            A = np.vstack(
                [
                    np.column_stack([N, t]),
                    np.hstack([np.diag(np.sqrt(at.priors)), np.zeros((3, 1))]),
                ]
            )
            b = np.concatenate([s, np.zeros(3)])
            rest = float(np.sum((b - A @ np.linalg.lstsq(A, b, rcond=None)[0]) ** 2))
            rest = 0.0 if i == j else rest
            exact = 0.5 * (2 * 5 + 5) * np.log1p(rest / 50.0 / 0.5)
            assert gaps[i, j] == pytest.approx(exact, rel=1e-8, abs=1e-9)


def test_rows_that_say_nothing_dilute() -> None:
    rng = np.random.default_rng(5)
    C = columns(rng, 40)
    silent = np.zeros((400, 7))
    at = scale()
    assert at.left(of(C)) < at.left(of(C) + of(silent, 0))
    assert at.left(of(C) + of(C)) < at.left(of(C))  # as telling, and a channel more


def test_what_moves_alike_is_never_told() -> None:
    rng = np.random.default_rng(6)
    C = columns(rng, 200)
    C[:, 5] = 3.0 * C[:, 4] + C[:, :3] @ np.array(
        [1e3, -2e3, 5e2]
    )  # nuisance parameters take it up
    at = scale(priors=np.full(3, 1e-12))
    listed = at.listed(of(100.0 * C, 40))
    assert listed[1, 2] == pytest.approx(listed[2, 1]) and listed[1, 2] > 0.99
    assert listed[0, 1] < 0.01
    assert at.separations(of(100.0 * C, 40), 3)[2] < 1e-3


def test_one_that_holds_another_is_told_by_its_price_alone() -> None:
    """Two effects that move alike, one with an unknown more: enough figures rule that one out where
    the simple one is true, and never the simple one where it is."""
    C = np.random.default_rng(7).standard_normal((5000, 5))
    C[:, 4] = C[:, 3]
    at = scale(2, modes=300, unknowns=np.array([1.0, 2.0]), likely=np.array([0.5, 0.5]))
    listed = at.listed(of(C, 400))
    assert listed[0, 1] < 0.5 < 0.99 < listed[1, 0]
