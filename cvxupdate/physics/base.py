"""What a physics word is: one more parameter (or a few) on the model, zero today, at a place where
it can stand."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property, partial

import numpy as np
import scipy.sparse as sp
from numpy.typing import NDArray

from cvxupdate.fe.block import COMMON, Block, Index
from cvxupdate.fe.elements.base import Element, Term
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.select import has_property, property_names, select_parameters

Real = NDArray[np.float64]


@dataclass(frozen=True)
class Wanted:
    """A parameter to select on a model (see `cvxupdate.fe.select.Wanted`)."""

    name: str
    of: str
    elements: tuple[int, ...]
    group: str | None = None
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None


@dataclass(frozen=True)
class Place:
    """A location in the contract's words."""

    nodes: tuple[int, ...] = ()
    elements: tuple[int, ...] = ()
    groups: tuple[str, ...] = ()
    dof: str | None = None

    def to_json(self) -> dict[str, object]:
        """The ``location`` of a finding."""
        out: dict[str, object] = {
            "nodes": list(self.nodes),
            "elements": list(self.elements),
            "groups": list(self.groups),
        }
        if self.dof is not None:
            out["dof"] = self.dof
        return out


@dataclass(frozen=True)
class Candidate:
    """A word at a place.

    ``grow`` makes the `model`, which carries the extra parameters at the end of its list, ``extra``
    of them (None: it has none of its own); ``start`` (extra,) is where a refit begins (zero: the
    model as it is); ``limits`` bound the first of them. ``tangent`` gives, for each screening
    column, derivative blocks on the base model's DOFs; ``tuned`` (DOF place, frequency in Hz,
    damping) a hidden oscillator's column instead; ``channel`` a sensor label (``sensor``: "gain",
    "delay" or "swap", the last with the channel ``other``). ``sign`` +1 where the first parameter
    cannot be negative. ``report`` names each reported figure: (name, index, how). ``members`` are
    the elements of a set; ``additive``: the set's column is the sum of its members' columns.
    """

    physics: str
    place: Place
    grow: Callable[[], Model] | None
    extra: int
    start: Real
    tangent: tuple[tuple[DerivativeBlock, ...], ...] = ()
    tuned: tuple[int, float, float] | None = None
    channel: str | None = None
    sensor: str | None = None
    other: str = ""
    sign: int = 0
    report: tuple[tuple[str, int, str], ...] = ()
    members: tuple[int, ...] = ()
    offset: float = 0.0
    additive: bool = False
    limits: tuple[float, float] = (0.0, 0.0)

    @cached_property
    def model(self) -> Model | None:
        """The model with the word on it, made when it is first asked for: most candidates are only
        screened."""
        return None if self.grow is None else self.grow()

    @property
    def name(self) -> str:
        """A short label, for tables."""
        p = self.place
        where = (
            p.groups
            or (tuple(f"e{e}" for e in p.elements) if p.elements else ())
            or tuple(f"n{n}" for n in p.nodes)
        )
        at = ", ".join(where[:4]) + (" …" if len(where) > 4 else "")
        if self.channel is not None:
            return f"{self.physics} ({self.sensor}) at {self.channel}" + (
                f" and {self.other}" if self.other else ""
            )
        return f"{self.physics} at {at or 'the whole structure'}" + (f" ({p.dof})" if p.dof else "")


@dataclass(frozen=True)
class Context:
    """The structure that words are placed on: the undamped model at p = 0, its matrices, the band's
    top (Hz), and which sensors there are; ``release(node, kind)`` builds the model without one
    support."""

    model: Model
    K: sp.csc_array
    M: sp.csc_array
    top: float
    bottom: float
    sensors: tuple[str, ...]
    supports: tuple[tuple[int, str], ...]
    release: Callable[[int, str], Model]
    zeta: float

    def local(self, row: int) -> tuple[float, float]:
        """Diagonal stiffness and mass at a free DOF: the scale of what a support or lump there
        would have to be."""
        stiffness, mass = self._diagonals
        return float(stiffness[row]), float(mass[row])

    @cached_property
    def _diagonals(self) -> tuple[Real, Real]:
        return self.K.diagonal(), self.M.diagonal()


def new_ids(model: Model, count: int) -> NDArray[np.int64]:
    """Element numbers that are not used yet."""
    top = max((int(b.ids.max(initial=0)) for b in model.blocks), default=0)
    return np.arange(top + 1, top + 1 + count, dtype=np.int64)


def small_block(
    model: Model,
    kind: Element,
    dofs: NDArray[np.int64],
    directions: Sequence[int],
    term: str,
    pattern: Real,
    properties: Mapping[str, float],
    group: str = "",
) -> Block:
    """A block of a few new elements: ``dofs`` (e, d), one geometric term each."""
    n = len(dofs)
    values = {
        **{k: np.full(n, v) for k, v in COMMON.items()},
        **{k: np.full(n, v) for k, v in properties.items()},
    }
    terms = tuple(Term(term, name, pattern[None]) for name in kind.coefficients(values))
    return Block(
        kind,
        new_ids(model, n),
        (group,) * n,
        dofs,
        np.array([directions]),
        terms,
        np.zeros(n, dtype=np.int64),
        values,
    )


