"""Bases that move the structure, as lumps so heavy that it does not move them."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.errors import ModelError
from cvxupdate.fe.batches import Place
from cvxupdate.fe.block import COMMON, Block
from cvxupdate.fe.elements.base import Real, Term, Values
from cvxupdate.fe.labels import KINDS
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec
from cvxupdate.spec import model as sm
from cvxupdate.spec.bases import on_bases

HEAVIER = 1e7
"""Of the structure. At a resonance of quality Q the base feels Q times its mass, so Q · 1e-7 is
left out; and rounding leaves eight digits of the structure's masses beside the base's, of which the
eigenproblem forms differences."""
NAME = "base"
"""The kind of their block (`Block.is_base`): no parameter, total mass or count is about it."""


@dataclass(frozen=True)
class BaseLump:
    """A mass along the one DOF of a base."""

    name: str = NAME
    nodes: int = 0
    dofs: tuple[str, ...] = ()
    properties: tuple[str, ...] = ("m",)

    def terms(self, xyz: Real, orientation: Real) -> tuple[Term, ...]:
        """A unit mass."""
        return (Term("M", "m", np.ones((len(xyz), 1, 1))),)

    def coefficients(self, properties: Mapping[str, Values]) -> dict[str, Values]:
        """The mass in kg."""
        return {"m": properties["m"]}


def moving(spec: Spec, mass_of: Callable[[Spec], float]) -> Spec:
    """The problem with its bases (`cvxupdate.spec.bases`), each with a mass: where none is given
    that of the structure by ``mass_of`` (kg) times 1e7, up to the next power of ten. A problem
    without bases, or with their masses, is returned as it is.

    Raises
    ------
    ModelError
        Where the structure has no mass to go by.
    """
    spec = on_bases(spec)
    if all(b.mass is not None for b in spec.model.bases):
        return spec
    bare = spec.model.model_copy(
        update={"bases": tuple(b.model_copy(update={"mass": 1.0}) for b in spec.model.bases)}
    )
    total = mass_of(replace(spec, model=bare, update=None))
    if total <= 0.0:
        raise ModelError(
            "the model has no mass by which to size the base that moves it. Give `mass` in "
            "[[model.bases]]: 1e7 times that of what stands on it."
        )
    mass = float(10.0 ** np.ceil(np.log10(HEAVIER * total)))
    bases = tuple(
        b if b.mass is not None else b.model_copy(update={"mass": mass}) for b in spec.model.bases
    )
    return replace(spec, model=spec.model.model_copy(update={"bases": bases}))


def base_blocks(text: sm.Model, position: Mapping[int, int], place: Place) -> list[Block]:
    """One block with the lump of every base, or none.

    Raises
    ------
    ModelError
        Where nothing stands on a base.
    """
    if not text.bases:
        return []
    rows = []
    for base in text.bases:
        kind = KINDS.index(base.dof)
        row = next(
            (place[position[n], kind] for n in base.nodes if (position.get(n, -1), kind) in place),
            None,
        )
        if row is None:
            raise ModelError(
                f"model.bases: nothing moves along {base.dof} at node {base.nodes[0]}, so a motion "
                "there drives nothing. Correct node or dof, or join an element to it."
            )
        rows.append(row)
    count = len(rows)
    properties = {k: np.full(count, v) for k, v in COMMON.items()}
    properties["m"] = np.array([base.mass or 1.0 for base in text.bases])
    lump = BaseLump()
    return [
        Block(
            lump,
            np.zeros(count, dtype=np.int64),
            ("",) * count,
            np.array(rows, dtype=np.int64)[:, None],
            np.array([[KINDS.index(b.dof)] for b in text.bases], dtype=np.int64),
            lump.terms(np.zeros((1, 3)), np.zeros((1, 3))),
            np.zeros(count, dtype=np.int64),
            properties,
        )
    ]


def base_labels(model: Model) -> frozenset[str]:
    """Labels of the DOFs that bases move ("n1.x"), tied ones too."""
    rows = {int(i) for b in model.blocks if b.is_base for i in b.dofs.ravel()}
    return frozenset(label for label, row in model.place.items() if row in rows)
