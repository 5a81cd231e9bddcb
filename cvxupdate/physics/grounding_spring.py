"""``grounding_spring``: a stiffness between a node and ground, or a support that is softer than
rigid."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial

import numpy as np
import scipy.sparse as sp

from cvxupdate.fe.elements import Spring, Term
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.physics.base import (
    Candidate,
    Context,
    Place,
    Wanted,
    at_once,
    dof_rows,
    small_block,
    with_block,
)

STIFFEST, SOFTEST = (
    1e5,
    1e4,
)  # upper bounds of a spring and of a support's compliance, in their units
RIGID = 1e4  # a soft support begins this much stiffer than the structure around it


@dataclass(frozen=True)
class Compliance:
    """A spring given by its compliance, so that zero means rigid: k = 1 / (a₀ + a)."""

    nodes: int
    dof: str
    name: str = "compliance"
    properties: tuple[str, ...] = ("a",)

    @property
    def dofs(self) -> tuple[str, ...]:
        """The DOF kind it acts along."""
        return (self.dof,)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """None: the block is made with its term."""
        return ()

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """k in N/m or N·m/rad."""
        return {"k": 1.0 / (properties["a0"] + properties["a"])}


def candidates(context: Context) -> list[Candidate]:
    """Springs to ground at every free DOF, and compliance of every support. Tell-tale: the lowest
    modes move most."""
    return _springs(context) + _supports(context)


def _springs(context: Context) -> list[Candidate]:
    out = []
    for row, node, kind in dof_rows(context.model, KINDS):
        stiffness, mass = context.local(row)
        if stiffness == 0.0 and mass == 0.0:
            continue
        unit = 0.02 * stiffness if stiffness > 0 else mass * (2 * np.pi * context.bottom) ** 2
        out.append(
            Candidate(
                "grounding_spring",
                Place(nodes=(node,), dof=kind),
                partial(_sprung, context.model, row, node, kind, unit),
                1,
                np.zeros(1),
                at_once((row,), "K", np.full((1, 1), unit)),
                sign=1,
                report=(("k", 0, "value"),),
                limits=(0.0, STIFFEST),
            )
        )
    return out


def _sprung(model: Model, row: int, node: int, kind: str, unit: float) -> Model:
    block = small_block(
        model,
        Spring(kind, 1),
        np.array([[row]]),
        [KINDS.index(kind)],
        "K",
        np.ones((1, 1)),
        {"k": 0.0},
    )
    return with_block(
        model,
        block,
        [
            Wanted(
                f"grounding_spring@n{node}.{kind}",
                "k",
                (int(block.ids[0]),),
                lower=0.0,
                upper=STIFFEST,
                scale=unit,
            )
        ],
    )


def _supports(context: Context) -> list[Candidate]:
    """A held DOF set free on a spring: k from infinity downwards; the screening column is −k_i k_iᵀ
    / k_ii per unit, exact at infinite stiffness."""
    out = []
    for node, kind in context.supports:
        model = context.release(node, kind)
        label = f"n{node}.{kind}"
        if label not in model.place:
            continue
        row = model.place[label]
        matrices = model.matrices(model.zero())
        stiffness = float(matrices.K[row, row])
        if stiffness <= 0.0:
            continue
        unit = 1.0 / stiffness
        out.append(
            Candidate(
                "grounding_spring",
                Place(nodes=(node,), dof=kind),
                partial(_softened, model, row, label, kind, unit),
                1,
                np.zeros(1),
                ((_tangent(context, model, matrices.K, row, unit),),),
                sign=1,
                report=(("k", 0, "inverse"),),
                offset=unit / RIGID,
                limits=(0.0, SOFTEST),
            )
        )
    return out


def _softened(model: Model, row: int, label: str, kind: str, unit: float) -> Model:
    block = small_block(
        model,
        Compliance(1, kind),
        np.array([[row]]),
        [KINDS.index(kind)],
        "K",
        np.ones((1, 1)),
        {"a": 0.0, "a0": unit / RIGID},
    )
    return with_block(
        model,
        block,
        [
            Wanted(
                f"soft_support@{label}",
                "a",
                (int(block.ids[0]),),
                lower=0.0,
                upper=SOFTEST,
                scale=unit,
            )
        ],
    )


def _tangent(
    context: Context, model: Model, K: sp.csc_array, row: int, unit: float
) -> DerivativeBlock:
    column = K[:, [row]].toarray()[:, 0]
    used = [
        i for i in np.flatnonzero(column) if i != row and model.labels[i] in context.model.place
    ]
    k = column[used]
    dofs = np.array([[context.model.place[model.labels[i]] for i in used]], dtype=np.int64)
    return DerivativeBlock(dofs, (-np.outer(k, k) * unit)[None], None, None, None)
