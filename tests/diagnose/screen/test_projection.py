"""Explained fractions and sizes are those of plain least squares beside nuisance parameters with
priors."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.screen.projection import Linearised, Projection, norms
from cvxupdate.physics.effect import ModelChange
from tests.cases.plain_evidence import effect, no_model

ROWS, NUISANCE = 40, 4
RNG = np.random.default_rng(11)
AT = Linearised(
    RNG.normal(size=(ROWS, NUISANCE)),
    RNG.normal(size=ROWS),
    0.1 * RNG.normal(size=NUISANCE),
    np.array([0.5, 1.0, 2.0, 1e4]),
)
J = RNG.normal(size=(ROWS, 6))
LEFT = Projection.of(AT)


def plain(columns: np.ndarray, at: Linearised = AT) -> tuple[float, np.ndarray]:
    """(weighted squares and priors at the minimum over nuisance steps and sizes, sizes)."""
    n, m = at.A.shape[1], columns.shape[1]
    A = np.block([[at.A, columns], [np.diag(1.0 / at.scales), np.zeros((n, m))]])
    r = np.concatenate([at.r, -at.p / at.scales])
    x = np.linalg.lstsq(A, r, rcond=None)[0]
    return float(np.sum((r - A @ x) ** 2)), x[n:]


def test_the_projected_residual_is_what_nuisance_parameters_leave() -> None:
    assert LEFT.total == pytest.approx(plain(np.zeros((ROWS, 0)))[0], rel=1e-12)


def test_of_some_rows_it_is_that_of_those() -> None:
    rows = RNG.random(ROWS) < 0.5
    some = Linearised(AT.A[rows], AT.r[rows], AT.p, AT.scales)
    half = Projection.of(AT, rows)
    assert half.total == pytest.approx(plain(np.zeros((int(rows.sum()), 0)), some)[0], rel=1e-12)
    assert half.rows == rows.sum()


def test_one_column_explains_what_plain_least_squares_takes_away() -> None:
    effects = [effect(nodes=(k,)) for k in range(J.shape[1])]
    Jp = LEFT.freed(J)
    scores = LEFT.one(effects, Jp.T @ LEFT.residual, norms(Jp), norms(J))
    for k, s in enumerate(scores):
        least, size = plain(J[:, [k]])
        assert s.effect is effects[k] and not s.exact
        assert s.fraction == pytest.approx(1.0 - least / LEFT.total, rel=1e-9)
        np.testing.assert_allclose(s.p, size, rtol=1e-9)


def test_a_size_on_the_side_that_it_may_not_take_explains_nothing() -> None:
    positive = replace(effect(), sign=1)
    for side in (1.0, -1.0):
        column = side * J[:, [0]]
        Jp = LEFT.freed(column)
        (s,) = LEFT.one([positive], Jp.T @ LEFT.residual, norms(Jp), norms(column))
        allowed = plain(column)[1][0] > 0.0
        assert (s.fraction > 0.0) == allowed == bool(s.p[0] > 0.0)
        both = LEFT.several(positive, np.hstack([column, J[:, 1:3]]), LEFT.freed(J[:, :3] * side))
        assert both.fraction >= 0.0


def test_what_nuisance_parameters_can_take_up_explains_nothing() -> None:
    """The last has no prior to speak of: a column along it is free."""
    column = AT.A[:, [3]]
    Jp = LEFT.freed(column)
    (s,) = LEFT.one([effect()], Jp.T @ LEFT.residual, norms(Jp), norms(column))
    assert s.fraction < 1e-6
    nothing = np.zeros((ROWS, 1))
    (s,) = LEFT.one([effect()], np.zeros(1), np.zeros(1), norms(nothing))
    assert s.fraction == 0.0 and s.p[0] == 0.0


@pytest.mark.parametrize("count", [2, 3, 5])
def test_several_columns_together(count: int) -> None:
    own = J[:, :count] * np.geomspace(1e-6, 1e6, count)  # units do not matter
    s = LEFT.several(effect(count=count), own, LEFT.freed(own))
    least, sizes = plain(J[:, :count])
    assert s.fraction == pytest.approx(1.0 - least / LEFT.total, rel=1e-9)
    np.testing.assert_allclose(s.p * np.geomspace(1e-6, 1e6, count), sizes, rtol=1e-7)


def test_several_with_a_first_unknown_on_the_wrong_side_explain_nothing() -> None:
    own = J[:, :2].copy()
    if plain(own)[1][0] > 0.0:
        own[:, 0] *= -1.0
    s = LEFT.several(replace(effect(count=2), sign=1), own, LEFT.freed(own))
    assert s.fraction == 0.0 and not np.any(s.p)
    empty = np.hstack([own[:, :1], np.zeros((ROWS, 1))])
    assert LEFT.several(effect(count=2), empty, LEFT.freed(empty)).fraction == 0.0


def test_sets_are_the_sums_of_their_members() -> None:
    """By the members' products; where they cancel to little, by the sum itself."""
    columns = np.column_stack([J, -J[:, 0] + 1e-6 * J[:, 1]])
    change = ModelChange(no_model, ((),), additive=True)
    effects = [replace(effect(nodes=(k,)), action=change) for k in range(10)]
    kept = {k: (columns[:, k], LEFT.freed(columns)[:, k]) for k in range(7)}
    sets = {7: [0, 1, 2], 8: [0, 6], 9: [3, 99]}
    found = LEFT.sets(effects, sets, kept)
    assert set(found) == {7, 8}, "a set without one of its members has no score"
    for k in (7, 8):
        least, size = plain(columns[:, sets[k]].sum(axis=1, keepdims=True))
        assert found[k].fraction == pytest.approx(1.0 - least / LEFT.total, rel=1e-5)
        assert found[k].p[0] == pytest.approx(size[0], rel=1e-5)
    assert LEFT.sets(effects, {9: [99]}, kept) == {}


