"""At least one instance of every member of the registries of the convex step, over one set of
columns; `tests/convex/test_quadratic.py` fails for a member without one."""

from __future__ import annotations

import numpy as np

from cvxupdate import convex as cv

COLUMNS = ("a.E", "b.E", "b.rho", "K[n1.x, n2.x]", "K[n2.x, n1.x]")
N = len(COLUMNS)

LOSSES: tuple[cv.Loss, ...] = (cv.LeastSquares(), cv.AbsoluteLoss(), cv.Huber(1.2), cv.Norm())

REGULARISERS: tuple[cv.Regulariser, ...] = (
    cv.Tikhonov(1.0, np.array([0.0, 0.1, 0.2, 0.0, -0.3]), np.array([0.1, 0.2, 0.3, 1e4, 1.0])),
    cv.Tikhonov(0.3),
    cv.L1(2.0),
    cv.GroupL1(2.0),
    cv.TotalVariation(2.0, (("a.E", "b.E"),)),
    cv.Entropy(2.0),
    cv.Robust(2.0),
)

MASS = np.array([0.0, 0.0, 2.5, 0.7, 0.0])
SHAPES = np.array([[1.0, 0.2, 0.0, -0.4, 0.0], [0.0, 0.3, 1.1, 0.0, 0.5]])
PARTS = tuple(np.diag(np.eye(3)[k % 3] * (0.5 + k)) for k in range(N))

CONSTRAINTS: tuple[cv.Constraint, ...] = (
    cv.Bounds(
        np.array([-1.0, -2.0, -np.inf, -3.0, -np.inf]), np.array([4.0, 5, 6, np.inf, np.inf])
    ),
    cv.Bounds(np.array([0.0, -1, -1, -1, -1]), np.array([0.0, 1, 1, 1, 1])),  # the first one held
    cv.Tied((("a.E", "b.E"),)),
    cv.LinearEquality({"a.E": 1.0, "b.rho": -2.0}, 0.1),
    cv.LinearInequality({"a.E": 1.0, "b.E": 0.5, "b.rho": -3.0}, upper=0.4),
    cv.LinearInequality({"a.E": -2.0, "b.rho": 1.0}, lower=-0.2, upper=0.7),
    cv.TotalMass(MASS, base=5.95),
    cv.TotalMass(MASS, base=5.95, value=6.0, tolerance=0.3),
    cv.NormAtMost(np.eye(N), np.full(N, 0.01), 0.2, "the change stays within 0.2 of 0.01"),
    cv.Equations(SHAPES, np.array([0.1, -0.05]), "two modes reproduced"),
    cv.Equations(SHAPES, np.array([0.1, -0.05]), "two modes reproduced, nearly", within=0.1),
    cv.MatrixInequality(np.eye(3), PARTS, "K stays positive definite", 1e-3),
    cv.ElementMass(("b.rho",)),
    cv.Budget(0.4),
    cv.Budget(0.9, "l1"),
    cv.Smooth((("a.E", "b.E"), ("b.E", "b.rho")), 0.2),
    cv.Symmetric("K", ("n1.x", "n2.x")),
    cv.Connectivity(("K[n1.x, n2.x]",)),
)
