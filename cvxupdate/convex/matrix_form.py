"""The step in matrix form: the cone program that every solver is given.

::

    minimise    ½ xᵀ P x + qᵀ x + constant
    subject to  A x + s = b,   s in K = {0}^zero × R₊^nonneg × SOC × PSD × exp

with the dual variable z in K* and the optimality conditions P x + q + Aᵀ z = 0, sᵀ z = 0 (Goulart &
Chen 2024, Clarabel).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
import scipy.sparse as sp

from ..system import Array


@dataclass(frozen=True)
class Cones:
    """The cone K, in the order of the rows of A.

    ``zero`` and ``nonneg`` count rows; ``soc`` lists the sizes (t, v) of the second-order cones ‖v‖
    ≤ t; ``psd`` the orders of semidefinite matrices, each as its upper triangle by columns with the
    off-diagonals times √2; ``exp`` counts exponential cones {(x, y, z): y exp(x/y) ≤ z, y > 0},
    three rows each.
    """

    zero: int = 0
    nonneg: int = 0
    soc: tuple[int, ...] = ()
    psd: tuple[int, ...] = ()
    exp: int = 0

    @property
    def rows(self) -> int:
        """Number of rows of A that the cone spans."""
        return (
            self.zero
            + self.nonneg
            + sum(self.soc)
            + sum(k * (k + 1) // 2 for k in self.psd)
            + 3 * self.exp
        )

    @property
    def beyond_qp(self) -> frozenset[str]:
        """Kinds of cone that a quadratic program does not have: "soc", "psd", "exp"."""
        kinds = (("soc", bool(self.soc)), ("psd", bool(self.psd)), ("exp", bool(self.exp)))
        return frozenset(kind for kind, present in kinds if present)


@dataclass(frozen=True, eq=False)
class ConeProgram:
    """A cone program (see the module's docstring). ``P`` (x, x) symmetric and ``A`` (rows, x) are
    scipy CSC arrays."""

    P: Any
    q: Array
    A: Any
    b: Array
    cones: Cones
    constant: float = 0.0

    def objective(self, x: Array) -> float:
        """½ xᵀ P x + qᵀ x + constant."""
        return float(0.5 * x @ (self.P @ x) + self.q @ x + self.constant)


def cone_program(problem: Any, *variables: Any) -> tuple[ConeProgram, tuple[int, ...]]:
    """The canonical cone program of a cvxpy problem at the present values of its Parameters.

    Compiles on the first call; later calls only apply the Parameters. The second value tells where
    the entries of each of the given cvxpy variables begin in x.
    """
    import cvxpy as cp

    data, _, inverse = problem.get_problem_data(cp.CLARABEL)
    dims = data["dims"]
    if dims.p3d or dims.pnd:
        raise NotImplementedError("ConeProgram carries no power cones; use SOC, PSD or exp cones")
    q = np.asarray(data["c"], dtype=float)
    size = q.size
    P = sp.csc_array(data["P"]) if data.get("P") is not None else sp.csc_array((size, size))
    A = sp.csc_array(data["A"]) if data["A"] is not None else sp.csc_array((0, size))
    b = np.zeros(0) if data["b"] is None else np.asarray(data["b"], dtype=float)
    P.eliminate_zeros()
    A.eliminate_zeros()
    cones = Cones(
        int(dims.zero),
        int(dims.nonneg),
        tuple(map(int, dims.soc)),
        tuple(map(int, dims.psd)),
        int(dims.exp),
    )
    constant = float(np.ravel(inverse[-1][cp.settings.OFFSET])[0])
    places = tuple(int(data["param_prob"].var_id_to_col[variable.id]) for variable in variables)
    return ConeProgram(P, q, A, b, cones, constant), places
