"""Families of element matrices as unknowns of the step: the cone X ⪰ 0, what is conserved."""

import numpy as np
import pytest

import cvxupdate.convex as cv
from cvxupdate.convex.constraints.generic import GenericTable
from cvxupdate.errors import InputError
from cvxupdate.system import LinearSystem
from tests.cases.convex_cases import FAMILY, Bench

NAMES = FAMILY.columns


def nearest(target: np.ndarray, constraint: cv.Generic) -> cv.Step:
    system = LinearSystem(np.eye(4), target, np.ones(4), NAMES, tuple("abcd"))
    return cv.solve_step(cv.StepProblem(constraints=(constraint,), columns=NAMES), system)


def block(p: np.ndarray) -> np.ndarray:
    return np.array([[1 + p[0], p[1] / np.sqrt(2)], [p[1] / np.sqrt(2), 1 + p[2]]])


@pytest.mark.parametrize("seed", range(4))
def test_the_step_is_the_projection_on_the_cone(seed: int) -> None:
    """Entries beside the diagonal are divided by √2, so the nearest p is the nearest matrix: the
    eigenvalues of N + P are cut off at the floor and the ceiling."""
    target = np.random.default_rng(seed).normal(0.0, 2.0, 4)
    step = nearest(target, cv.Generic((FAMILY,), 0.1, 2.5))
    values, Q = np.linalg.eigh(block(target))
    want = Q @ np.diag(np.clip(values, 0.1, 2.5)) @ Q.T
    assert step.status == "optimal"
    np.testing.assert_allclose(block(step.p), want, atol=1e-6)
    assert step.p[3] == pytest.approx(np.clip(1 + target[3], 0.1, 2.5) - 1, abs=1e-6)


def test_mass_is_kept_with_and_without_inertia() -> None:
    target = np.array([0.3, 0.2, -0.1, 0.4])
    today, change = FAMILY.bodies[0]
    for inertia, rows in ((False, 3), (True, 6)):
        step = nearest(target, cv.Generic((FAMILY,), mass=True, inertia=inertia))
        moved = np.einsum("n,nab->ab", step.p, change)
        np.testing.assert_allclose(np.diag(moved)[:rows], 0.0, atol=1e-8 * today.max())
    assert abs(np.einsum("n,nab->ab", target, change)[0, 0]) > 0.01


def test_a_table_without_families_and_a_ceiling_below_one_are_refused() -> None:
    class Without(Bench):
        def families(self) -> tuple[cv.FamilyBlocks, ...]:
            return ()

    assert cv.Generic.from_spec(None, Without()) is None
    with pytest.raises(InputError, match='no parameter is of = "generic"'):
        cv.Generic.from_spec(GenericTable(), Without())
    with pytest.raises(InputError, match="excludes the nominal element"):
        cv.Generic.from_spec(GenericTable(ceiling=0.5), Bench())


def test_clauses_name_family_and_modes() -> None:
    names = [c.name for c in cv.Generic((FAMILY,), 0.01, 4.0, mass=True).clauses(NAMES)]
    assert names == [
        "e1.M, modes 1, 3: at least 0.01 of the nominal element",
        "e1.M, modes 1, 3: at most 4 of the nominal element",
        "e1.M, mode 2: at least 0.01 of the nominal element",
        "e1.M, mode 2: at most 4 of the nominal element",
        "e1.M: mass kept",
    ]
