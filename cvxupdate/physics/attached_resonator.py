"""``attached_resonator``: a hidden mass on a spring and damper; tell-tale: a mode that the model
does not have (Ewins 2000, 6.3)."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Term
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.base import (
    TRANSLATIONS,
    Candidate,
    Context,
    Place,
    Wanted,
    append_parameters,
    dof_rows,
    new_ids,
)

DAMPING = 0.01  # of the trial oscillators; free afterwards
STEPS = 24  # trial frequencies in the band


@dataclass(frozen=True)
class Oscillator:
    """Mass, spring and dashpot on one DOF of the structure; DOFs (host, hidden)."""

    dof: str
    name: str = "oscillator"
    nodes: int = 2
    properties: tuple[str, ...] = ("m", "k", "c")

    @property
    def dofs(self) -> tuple[str, ...]:
        """The DOF kind it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the block is made with its terms."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """m in kg, k in N/m, c in N·s/m."""
        return {name: properties[name] for name in self.properties}


def candidates(context: Context) -> list[Candidate]:
    """At every free translation, on a grid of frequencies; the model is only built for those that
    pass the screening (`attach`)."""
    grid = np.geomspace(max(context.bottom, 1e-3), context.top, STEPS)
    return [
        Candidate(
            "attached_resonator",
            Place(nodes=(node,), dof=kind),
            None,
            3,
            np.zeros(3),
            tuned=(row, float(f), DAMPING),
            sign=1,
            report=(("m", 0, "value"), ("k", 1, "value"), ("c", 2, "value")),
        )
        for row, node, kind in dof_rows(context.model, TRANSLATIONS)
        for f in grid
    ]


def attach(model: Model, row: int, frequency: float, mass: float, zeta: float = DAMPING) -> Model:
    """The model with an oscillator of the given tuning; its m, k, c are parameters relative to
    these values."""
    code = int(model.dof_kind[row])
    omega = 2 * np.pi * frequency
    hidden = model.size
    label = model.labels[row]
    grown = replace(
        model,
        labels=(*model.labels, f"{label.split('.')[0]}@hidden.{KINDS[code]}"),
        dof_node=np.append(model.dof_node, model.dof_node[row]),
        dof_kind=np.append(model.dof_kind, code),
    )
    pair = np.array([[1.0, -1.0], [-1.0, 1.0]])
    properties = {
        **{k: np.array([v]) for k, v in COMMON.items()},
        "m": np.array([mass]),
        "k": np.array([mass * omega**2]),
        "c": np.array([2 * zeta * mass * omega]),
    }
    ids = new_ids(model, 1)
    terms = (
        Term("M", "m", np.diag([0.0, 1.0])[None]),
        Term("K", "k", pair[None]),
        Term("C", "c", pair[None]),
    )
    block = Block(
        Oscillator(KINDS[code]),
        ids,
        ("",),
        np.array([[row, hidden]]),
        np.array([[code, code]]),
        terms,
        np.zeros(1, dtype=np.int64),
        properties,
    )
    grown = replace(grown, blocks=(*grown.blocks, block))
    wanted = [
        Wanted(f"resonator.{n}", n, (int(ids[0]),), lower=-0.97, upper=50.0)
        for n in ("m", "k", "c")
    ]
    return append_parameters(grown, wanted)