def with_block(model: Model, block: Block, wanted: Sequence[Wanted]) -> Model:
    """The model with a block added and parameters on it appended."""
    return append_parameters(replace(model, blocks=(*model.blocks, block)), wanted)


def append_parameters(model: Model, wanted: Sequence[Wanted]) -> Model:
    """The model with parameters appended; a name that is taken gets a number."""
    taken = {q.name for q in model.parameters}
    fresh = [
        replace(w, name=w.name if w.name not in taken else f"{w.name} ({len(taken)})")
        for w in wanted
    ]
    added: tuple[Parameter, ...] = select_parameters(fresh, model)
    return model.with_parameters((*model.parameters, *added))


def tangents(model: Model, extra: int) -> tuple[tuple[DerivativeBlock, ...], ...]:
    """Derivative blocks of the last ``extra`` parameters at p = 0."""
    return tuple(model.derivative(len(model.parameters) - extra + k) for k in range(extra))


@dataclass(frozen=True)
class Rates:
    """What a property does to the matrices of every element at p = 0, formed once: sets of elements
    share it.

    ``blocks``: number, (dofs (n, d), {"K": (n, d, d), …}, which elements it moves {"K": (n,), …})
    of each block that has the property; ``places`` the (block, row) of each element number.
    """

    blocks: Mapping[int, tuple[Index, Mapping[str, Real], Mapping[str, NDArray[np.bool_]]]]
    places: Mapping[int, tuple[tuple[int, int], ...]]

    @classmethod
    def of(cls, model: Model, of: str, scale: float | None = None) -> Rates:
        """Of the property ``of``, in shares of its value, or by ``scale`` where it is zero (see
        `select_parameters`)."""
        names = property_names(of)
        blocks: dict[int, tuple[Index, Mapping[str, Real], Mapping[str, NDArray[np.bool_]]]] = {}
        places: dict[int, tuple[tuple[int, int], ...]] = {}
        for number, block in enumerate(model.blocks):
            if has_property(block, of):
                base = np.array([block.properties[n] for n in names])
                rates = block.derivative(
                    block.properties,
                    np.arange(len(block.ids)),
                    names,
                    np.where(base != 0.0, base, scale or 0.0),
                )
                blocks[number] = (
                    block.dofs,
                    rates,
                    {m: np.any(v != 0.0, axis=(1, 2)) for m, v in rates.items()},
                )
                for row, element in enumerate(block.ids.tolist()):
                    places[element] = (*places.get(element, ()), (number, row))
        return cls(blocks, places)

    def tangent(self, ids: Sequence[int]) -> tuple[DerivativeBlock, ...]:
        """Derivative blocks of one parameter on the elements ``ids``, those without effect left
        out."""
        chosen: dict[int, list[int]] = {}
        for element in ids:
            for number, row in self.places.get(element, ()):
                chosen.setdefault(number, []).append(row)
        out = []
        for number in sorted(chosen):
            dofs, rates, moving = self.blocks[number]
            rows = np.array(chosen[number])
            parts = {m: v[rows] for m, v in rates.items() if np.any(moving[m][rows])}
            if parts:
                out.append(
                    DerivativeBlock(
                        dofs[rows], parts.get("K"), parts.get("M"), parts.get("C"), parts.get("D")
                    )
                )
        return tuple(out)


def given(model: Model) -> Callable[[], Model]:
    """A model that is at hand already, for `Candidate.grow`."""
    return partial(_itself, model)


def _itself(model: Model) -> Model:
    return model


def at_once(
    dofs: Sequence[int], matrix: str, values: Real
) -> tuple[tuple[DerivativeBlock, ...], ...]:
    """`Candidate.tangent` of one element that adds ``values`` (d, d) to one matrix per unit of
    p."""
    parts = {m: values[None] if m == matrix else None for m in "KMCD"}
    return (
        (
            DerivativeBlock(
                np.array([dofs], dtype=np.int64), parts["K"], parts["M"], parts["C"], parts["D"]
            ),
        ),
    )


def dof_rows(model: Model, kinds: Sequence[str]) -> list[tuple[int, int, str]]:
    """(row, node id, kind) of the free DOFs of the given kinds."""
    return [
        (i, int(model.node_ids[n]), KINDS[k])
        for i, (n, k) in enumerate(
            zip(model.dof_node.tolist(), model.dof_kind.tolist(), strict=True)
        )
        if KINDS[k] in kinds and "@" not in model.labels[i]
    ]


TRANSLATIONS = ("x", "y", "z")
ROTATIONS = ("rx", "ry", "rz")


def reported(
    model: Model, parameter: Parameter, how: str, x: float, dx: float, offset: float
) -> tuple[float, float]:
    """A parameter's value ``x`` and deviation ``dx``, in units of p, as the contract reports it:
    ``how`` is "factor", "inverse", "kappa" or "value"."""
    if how == "factor":
        return 1.0 + x, dx
    if how == "inverse":
        compliance = offset + parameter.unit_size * x
        return 1.0 / compliance, parameter.unit_size * dx / compliance**2
    if how == "kappa":
        kappa = max(
            (float(b.properties["kappa"][0]) for b in model.blocks if "kappa" in b.properties),
            default=5.0 / 6.0,
        )
        return kappa / max(x, 1e-6), kappa * dx / max(x, 1e-6) ** 2
    return parameter.physical(x), abs(parameter.unit_size) * dx
