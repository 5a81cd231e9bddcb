"""``attached_resonator``: a hidden mass on a spring and damper; tell-tale: a mode that the model
does not have (Ewins 2000, 6.3)."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any, final

import numpy as np

from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements import Term
from cvxupdate.fe.elements.base import Real, Values
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.draft import Draft, kind_of, not_negative
from cvxupdate.physics.effect import MODES, RESPONSES, Effect, EffectType, HiddenOscillator
from cvxupdate.physics.growth import append_parameters, dof_rows, limited, new_ids
from cvxupdate.physics.place import TRANSLATIONS, Place, at, drive_point
from cvxupdate.physics.quantity import physical
from cvxupdate.physics.units import number, quantity, stiffness_unit

DAMPING = 0.01  # of the trial oscillators; free afterwards
STEPS = 24  # trial frequencies in the band
LIMITS = (-0.97, 50.0)  # of its mass, stiffness and damping


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


def write(draft: Draft, model: Model, block: Block, e: int, now: Mapping[str, float]) -> None:
    """A node of its own that moves along one DOF only: mass, spring and dashpot."""
    host, number = int(block.dofs[e, 0]), int(block.ids[e])
    node, dof = draft.end(model, host), kind_of(model, host)
    fresh, group = draft.fresh_node(node), draft.fresh_group("resonator", node)
    draft.hold(fresh, [k for k in draft.model["dofs"] if k != dof])
    both: dict[str, Any] = {"nodes": [node, fresh], "dof": dof}
    kinds = {"m": ("mass", {"nodes": [fresh]}), "k": ("spring", both), "c": ("dashpot", both)}
    for key, (kind, row) in kinds.items():
        if key == "c" and now[key] == 0.0:
            continue
        own = number if key == "m" else draft.fresh_element()
        value = not_negative(own, key, now[key])
        draft.put(kind, {"id": own, **row, key: value, "group": group})
        draft.known[number, key] = (own, key)


@final
class AttachedResonator(EffectType):
    """A hidden oscillator."""

    name = "attached_resonator"
    noun = "a hidden oscillator"
    told_by = frozenset({RESPONSES, MODES})
    writers = (("oscillator", write),)

    def candidates(self, context: SearchContext) -> list[Effect]:
        """At every free translation, on a grid of frequencies; the model is only built for those
        that pass the screening (`attach`). Without dashpot for tables of modes, whose model is
        undamped."""
        grid = np.geomspace(max(context.bottom, 1e-3), context.top, STEPS)
        figures = [physical("m", "kg"), physical("k", "N/m", 1)]
        if not context.undamped:
            figures.append(physical("c", "N·s/m", 2))
        zeta = 0.0 if context.undamped else DAMPING
        return [
            Effect(
                self,
                Place(nodes=(node,), dof=kind),
                HiddenOscillator(row, float(f), zeta, attach),
                tuple(figures),
                1,
                LIMITS,
                drive_point(Place(nodes=(node,), dof=kind), context.driven),
            )
            for row, node, kind in dof_rows(context.model, TRANSLATIONS)
            for f in grid
        ]

    def says(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Mass, frequency and spring."""
        m, k = values["m"], values["k"]
        spring = quantity(k, stiffness_unit(effect.place))
        shaker = ": the shaker's armature on its stinger" if effect.spot else ""
        spot = effect.spot or at(effect.place)
        return (
            f"Something of {quantity(m, 'kg')} swings on its own {spot}, "
            f"at {number(_tuning(m, k))} Hz (on a spring of {spring}), that the model does not "
            f"know{shaker}."
        )

    def sizeless(self, effect: Effect, values: Mapping[str, float]) -> str:
        """Its frequency, which its own mode tells."""
        m = values["m"]
        return (
            f"Something swings on its own {at(effect.place)}, at "
            f"{number(_tuning(m, values['k']))} Hz, that the model does not know; how heavy it is "
            f"these recordings do not tell ({quantity(m, 'kg')} would do)."
        )


def _tuning(m: float, k: float) -> float:
    """Hz."""
    return math.sqrt(k / m) / (2.0 * math.pi) if m > 0 and k > 0 else math.nan


def hidden_label(label: str, kind: str) -> str:
    """That of the own DOF of an oscillator at a DOF."""
    return f"{label.split('.')[0]}@hidden.{kind}"


def attach(model: Model, row: int, frequency: float, mass: float, zeta: float = DAMPING) -> Model:
    """The model with an oscillator of the given tuning; its m, k, c are parameters relative to
    these values (no c without damping)."""
    code = int(model.dof_kind[row])
    omega = 2 * np.pi * frequency
    hidden = model.size
    label = model.labels[row]
    grown = replace(
        model,
        labels=(*model.labels, hidden_label(label, KINDS[code])),
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
    names = ("m", "k", "c") if zeta > 0.0 else ("m", "k")
    wanted = [limited(f"resonator.{n}", n, ids.tolist(), LIMITS) for n in names]
    return append_parameters(grown, wanted)
