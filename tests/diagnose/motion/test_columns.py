"""Which scores of laws begin a search: those of the point that the best law explains best."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.motion import columns
from cvxupdate.diagnose.motion.columns import CLOSER_EACH, LawScores, _family, _worth_it, nothing
from cvxupdate.diagnose.types import Score
from cvxupdate.physics.cubic_stiffness import EVEN
from cvxupdate.physics.internal_force import NonlinearForce
from tests.cases.plain_evidence import effect

RUBS, DRAGS = effect("dry_friction", nodes=(2,)), effect("quadratic_damping", nodes=(3,))


@pytest.fixture
def point(monkeypatch):
    """Makes a fit at p = 1; (fractions of both laws, total) at the nominal model and there."""

    def make(nominal, fitted):
        def at(setting, p):
            return SimpleNamespace(p=p, setting=setting, point=tuple(p))

        def scored(point, effects):
            parts, total = nominal if not any(point) else fitted
            return [Score(e, f, np.ones(1)) for e, f in zip(effects, parts, strict=True)], total

        monkeypatch.setattr(columns, "fitted_at", at)
        monkeypatch.setattr(columns, "law_scores", scored)
        return at(SimpleNamespace(columns=("x",)), np.ones(1))

    return make


def test_a_larger_part_of_much_more_is_no_better(point) -> None:
    """Four fifths of what the nuisance parameters leave unfitted: friction resembles them."""
    found = LawScores().first(point(((0.8, 0.03), 145.0), ((0.07, 0.3), 13.6)), (RUBS, DRAGS))
    assert found[DRAGS.key].fraction == 0.3 and found[RUBS.key].fraction == 0.07
    assert all(s.trusted for s in found.values())


def test_where_a_law_leaves_less_at_the_nominal_model_its_own_are_taken(point) -> None:
    found = LawScores().first(point(((0.9, 0.2), 100.0), ((0.4, 0.5), 40.0)), (RUBS, DRAGS))
    assert found[RUBS.key].fraction == 0.9 and not any(s.trusted for s in found.values())


def test_without_laws_there_are_no_scores(point) -> None:
    assert LawScores().first(point(((), 1.0), ((), 1.0)), ()) == {}
    assert not nothing(RUBS).trusted and nothing(RUBS).fraction == 0.0


@pytest.mark.parametrize(
    ("law", "sides", "side"),
    [
        ("cubic", "one", 1),
        ("quadratic", "one", 1),
        ("friction", "one", 1),
        ("clearance", "one", -1),
        ("clearance", "two", 1),
        ("jenkins", "one", 1),
    ],
)
def test_many_sizes_at_once_are_those_one_by_one(law: str, sides: str, side: int) -> None:
    action = NonlinearForce(law, (0,), ("a",), (True,), sides, side)
    t = np.linspace(0.0, 1.0, 400)
    motion = [(0.01 * np.sin(9.0 * t) * t, 0.02 * np.cos(7.0 * t) * t)]
    family, sizes = _family(action, motion)
    whole = family(sizes)(*motion[0])
    assert whole.shape == (400, len(sizes)) and np.any(whole[:, 0] != 0.0)
    for k, size in enumerate(sizes):
        np.testing.assert_allclose(whole[:, [k]], family(np.array([size]))(*motion[0]))


def test_a_force_in_the_square_is_a_candidate_of_its_own() -> None:
    """At every place, beside that in the cube: one of them pushes the same way on both sides."""
    t = np.linspace(0.0, 1.0, 400)
    motion = [(0.01 * np.sin(9.0 * t) * t, 0.02 * np.cos(7.0 * t) * t)]
    cube, square = (
        _family(NonlinearForce("cubic", (0,), (name,), (False,)), motion)[0](np.ones(1))
        for name in ("k3", EVEN)
    )
    x = motion[0][0]
    np.testing.assert_allclose(cube(*motion[0])[:, 0], x**3)
    np.testing.assert_allclose(square(*motion[0])[:, 0], x**2)


def test_a_finer_grid_is_for_the_best_of_each_type() -> None:
    many = [effect("dry_friction", nodes=(n,)) for n in range(CLOSER_EACH + 3)]
    found = {i: (e, 0.9 - 0.01 * i) for i, e in enumerate(many)}
    found[98], found[99] = (DRAGS, 0.5), (effect("quadratic_damping", nodes=(4,)), 0.1)
    assert _worth_it(found) == {*range(CLOSER_EACH), 98}
