"""A case: drawing, rig, what is concealed, scatter, sensors and noise, all from a seed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from validation.rigs import effects, families, rig
from validation.rigs.bench import Op, Structure, build
from validation.rigs.drawing import Drawing, Generator
from validation.rigs.effects import Truth
from validation.rigs.response import Modal, as_before, modal, natural

Real = NDArray[np.float64]
STIFFNESS, MASS = 0.02, 0.012  # rolled metal: deviation of E and of mass per metre of a group
MESH = 0.006  # an analyst's mesh has its frequencies within this of the converged ones
THICK = 1.0 / 40.0  # of a plate's shorter side: above it plates deform in shear
LABORATORIES = ("tables", "rigs")
FIRST = {"tables": (3000, 5000), "rigs": (4000, 6000)}  # development, evaluation
COUNT = {"tables": 120, "rigs": 90}


def laboratory_of(seed: int) -> str:
    """Whose seed it is."""
    return "tables" if seed // 1000 % 2 else "rigs"


def secret(seed: int) -> bool:
    """Whether a seed belongs to an evaluation: only totals of it are looked at."""
    return seed >= min(last for _, last in FIRST.values())


@dataclass(frozen=True)
class Case:
    """All of a generated problem that its files are written from."""

    seed: int
    drawing: Drawing
    kind: str  # frf | modes
    scatter: dict[str, tuple[float, float]]
    zeta: Real
    shear: bool
    rotary: bool
    rig: tuple[Truth, ...]
    concealed: tuple[Truth, ...]
    sensors: tuple[tuple[int, str], ...]
    drives: tuple[tuple[int, str], ...]
    low: float
    top: float
    noise: float  # of FRFs: fraction of the r.m.s. response; of shapes: of the largest entry
    spread: float  # of frequencies in a table: relative deviation
    gains: tuple[float, ...]  # of each sensor

    def ops(self, drive: int = 0, concealed: bool = True) -> list[Op]:
        """Everything that is done to the drawing. The stinger goes with the shaker to the drive; a
        joint that is loose has not the class's stiffness as well."""
        out: list[Op] = [o for t in (self.concealed if concealed else ()) for o in t.ops]
        loose = {(o["element"], o["node"]) for o in out if o["do"] == "release"}
        here, now = self.drives[0], self.drives[drive]
        for t in self.rig:
            stinger = t.location["nodes"] == [here[0]] and t.physics == "added_mass"
            for o in t.ops:
                if o["do"] == "release" and (o["element"], o["node"]) in loose:
                    continue
                moved = {"node": now[0], **({"dof": now[1]} if "dof" in o else {})}
                out.append({**o, **moved} if stinger else o)
        return out

    def bench(self, drive: int = 0, concealed: bool = True) -> Structure:
        """The structure as it is tested."""
        return build(self.drawing, self.ops(drive, concealed), self.shear, self.rotary)

    def modal(self, drive: int = 0, concealed: bool = True) -> Modal:
        """Its modes, windows of a hammer test included in their damping."""
        m = modal(self.bench(drive, False), self.scatter, self.zeta)
        if concealed and self.concealed:
            now = modal(self.bench(drive, True), self.scatter, self.zeta)
            zeta = as_before(now, m, self.drawing.places(), len(self.zeta))
            m = replace(now, zeta=zeta)
        alpha = sum(t.alpha for t in self.rig)
        return replace(m, zeta=m.zeta + alpha / (2.0 * np.maximum(m.omega, 1e-3)))

    @cached_property
    def gain(self) -> float:
        """What the force channel reads of the force."""
        return float(np.prod([t.gain for t in self.rig]))

    @property
    def hidden(self) -> list[Truth]:
        """What is true of the specimen besides: shear."""
        if not self.shear:
            return []
        groups = self.drawing.groups()
        everything = effects.place((), sorted(e for g in groups.values() for e in g), list(groups))
        none: dict[str, list[int]] = {"nodes": [], "elements": []}
        return [Truth("shear_deformation", everything, (), (), none)]


def labels(seed: int) -> tuple[str, str]:
    """(family, kind of recording) of a seed, without drawing the rest."""
    tables = laboratory_of(seed) == "tables"
    family = _subject(np.random.default_rng([20261122, seed]), seed, tables)[1]
    return family, "modes" if tables or seed % 2 else "frf"


def draw(seed: int) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([20261122, seed])
    tables = laboratory_of(seed) == "tables"
    null = seed % 3 == 0
    name, family = _subject(rng, seed, tables)
    d = families.draw(rng, family)
    chain = family == "chain"
    ratio = 0.0 if d.plate is None else d.plate.h / min(d.plate.a, d.plate.b)
    shear = not chain and (ratio > THICK if d.plate else rng.random() < 0.4)
    rotary = shear or bool(rng.random() < 0.5)
    first, good = sound(d)
    kind = labels(seed)[1]
    sensors, drives = _instruments(rng, d)
    shaker = bool(rng.random() < 0.5)
    setting = rig.Setting(d, first, sensors, drives[0], kind == "frf", shaker)
    around = () if tables else tuple(rig.draw(rng, setting))
    found = () if null else tuple(_concealed(rng, d, name, first, tables))
    zeta = between_modes(rng, 0.006 if not chain else 0.012)
    case = Case(
        seed,
        d,
        kind,
        scattered(rng, d),
        zeta,
        shear,
        rotary,
        around,
        found,
        sensors,
        drives,
        0.0,
        0.0,
        families.between(rng, 0.005, 0.03)
        if kind == "modes"
        else families.between(rng, 3e-3, 0.03),
        families.between(rng, 2e-4, 5e-3),
        tuple(1.0 + 0.007 * rng.standard_normal(len(sensors))),
    )
    return _band(rng, case, first, good)


