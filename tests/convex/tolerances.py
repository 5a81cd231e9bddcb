"""The one tolerance table: what each solver is held to in every contract test.

``objective``: relative difference from Clarabel's objective; ``certificate``: largest relative
residual of the optimality conditions; ``feasible``: how far p may break a clause, in its unit.
"""

from __future__ import annotations

from dataclasses import dataclass


@dataclass(frozen=True)
class Tolerance:
    objective: float
    certificate: float
    feasible: float


TOLERANCES = {
    "CLARABEL": Tolerance(1e-7, 1e-7, 1e-7),
    "OSQP": Tolerance(1e-7, 1e-7, 1e-7),
    "SCS": Tolerance(1e-7, 1e-7, 1e-7),
    "PROXQP": Tolerance(1e-7, 1e-7, 1e-7),
    "PIQP": Tolerance(1e-7, 1e-6, 1e-7),
    "DAQP": Tolerance(1e-7, 1e-7, 1e-7),
    "QUADPROG": Tolerance(1e-7, 1e-7, 1e-7),
    "HIGHS": Tolerance(1e-7, 1e-7, 1e-7),
}
