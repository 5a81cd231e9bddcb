"""Words that are a factor on a property of elements: stiffness_change, mass_change,
thickness_change, structural_damping, axial_preload, shear_deformation, orthotropy. Each is the
model with a parameter on that property, at every set of elements where it can stand."""

from __future__ import annotations

from collections.abc import Sequence
from functools import partial

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.physics.base import (
    Candidate,
    Context,
    Place,
    Rates,
    Wanted,
    append_parameters,
    given,
    tangents,
)
from cvxupdate.physics.members import member_sets, straight

LOSS = 0.02  # loss factor that is one unit

Sets = Sequence[tuple[tuple[int, ...], tuple[str, ...]]]


def _factor(
    context: Context, word: str, of: str, sets: Sets, lower: float, upper: float
) -> list[Candidate]:
    out: list[Candidate] = []
    rates = Rates.of(context.model, of)
    for ids, groups in sets:
        grow = partial(
            append_parameters,
            context.model,
            [Wanted(f"{word}@{len(out)}", of, ids, lower=lower, upper=upper)],
        )
        out.append(
            Candidate(
                word,
                Place(elements=ids, groups=groups),
                grow,
                1,
                np.zeros(1),
                (rates.tangent(ids),),
                report=(("factor", 0, "factor"),),
                members=ids,
                additive=True,
                limits=(lower, upper),
            )
        )
    return out


def stiffness_change(context: Context) -> list[Candidate]:
    """A factor on K of a set of elements (3.22)."""
    return _factor(
        context,
        "stiffness_change",
        "stiffness",
        member_sets(context.model, "stiffness"),
        -0.95,
        9.0,
    )


def mass_change(context: Context) -> list[Candidate]:
    """A factor on M of a set of elements (3.22); lumps are ``added_mass``."""
    return _factor(context, "mass_change", "mass", member_sets(context.model, "rho"), -0.95, 9.0)


def thickness_change(context: Context) -> list[Candidate]:
    """A factor on a plate's thickness or a rectangle's height: bending stiffness with its cube,
    mass with itself (thesis 8.4)."""
    return [
        c
        for of in ("thickness", "height")
        for c in _factor(context, "thickness_change", of, member_sets(context.model, of), -0.8, 3.0)
    ]


def structural_damping(context: Context) -> list[Candidate]:
    """Hysteretic loss in a group, D = η K (3.45); tell-tale: damping follows the share of strain
    energy in the group."""
    out: list[Candidate] = []
    sets = member_sets(context.model, "eta")
    whole = max((len(ids) for ids, _ in sets), default=0)
    rates = Rates.of(context.model, "eta", LOSS)
    for ids, groups in sets:
        if not groups or (len(groups) > 1 and len(ids) == whole):
            continue  # the loss of everything alike is what every mode's damping may be anyway
        grow = partial(
            append_parameters,
            context.model,
            [
                Wanted(
                    f"structural_damping@{len(out)}", "eta", ids, lower=0.0, upper=50.0, scale=LOSS
                )
            ],
        )
        out.append(
            Candidate(
                "structural_damping",
                Place(elements=ids, groups=groups),
                grow,
                1,
                np.zeros(1),
                (rates.tangent(ids),),
                sign=1,
                report=(("eta", 0, "value"),),
                members=ids,
                limits=(0.0, 50.0),
            )
        )
    return out


def mass_proportional_damping(context: Context) -> list[Candidate]:
    """C = α M over the whole structure: every mode decays at the rate α / 2 (air, suspension, an
    exponential window)."""
    grown = append_parameters(
        context.model,
        [Wanted("mass_proportional_damping", "alpha", (), lower=0.0, upper=1e3, scale=1.0)],
    )
    return [
        Candidate(
            "mass_proportional_damping",
            Place(),
            given(grown),
            1,
            np.zeros(1),
            tangents(grown, 1),
            sign=1,
            report=(("alpha", 0, "value"),),
            limits=(0.0, 1e3),
        )
    ]


def axial_preload(context: Context) -> list[Candidate]:
    """Geometric stiffness of a tension or compression in a group or a straight member
    (Przemieniecki 1968, 15.2); tell-tale: low modes shift most."""
    out: list[Candidate] = []
    members = {tuple(sorted(m)) for m in straight(context.model, "N")}
    for ids, groups in member_sets(context.model, "N"):
        if not groups and ids not in members:
            continue
        unit = _euler(context.model, ids)
        grown = append_parameters(
            context.model,
            [Wanted(f"axial_preload@{len(out)}", "N", ids, lower=-5.0, upper=50.0, scale=unit)],
        )
        out.append(
            Candidate(
                "axial_preload",
                Place(elements=ids, groups=groups),
                given(grown),
                1,
                np.zeros(1),
                tangents(grown, 1),
                report=(("N", 0, "value"),),
                members=ids,
                limits=(-5.0, 50.0),
            )
        )
    return out


def _euler(model: Model, ids: Sequence[int]) -> float:
    """π² E I / L² of the elements taken as one bar: the size of a force that matters."""
    from cvxupdate.fe.sections import section_constants

    wanted = set(ids)
    for block in model.blocks:
        rows = np.flatnonzero([i in wanted for i in block.ids.tolist()])
        section = getattr(block.kind, "section", None)
        if len(rows) and section is not None:
            c = section_constants(section, block.properties)
            bending = float(
                np.min(
                    np.minimum(np.real(c["Iy"][rows]), np.real(c["Iz"][rows]))
                    * block.properties["E"][rows]
                )
            )
            return float(np.pi**2 * bending / np.sum(block.properties["length"][rows]) ** 2)
    return 1.0


def shear_deformation(context: Context) -> list[Candidate]:
    """Timoshenko shear where the model is Euler–Bernoulli; tell-tale: high modes fall, the more the
    higher. Φ = 12 E I / (κ G A L²)."""
    out: list[Candidate] = []
    for ids, groups in member_sets(context.model, "shear"):
        if not groups:
            continue
        grown = append_parameters(
            context.model,
            [Wanted(f"shear@{len(out)}", "shear", ids, lower=0.0, upper=3.0, scale=1.0)],
        )
        out.append(
            Candidate(
                "shear_deformation",
                Place(elements=ids, groups=groups),
                given(grown),
                1,
                np.zeros(1),
                tangents(grown, 1),
                sign=1,
                report=(("kappa", 0, "kappa"),),
                members=ids,
                limits=(0.0, 3.0),
            )
        )
    return out


def orthotropy(context: Context) -> list[Candidate]:
    """Direction-dependent rigidities of a plate group (8.4): Dx, Dy, D1, Dxy as factors on the
    isotropic ones."""
    out: list[Candidate] = []
    for ids, groups in member_sets(context.model, "Dx"):
        if not groups:
            continue
        names = ("Dx", "Dy", "D1", "Dxy")
        grown = append_parameters(
            context.model,
            [Wanted(f"orthotropy.{n}@{len(out)}", n, ids, lower=-0.8, upper=3.0) for n in names],
        )
        out.append(
            Candidate(
                "orthotropy",
                Place(elements=ids, groups=groups),
                given(grown),
                4,
                np.zeros(4),
                tangents(grown, 4),
                report=tuple((n, k, "factor") for k, n in enumerate(names)),
                members=ids,
                limits=(-0.8, 3.0),
            )
        )
    return out
