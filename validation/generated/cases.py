"""A case: drawing, what is concealed, usual scatter, sensors and noise, all from a seed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from validation.generated.drawings import (
    FAMILIES,
    SHARES,
    Generator,
    band,
    between,
    cords,
    design_of,
    frequencies,
    pick,
)
from validation.generated.effects import MAKERS, NOT_IN_TABLES, SECOND, WORDS, Finding, Scene
from validation.generated.laboratory import Design, Effect, Modal

SPINNING = (1, 12)  # seeds modulo 15: a rotor that spins, and one at rest with nothing concealed


@dataclass(frozen=True)
class Case:
    """All of a generated problem that its files are written from."""

    seed: int
    design: Design
    scatter: dict[int, tuple[float, float]]
    zeta: np.ndarray
    findings: tuple[Finding, ...]
    kind: str
    first: float
    top: float
    sensors: tuple[tuple[int, str], ...]
    drives: tuple[tuple[int, str], ...]
    noise: float

    @property
    def effects(self) -> tuple[Effect, ...]:
        """What the laboratory does besides the drawing; soft cords included."""
        return (*cords(self.design), *(f.effect for f in self.findings))


def draw(seed: int) -> Case:
    """The case of a seed."""
    rng = np.random.default_rng([20261121, seed])
    null = seed % 3 == 0
    word = str(pick(rng, list(WORDS)))
    possible = [f for f in FAMILIES if null or f in WORDS[word]]
    weights = np.array([SHARES[f] for f in possible])
    family = str(rng.choice(possible, p=weights / weights.sum()))
    if seed % 15 in SPINNING:
        word, family = "gyroscopic", "rotor"
    design = design_of(rng, family, "" if null else word)
    f = frequencies(design)
    top = band(rng, design, f)
    kind = str(rng.choice(("frf", "time", "modes"), p=(0.45, 0.4, 0.15)))
    if not null and kind == "modes" and word in NOT_IN_TABLES:
        kind = "frf"
    if not null and word == "structural_damping":
        kind = "frf"  # hysteretic losses are not causal: no exact run from rest exists
    sensors, drives = instruments(rng, design)
    scene = Scene(design, f, top, kind, sensors)
    findings: list[Finding] = [] if null else [MAKERS[word](rng, scene, word)]
    if findings and rng.random() < 0.15:
        others = [
            w
            for w in SECOND
            if family in WORDS[w] and w != word and not (kind == "modes" and w in NOT_IN_TABLES)
        ]
        findings += (
            [MAKERS[second](rng, scene, second) for second in [str(pick(rng, others))]]
            if others
            else []
        )
    sk, sm = rng.uniform(0.003, 0.012), rng.uniform(0.002, 0.006)
    groups = {
        e.group: (
            1.0 + float(np.clip(sk * rng.standard_normal(), -0.025, 0.025)),
            1.0 + float(np.clip(sm * rng.standard_normal(), -0.015, 0.015)),
        )
        for e in design.elements
    }
    scatter = {
        e.id: (
            groups[e.group][0] * (1.0 + 6e-4 * rng.standard_normal()),
            groups[e.group][1] * (1.0 + 6e-4 * rng.standard_normal()),
        )
        for e in design.elements
    }
    zeta = (
        design.eta
        / 2.0
        * np.exp(
            np.clip(0.25 * rng.standard_normal(), -0.5, 0.5)
            + np.clip(0.22 * rng.standard_normal(60), -0.5, 0.5)
        )
    )
    return Case(
        seed,
        design,
        scatter,
        zeta,
        tuple(findings),
        kind,
        float(f[0]),
        top,
        sensors,
        drives,
        between(rng, 0.002, 0.02),
    )


def instruments(
    rng: Generator, design: Design
) -> tuple[tuple[tuple[int, str], ...], tuple[tuple[int, str], ...]]:
    """Sensors on a random part of the free translations; one drive for what is fitted, mostly
    another for what is held out."""
    held = set(design.held)
    free = [
        (n, d)
        for n in design.nodes
        for d in design.dofs
        if d in ("x", "y", "z") and (n, d) not in held
    ]
    least = min(len(free), max(3, int(np.ceil(0.6 * len(free))) if design.family == "chain" else 4))
    most = len(free) if design.family == "chain" else min(len(free), 14)
    chosen = sorted(
        rng.choice(len(free), int(rng.integers(least, most + 1)), replace=False).tolist()
    )
    sensors = tuple(free[i] for i in chosen)
    at = rng.permutation(len(free))
    fit = sensors[int(rng.integers(len(sensors)))] if rng.random() < 0.7 else free[int(at[0])]
    out = fit if rng.random() < 0.3 else next(free[int(i)] for i in at if free[int(i)] != fit)
    return sensors, (fit, out)


def lowest(m: Modal, case: Case) -> float:
    """The lowest flexible natural frequency on the bench, Hz; bodies that swing on their cords do
    not count."""
    f = m.damped()[0]
    return float(f[f > 0.1 * case.first].min())


def exchanged(case: Case) -> list[int]:
    """Which sensor's motion each channel records: itself, unless two cables were exchanged."""
    order = list(range(len(case.sensors)))
    for x in case.findings:
        if "other" in x.effect:
            a, b = (
                case.sensors.index((x.effect["node"], x.effect["dof"])),
                case.sensors.index(x.effect["other"]),
            )
            order[a], order[b] = order[b], order[a]
    return order


def faults(case: Case, s: np.ndarray) -> np.ndarray:
    """What faulty channels do to every sensor at points ``s`` (2πi f), (points, sensors)."""
    out = np.ones((len(s), len(case.sensors)), dtype=complex)
    for x in case.findings:
        e = x.effect
        if e["physics"] == "sensor_fault":
            at = case.sensors.index((e["node"], e["dof"]))
            if "other" in e:
                continue
            out[:, at] *= e["gain"] if "gain" in e else np.exp(-s * e["delay"])
    return out
