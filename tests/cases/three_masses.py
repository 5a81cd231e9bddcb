"""A chain of three masses with one parameter, the stiffness of its second spring."""

from __future__ import annotations

from cvxupdate.fe.model import Model
from cvxupdate.fe.select import select_parameters
from cvxupdate.physics.growth import Wanted
from tests.cases.elements import build

STIFFNESS, MASS, ZETA = (6.0e4, 4.0e4, 5.2e4), (2.0, 1.4, 1.1), 0.01


def chain() -> Model:
    text = {
        "dofs": ["x"],
        "nodes": [{"id": i + 1, "x": float(i)} for i in range(3)],
        "elements": [
            {
                "type": "spring",
                "dof": "x",
                "rows": [
                    {"id": 1, "nodes": [1], "k": STIFFNESS[0]},
                    {"id": 2, "nodes": [1, 2], "k": STIFFNESS[1]},
                    {"id": 3, "nodes": [2, 3], "k": STIFFNESS[2]},
                ],
            },
            {
                "type": "mass",
                "rows": [{"id": 4 + i, "nodes": [i + 1], "m": m} for i, m in enumerate(MASS)],
            },
        ],
        "damping": {"kind": "modal", "zeta": ZETA},
    }
    model = build(text)
    return model.with_parameters(select_parameters([Wanted("k2", "stiffness", (2,))], model))
