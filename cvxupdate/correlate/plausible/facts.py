"""What a model is made of, in figures that a reader can judge; and materials that nothing is made
of."""

from __future__ import annotations

from typing import Any

import numpy as np

from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.fe.modes import loose_dofs, model_modes
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import Block

FAST, SLOW = 2.5e4, 10.0
"""Speed of sound √(E/ρ) in m/s that no solid reaches (diamond: 1.8e4), or that only gels fall
below (soft rubber: 30)."""
PERCENT = 0.3
"""Median damping ratio above which a table of modes is probably in per cent."""
FIRST = 5
"""Natural frequencies that are stated."""
MOST_NAMED = 8
"""Loose DOFs that are named."""


def facts(model: Model) -> dict[str, Any]:
    """Total mass (kg; None for matrices of another program) or, of what only turns, ``inertia``
    about each axis (kg·m²), extent (m, along x, y, z), the first natural frequencies (Hz), and what
    moves ``free`` of strain, in sentences.

    Raises
    ------
    ModelError
        The model is a mechanism, or its mass is indefinite.
    """
    modes = model_modes(model, FIRST)
    given = any(b.kind.name == "matrix" for b in model.blocks)
    extent = np.ptp(model.xyz, axis=0) if len(model.xyz) else np.zeros(3)
    return {
        "mass": None if given else float(model.total_mass()),
        "inertia": {} if given or model.total_mass() > 0.0 else _inertia(model),
        "extent": [float(x) for x in extent],
        "frequencies": [float(f) for f in modes.flexible().frequencies[:FIRST]],
        "free": free_says(model, modes.rigid),
    }


def _inertia(model: Model) -> dict[str, float]:
    """Of all that turns together about each axis that DOFs are about."""
    M, out = model.matrices(model.zero()).M, {}
    for code, kind in enumerate(KINDS):
        turns = (model.dof_kind == code).astype(float)
        if kind.startswith("r") and (whole := float(turns @ (M @ turns))) > 0.0:
            out[kind] = whole
    return out


def free_says(model: Model, motions: int) -> list[str]:
    """What moves without strain, of so many motions in all: DOFs that no stiffness acts on by
    their labels, and beside those the structure as a rigid body; a base goes as it is moved."""
    motions -= sum(len(b.ids) for b in model.blocks if b.is_base)
    if motions <= 0:
        return []
    loose, out = loose_dofs(model), []
    if loose:
        more = f" and {len(loose) - MOST_NAMED} more" if len(loose) > MOST_NAMED else ""
        names = f"{', '.join(loose[:MOST_NAMED])}{more}"
        verb = "has" if len(loose) == 1 else "have"
        out.append(f"{names} {verb} mass but no stiffness: nothing holds what is there")
    rest = motions - len(loose)
    if rest > 0:
        drawn = not any(b.kind.name == "matrix" for b in model.blocks)
        how = "moves as a rigid body" if drawn else "moves without strain"
        out.append(
            f"The model {how} in {rest} way{'s' if rest > 1 else ''}: right for a structure that "
            "hangs free, wrong where a support is missing"
        )
    return out


def held(spec: Spec) -> list[dict[str, Any]]:
    """What supports hold: ``nodes`` (numbers, or "all") that share the same active ``dofs``."""
    kinds: dict[int | str, set[str]] = {}
    for support in spec.model.supports:
        for node in ("all",) if support.nodes == "all" else support.nodes:
            kinds.setdefault(node, set()).update(set(support.dofs) & set(spec.model.dofs))
    alike: dict[tuple[str, ...], list[int | str]] = {}
    for node, found in kinds.items():
        alike.setdefault(tuple(k for k in spec.model.dofs if k in found), []).append(node)
    return [
        {"nodes": "all" if "all" in nodes else sorted(map(int, nodes)), "dofs": list(dofs)}
        for dofs, nodes in alike.items()
        if dofs
    ]


def moved(spec: Spec) -> list[dict[str, Any]]:
    """The bases whose motion is recorded, or that the file has: ``nodes`` and their ``dofs``."""
    return [{"nodes": sorted(b.nodes), "dofs": [b.dof]} for b in spec.model.bases]


def states(spec: Spec) -> dict[str, int]:
    """How many recordings are of each state of the structure, "" for none; empty where no state is
    named."""
    named = [r.state or "" for r in spec.recordings]
    return {name: named.count(name) for name in dict.fromkeys(named)} if any(named) else {}


def material_doubts(spec: Spec) -> tuple[Doubt, ...]:
    """Materials in which sound would travel as in none: of all that elements are made of, because
    one that stands for a rigid or massless link may be anything."""
    used = dict.fromkeys(name for block in spec.model.elements for name in _materials(block))
    known = [(n, spec.model.materials[n]) for n in used if n in spec.model.materials]
    speeds = [(n, m, float(np.sqrt(m.E / m.rho))) for n, m in known if m.rho > 0.0]
    if not speeds or len(speeds) < len(known):
        return ()
    fast, slow = all(c > FAST for *_, c in speeds), all(c < SLOW for *_, c in speeds)
    if not (fast or slow):
        return ()
    name, m, c = speeds[0]
    ask = "is rho in g/cm³ or t/mm³?" if fast else "is E in MPa or GPa?"
    says = (
        f"In material {name!r} (E = {m.E:g} Pa, rho = {m.rho:g} kg/m³) sound would travel at "
        f"{c:.3g} m/s, {'faster' if fast else 'slower'} than in any solid: {ask}"
    )
    return (Doubt("material", says, value=c),)


def _materials(block: Block) -> list[str]:
    rows = [row.get("material") for row in block.rows]
    return [name for name in (block.get("material"), *rows) if isinstance(name, str)]
