"""How forces act and sensors measure beside what their labels say: a few millimetres off the node,
a degree or two off the direction.

Nobody hits a node. Where a mode hardly moves along the drive, the moment of a force beside its node
and its share across are much of what excites that mode, in all channels alike: a model whose force
is exact is then far off in whole resonances, however right it is. A sensor near a node of a mode
reads the slope there (Ewins 2000, 3.3 and 3.11). So both have a lever about the other axes and a
share along them, nuisance parameters that change no matrix: in place of a mode's shape φ(label) at
a drive or a sensor stands φ(label) + Σ p φ(other).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.nominal.theory import ASIDE
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.settings import BESIDE, CREDIBLE, MOST_ASIDE, RESPONSE_DISCREPANCY, TILTED
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.synthesis.pieces import Driven, Response, receptances
from cvxupdate.physics.place import channel_place

FORCE, SENSOR, BY = "force", "sensor", " by "
AXES = "xyz"
SEEN = 40  # modes, about, of a band


def with_aside(model: Model, drives: Sequence[str], sensors: Sequence[str], top: float) -> Model:
    """The model with a lever and a share along every other axis of its drives, and of those sensors
    where that changes what they read of one of the drives by more than a sound model may miss,
    behind its parameters. The model's modes below ``top`` (Hz) say that: a drive across a sensor's
    axis moves it little along that, and much beside."""
    forces = [(FORCE, x, other) for x in drives for other in _others(model, x)]
    if not forces:
        return model  # nothing moves but along its label
    modes = model_modes(model, min(model.size, SEEN))
    in_band = modes.frequencies <= top
    in_band[: modes.rigid] = False
    shapes = modes.shapes[:, in_band]
    driven = shapes[[model.place[x] for x in drives if x in model.place]]

    def moved(label: str) -> Real:  # by each drive, over all resonances
        return np.asarray(np.sqrt(np.sum((driven * shapes[model.place[label]]) ** 2, axis=1)))

    def part(x: str, other: str) -> float:
        return float(np.max(moved(other) / np.maximum(moved(x), 1e-300), initial=0.0))

    heard = [
        (_usual(other) * part(x, other), (SENSOR, x, other))
        for x in sensors
        if x in model.place
        for other in _others(model, x)
    ]
    heard = [(part, which) for part, which in heard if part > RESPONSE_DISCREPANCY]
    most = sorted(heard, key=lambda pair: -pair[0])[:MOST_ASIDE]
    more = [_wanted(*which) for which in (*forces, *(w for _, w in most))]
    return model.with_parameters((*model.parameters, *more)) if more else model


def _others(model: Model, label: str) -> list[str]:
    """DOFs of a node but the label's own, and the turn about its direction: what is beside the node
    along that does not move."""
    place = channel_place(label)
    found = (f"n{place.nodes[0]}.{r}{axis}" for r in ("", "r") for axis in AXES)
    own = {label, f"n{place.nodes[0]}.r{place.dof}"}
    turned = (place.dof or "").startswith("r")
    return [] if turned else [x for x in found if x in model.place and x not in own]


def _turns(other: str) -> bool:
    return other.split(".")[1].startswith("r")


def _usual(other: str) -> float:
    return BESIDE if _turns(other) else TILTED


def _wanted(what: str, label: str, other: str) -> Parameter:
    most = CREDIBLE * _usual(other)
    unit = "m" if _turns(other) else "1"
    name = f"{what} {label}{BY}{other}"
    return Parameter(name, what, (), -most, most, 0.0, 1.0, unit, group=ASIDE)


@dataclass(frozen=True)
class Known:
    """Such a parameter of one signal: its number, that of the drive or sensor, the other DOF."""

    parameter: int
    number: int
    dof: int


def _known(model: Model, signal: Driven) -> tuple[list[Known], list[Known]]:
    """Those of its sensors, and of its drives."""
    labels: dict[str, Sequence[str]] = {SENSOR: signal.sensors, FORCE: signal.inputs}
    out: dict[str, list[Known]] = {SENSOR: [], FORCE: []}
    for j, q in enumerate(model.parameters):
        if q.group == ASIDE:
            label, other = q.name.removeprefix(f"{q.of} ").split(BY)
            here = (k for k, x in enumerate(labels[q.of]) if x == label)
            out[q.of] += [Known(j, k, model.place[other]) for k in here]
    return out[SENSOR], out[FORCE]


def shapes_aside(
    model: Model, p: Real, signal: Driven, modes: Modes, more: int = 0
) -> tuple[Real, Real] | None:
    """What is added to the modes' shapes at sensors (modes, sensors and so many ``more`` places)
    and at drives (modes, drives); None where nothing is."""
    both, count = _known(model, signal), modes.shapes.shape[1]
    if not any(p[k.parameter] for known in both for k in known):
        return None
    out = np.zeros((count, len(signal.sensors) + more)), np.zeros((count, len(signal.inputs)))
    for shapes, known in zip(out, both, strict=True):
        for k in known:
            shapes[:, k.number] += p[k.parameter] * modes.shapes[k.dof]
    return out


def with_rates(model: Model, modes: Modes, r: Response, columns: Complex) -> Complex:
    """Derivatives (points, sensors, cases, parameters) of a response, those by these parameters,
    which no matrix has, filled in: what a unit of force, or a moment, along the other axis does,
    and how much a sensor along it would read."""
    at, by = _known(model, r.signal)
    if not (at or by):
        return columns
    dofs = np.array(sorted({k.dof for k in (*at, *by)}), dtype=np.int64)
    found = receptances(r, modes, dofs)
    left, right = (x * r.drive[:, None] for x in (found.left, found.right))
    for k in at:
        columns[:, k.number, :, k.parameter] = right[int(np.searchsorted(dofs, k.dof))]
    for k in by:
        unit = left[int(np.searchsorted(dofs, k.dof))]
        columns[..., k.parameter] = _by_cases(r.signal, k.number, unit)
    return columns


def _by_cases(signal: Driven, number: int, unit: Complex) -> Complex:
    """From what a unit at a drive does (points, sensors) to every case."""
    if signal.plain:
        out = np.zeros((*unit.shape, signal.U.shape[2]), dtype=complex)
        out[:, :, number] = unit
        return out
    return np.asarray(unit[:, :, None] * signal.U[:, number, None, :])
