"""What a faulty channel makes of a response."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.physics.place import channel_place

Complex = NDArray[np.complex128]


@dataclass(frozen=True)
class Fault:
    """A sensor fault under trial, one unknown p each.

    ``how``: "gain", reading × (1 + p); "force", of a force channel, reading / (1 + p), so that
    responses to it seem (1 + p) times as large; "delay", reading late by p · ``unit`` seconds;
    "swap", the readings of ``channel`` and ``other`` exchanged: each carries the share 1 + p of the
    other's and −p of its own, so p = 0 is the whole exchange (start there) and a p that a fit
    drives away from 0 says that it was none. A recording that has only one of the two channels is
    left as it is. ``others``: the forces that the same transducer reads in other recordings.
    """

    channel: str
    how: str
    unit: float = 1.0
    other: str = ""
    others: tuple[str, ...] = ()

    @property
    def labels(self) -> tuple[str, ...]:
        """Of all channels that suffer from it."""
        return (self.channel, *((self.other,) if self.other else self.others))

    @property
    def spot(self) -> str:
        """These in words: "n1.x and n2.x"."""
        return " and ".join(self.labels)

    @property
    def label(self) -> str:
        """The name of its unknown: "swap of n1.x and n2.x"."""
        return f"{self.how} of {self.spot}"

    def applied(
        self, p: float, sensors: Sequence[str], s: Complex, y: Complex, inputs: Sequence[str] = ()
    ) -> Complex:
        """What the faulty channels make of responses ``y`` (points, sensors, cases) at ``s``
        (points,), 1/s; linear in ``y``. ``inputs``: what drives the cases, in order; each may stand
        for several columns in a row."""
        out = y.copy()
        own = _places(sensors, self.channel)
        if self.how == "swap":
            for a, b in self._pairs(sensors):
                out[:, a] += (1.0 + p) * (y[:, b] - y[:, a])
                out[:, b] += (1.0 + p) * (y[:, a] - y[:, b])
        elif self.how == "gain":
            out[:, own] *= 1.0 + p
        elif self.how == "force":
            out[:, :, self._cases(inputs, y)] *= 1.0 + p
        else:
            out[:, own] *= np.exp(-1j * s.imag * p * self.unit)[:, None, None]
        return out

    def rate(
        self, p: float, sensors: Sequence[str], s: Complex, y: Complex, inputs: Sequence[str] = ()
    ) -> Complex:
        """Derivative of `applied` with respect to p. For a swap it is also what the share exchanged
        adds to sound readings ``y``."""
        out = np.zeros(y.shape, dtype=complex)
        own = _places(sensors, self.channel)
        if self.how == "swap":
            for a, b in self._pairs(sensors):
                out[:, a] = y[:, b] - y[:, a]
                out[:, b] = y[:, a] - y[:, b]
        elif self.how == "gain":
            out[:, own] = y[:, own]
        elif self.how == "force":
            cases = self._cases(inputs, y)
            out[:, :, cases] = y[:, :, cases]
        else:
            late = self.applied(p, sensors, s, y)[:, own]
            out[:, own] = late * (-1j * s.imag * self.unit)[:, None, None]
        return out

    def corrections(self, p: float, has: Collection[str]) -> list[dict[str, Any]]:
        """The rows of ``corrections`` that take it out of a recording which ``has`` channels of
        these names (see `named`)."""
        if self.how == "force":
            gain = {"quantity": "force", "gain": 1.0 / (1.0 + p)}
            return [{**_row(x), **gain} for x in self.labels if named(x, "force") in has]
        if not set(self.labels) <= set(has):
            return []
        row = _row(self.channel)
        if self.how == "swap":
            return [{**row, "exchanged_with": _row(self.other)}]
        return [{**row, **({"gain": 1.0 + p} if self.how == "gain" else {"delay": p * self.unit})}]

    def _cases(self, inputs: Sequence[str], y: Complex) -> NDArray[np.bool_]:
        """Columns (cases,) that its force drives; none where several drive each."""
        if not inputs or y.shape[2] % len(inputs):
            return np.zeros(y.shape[2], dtype=bool)
        return np.repeat([label in self.labels for label in inputs], y.shape[2] // len(inputs))

    def _pairs(self, sensors: Sequence[str]) -> list[tuple[int, int]]:
        both = (_places(sensors, label) for label in (self.channel, self.other))
        return list(zip(*both, strict=False))


def named(label: str, quantity: str) -> str:
    """The name of a channel: its label, with what it measures where that is a force."""
    return f"force {label}" if quantity == "force" else label


def _places(sensors: Sequence[str], channel: str) -> list[int]:
    return [k for k, label in enumerate(sensors) if label == channel]


def _row(label: str) -> dict[str, Any]:
    place = channel_place(label)
    return {"node": place.nodes[0], "dof": place.dof}
