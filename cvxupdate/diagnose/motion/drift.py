"""Whether the structure changed while it was measured: stiffness that goes with time, not with the
level.

In the same form as the laws: what a model leaves is the answer to the force −ΔK(t) x along the
smoothed motion, so a change of stiffness that ramps within each run and steps from run to run is a
few columns more. A law at one place moves all runs of a level alike and follows the motion; drift
follows the clock. So a step that all runs of one level have in common says nothing of drift: it is
fitted beside, and only ramps and steps between runs of one level count. Nor does a ramp that sweeps
of one level have in common: there the clock is the frequency, and with it the amplitude, and the
structure was as before when the next one began.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.diagnose.motion.runs import Run
from cvxupdate.diagnose.motion.scene import Scene
from cvxupdate.diagnose.motion.smoother import Beyond
from cvxupdate.diagnose.responses.signals import Complex, Real
from cvxupdate.diagnose.settings import CLOCK_GAIN, CLOCK_PART, HALVED
from cvxupdate.fe.synthesis.derivatives import modal_blocks

GROUPS = 8  # whose stiffness is looked at one by one
ONE_LEVEL = 0.02  # relative difference of levels that are one
SMALL = 1e-12  # of the squares: as good as nothing


@dataclass(frozen=True)
class Drift:
    """What a change of stiffness with time explains of what changes with the level leave beyond
    noise (``fraction``, 0 to 1), of which group (None: of all), and the relative change ``steps``
    of each run by name, with ``ramps`` within it; ``taken`` weighted squares in all, ``gain`` for
    each unknown, ``left`` beyond noise."""

    fraction: float
    group: str | None
    steps: Mapping[str, float]
    ramps: Mapping[str, float]
    taken: float = 0.0
    gain: float = 0.0
    left: float = np.inf

    @property
    def says(self) -> str:
        """In words."""
        where = "of the whole structure" if self.group is None else f"of group '{self.group}'"
        within = max((abs(r) for r in self.ramps.values()), default=0.0)
        between = np.ptp(list(self.steps.values())) if len(self.steps) > 1 else 0.0
        first = next(iter(self.steps.values()), 0.0)
        runs = ", ".join(f"{100 * (s - first):+.2g} % in {name}" for name, s in self.steps.items())
        return (
            f"The stiffness {where} follows the clock, not the level: it changes by up to "
            f"{100 * within:.2g} % within a run and by {100 * between:.2g} % between runs "
            f"({runs}, against the first); that explains {100 * self.fraction:.3g} % of what a "
            "model that stays the same leaves beyond noise."
        )


def drift_of(scene: Scene) -> Drift:
    """The best explanation by a stiffness that goes with time."""
    motions = {b.run.name: smoothed_modes(b, scene) for b in scene.beyond}
    best = Drift(0.0, None, {}, {})
    noise = noise_of(scene)
    names, n = list(motions), len(motions)
    common = _in_common([b.run for b in scene.beyond])
    for group, K in _stiffness(scene).items():
        freed = scene.left.freed(_columns(scene, motions, K))
        level, _ = _least(freed @ common, scene.left.residual)
        rest, found = _least(freed, scene.left.residual)
        beyond = max(level - noise, 0.0)
        fraction = min(1.0, (level - rest) / max(beyond, SMALL * scene.left.total + 1e-300))
        if beyond > 0.0 and fraction > best.fraction:
            taken = level - rest
            gain = taken / max(1, 2 * n - common.shape[1])
            ramps = dict(zip(names, found[n:].tolist(), strict=True))
            steps = dict(zip(names, found[:n].tolist(), strict=True))
            best = Drift(fraction, group, steps, ramps, taken, gain, max(rest - noise, 0.0))
    return best


def told(scene: Scene, law: float) -> str:
    """Drift in words where it explains what a model leaves better than the best law does, which
    takes the fraction ``law`` of its squares; else empty."""
    found, taken = drift_of(scene), law * scene.left.total
    left = max(0.0, scene.left.total - taken - noise_of(scene))
    return found.says if clock_not_level(found, taken, left) else ""


def noise_of(scene: Scene) -> float:
    """Weighted squares of the projected residual that noise alone makes."""
    rows = scene.left.rows
    spare = max(0, rows - scene.left.basis.shape[1]) / max(1, rows)
    return float(np.sum(scene.point.setting.noise_parts(scene.point))) * spare


def _in_common(runs: Sequence[Run]) -> Real:
    """(2 runs, columns): a step of the runs of each level, a ramp of those of them that are
    sweeps."""
    steps = _of_levels([r.level for r in runs])
    ramps = steps * np.array([[float(is_sweep(r.force))] for r in runs])
    ramps = ramps[:, np.any(ramps != 0.0, axis=0)]
    nothing = np.zeros((len(runs), 1))
    return np.block([[steps, nothing * ramps[:1]], [nothing * steps[:1], ramps]])


def is_sweep(force: Real) -> bool:
    """Whether forces (samples, inputs) have other frequencies in the last third than in the first:
    less than `HALVED` of their power is common to both."""
    third = len(force) // 3
    first, last = (
        np.sum(np.abs(np.fft.rfft(part, axis=0)) ** 2, axis=1)
        for part in (force[:third], force[len(force) - third :])
    )
    whole = float(np.sqrt(first.sum() * last.sum()))
    width = max(1, third // 100)
    first, last = (np.convolve(p, np.ones(width) / width, mode="same") for p in (first, last))
    return whole > 0.0 and float(np.sum(np.sqrt(first * last))) < HALVED * whole


def _of_levels(levels: Sequence[float]) -> Real:
    """(runs, levels): which runs have a level in common."""
    firsts: list[float] = []
    for level in levels:
        if not any(abs(level - x) <= ONE_LEVEL * abs(x) for x in firsts):
            firsts.append(level)
    return np.array(
        [[float(abs(level - x) <= ONE_LEVEL * abs(x)) for x in firsts] for level in levels]
    )


def _least(A: Real, b: Real) -> tuple[float, Real]:
    """(squares that remain, coefficients)."""
    found, *_ = np.linalg.lstsq(A, b, rcond=1e-8)
    rest = b - A @ found
    return float(rest @ rest), np.asarray(found, dtype=float)


def clock_not_level(drift: Drift, law: float, law_left: float) -> bool:
    """Whether drift is the better explanation: it takes a fair part of what changes with the level
    leave beyond noise, by more than chance; and it takes more than twice what the best law takes
    (``law``, weighted squares), or leaves less than half of what that leaves beyond noise."""
    better = HALVED * drift.taken > law or drift.left < HALVED * law_left
    return drift.fraction > CLOCK_PART and drift.gain > CLOCK_GAIN and better


def smoothed_modes(b: Beyond, scene: Scene) -> Real:
    """Modal coordinates (samples, modes) by forces at every DOF that moves mass: the smoother of
    `Beyond.smoother` with as many latent forces as modes."""
    H = b.drive[:, :, None] * b.at[None] * b.inverse[:, None, :]
    power = np.sum(np.abs(H) ** 2, axis=2).sum(axis=1)
    said = np.sum(np.abs(b.residual) ** 2, axis=1)
    width = max(5, len(said) // 100)
    kernel = np.ones(width) / width
    noise = float(b.noise.sum())
    total = np.convolve(said, kernel, mode="same")
    variance = np.maximum(total - noise, 0.0) / np.maximum(
        np.convolve(power, kernel, mode="same"), 1e-300
    )
    heard = np.flatnonzero(total > 4.0 * noise)
    if len(heard) and heard[0] > 0:
        variance[: heard[0]] = np.median(variance[heard[0] : 3 * heard[0] + 1])
    G = H @ np.conj(np.swapaxes(H, 1, 2)) * variance[:, None, None] + np.diag(b.noise)
    known = np.linalg.solve(G, b.residual[:, :, None])
    force = variance[:, None] * (np.conj(np.swapaxes(H, 1, 2)) @ known)[:, :, 0]
    return b.run.samples_of(b.eta + b.inverse * force)


def _stiffness(scene: Scene) -> dict[str | None, Real]:
    """Modal stiffness of every group and of all (modes, modes)."""
    point = scene.point
    model = point.setting.model
    shapes = point.modes.shapes
    out: dict[str | None, Real] = {None: np.diag(np.maximum(point.modes.eigenvalues, 0.0))}
    own = [k for k, q in enumerate(model.parameters) if q.of == "stiffness" and q.group is not None]
    for k in own[:GROUPS] if len(own) > 1 else []:
        parts = (modal_blocks(shapes, b)[0] for b in model.derivative(k))
        out[model.parameters[k].group] = sum(
            (x for x in parts if x is not None), np.zeros((shapes.shape[1],) * 2)
        )
    return out


def _columns(scene: Scene, motions: Mapping[str, Real], K: Real) -> Real:
    """(rows, 2 runs): a step of the stiffness K in each run, then a ramp from −½ to ½ in each."""
    names = list(motions)
    forces: dict[str, Sequence[Real]] = {}
    for name, eta in motions.items():
        f = -eta @ K.T
        forces[name] = (f, f * (np.arange(len(f)) / len(f) - 0.5)[:, None])
    parts = []
    for s, reach in zip(scene.point.setting.signals, scene.reaches(np.eye(len(K))), strict=True):
        n, at = reach.shape[0] * reach.shape[1], names.index(s.name)
        run = scene.point.setting.runs[s.name]
        block = np.zeros((2 * n, 2 * len(names)))
        for kind, f in enumerate(forces[s.name]):
            spectra: Complex = run.decaying(f, s.s)
            flat = np.einsum("smr,sr->sm", reach, spectra).reshape(-1)
            block[:n, kind * len(names) + at], block[n:, kind * len(names) + at] = (
                flat.real,
                flat.imag,
            )
        parts.append(block)
    return np.vstack(parts)