def _subject(rng: Generator, seed: int, tables: bool) -> tuple[str, str]:
    """(what is concealed, on which family)."""
    if tables:
        name = sorted(effects.TABLES)[int(rng.integers(len(effects.TABLES)))]
        on = effects.TABLES[name][1] if seed % 3 else families.FAMILIES
        return name, on[int(rng.integers(len(on)))]
    names = ("lump", "softer", "joint", "damper", "resonator", "damage")
    name = names[int(rng.integers(len(names)))]
    possible = [
        f
        for f in families.FAMILIES
        if seed % 3 == 0 or name != "joint" or f in effects.TABLES["joint"][1]
    ]
    return name, possible[int(rng.integers(len(possible)))]


def _concealed(rng: Generator, d: Drawing, name: str, first: float, tables: bool) -> list[Truth]:
    if name in ("damper", "resonator"):
        make = effects.damper if name == "damper" else effects.resonator
        return [make(rng, d, first)]
    makers: dict[str, effects.Maker] = {k: v for k, (v, _) in effects.TABLES.items()}
    makers["damage"] = effects.damage
    out = [makers[name](rng, d)]
    if tables and rng.random() < 0.2:  # two effects at once
        others = [
            k
            for k, (_, on) in effects.TABLES.items()
            if d.family in on and k not in (name, "group")
        ]
        if name != "group" and others:
            second = makers[others[int(rng.integers(len(others)))]](rng, d)
            same = {o.get("node", tuple(o.get("elements", ()))) for t in out for o in t.ops}
            if not any(o.get("node", tuple(o.get("elements", ()))) in same for o in second.ops):
                out.append(second)
    return out


def sound(d: Drawing) -> tuple[float, int]:
    """(lowest flexible frequency of the drawing in Hz, modes that the analyst's mesh has right)."""
    fine = natural(*build(d, [], False, True).matrices({}))[0] / (2.0 * np.pi)
    moves = np.flatnonzero(fine > 1e-3 * fine[min(9, len(fine) - 1)])
    skip = int(moves[0])
    if d.plate is not None or d.family == "chain":
        most = len(fine) - skip if d.family == "chain" else 8
        return float(fine[skip]), most
    rough = natural(*build(d, [], False, True, coarse=True).matrices({}))[0] / (2.0 * np.pi)
    n = min(len(rough), len(fine), skip + 12)
    off = np.abs(rough[skip:n] / fine[skip:n] - 1.0) > MESH
    return float(fine[skip]), int(np.argmax(off)) if off.any() else n - skip


def scattered(rng: Generator, d: Drawing) -> dict[str, tuple[float, float]]:
    """Usual factors on stiffness and mass of each group."""

    def one(spread: float) -> float:
        return 1.0 + spread * float(np.clip(rng.standard_normal(), -2.5, 2.5))

    return {g: (one(STIFFNESS), one(MASS)) for g in d.groups()}


def between_modes(rng: Generator, middle: float) -> Real:
    """Damping of the lowest modes, scattered about a level."""
    level = middle * np.exp(0.5 * np.clip(rng.standard_normal(), -1.5, 1.5))
    return np.asarray(level * np.exp(0.25 * np.clip(rng.standard_normal(40), -2.0, 2.0)))


def _instruments(
    rng: Generator, d: Drawing
) -> tuple[tuple[tuple[int, str], ...], tuple[tuple[int, str], ...]]:
    """Few to many sensors on a random part of the translations; two drives."""
    places = d.places()
    least = min(len(places), 4 if d.family != "chain" else max(4, len(places) // 2))
    most = min(len(places), 16)
    chosen = rng.choice(len(places), int(rng.integers(least, most + 1)), replace=False)
    sensors = tuple(places[i] for i in sorted(chosen.tolist()))
    at = rng.permutation(len(places))
    fit = sensors[int(rng.integers(len(sensors)))] if rng.random() < 0.7 else places[int(at[0])]
    other = next(places[int(i)] for i in at if places[int(i)] != fit)
    return sensors, (fit, other)


def _band(rng: Generator, case: Case, first: float, good: int) -> Case:
    """With the band: four to eight modes, as far as the analyst's mesh is right."""
    f = case.modal().omega / (2.0 * np.pi)
    low = 0.5 * first if case.drawing.free else 0.0
    inside = f[f > low]
    n = int(np.clip(int(rng.integers(4, 9)), min(4, len(inside)), min(max(4, good), len(inside))))
    top = 1.3 * inside[n - 1] if n == len(inside) else np.sqrt(inside[n - 1] * inside[n])
    return replace(case, low=float(max(low, 0.35 * inside[0])), top=float(top))


def without(case: Case, index: int) -> Case:
    """The case with one concealed effect taken away."""
    kept: Sequence[Truth] = [t for i, t in enumerate(case.concealed) if i != index]
    return replace(case, concealed=tuple(kept))