def test_products_are_those_of_projected_columns() -> None:
    inside = AT.A @ RNG.normal(size=(NUISANCE, 1)) * 1e4  # the priors hold next to nothing of it
    loose = Projection.of(replace(AT, scales=np.full(NUISANCE, 1e12)))
    along, length = loose.products(np.hstack([J, inside]))
    Jp = loose.freed(J)
    np.testing.assert_allclose(along[:-1], Jp.T @ loose.residual, rtol=1e-10)
    np.testing.assert_allclose(length[:-1], norms(Jp) ** 2, rtol=1e-10)
    assert along[-1] == length[-1] == 0.0, "what the nuisance parameters do is rounding"


def test_what_remains_after_changes_of_given_sizes() -> None:
    """As if nuisance parameters were fitted anew after each."""
    for k, left in enumerate(LEFT.remaining(J)):
        after = replace(AT, r=AT.r - J[:, k])
        assert left == pytest.approx(plain(np.zeros((ROWS, 0)), after)[0], rel=1e-9)


def test_nothing_left_is_explained_by_nothing() -> None:
    silent = Projection.of(Linearised(AT.A, np.zeros(ROWS), np.zeros(NUISANCE), AT.scales))
    Jp = silent.freed(J)
    scores = silent.one([effect()] * 6, Jp.T @ silent.residual, norms(Jp), norms(J))
    assert all(s.fraction == 0.0 for s in scores)
    assert silent.several(effect(count=2), J[:, :2], Jp[:, :2]).fraction == 0.0


def test_further_columns_are_taken_out_like_nuisance_parameters_without_priors() -> None:
    """To within a prior of a ten-thousandth."""
    more = Linearised(
        np.hstack([AT.A, J[:, :2]]),
        AT.r,
        np.append(AT.p, [0.0, 0.0]),
        np.append(AT.scales, [1e6] * 2),
    )
    expected, found = Projection.of(more), LEFT.beside(J[:, :2])
    assert found.total == pytest.approx(expected.total, rel=1e-6)
    for one, other in zip(found.products(J[:, 2:]), expected.products(J[:, 2:]), strict=True):
        assert one == pytest.approx(other, rel=1e-5)
