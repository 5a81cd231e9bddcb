"""A case: structure, what is concealed, how it is driven and recorded, all from a seed.

Seeds below 1000 are for development; 1000 to 1119 are the evaluation, of which only totals are
looked at. Records of the seeds 500 to 999 and 1500 to 1619 are as simulations write them: forces
set in with the first sample, and no filter takes out what is above half the sampling rate. Of six
seeds one conceals nothing, one something linear, one drifts while it is measured, three have an
internal force, one in seven of them with something linear beside it.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from validation.motions.drives import Drive, drawn
from validation.motions.effects import MAKERS, OFTEN, Spot
from validation.motions.laws import Law
from validation.motions.march import Bench, Change
from validation.rigs import effects as linear
from validation.rigs import families
from validation.rigs.cases import Case as Plain
from validation.rigs.cases import between_modes, scattered, sound
from validation.rigs.drawing import TRANSLATIONS, Drawing, Generator
from validation.rigs.effects import Truth
from validation.rigs.families import between
from validation.rigs.response import Modal

Real = NDArray[np.float64]
EVALUATION, COUNT = 1000, 120  # first seed of the evaluation, how many
KINDS = ("null", "linear", "drift", "law", "law", "law")
FAMILIES = ("chain", "chain", "cantilever", "cantilever", "portal", "frame", "frame")
LINEAR = {  # what may be concealed beside or instead, where
    "chain": (linear.lump, linear.support, linear.softer),
    "cantilever": (linear.lump, linear.foot, linear.softer),
    "portal": (linear.lump, linear.foot, linear.joint),
    "frame": (linear.lump, linear.foot, linear.joint),
}
BESIDE = 1.0 / 7.0
MOVES = 0.25  # of the largest motion at least, where an internal force stands
REACH = 1e-3  # of the size of the structure: peak motion at the middle level
QUANTITIES = ("acceleration", "acceleration", "acceleration", "velocity", "displacement")


def secret(seed: int) -> bool:
    """Whether a seed belongs to the evaluation: only totals of it are looked at."""
    return seed >= EVALUATION


@dataclass(frozen=True)
class Run:
    """One recording: its level relative to the lowest and what it is for, the force on the bench's
    clock, how much the stiffness has changed at its beginning and end."""

    level: float
    use: str
    force: Real
    start: float = 0.0
    end: float = 0.0


@dataclass(frozen=True)
class Case:
    """All that the files of a problem are written from; ``plain`` is its linear part, ``moving``
    the groups whose stiffness drifts."""

    seed: int
    what: str
    plain: Plain
    modal: Modal
    bench: Bench
    laws: tuple[tuple[Law, Real], ...]
    truths: tuple[Truth, ...]
    runs: tuple[Run, ...]
    drive: Drive
    quantity: str
    noise: float  # of the r.m.s. of each channel in the quietest run
    moving: tuple[str, ...]

    @property
    def push(self) -> Real:
        """Vector of the drive."""
        return self.modal.structure.at(*self.plain.drives[0])

    def change(self, run: Run) -> Change | None:
        """What drifts in a run."""
        if not self.moving:
            return None
        s, B = self.modal.structure, self.bench.basis
        K = sum((self.plain.scatter[g][0] * s.groups[g][0] for g in self.moving), np.zeros(()))
        return Change(B.T @ K @ B, run.start, run.end)


def draw(seed: int) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([20261124, seed])
    kind = KINDS[seed % len(KINDS)]
    d = families.draw(rng, FAMILIES[int(rng.integers(len(FAMILIES)))])
    found: list[Truth] = []
    if kind == "linear" or (kind == "law" and rng.random() < BESIDE):
        makers = LINEAR[d.family]
        found.append(makers[int(rng.integers(len(makers)))](rng, d))
    plain = _plain(rng, seed, d, tuple(found))
    modal = plain.modal()
    drive = drawn(rng, seed, float(modal.omega[0]) / (2.0 * np.pi), plain.top)
    levels = _levels(rng, kind == "drift")
    unit = drive.force(rng)
    spots = _spots(plain, modal, drive, unit)
    middle = float(np.sqrt(min(levels) * max(levels)))
    size = max(float(np.ptp([p[k] for p in d.nodes.values()])) for k in range(3))
    scale = REACH * (1.0 if d.family == "chain" else size) / max(s.x for s in spots)
    laws: list[tuple[Law, Real]] = []
    what = kind
    if kind == "law":
        names = (*MAKERS, *OFTEN)
        what = names[int(rng.integers(len(names)))]
        spot = spots[int(rng.integers(len(spots)))]
        spot = replace(spot, x=scale * spot.x, v=scale * spot.v)
        law, truth = MAKERS[what](rng, d, spot)
        laws.append((law, direction(modal, spot.nodes, spot.dof)))
        found.append(truth)
    push = modal.structure.at(*plain.drives[0])
    bench = Bench.of(modal, plain.top, [push, *(b for _, b in laws)])
    changes, moving = _drift(rng, d, len(levels), kind == "drift")
    runs = []
    for k, (level, (start, end)) in enumerate(zip(levels, changes, strict=True)):
        use = "hold-out" if k == len(levels) - 1 else "fit"
        force = drive.force(rng) * (scale / middle * level)
        runs.append(Run(level, use, force, start, end))
    return Case(
        seed,
        what,
        plain,
        modal,
        bench,
        tuple(laws),
        tuple(found),
        tuple(runs),
        drive,
        QUANTITIES[int(rng.integers(len(QUANTITIES)))],
        between(rng, 0.003, 0.03),
        moving,
    )


def _plain(rng: Generator, seed: int, d: Drawing, found: tuple[Truth, ...]) -> Plain:
    """The linear part, in two to five modes, with one to five sensors that need not be where
    something is concealed."""
    places = d.places()
    _, good = sound(d)
    wanted = int(np.clip(int(rng.integers(2, 6)), 2, max(2, good)))
    least = 1 if d.family == "chain" else 2
    count = min(len(places), int(rng.integers(least, 6)))
    sensors = tuple(
        places[i] for i in sorted(rng.choice(len(places), count, replace=False).tolist())
    )
    zeta = between_modes(rng, 0.006 if d.family != "chain" else 0.012)
    case = Plain(
        seed=seed,
        drawing=d,
        kind="frf",
        scatter=scattered(rng, d),
        zeta=zeta,
        shear=False,
        rotary=d.rotary,
        rig=(),
        concealed=found,
        sensors=sensors,
        drives=(places[0], places[0]),
        low=0.0,
        top=0.0,
        noise=0.01,
        spread=0.0,
        gains=tuple(1.0 + 0.005 * rng.standard_normal(count)),
    )
    modal = case.modal()
    f = modal.omega / (2.0 * np.pi)
    n = min(wanted, len(f))
    top = 1.3 * f[n - 1] if n == len(f) else float(np.sqrt(f[n - 1] * f[n]))
    # the shaker stands where it moves every mode of the band
    moves = np.abs(modal.rows(places)[:, :n])
    best = np.argsort(-np.min(moves / moves.max(axis=0), axis=1), kind="stable")
    at = places[int(best[int(rng.integers(max(1, len(places) // 4)))])]
    return replace(case, drives=(at, at), low=float(0.4 * f[0]), top=float(top))


def direction(modal: Modal, nodes: Sequence[int], dof: str) -> Real:
    """Vector of a place: of its node, or of the second of two less the first."""
    at = modal.structure.at
    return at(nodes[0], dof) if len(nodes) == 1 else at(nodes[1], dof) - at(nodes[0], dof)


def _spots(plain: Plain, modal: Modal, drive: Drive, unit: Real) -> list[Spot]:
    """Where an internal force may stand: translations that move, against ground; in a chain also
    between neighbours."""
    d = plain.drawing
    where = [((n,), k) for n, k in d.places()]
    where += [(s.nodes, s.dof) for s in d.springs if len(s.nodes) == 2]
    where = [w for w in where if w[1] in TRANSLATIONS]
    push = modal.structure.at(*plain.drives[0])
    ends = [direction(modal, *w) for w in where]
    bench = Bench.of(modal, plain.top, [push])
    eta = bench.linear(push, unit, drive.fine)
    fast = np.gradient(eta, 1.0 / drive.fine, axis=0)
    K = 1.0 / np.maximum(modal.omega, 1e-9) ** 2
    spots = []
    for (nodes, dof), b in zip(where, ends, strict=True):
        x, v = (2.0 * float(np.std(y @ (b @ bench.basis))) for y in (eta, fast))
        spots.append(Spot(nodes, dof, x, v, 1.0 / float(np.sum(K * (b @ modal.shapes) ** 2))))
    most = max(s.x for s in spots if len(s.nodes) == 1)
    moving = [s for s in spots if s.x >= MOVES * most]
    pairs = [s for s in moving if len(s.nodes) == 2]
    return [*moving, *pairs]  # between neighbours twice as often


def _levels(rng: Generator, drifting: bool) -> list[float]:
    """Levels of the runs in their order, the last of them held out. Drifting structures are
    measured at one level more than once, or at one level only."""
    high = float(np.round(between(rng, 2.0, 6.0), 1))
    fit = [1.0, high] if rng.random() < 0.5 else [1.0, float(np.round(high**0.5, 2)), high]
    if drifting:
        fit = [1.0] * 3 if rng.random() < 0.4 else [*fit, fit[0]]
    order = rng.permutation(len(fit))
    held = 1.0 if max(fit) == 1.0 else float(np.round(rng.uniform(0.5, 0.9) * high, 2))
    return [*(fit[i] for i in order), held]


def _drift(
    rng: Generator, d: Drawing, runs: int, drifting: bool
) -> tuple[list[tuple[float, float]], tuple[str, ...]]:
    """Relative changes of stiffness at the ends of each run, and of which groups: a slow ramp
    through all runs, or steps between them; nothing where nothing drifts."""
    if not drifting:
        return [(0.0, 0.0)] * runs, ()
    groups = sorted(d.groups())
    groups = [g for g in groups if not g.startswith("mass ")]
    chosen = tuple(groups) if rng.random() < 0.6 else (groups[int(rng.integers(len(groups)))],)
    size = between(rng, 0.02, 0.1) * (1.0 if len(chosen) > 1 else 2.0)
    sign = -1.0 if rng.random() < 0.6 else 1.0
    if rng.random() < 0.5:  # warming through, creep
        ends = sign * size * np.linspace(0.0, 1.0, runs + 1)
        return [(float(a), float(b)) for a, b in pairwise(ends)], chosen
    steps = sign * size * np.cumsum(rng.uniform(0.0, 1.0, runs)) / (0.5 * runs)  # loosening
    return [(float(a), float(a)) for a in steps], chosen
