"""How strongly an effect shows in the recordings, and what nuisance parameters leave of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from validation.generated.cases import Case, exchanged, faults, lowest
from validation.generated.laboratory import Modal, build, modal

PRIOR = {
    "stiffness": 0.02,
    "mass": 0.012,
    "damping": 1.0,
    "mode": 0.35,
}  # what drawing and laboratory usually differ by; damping as its logarithm
FLOOR = (
    0.01  # of the response around: discretisation, which a model's user does not know any better
)


def visibility(case: Case, index: int, m: Modal) -> tuple[float, float]:
    """How far an effect changes the recordings, the others being there: relative to the response
    (for tables: in deviations); and what nuisance parameters leave of that, r.m.s. in units of
    noise and `FLOOR` together (to first order): well below one it drowns in them, line by line."""
    rest = replace(case, findings=tuple(f for i, f in enumerate(case.findings) if i != index))
    without = modal(build(rest.design, rest.scatter, rest.effects), case.top, case.zeta)
    if case.kind == "modes":
        return _visible_in_table(rest, m, without)
    f = np.linspace(0.3 * lowest(m, case), case.top, 400)
    s = 2.0 * np.pi * f * (0.01 + 1j)
    drives = [case.drives[0]]
    H, G = (
        x.accelerance(s, x.rows(case.sensors), x.rows(drives))[:, :, 0][:, exchanged(c)]
        * faults(c, s)
        for x, c in ((m, case), (without, rest))
    )
    scale = np.sqrt(
        (FLOOR * np.abs(G)) ** 2
        + (0.1 * FLOOR) ** 2 * np.mean(np.abs(G) ** 2, axis=0)
        + case.noise**2 * np.mean(np.abs(G) ** 2)
    )
    columns, priors = _ordinary_columns(rest, without, s, drives[0])
    A = np.array(
        [np.concatenate([(c / scale).real.ravel(), (c / scale).imag.ravel()]) for c in columns]
    ).T
    gap = (H - G) / scale
    return float(np.linalg.norm(H - G) / np.linalg.norm(G)), _unabsorbed(
        A, np.concatenate([gap.real.ravel(), gap.imag.ravel()]), np.array(priors)
    )


def _unabsorbed(A: np.ndarray, gap: np.ndarray, priors: np.ndarray) -> float:
    """Root mean square of a weighted gap that columns with priors leave, priors included."""
    system = np.vstack([A, np.diag(1.0 / priors)])
    rest = np.concatenate([gap, np.zeros(len(priors))])
    x = np.linalg.lstsq(system, rest, rcond=None)[0]
    return float(np.linalg.norm(rest - system @ x) / np.sqrt(len(gap)))


def _changes(case: Case) -> list[tuple[np.ndarray, np.ndarray, float]]:
    """(∂K, ∂M, prior) of stiffness and mass of every group, by a difference of exact matrices (they
    are linear in both)."""
    base = build(case.design, case.scatter, case.effects)
    out = []
    for group in dict.fromkeys(e.group for e in case.design.elements):
        for part, word in ((0, "stiffness"), (1, "mass")):
            moved = dict(case.scatter)
            for e in case.design.elements:
                if e.group == group:
                    k, m = case.scatter[e.id]
                    moved[e.id] = (k + 0.01, m) if part == 0 else (k, m + 0.01)
            near = build(case.design, moved, case.effects)
            dK, dM = (near.K - base.K) / 0.01, (near.M - base.M) / 0.01
            if np.any(dK) or np.any(dM):
                out.append((dK, dM, PRIOR[word]))
    return out


def _ordinary_columns(
    case: Case, m: Modal, s: np.ndarray, drive: tuple[int, str]
) -> tuple[list[np.ndarray], list[float]]:
    """Derivatives (points, sensors) of the response by nuisance parameters, and their priors."""
    read, push, inverse = m.shapes[m.rows(case.sensors)], m.shapes[m.rows([drive])[0]], m.inverse(s)
    fault = faults(case, s)
    left, right = read @ inverse, inverse @ push
    columns, priors = [], []

    def add(change: np.ndarray, prior: float) -> None:
        columns.append(-(s[:, None] ** 2) * np.einsum("fsm,fm->fs", left, change) * fault)
        priors.append(prior)

    for dK, dM, prior in _changes(case):
        k, mass = m.shapes.T @ dK @ m.shapes, m.shapes.T @ dM @ m.shapes
        add(right @ k.T + s[:, None] ** 2 * (right @ mass.T), prior)
    damping = 2.0 * m.zeta * m.omega * s[:, None] * right
    add(damping, PRIOR["damping"])
    for r in np.flatnonzero(m.omega < 2.5 * np.pi * case.top):
        add(damping * (np.arange(len(m.omega)) == r), PRIOR["mode"])
    return columns, priors


def _visible_in_table(case: Case, m: Modal, without: Modal) -> tuple[float, float]:
    (a, za), (b, zb) = (x.damped() for x in (m, without))
    n = min(len(a), len(b))
    keep = (b[:n] < case.top) & (b[:n] > 0.1 * case.first)
    change, damping = (a[:n] / b[:n] - 1.0)[keep], (za[:n] / zb[:n] - 1.0)[keep]
    shapes = without.shapes[:, :n][:, keep]
    omega = without.omega[:n][keep]
    changes = _changes(case)
    columns = [
        (np.sum(shapes * (dK @ shapes), axis=0) / omega**2 - np.sum(shapes * (dM @ shapes), axis=0))
        / 2.0
        for dK, dM, _ in changes
    ]
    priors = np.array([p for *_, p in changes])
    floor = 0.003  # of a frequency
    strain = float(np.sqrt(np.mean((damping - np.mean(damping)) ** 2))) / PRIOR["mode"]
    seen = max(
        float(np.sqrt(np.mean(change**2))) / 5e-4, float(np.sqrt(np.mean(damping**2))) / 0.05
    )
    return seen, max(_unabsorbed(np.array(columns).T / floor, change / floor, priors), strain)
