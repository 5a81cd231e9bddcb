"""Responses to a drive that took along what stands at it (`cvxupdate.physics.shaker`).

The model has the shaker's mass and spring where the first of what was fitted was driven. Driven
from elsewhere the structure is without them there, and has them at its new drive: a change Δ of the
dynamic stiffness of these few DOFs by which receptances H become H − H_sr Δ (I + H_rr Δ)⁻¹ H_rd, in
closed form (Sherman, Morrison and Woodbury; Ewins 2000, 6.4).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Protocol

import numpy as np

from cvxupdate.diagnose.responses.aside import shapes_aside
from cvxupdate.diagnose.responses.signals import Complex, Real, Signal
from cvxupdate.fe.block import Index
from cvxupdate.fe.model import KINDS, DerivativeBlock, Model
from cvxupdate.fe.modes import Modes
from cvxupdate.fe.synthesis.derivatives import Among, summed
from cvxupdate.fe.synthesis.loss import Loss
from cvxupdate.fe.synthesis.pieces import Driven, Response, respond, sensor_rows
from cvxupdate.fe.synthesis.products import times
from cvxupdate.physics.place import channel_place
from cvxupdate.physics.shaker import goes_with_drive

Rate = DerivativeBlock | Among
Further = tuple[Real | None, Real | None]


class Point(Protocol):
    """A model at values ``p`` of the unknowns, its parameters first."""

    @property
    def p(self) -> Real:
        """The unknowns."""

    @property
    def modes(self) -> Modes:
        """Its modes there."""

    @property
    def loss(self) -> Loss:
        """How they lose energy."""

    @property
    def near(self) -> int:
        """How many have pieces of their own."""


@dataclass(frozen=True)
class Carried:
    """What a model has at a drive that goes with it: blocks of its matrices, and the ``labels`` of
    the DOFs of each (one more for a DOF that is held: none)."""

    labels: tuple[tuple[tuple[str, ...], ...], ...]
    blocks: tuple[DerivativeBlock, ...]

    @classmethod
    def of(cls, model: Model, p: Real) -> Carried:
        """What parameters of the model, at their values ``p``, say goes with the drive."""
        blocks = tuple(_going(model, p))
        names = (*model.labels, "")
        labels = (tuple(tuple(names[i] for i in row) for row in b.dofs.tolist()) for b in blocks)
        return cls(tuple(labels), blocks)

    def where(self, driven: Sequence[str]) -> Carried:
        """The same, or nothing where none of the places ``driven`` is that where it stands."""
        nodes = {x.split(".")[0] for b in self.labels for row in b for x in row if x}
        return self if nodes <= {x.split(".")[0] for x in driven} else NOTHING

    def on(self, model: Model) -> list[DerivativeBlock]:
        """The blocks on a model that has it there by itself."""
        rows = [[[model.place.get(x, -1) for x in row] for row in b] for b in self.labels]
        return [
            replace(b, dofs=np.array(r, dtype=np.int64))
            for b, r in zip(self.blocks, rows, strict=True)
        ]


NOTHING = Carried((), ())


def _which(model: Model) -> list[int]:
    return [j for j, q in enumerate(model.parameters) if goes_with_drive(q.name)]


def _going(model: Model, p: Real) -> list[DerivativeBlock]:
    own = p[: len(model.parameters)]
    return [_sized(b, float(own[j])) for j in _which(model) for b in model.derivative(j, own)]


def driven(
    point: Point, model: Model, signal: Signal, further: Further, carried: Carried = NOTHING
) -> Response:
    """The ``model``'s answer to a signal, with C and D among its lowest modes (``further``): where
    that is driven from a place to which something went along, with that there, be it what its
    parameters say or what it had ``carried`` there before."""
    blocks = [*carried.on(model), *_going(model, point.p)] if len(signal.inputs) == 1 else []
    pairs = [(b, _moved(model, b, signal.inputs[0])) for b in blocks]
    if any(not np.array_equal(stays.dofs, goes.dofs) for stays, goes in pairs):
        return _changed(point, model, signal, further, pairs)
    at, by = (sensor_rows(model, labels) for labels in (signal.sensors, signal.inputs))
    aside = shapes_aside(model, point.p, signal, point.modes)
    return respond(signal, point.modes, at, by, point.loss, *further, point.near, aside)


def rates_at(
    model: Model, p: Real, signal: Driven, rates: Sequence[Sequence[Rate]]
) -> Sequence[Sequence[Rate]]:
    """Derivatives of the model by every parameter, as a signal has them: where the drive is, of
    those that go with it."""
    going = _which(model)
    if len(signal.inputs) != 1 or not going:
        return rates
    out = list(rates)
    for j in going:
        out[j] = [_moved(model, b, signal.inputs[0]) for b in model.derivative(j, p)]
    return out


def _moved(model: Model, block: DerivativeBlock, drive: str) -> DerivativeBlock:
    """What a block at one drive is at another: along the same axes, but along that of the drive
    where it acts along one alone."""
    place = channel_place(drive)

    def row(old: int) -> int:
        kind = place.dof if block.dofs.size == 1 else KINDS[int(model.dof_kind[old])]
        return model.place.get(f"n{place.nodes[0]}.{kind}", -1)

    return replace(block, dofs=np.vectorize(row, otypes=[np.int64])(block.dofs))


def _sized(block: DerivativeBlock, p: float) -> DerivativeBlock:
    K, M, C, D = (None if v is None else p * v for v in (block.K, block.M, block.C, block.D))
    return DerivativeBlock(block.dofs, K, M, C, D)


def _changed(
    point: Point,
    model: Model,
    signal: Signal,
    further: Further,
    pairs: Sequence[tuple[DerivativeBlock, DerivativeBlock]],
) -> Response:
    """Responses where each first block is taken off and the second put on, every mode with pieces
    of its own: (Z + Δ)⁻¹ = Z⁻¹ − Z⁻¹ Δ (I + H Δ)⁻¹ Z⁻¹, on the side of the drive and of the
    sensors, so that what derives from these pieces is that of the changed structure."""
    used = np.unique(np.concatenate([b.dofs.reshape(-1) for pair in pairs for b in pair]))
    sensors, inputs = (sensor_rows(model, x) for x in (signal.sensors, signal.inputs))
    n, every = len(sensors), len(point.modes.eigenvalues)
    r = respond(
        signal,
        point.modes,
        np.concatenate([sensors, used]),
        inputs,
        point.loss,
        *further,
        every,
        shapes_aside(model, point.p, signal, point.modes, len(used)),
    )
    answer, phi = r.a[:, :, n:], r.at[:, n:]  # to forces at the DOFs; the modes' shapes there
    H, heard, moved = (
        np.moveaxis(times(phi.T, x), 0, 1) for x in (answer, r.a[:, :, :n], r.q)
    )  # (points, DOFs, ·)
    delta = _stiffness(pairs, used, signal.s)
    core = np.linalg.solve(np.eye(len(used)) + delta @ H, delta)
    pull = np.swapaxes(answer, 0, 1)  # (points, modes, DOFs)
    q = r.q - np.swapaxes(pull @ (core @ moved), 0, 1)
    a = r.a[:, :, :n] - np.swapaxes(pull @ (np.swapaxes(core, 1, 2) @ heard), 0, 1)
    raw = r.drive[:, None, None] * np.moveaxis(times(r.at[:, :n].T, q), 0, 1)
    return Response(signal, q, a, None, raw, r.drive, r.at[:, :n], r.inverse, True)


def _stiffness(
    pairs: Sequence[tuple[DerivativeBlock, DerivativeBlock]], used: Index, s: Complex
) -> Complex:
    """Δ (points, DOFs, DOFs): the dynamic stiffness of the second blocks less that of the first."""
    delta = np.zeros((len(s), len(used), len(used)), dtype=complex)
    at, none = s[:, None, None], np.zeros(delta.shape[1:])
    for sign, block in ((sign, b) for pair in pairs for sign, b in zip((-1, 1), pair, strict=True)):
        K, M, C, D = (none if x is None else x for x in summed(block, used))
        delta += sign * (K + at**2 * M + at * C + 1j * D)
    return delta
