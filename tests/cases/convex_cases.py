"""Instances of every part of the convex step; the contract tests run over their products."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate import convex as cv
from cvxupdate.system import LinearSystem

COLUMNS = ("a.E", "a.rho", "b.E", "b.rho", "c.k", "d.m")


def system(
    rows: int = 24,
    columns: tuple[str, ...] = COLUMNS,
    seed: int = 3,
    deviation: float = 0.01,
    outliers: int = 3,
) -> LinearSystem:
    """A noisy system with columns of unequal size, unequal weights and a few outliers; no symmetry
    anywhere."""
    rng = np.random.default_rng(seed)
    n = len(columns)
    A = rng.normal(size=(rows, n)) * np.geomspace(0.3, 2.0, n) + 0.2
    p = rng.uniform(-0.25, 0.35, n)
    std = deviation * rng.uniform(0.5, 2.0, rows)
    b = A @ p + std * rng.normal(size=rows)
    b[:outliers] += 30 * std[:outliers]
    return LinearSystem(A, b, 1 / std, columns, tuple(f"row {i}" for i in range(rows)))


LOSSES = {"least-squares": cv.LeastSquares(), "l1": cv.AbsoluteLoss(), "huber": cv.Huber()}

REGULARISERS: dict[str, tuple[cv.Regulariser, ...]] = {
    "none": (),
    "tikhonov": (cv.Tikhonov(300.0, reference=0.02, scale=np.linspace(0.5, 2.0, 6)),),
    "l1": (cv.L1(40.0, scale=np.linspace(2.0, 0.5, 6)),),
    "group-l1": (cv.GroupL1(40.0),),
}

MASS = np.array([0.0, 2.5, 0.0, 1.25, 0.0, 0.7])

CONSTRAINTS: dict[str, tuple[cv.Constraint, ...]] = {
    "none": (),
    "bounds": (cv.Bounds(np.full(6, -0.1), np.array([0.1, 0.2, 0.1, 0.3, np.inf, 0.15])),),
    "tied": (cv.Tied((("a.E", "b.E"), ("a.rho", "b.rho"))),),
    "equality": (cv.LinearEquality({"a.E": 1.0, "c.k": -2.0}, 0.1),),
    "inequality": (cv.LinearInequality({"a.E": 1.0, "a.rho": 1.0, "d.m": 0.5}, upper=-0.05),),
    "total mass": (cv.TotalMass(MASS, base=5.95),),
    "norm": (
        cv.NormAtMost(np.eye(6), np.full(6, 0.01), 0.2, "the change stays within 0.2 of 0.01"),
    ),
    "several": (cv.Bounds(-0.3, 0.3), cv.Tied((("a.E", "b.E"),)), cv.TotalMass(MASS, base=5.95)),
}


@dataclass(frozen=True)
class KnownConflict:
    """Constraints that cannot hold together, the clauses at fault, and part of a sentence on the
    way out."""

    constraints: tuple[cv.Constraint, ...]
    clauses: frozenset[str]
    way_out: str
    radius: float | None = None


CONFLICTS: dict[str, KnownConflict] = {
    "sum beyond bounds": KnownConflict(
        (cv.Bounds(-0.1, 0.1), cv.LinearEquality({"a.E": 1.0, "b.E": 1.0}, 0.5)),
        frozenset({"bounds on a.E: -0.1 to 0.1", "bounds on b.E: -0.1 to 0.1", "a.E + b.E = 0.5"}),
        '"a.E + b.E = 0.5" is let go by -0.3',
    ),
    "mass out of reach": KnownConflict(
        (
            cv.Bounds(-0.1, 0.1),
            cv.Tied((("a.E", "b.E"),)),
            cv.TotalMass(MASS, base=5.95, value=6.95),
        ),
        frozenset(
            {
                "bounds on a.rho: -0.1 to 0.1",
                "bounds on b.rho: -0.1 to 0.1",
                "bounds on d.m: -0.1 to 0.1",
                "total mass set to 6.95 kg",
            }
        ),
        '"total mass set to 6.95 kg" is let go by -0.555 kg',
    ),
    "tied against apart": KnownConflict(
        (
            cv.Bounds(-0.5, 0.5),
            cv.Tied((("a.E", "b.E", "c.k"), ("a.rho", "b.rho"))),
            cv.LinearInequality({"a.E": 1.0, "c.k": -1.0}, lower=0.05),
        ),
        frozenset({"tied: a.E = b.E = c.k", "a.E - c.k at least 0.05"}),
        '"a.E - c.k at least 0.05" has its lower limit at 0 instead of 0.05',
    ),
    "two values for one": KnownConflict(
        (
            cv.LinearEquality({"c.k": 1.0}, 0.2),
            cv.LinearEquality({"c.k": 2.0}, 0.1),
            cv.LinearEquality({"d.m": 1.0}, 0.1),
        ),
        frozenset({"c.k = 0.2", "2 c.k = 0.1"}),
        '"2 c.k = 0.1" is let go by +0.3',
    ),
    "trust region too small": KnownConflict(
        (cv.Bounds(-0.5, 0.5), cv.LinearEquality({"a.E": 1.0}, 0.3)),
        frozenset({"a.E = 0.3", "trust region on a.E: within 0.1 of 0"}),
        '"a.E = 0.3" is let go by -0.2',
        radius=0.1,
    ),
    "chain of inequalities": KnownConflict(
        (
            cv.LinearInequality({"a.E": 1.0, "b.E": -1.0}, lower=0.1),
            cv.LinearInequality({"b.E": 1.0, "c.k": -1.0}, lower=0.1),
            cv.LinearInequality({"c.k": 1.0, "a.E": -1.0}, lower=0.1),
            cv.Bounds(-1.0, 1.0),
        ),
        frozenset({"a.E - b.E at least 0.1", "b.E - c.k at least 0.1", "c.k - a.E at least 0.1"}),
        "has its lower limit at -0.2 instead of 0.1",
    ),
    "ball against bounds": KnownConflict(
        (
            cv.Bounds(-0.5, 0.1),
            cv.NormAtMost(np.eye(6)[[2]], np.array([0.5]), 0.3, "b.E within 0.3 of 0.5"),
            cv.Tied((("a.rho", "d.m"),)),
        ),
        frozenset({"bounds on b.E: -0.5 to 0.1", "b.E within 0.3 of 0.5"}),
        '"b.E within 0.3 of 0.5" gives way by 0.1',
    ),
    "two balls": KnownConflict(
        (
            cv.NormAtMost(np.eye(6), np.full(6, 0.2), 0.1, "near 0.2"),
            cv.NormAtMost(np.eye(6), np.full(6, -0.2), 0.1, "near -0.2"),
            cv.NormAtMost(np.eye(6), np.zeros(6), 5.0, "within 5"),
            cv.Bounds(-1.0, 1.0),
        ),
        frozenset({"near 0.2", "near -0.2"}),
        "gives way by 0.7798",
    ),
}
