"""Where to put sensors and exciters, from the model's modes (2.3.2, 2.9)."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np

from cvxupdate.commands.planned import ExciterSet, Indicator, Real, SensorSet
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes
from cvxupdate.recordings.appropriate import exciter_places, mmif, principal_forces
from cvxupdate.reduction.sensors import effective_independence, qr_places, visibility

CLOSE = 0.02
"""Relative distance of frequencies below which one exciter cannot tell two modes from each other:
their resonances overlap at a damping of 1 %."""
DRIVEN = 0.1
"""Of what the best place gives a mode: below it the mode is lost in the others' response."""
MOST_EXCITERS = 3
FEW = 300
"""Candidate places that exchanges of exciters are tried on."""
ZETA = 0.01
"""Damping ratio of the responses that MMIF is shown of; only how sharp its dips are depends on it.
"""
LINES = 1200
BEYOND = 1.15
"""Of the highest frequency wanted: where the indicator's band ends."""
RULES = {
    "a-optimal": "least total variance of the parameters (A-optimal, greedy)",
    "effective-independence": "each adds to the independence of the shapes (Kammer 1991)",
    "qr": "each sees most of what those before it do not (Schedlinski and Link 1996)",
    "energy": "most kinetic energy, mode by mode",
}


def candidates(model: Model) -> np.ndarray:
    """Free translations: rotations are not measured with common sensors."""
    found = np.flatnonzero(model.dof_kind < 3)
    if not len(found):
        raise InputError("the model has no free translation: there is nowhere to put a sensor.")
    return found


def sensor_sets(
    model: Model, modes: Modes, mass: Real, count: int, information: Real | None
) -> tuple[SensorSet, ...]:
    """Sensors by every rule. ``mass`` (N,) diagonal of M; ``information`` (candidates, n, n) what
    each candidate tells of the parameters, None without."""
    phi, places = modes.shapes, candidates(model)
    if not phi.shape[1] <= count <= len(places):
        raise InputError(
            f"{count} sensors for {phi.shape[1]} modes on {len(places)} free translations: give at "
            "least as many --sensors as --modes, and no more than there are places; or ask for "
            "fewer --modes."
        )
    energy = mass[places, None] * phi[places] ** 2
    ways: dict[str, Callable[[], np.ndarray]] = {
        "effective-independence": lambda: _by_gain(phi, effective_independence(phi, count, places)),
        "qr": lambda: qr_places(phi, count, places),
        "energy": lambda: places[_alternating(energy, count)],
    }
    if information is not None:
        ways = {"a-optimal": lambda: places[most_telling(information, count)], **ways}
    out = []
    for rule, choose in ways.items():
        chosen = choose()
        seen = visibility(phi, chosen, places)
        off = seen.alike - np.diag(np.diag(seen.alike))
        out.append(
            SensorSet(
                rule,
                RULES[rule],
                tuple(model.labels[i] for i in chosen),
                seen.condition,
                float(off.max(initial=0.0)),
                float(seen.peak.min()),
                None
                if information is None
                else _left(information[np.searchsorted(places, chosen)]),
            )
        )
    return tuple(out)


def _by_gain(phi: Real, chosen: np.ndarray) -> np.ndarray:
    """The same places, those that matter most first."""
    order = qr_places(phi, len(chosen), chosen)
    return np.asarray(order)


def _alternating(energy: Real, count: int) -> np.ndarray:
    """Places of the most energy, of every mode in turn."""
    order = np.argsort(-energy, axis=0)
    chosen: list[int] = []
    for rank in range(len(energy)):
        for place in order[rank].tolist():
            if place not in chosen and len(chosen) < count:
                chosen.append(place)
    return np.array(chosen)


PRIOR = 0.05
"""Deviation that every parameter may have before anything is measured."""


def most_telling(information: Real, count: int) -> np.ndarray:
    """Greedy A-optimal places (Fedorov 1972): each next one lowers trace (I/prior² + Σ info)⁻¹
    most. ``information`` (places, n, n)."""
    total = np.eye(information.shape[1]) / PRIOR**2
    free, chosen = list(range(len(information))), []
    for _ in range(count):
        left = np.trace(np.linalg.inv(total + information[free]), axis1=1, axis2=2)
        best = free.pop(int(np.argmin(left)))
        total = total + information[best]
        chosen.append(best)
    return np.array(chosen)


