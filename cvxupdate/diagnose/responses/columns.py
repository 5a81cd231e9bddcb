"""Columns of candidates: to first order, what each would add to the weighted rows. Many at a time,
because a product of large matrices is cheap."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.fe.synthesis.derivatives import Changes
from cvxupdate.fe.synthesis.pieces import Receptances, Response
from cvxupdate.physics.effect import ChannelFault, Effect, HiddenOscillator, ModelChange

# numbers at points (points × sensors × cases × columns) that are held at a time: what fits in a
# cache
ROOM = 250_000
NONE = "none"  # kind of a candidate without a column


@dataclass(frozen=True)
class Columns:
    """Columns at a point, ``weights`` (signal by signal, flat) included: rows are real parts, then
    imaginary parts, signal by signal."""

    point: ResponsePoint

    @cached_property
    def weights(self) -> tuple[Real, ...]:
        """1 / deviation of every row of every signal."""
        return tuple(1.0 / s.scale().reshape(-1) for s in self.point.setting.signals)

    def batches(self, candidates: Mapping[int, Effect]) -> Iterator[tuple[list[int], Real]]:
        """(numbers of candidates, their columns (rows, n), side by side, equally many each);
        candidates without any are left out."""
        kinds: dict[tuple[str, int], list[int]] = {}
        for k, c in candidates.items():
            kinds.setdefault((_kind(c), c.count if c.change else 1), []).append(k)
        for (kind, width), numbers in kinds.items():
            for part in _pieces(numbers, self._at_once(width)):
                yield from self._batch(kind, part, [candidates[k] for k in part])

    def _at_once(self, columns: int) -> int:
        largest = max(r.raw.size for r in self.point.responses)
        return max(1, ROOM // (largest * columns))

    def _batch(
        self, kind: str, numbers: list[int], chosen: list[Effect]
    ) -> Iterator[tuple[list[int], Real]]:
        responses = self.point.responses
        if kind == "tuned":
            yield (
                numbers,
                self._stacked(
                    [
                        np.moveaxis(r.rows(_tuned(r, g, chosen)), 1, -1)
                        for r, g in zip(responses, self.point.green, strict=True)
                    ]
                ),
            )
        elif kind == "fault":
            yield numbers, self._stacked([self._faults(r, chosen) for r in responses])
        elif kind == "change":
            change = Changes.of(
                [t for c in chosen if c.change for t in c.change.tangent],
                self.point.modes,
                self.point.low,
            )
            yield (
                numbers,
                self._stacked([r.rows(change.columns(r)) for r in responses]),
            )

    def _stacked(self, rows: Sequence[Complex]) -> Real:
        """From rows (rows, sensors, cases, n) of every signal to weighted columns."""
        parts = []
        for v, w in zip(rows, self.weights, strict=True):
            flat = v.reshape(-1, v.shape[-1])
            parts += [w[:, None] * flat.real, w[:, None] * flat.imag]
        return np.vstack(parts)

    def _faults(self, r: Response, chosen: Sequence[Effect]) -> Complex:
        """Rows (rows, sensors, cases, n): gains and exchanges act on rows as they do on points,
        only delays need their frequency."""
        faults = [c.fault for c in chosen if c.fault is not None]
        heard = self.point.faulty(r.signal, r.raw)
        rows = r.rows(heard)
        unit = delay_unit(self.point.setting.top)
        late = (
            r.rows((-1j * unit) * r.signal.s.imag[:, None, None] * heard)
            if any(f.how == "delay" for f in faults)
            else rows
        )
        out = np.zeros((*rows.shape, len(chosen)), dtype=complex)
        for k, f in enumerate(faults):
            if f.how == "delay":
                own = [i for i, label in enumerate(r.signal.sensors) if label == f.channel]
                out[..., k][:, own] = late[:, own]
            else:
                out[..., k] = f.rate(0.0, r.signal.sensors, r.signal.s, rows, r.signal.inputs)
        return out


def sums_of(candidates: Sequence[Effect]) -> dict[int, list[int]]:
    """Sets of elements whose columns are the sums of those of single elements that are candidates
    too: numbers of both."""
    sets = {
        k: (c.physics, c.change.members)
        for k, c in enumerate(candidates)
        if c.change is not None and c.change.additive and c.change.members and _kind(c) != NONE
    }
    singles = {(name, ids[0]): k for k, (name, ids) in sets.items() if len(ids) == 1}
    return {
        k: [singles[name, e] for e in ids]
        for k, (name, ids) in sets.items()
        if len(ids) > 1 and all((name, e) in singles for e in ids)
    }


def columns_of(point: ResponsePoint, candidates: Sequence[Effect]) -> list[Real | None]:
    """Weighted columns (rows, n) of each candidate; None where it has none."""
    out: list[Real | None] = [None] * len(candidates)
    sets = sums_of(candidates)
    for numbers, J in Columns(point).batches(
        {k: c for k, c in enumerate(candidates) if k not in sets}
    ):
        for k, own in zip(numbers, np.split(J, len(numbers), axis=1), strict=True):
            out[k] = own
    for k, members in sets.items():
        out[k] = np.sum([column for m in members if (column := out[m]) is not None], axis=0)
    return out


def delay_unit(top: float) -> float:
    """A delay that turns the phase by one radian at the top of the band (Hz), s."""
    return 1.0 / (2.0 * np.pi * top)


def _kind(c: Effect) -> str:
    match c.action:
        case ChannelFault():
            return "fault"
        case HiddenOscillator():
            return "tuned"
        case ModelChange(tangent=tangent) if all(tangent):
            return "change"
    return NONE


def _pieces(numbers: list[int], most: int) -> list[list[int]]:
    return [numbers[k : k + most] for k in range(0, len(numbers), most)]


def _tuned(r: Response, g: Receptances, chosen: Sequence[Effect]) -> Complex:
    """(points, n, sensors, cases): hidden oscillators of one gram-like unit of mass, dynamic mass
    s² (2ζωs + ω²) / (s² + 2ζωs + ω²) at their DOFs."""
    hidden = [c.action for c in chosen if isinstance(c.action, HiddenOscillator)]
    places = [h.row for h in hidden]
    frequency, zeta = np.array([h.frequency for h in hidden]), np.array([h.zeta for h in hidden])
    s, omega = r.signal.s[:, None], 2.0 * np.pi * frequency
    soft = 2.0 * zeta * omega * s + omega**2
    dynamic = -(r.drive * r.signal.s**2)[:, None] * soft / (s**2 + soft)
    out = np.empty((len(s), len(chosen), *r.raw.shape[1:]), dtype=complex)
    for k, (place, moved) in enumerate(zip(places, dynamic.T, strict=True)):
        np.multiply(
            g.left[place][:, :, None], (moved[:, None] * g.right[place])[:, None, :], out=out[:, k]
        )
    return out
