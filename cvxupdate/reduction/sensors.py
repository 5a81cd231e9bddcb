"""Where to measure, and what the chosen places can and cannot see."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.linalg import qr

from cvxupdate.errors import InputError, ModelError
from cvxupdate.reduction.split import Array, Index, Real, master_rows

# A mode whose largest motion at the sensors is below this fraction of its largest anywhere drowns
# in noise.
HARDLY_MOVES = 0.1
# Two modes that look more alike than this to the sensors will be taken for one another.
LOOK_ALIKE = 0.5
# Independence below which only rounding tells a mode from a mixture of the others.
MIXTURE = 1e-8
# Pairs of modes named one by one.
MOST_SAID = 8


@dataclass(frozen=True)
class Visibility:
    """What a set of sensors sees of a set of modes; indices of modes count from 0.

    ``rank`` and ``condition`` belong to the unit-length modal matrix at the sensors; ``alike``
    (modes, modes) is the MAC of the modes with one another as the sensors see them;
    ``independence`` (modes,) the sine of the angle between a mode and all the others together (0: a
    mixture of the others, 1: orthogonal to them), whose inverse is the factor by which noise grows
    in that mode's modal coordinate; ``peak`` (modes,) the largest motion at a sensor over the
    largest at any DOF that was compared; ``hidden`` the modes with peak < 0.1; ``confused`` the
    pairs with MAC > 0.5.
    """

    sensors: Index
    rank: int
    condition: float
    alike: Real
    independence: Real
    peak: Real
    hidden: Index
    confused: tuple[tuple[int, int], ...]

    def says(self) -> tuple[str, ...]:
        """The report in plain words, modes counted from 1."""
        modes = self.peak.size
        counted = (
            f"{self.sensors.size} sensor{'' if self.sensors.size == 1 else 's'}, {modes} "
            f"mode{'' if modes == 1 else 's'}"
        )
        singular = self.rank < modes
        condition = "" if singular else f", condition number {self.condition:.3g}"
        lines = [f"{counted}: rank {self.rank}{condition}."]
        lines += [
            f"Mode {r + 1} hardly moves at the sensors ({100 * self.peak[r]:.1f} % of its peak)."
            for r in self.hidden
        ]
        if self.sensors.size == 1:
            return (
                *lines,
                "One sensor sees no shapes: modes can be distinguished by their frequencies alone.",
            )
        alike = [
            f"Modes {i + 1} and {j + 1} look alike to these sensors (MAC {self.alike[i, j]:.2f})."
            for i, j in self.confused
        ]
        lines += alike[:MOST_SAID] + (
            [f"And {len(alike) - MOST_SAID} more pairs look alike."]
            if len(alike) > MOST_SAID
            else []
        )
        weak = [r for r in range(modes) if self.independence[r] < 0.3]
        lines += [
            f"Mode {r + 1} is a mixture of the others at these sensors."
            if self.independence[r] < MIXTURE
            else f"Mode {r + 1} is nearly a mixture of the others at these sensors (independence "
            f"{self.independence[r]:.2g}: noise grows {1 / self.independence[r]:.3g} times)."
            for r in weak
        ]
        if singular:
            lines.append(
                "These places cannot distinguish all modes: SEREP and TAM from these modes "
                "are impossible."
            )
        return tuple(lines)

    def to_json(self) -> dict[str, Any]:
        """Plain lists and numbers, ready for ``json.dumps``; an infinite condition becomes None."""
        return {
            "sensors": self.sensors.tolist(),
            "rank": self.rank,
            "condition": self.condition if np.isfinite(self.condition) else None,
            "alike": self.alike.tolist(),
            "independence": self.independence.tolist(),
            "peak": self.peak.tolist(),
            "hidden": self.hidden.tolist(),
            "confused": [list(pair) for pair in self.confused],
            "says": list(self.says()),
        }


def effective_independence(phi: Array, count: int, candidates: Index | None = None) -> Index:
    """Kammer's (1991) effective independence: drop, one by one, the place that adds least to |Φᵀ
    Φ|.

    The contribution of place i to the rank of Φ is E_i = [Φ(ΦᵀΦ)⁻¹Φᵀ]_ii; deleting it multiplies
    that determinant by 1 − E_i. The projector is downdated (Sherman–Morrison), so the cost is
    candidates² · modes operations.

    Parameters
    ----------
    phi : (N, modes) real shapes to be seen. count : sensors to keep, modes ≤ count. candidates :
    rows allowed (all when
    None; leave out DOFs of another unit, such as rotations).

    Returns
    -------
    (count,) rows of ``phi``, ascending. Raises `InputError` for an impossible count, `ModelError`
    when even all
    candidates cannot distinguish the modes.
    """
    rows = _candidates(phi, count, candidates)
    Q = _orthonormal(phi[rows])
    alive = np.arange(rows.size)
    while alive.size > count:
        P = np.linalg.inv(Q[alive].T @ Q[alive])
        contribution = np.einsum("ij,jk,ik->i", Q[alive], P, Q[alive])
        # The projector is rebuilt every 64 deletions so that rounding does not pile up.
        for _ in range(min(64, alive.size - count)):
            worst = int(np.argmin(contribution))
            direction = P @ Q[alive[worst]]
            left = 1.0 - contribution[worst]
            keep = np.arange(alive.size) != worst
            alive, contribution = alive[keep], contribution[keep]
            contribution = contribution + (Q[alive] @ direction) ** 2 / left
            P = P + np.outer(direction, direction) / left
    return np.sort(rows[alive])


def qr_places(phi: Array, count: int, candidates: Index | None = None) -> Index:
    """Places by QR with column pivoting of Φᵀ: each adds most to what those before it see
    (Schedlinski & Link 1996).

    The first ``modes`` places come from one factorisation; further ones from the same on the places
    left, in rounds. Arguments and errors as `effective_independence`; the rows come in the order of
    their choice.
    """
    rows = _candidates(phi, count, candidates)
    Q = _orthonormal(phi[rows])
    chosen: list[int] = []
    left = np.arange(rows.size)
    while len(chosen) < count:
        pivots = qr(Q[left].T, mode="r", pivoting=True)[1][: min(Q.shape[1], count - len(chosen))]
        chosen += left[pivots].tolist()
        left = np.delete(left, pivots)
    return rows[np.array(chosen, dtype=np.intp)]


def visibility(phi: Array, sensors: Index, compared: Index | None = None) -> Visibility:
    """What ``sensors`` (n,) can and cannot see of the modes ``phi`` (N, modes).

    ``compared`` are the rows of the sensors' kind (for instance translations) among which a mode's
    peak is sought; all when None. Raises `InputError` when the rows are not rows of ``phi``.
    """
    n = master_rows(sensors, phi.shape[0])
    field = phi if compared is None else phi[master_rows(compared, phi.shape[0])]
    seen = phi[n]
    length = np.linalg.norm(seen, axis=0)
    largest = np.max(np.abs(field), axis=0)
    if np.any(largest == 0.0):
        raise InputError(
            "visibility: a mode does not move at any DOF compared; leave it out or widen `compared`"
        )
    unit = seen / np.where(length > 0.0, length, 1.0)
    alike = np.minimum(np.abs(unit.conj().T @ unit) ** 2, 1.0)
    sigma = np.linalg.svd(unit, compute_uv=False)
    modes = phi.shape[1]
    rank = int(np.sum(sigma > 1e-10 * max(sigma[0], 1e-300)))
    condition = float(sigma[0] / sigma[-1]) if rank == modes else np.inf
    peak = np.max(np.abs(seen), axis=0) / largest
    confused = tuple(
        (i, j) for i in range(modes) for j in range(i + 1, modes) if alike[i, j] > LOOK_ALIKE
    )
    hidden = np.flatnonzero(peak < HARDLY_MOVES)
    return Visibility(n, rank, condition, alike, _independence(unit), peak, hidden, confused)


def _independence(unit: Array) -> Real:
    """Distance of every unit column from the span of the others, between 0 and 1."""
    out = np.zeros(unit.shape[1])
    for r in range(unit.shape[1]):
        others = np.delete(unit, r, axis=1)
        if others.shape[1] == 0:
            out[r] = np.linalg.norm(unit[:, r])
            continue
        rest = unit[:, r] - others @ np.linalg.lstsq(others, unit[:, r], rcond=1e-10)[0]
        out[r] = min(float(np.linalg.norm(rest)), 1.0)
    return out


def _candidates(phi: Array, count: int, candidates: Index | None) -> Index:
    rows = np.arange(phi.shape[0]) if candidates is None else master_rows(candidates, phi.shape[0])
    if not phi.shape[1] <= count <= rows.size:
        raise InputError(
            f"sensor places: {count} places must be at least the {phi.shape[1]} modes and at "
            f"most the {rows.size} candidates"
        )
    return rows


def _orthonormal(phi: Array) -> Real:
    """Orthonormal basis of the modes at the candidates: the choice must not depend on how the modes
    are scaled."""
    if np.iscomplexobj(phi):
        raise InputError("sensor places: give real shapes (realise complex modes first)")
    U, sigma, _ = np.linalg.svd(
        phi / np.maximum(np.linalg.norm(phi, axis=0), 1e-300), full_matrices=False
    )
    if sigma[-1] < 1e-10 * sigma[0]:
        raise ModelError(
            "sensor places: even all candidates together cannot distinguish the modes; allow "
            "more of them"
        )
    return np.asarray(U)