def _left(information: Real) -> float:
    """The median deviation of the parameters with these places."""
    total = np.eye(information.shape[1]) / PRIOR**2 + information.sum(axis=0)
    return float(np.median(np.sqrt(np.diag(np.linalg.inv(total)))))


def exciter_set(
    model: Model, modes: Modes, count: int | None, sensors: tuple[str, ...]
) -> ExciterSet:
    """Exciters that drive every mode, and as many as close modes need. Without ``count`` the
    fewest, three at most."""
    phi, places = modes.shapes.T, candidates(model)
    best = np.max(np.abs(phi[:, places]), axis=1)
    some = places[np.argsort(-np.min(np.abs(phi[:, places]) / best[:, None], axis=0))[:FEW]]
    least = max(crowd(modes.frequencies), 1)
    found: tuple[int, ...] = ()
    for number in range(least, MOST_EXCITERS + 1) if count is None else (count,):
        found = _places(phi, best, some, number)
        if _drive(phi, best, found).min() >= DRIVEN:
            break
    if not found:
        found = _places(phi, best, some, least)
    B = phi[:, list(found)]
    forces = np.linalg.pinv(B).T
    forces = forces / np.maximum(np.linalg.norm(forces, axis=1, keepdims=True), 1e-300)
    modal = forces @ B.T
    power = np.maximum(np.sum(modal**2, axis=1), 1e-300)
    H = _responses(model, modes, sensors, found)[1]
    return ExciterSet(
        tuple(model.labels[i] for i in found),
        tuple(_drive(phi, best, found).tolist()),
        forces,
        tuple((np.diag(modal) ** 2 / power).tolist()),
        int(principal_forces(H).shape[1]),
    )


def crowd(frequencies: Real) -> int:
    """The most modes that lie together, each within `CLOSE` of the next."""
    near = np.diff(frequencies) < CLOSE * frequencies[:-1]
    most = run = 1
    for close in near:
        run = run + 1 if close else 1
        most = max(most, run)
    return most


def _places(phi: Real, best: Real, some: np.ndarray, count: int) -> tuple[int, ...]:
    """One exciter where the mode that it drives least is driven most; several where their modal
    forces are most independent."""
    if count > len(some):
        raise InputError(f"--exciters {count}: there are {len(some)} free translations.")
    if count == 1:
        return (int(some[0]),)
    scaled = phi / best[:, None]
    return exciter_places(scaled, count, candidates=tuple(some.tolist())).columns


def _drive(phi: Real, best: Real, places: tuple[int, ...]) -> Real:
    return np.asarray(np.max(np.abs(phi[:, list(places)]), axis=1) / best)


def _responses(
    model: Model, modes: Modes, sensors: tuple[str, ...], exciters: tuple[int, ...]
) -> tuple[Real, np.ndarray]:
    """(lines,) Hz and receptances of these modes with `ZETA`, (lines, sensors, exciters)."""
    f = modes.frequencies
    lines = np.linspace(0.7 * f[0], BEYOND * f[-1], LINES)
    w, wr = 2 * np.pi * lines, 2 * np.pi * f
    rows = [model.place[label] for label in sensors]
    left, right = modes.shapes[rows], modes.shapes[list(exciters)]
    gain = 1.0 / (wr**2 - w[:, None] ** 2 + 2j * ZETA * wr * w[:, None])
    return lines, np.einsum("sr,fr,er->fse", left, gain, right)


def indicator(
    model: Model, modes: Modes, sensors: tuple[str, ...], exciters: tuple[str, ...]
) -> Indicator:
    """MMIF of the responses that these sensors and exciters would give."""
    f, H = _responses(model, modes, sensors, tuple(model.place[e] for e in exciters))
    curves = mmif(H)[0].T
    dips = []
    for mode in modes.frequencies:
        near = np.abs(f - mode) <= CLOSE * mode
        dips.append(float(curves[0, near].min()) if np.any(near) else float("nan"))
    return Indicator(f, np.asarray(curves), tuple(dips))
