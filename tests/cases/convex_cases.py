"""Instances of every part of the convex step; the contract tests run over their products."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
import scipy.sparse as sp

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


LOSSES = {
    "least-squares": cv.LeastSquares(),
    "l1": cv.AbsoluteLoss(),
    "huber": cv.Huber(),
    "norm": cv.Norm(),
}


COVARIANCE = np.diag(np.linspace(0.05, 0.2, 6) ** 2) + 1e-3 * np.outer(
    [1.0, -1.0, 0.5, 0.0, 1.0, 0.3], [1.0, -1.0, 0.5, 0.0, 1.0, 0.3]
)
"""Of six parameters, correlated both ways."""


def regularisers(columns: tuple[str, ...]) -> dict[str, tuple[cv.Regulariser, ...]]:
    """An instance of every regulariser, over six parameters."""
    a, b, c, d, e, _ = columns
    return {
        "none": (),
        "tikhonov": (cv.Tikhonov(300.0, reference=0.02, scale=np.linspace(0.5, 2.0, 6)),),
        "l1": (cv.L1(40.0, scale=np.linspace(2.0, 0.5, 6)),),
        "group-l1": (cv.GroupL1(40.0),),
        "total-variation": (cv.TotalVariation(40.0, ((a, c), (b, d), (c, e))),),
        "entropy": (cv.Entropy(300.0, reference=0.02),),
        "robust": (cv.Robust(10.0),),
        "prior": (cv.Prior(1.0, COVARIANCE),),
    }


REGULARISERS = regularisers(COLUMNS)

MASS = np.array([0.0, 2.5, 0.0, 1.25, 0.0, 0.7])


def band(seed: int, size: int = 5) -> sp.csc_array:
    """A symmetric matrix with two side diagonals."""
    A = np.triu(np.tril(np.random.default_rng(seed).normal(size=(size, size)), 2), -2)
    return sp.csc_array((A + A.T) / 2)


POSITIVE = cv.MatrixInequality(
    0.05 * band(20) + sp.eye_array(5), [1.5 * band(k) for k in range(6)], "S stays positive", 0.4
)
SUM = cv.Equations(np.array([[1.0, 1.0, 0.0, 2.0, 0.0, 0.0]]), np.array([0.1]), "a and b")
NEAR = cv.Equations(np.eye(6)[:4] + 0.1, np.full(4, 0.05), "mode 1 within 0.2", within=0.2)

_PARTS = np.array([0.5, 0.1, 0.2, 0.3])
FAMILY = cv.FamilyBlocks(
    "e1.M",
    COLUMNS[:4],
    ((0, 0), (0, 2), (2, 2), (1, 1)),
    ((0, 2), (1,)),
    np.ones(3),
    (
        (
            np.diag([2.0, 2.0, 2.0, 0.1, 0.2, 0.3]),
            np.array([m * np.diag([2.0, 2.0, 2.0, 0.1 * m, 0.2, 0.3]) for m in _PARTS]),
        ),
    ),
)

CONSTRAINTS: dict[str, tuple[cv.Constraint, ...]] = {
    "none": (),
    "bounds": (cv.Bounds(np.full(6, -0.1), np.array([0.1, 0.2, 0.1, 0.3, np.inf, 0.15])),),
    "tied": (cv.Tied((("a.E", "b.E"), ("a.rho", "b.rho"))),),
    "equality": (cv.LinearEquality({"a.E": 1.0, "c.k": -2.0}, 0.1),),
    "inequality": (cv.LinearInequality({"a.E": 1.0, "a.rho": 1.0, "d.m": 0.5}, upper=-0.05),),
    "total mass": (cv.TotalMass(MASS, base=5.95),),
    "mass positive": (cv.MassPositive(cv.ElementMass(("a.rho", "d.m"), 0.98), POSITIVE),),
    "stiffness positive": (cv.StiffnessPositive(SUM, POSITIVE),),
    "inertia": (cv.Inertia((cv.Equations(MASS[None], np.zeros(1), "mass", unit="kg"), SUM)),),
    "mode": (cv.ReproducedMode(NEAR),),
    "mirror": (cv.Mirror((("a.E", "b.E"), ("a.rho", "b.rho"))),),
    "tied groups": (cv.TiedGroups(("a.E", "b.E", "c.k")),),
    "symmetric": (cv.Symmetric(("K",), ("n1.x", "n1.y")),),
    "connectivity": (cv.Connectivity(("c.k",)),),
    "budget": (cv.Budget(0.2),),
    "budget of the sum": (cv.Budget(0.3, "l1"),),
    "smooth": (cv.Smooth((("a.E", "b.E"), ("b.rho", "d.m")), 0.05),),
    "generic": (cv.Generic((FAMILY,), 0.9, 1.5, mass=True),),
    "element mass": (cv.ElementMass(("a.rho", "b.rho", "d.m"), 0.98),),
    "norm": (
        cv.NormAtMost(np.eye(6), np.full(6, 0.01), 0.2, "the change stays within 0.2 of 0.01"),
    ),
    "equations": (SUM,),
    "matrix inequality": (POSITIVE,),
    "several": (cv.Bounds(-0.3, 0.3), cv.Tied((("a.E", "b.E"),)), cv.TotalMass(MASS, base=5.95)),
}

ONE_SIDED = np.array([-1.0, -2.0, -np.inf, -3.0, -np.inf, -0.2])
FORMS: tuple[cv.Regulariser | cv.Constraint, ...] = (
    cv.Tikhonov(0.3),
    cv.Tikhonov(
        1.0,
        np.array([0.0, 0.1, 0.2, 0.0, -0.3, 0.0]),
        np.array([0.1, 0.2, 0.3, 1e4, 1.0, 2.0]),
    ),
    cv.Prior(2.0, COVARIANCE, "present"),
    cv.Prior(1.5, np.diag(COVARIANCE).copy()),
    cv.Prior(0.7, np.diag(COVARIANCE).copy(), "present"),
    cv.Bounds(ONE_SIDED, np.array([4.0, 5.0, 6.0, np.inf, np.inf, 0.2])),
    cv.Bounds(np.array([0.0, -1, -1, -1, -1, -1]), np.array([0.0, 1, 1, 1, 1, 1])),  # one is held
    cv.LinearInequality({"a.E": -2.0, "b.rho": 1.0}, lower=-0.2, upper=0.7),
    cv.TotalMass(MASS, base=5.95, value=6.0, tolerance=0.3),
)
"""The same members in other forms: open sides, a held parameter, a side each way."""

LABELS = ("n1.x", "n1.y")
ENTRIES = (*(cv.entry_name("K", i, j) for i in LABELS for j in LABELS), "c.k", "d.m")
CASE_COLUMNS = {"symmetric": ENTRIES}
"""Cases whose parameters have other names than `COLUMNS`."""

CONES = {
    "norm": "second-order cone",
    "group-l1": "second-order cone",
    "robust": "second-order cone",
    "entropy": "exponential cone",
    "mode": "second-order cone",
    "budget": "second-order cone",
    "mass positive": "semidefinite cone",
    "stiffness positive": "semidefinite cone",
    "matrix inequality": "semidefinite cone",
    "generic": "semidefinite cone",
}
"""What a loss, a regulariser or a constraint asks of a solver beyond linear rows."""

TABLES: dict[str, dict[str, Any]] = {
    "bounds": {"lower": -0.5},
    "tied": {"parameters": ("a.E", "b.E")},
    "linear": {"coefficients": {"a.E": 1.0}, "at_most": 0.1},
    "total_mass": {"value": 6.0},
    "mass_positive": {"matrix": True},
    "stiffness_positive": {},
    "inertia": {},
    "generic": {"ceiling": 3.0, "inertia": True},
    "modes": {"mode": 1, "within": 2.0},
    "mirror": {"plane": "x"},
    "tied_groups": {"groups": ("left", "right"), "of": "E"},
    "symmetry": {},
    "connectivity": {},
    "budget": {"at_most": 0.1, "norm": "l1"},
    "smoothness": {"at_most": 0.1},
}
"""A table for each key of [constraints]."""

PENALTIES: dict[str, dict[str, Any]] = {"prior": {"deviation": 0.2, "deviations": {"a.E": 0.1}}}
"""What the table of a regulariser has to say beside `kind` and `weight`."""


@dataclass(frozen=True)
class Bench:
    """A context over `ENTRIES` or `COLUMNS` whose answers are made up, but of the right shapes."""

    columns: tuple[str, ...] = COLUMNS
    labels: tuple[str, ...] = ("n1.x", "n1.y")

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        return np.full(6, -0.5), np.full(6, np.inf)

    def changing(self, *of: str) -> tuple[str, ...]:
        return tuple(name for name in self.columns if name.rpartition(".")[2] in of)

    def absent(self) -> tuple[str, ...]:
        return self.columns[4:5]

    def neighbours(self) -> tuple[tuple[str, str], ...]:
        return ((self.columns[0], self.columns[2]),)

    def coupled(self) -> tuple[tuple[str, str], ...]:
        return self.neighbours()

    def mirror_images(self, plane: str, at: float) -> tuple[tuple[str, ...], ...]:
        return self.neighbours()

    def inside(self, groups: tuple[str, ...], of: str) -> tuple[str, ...]:
        return self.changing(of)

    def whole(self) -> tuple[str, ...]:
        return ("K",)

    def unsymmetric(self) -> tuple[str, ...]:
        return ("K",)

    def mass(self) -> cv.MassLaw:
        return cv.MassLaw(MASS, 5.95, True)

    def matrix(self, name: str, asked_by: str) -> tuple[Any, tuple[Any, ...]]:
        return POSITIVE.base, tuple(POSITIVE.derivatives)

    def free_motions(self) -> np.ndarray:
        return np.eye(5)[:, :1]

    def pins(self, motions: np.ndarray) -> np.ndarray:
        return np.array([0])

    def body(self) -> cv.RigidBody:
        J = np.diag([3.0, 3.0, 3.0, 0.1, 0.2, 0.3])
        return cv.RigidBody(lambda centre: (J, np.array([m * J for m in MASS])), False)

    def families(self) -> tuple[cv.FamilyBlocks, ...]:
        return (replace(FAMILY, columns=self.columns[:4]),)

    def mode(self, number: int, exactly: bool) -> cv.ModeRows:
        return cv.ModeRows(NEAR.A, NEAR.b, f"mode {number}")


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
