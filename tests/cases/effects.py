"""An instance of every effect type: the contract tests of tests/physics run over all of them.

Structures have stiffness, mass and damping of every kind that a file can say, unequal spans and no
symmetry; each instance names the structure where its type can stand, and figures for its sentence.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import select_parameters
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.growth import Wanted
from cvxupdate.spec import Spec, load_problem
from tests.cases.elements import STEEL, grid, nodes, sheet, squares, toml

BEAM: dict[str, Any] = {
    "dofs": ["x", "z", "ry"],
    "nodes": nodes([(x, 0.0, 0.0) for x in (0.0, 0.11, 0.23, 0.37, 0.48, 0.6)]),
    "materials": {"steel": {**STEEL, "eta": 0.004}},
    "sections": {"flat bar": {"shape": "rectangle", "width": 0.04, "height": 0.008}},
    "elements": [
        {
            "type": "beam3d",
            "material": "steel",
            "section": "flat bar",
            "rows": [
                {"id": i, "nodes": [i, i + 1], "group": "long" if i < 4 else "short"}
                for i in range(1, 6)
            ],
        },
        {
            "type": "mass",
            "rows": [{"id": 11, "nodes": [4], "m": 0.12, "Iyy": 2e-5, "group": "tip"}],
        },
        {
            "type": "spring",
            "rows": [
                {"id": 21, "nodes": [6], "k": 2e4, "dofs": ["x", "z"], "group": "hanger"},
                {"id": 22, "nodes": [3, 5], "k": 3e3, "dof": "z", "group": "tie"},
            ],
        },
        {"type": "dashpot", "dof": "z", "rows": [{"id": 31, "nodes": [3], "c": 1.4}]},
    ],
    "supports": [
        {"nodes": "all", "dofs": ["y", "rx", "rz"]},
        {"nodes": [1], "dofs": ["x"]},
        {"nodes": [1, 2], "dofs": ["z"]},
    ],
    "damping": {"kind": "structural", "eta": 0.01},
}
PLATE: dict[str, Any] = {
    **grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26], material={**STEEL, "eta": 0.003}),
    "supports": [{"nodes": [1, 4], "dofs": ["z"]}],
    "damping": {"kind": "modal", "zeta": [0.01, 0.02]},
}
EDGE: dict[str, Any] = {
    **grid([0.0, 0.11, 0.3], [0.0, 0.17, 0.26, 0.4], material=STEEL),
    "supports": [{"nodes": [1, 4, 7, 10], "dofs": ["z", "rx", "ry"]}],
    "damping": {"kind": "modal", "zeta": [0.01, 0.02]},
}
TURNING: dict[str, Any] = {  # an edge that is held rigidly across, and about its line on springs
    **EDGE,
    "supports": [{"nodes": [1, 4, 7, 10], "dofs": ["z", "rx"]}],
    "elements": [
        *EDGE["elements"],
        {
            "type": "spring",
            "dof": "ry",
            "rows": [
                {"id": 90 + n, "nodes": [n], "k": 40.0 * n, "edge": True, "group": f"edge {n}"}
                for n in (1, 4, 7, 10)
            ],
        },
    ],
}
HINGED: dict[str, Any] = {**EDGE, "supports": [{"nodes": [1, 4, 7, 10], "dofs": ["z"]}]}
_CELLS = squares(3, 2, 0.2)
SHELL: dict[str, Any] = {
    **sheet(
        _CELLS[0] @ [[0.42, 0.0, 0.21], [0.05, 0.26, 0.1]],
        _CELLS[1],
        material={**STEEL, "eta": 0.003},
        offset=0.002,
    ),
    "supports": [{"nodes": [1, 4], "dofs": ["x", "y", "z"]}],
    "damping": {"kind": "structural", "eta": 0.01},
}
SHAFT: dict[str, Any] = {
    "dofs": ["y", "z", "ry", "rz"],
    "nodes": nodes([(x, 0.0, 0.0) for x in (0.0, 0.13, 0.29, 0.4)]),
    "materials": {"m": STEEL},
    "sections": {"s": {"shape": "circle", "diameter": 0.02}},
    "elements": [
        {
            "type": "beam3d",
            "material": "m",
            "section": "s",
            "rows": [
                {"id": 1, "nodes": [1, 2], "group": "shaft"},
                {"id": 2, "nodes": [3, 2], "group": "shaft"},
                {"id": 3, "nodes": [3, 4], "group": "shaft"},
            ],
        },
        {
            "type": "mass",
            "rows": [{"id": 4, "nodes": [3], "m": 2.0, "Ixx": 0.02, "Iyy": 0.011, "Izz": 0.011}],
        },
        {"type": "dashpot", "dof": "y", "rows": [{"id": 5, "nodes": [4], "c": 7.0}]},
    ],
    "supports": [{"nodes": [1], "dofs": ["y", "z", "ry", "rz"]}],
}
FRAME: dict[str, Any] = {  # two bays, two storeys on one side; feet pinned and clamped
    "dofs": ["x", "z", "ry"],
    "nodes": nodes(
        [(x, 0.0, z) for x in (0.0, 0.5, 0.9) for z in (0.0, 0.4)]
        + [(0.0, 0.0, 0.7), (0.5, 0.0, 0.7), (0.2, 0.0, 0.4)]
    ),
    "materials": {"steel": {**STEEL, "eta": 0.004}},
    "sections": {
        "post": {"shape": "rectangle", "width": 0.02, "height": 0.012},
        "beam": {"shape": "rectangle", "width": 0.03, "height": 0.009},
    },
    "elements": [
        {
            "type": "beam3d",
            "material": "steel",
            "section": "post",
            "rows": [
                {"id": i, "nodes": n, "group": "posts"}
                for i, n in enumerate(([1, 2], [2, 7], [4, 3], [4, 8], [5, 6]), 1)
            ],
        },
        {
            "type": "beam3d",
            "material": "steel",
            "section": "beam",
            "rows": [
                {"id": i, "nodes": n, "group": "beams"}
                for i, n in enumerate(([2, 9], [9, 4], [6, 4], [7, 8]), 11)
            ],
        },
    ],
    "supports": [
        {"nodes": "all", "dofs": ["y", "rx", "rz"]},
        {"nodes": [1, 3, 5], "dofs": ["x", "z"]},
        {"nodes": [1, 3], "dofs": ["ry"]},
    ],
}
HUNG: dict[str, Any] = {
    **grid([0.0, 0.11, 0.31, 0.42], [0.0, 0.13, 0.26], material={**STEEL, "eta": 0.003}),
    "damping": {"kind": "modal", "zeta": [0.01, 0.02]},
}
MOUNTED: dict[str, Any] = {  # on pads, and tied
    **SHAFT,
    "elements": [
        *SHAFT["elements"],
        {
            "type": "spring",
            "rows": [
                {"id": 6, "nodes": [2], "k": 4e4, "dofs": ["y", "z"], "group": "pad"},
                {"id": 7, "nodes": [4], "k": 3e4, "dof": "z", "group": "pad"},
                {"id": 8, "nodes": [3, 4], "k": 3e3, "dof": "z", "group": "tie"},
            ],
        },
    ],
}
STRUCTURES: dict[str, dict[str, Any]] = {
    "beam": BEAM,
    "plate": PLATE,
    "edge": EDGE,
    "turning": TURNING,
    "hinged": HINGED,
    "shell": SHELL,
    "shaft": SHAFT,
    "frame": FRAME,
    "hung": HUNG,
    "mounted": MOUNTED,
}
ACCELEROMETERS = {
    "frame": ("n2.x", "n8.x", "n9.z"),
    "hung": ("n1.z", "n7.z"),
    "mounted": ("n2.y", "n4.z"),
    "beam": ("n3.z", "n4.x", "n4.z", "n6.z"),
    "edge": ("n6.z", "n9.z"),
    "turning": ("n6.z", "n9.z"),
    "hinged": ("n6.z", "n9.z"),
    "plate": ("n6.z", "n9.z"),
    "shell": ("n6.z", "n9.x"),
    "shaft": ("n2.y", "n3.z", "n4.z"),
}


@dataclass(frozen=True)
class Case:
    """An effect type by the name of its class: where it can stand, and figures to be told;
    ``apart``: of several drives, one at a time."""

    type: str
    structure: str
    figures: Mapping[str, float]
    apart: bool = False


CASES = (
    Case("StiffnessChange", "beam", {"factor": 0.87}),
    Case("SoftZone", "beam", {"factor": 0.61, "give_first": 0.13, "give_last": 0.21}),
    Case("AbsentMember", "frame", {"factor": 0.013}),
    Case("MassChange", "plate", {"factor": 1.1}),
    Case("ThicknessChange", "plate", {"factor": 1.35}),
    Case("ThicknessChange", "shell", {"factor": 1.35}),
    Case("Orthotropy", "plate", {"Dx": 1.1, "Dy": 0.8, "D1": 1.0, "Dxy": 0.93}),
    Case("Orthotropy", "shell", {"Dx": 1.1, "Dy": 0.8, "D1": 1.0, "Dxy": 0.93}),
    Case("AddedMass", "beam", {"m": -1.21}),
    Case("SpreadLump", "plate", {"m": 1.21, "J": 3.4e-4}),
    Case("SpreadLump", "beam", {"m": 1.21, "J": 3.4e-4}),
    Case("SensorMass", "beam", {"m": 0.0348}),
    Case("GroundingSpring", "beam", {"k": 3490.0}),
    Case("Cords", "hung", {"k": 320.0}),
    Case("HeldEdges", "hinged", {"k": 113.0}),
    Case("SoftSupport", "beam", {"k": 2.1e6}),
    Case("EqualSupports", "beam", {"k": 2.1e6}),
    Case("LooseSpan", "edge", {"k": 2.1e6, "kr": 310.0}),
    Case("LooseSpan", "turning", {"k": 2.1e6, "kr": 310.0}),
    Case("LooserSupport", "mounted", {"k": 2.1e6}),
    Case("SoftMounts", "mounted", {"factor": 0.71}),
    Case("FlexibleSupport", "beam", {"k": 2.1e6, "m": 3.4}),
    Case("MovingFixture", "frame", {"k": 2.1e6, "m": 3.4, "kr": 5.6e3, "J": 0.021}),
    Case("ShakerAttachment", "beam", {"m": 0.021, "k": 4300.0}),
    Case("DriveMass", "beam", {"m": 0.021}, apart=True),
    Case("JointFlexibility", "beam", {"k": 2.1e6}),
    Case("EqualJoints", "frame", {"k": 2.1e6}),
    Case("ShearDeformation", "beam", {"kappa": 0.83}),
    Case("ShearDeformation", "shell", {"kappa": 0.83}),
    Case("AxialPreload", "beam", {"N": -1830.0}),
    Case("Spin", "shaft", {"omega": -314.159}),
    Case("AttachedResonator", "beam", {"m": 0.0348, "k": 88826.0, "c": 3.7}),
    Case("ViscousDamper", "beam", {"c": 0.0377}),
    Case("StructuralDamping", "beam", {"eta": 0.012}),
    Case("MassProportionalDamping", "shaft", {"alpha": 1.3}),
    Case("ChannelGain", "beam", {"gain": 0.5}),
    Case("ForceGain", "beam", {"gain": 0.88}),
    Case("DriveGain", "beam", {"gain": 0.88}),
    Case("RecordingGain", "beam", {"gain": 0.88}, apart=True),
    Case("ChannelDelay", "beam", {"delay": 0.0037}),
    Case("ExchangedChannels", "beam", {"gain": 1.0}),
    Case("CubicStiffness", "beam", {"k3": 2.2e7}),
    Case("Clearance", "beam", {"k": 5e5, "gap": -0.00029}),
    Case("DryFriction", "beam", {"force": 0.8}),
    Case("Hysteresis", "beam", {"k": 2e5, "force": 65.0}),
    Case("QuadraticDamping", "beam", {"c2": 12.0}),
)


def problem(folder: Path, structure: Mapping[str, Any]) -> Spec:
    """A problem file of a structure, read."""
    path = folder / "problem.toml"
    path.write_text(
        f'title = "A \\"quoted\\" title"\nmodel = {toml(structure)}\n', encoding="utf-8"
    )
    return load_problem(path)


def nuisance(model: Model) -> Model:
    """A p-value of stiffness and mass for the first group."""
    first = model.blocks[0]
    mine = tuple(
        int(i) for i, g in zip(first.ids, first.groups, strict=True) if g == first.groups[0]
    )
    return model.with_parameters(
        select_parameters(
            [Wanted(w, w, mine, first.groups[0]) for w in ("stiffness", "mass")], model
        )
    )


def context_of(spec: Spec, model: Model, sensors: tuple[str, ...] = ()) -> SearchContext:
    """Of a model built from ``spec``; ``sensors`` are accelerometers."""
    m = model.matrices(model.zero())
    held = [
        (int(n), k)
        for s in spec.model.supports
        if s.nodes != "all"
        for n in s.nodes
        for k in s.dofs
        if k in spec.model.dofs
    ]

    def release(node: int, kind: str) -> Model:
        supports = []
        for s in spec.model.supports:
            for n in [n.id for n in spec.model.nodes] if s.nodes == "all" else s.nodes:
                kept = tuple(k for k in s.dofs if (n, k) != (node, kind))
                supports += [s.model_copy(update={"nodes": (n,), "dofs": kept})] if kept else []
        freed = replace(spec, model=spec.model.model_copy(update={"supports": tuple(supports)}))
        return nuisance(undamped(build_model(freed)))

    return SearchContext(
        model,
        m.K,
        m.M,
        400.0,
        5.0,
        sensors,
        tuple(held),
        release,
        0.005,
        sensors,
        sensors[:1],
        sensors[:1],
        sensors[-1:],
    )
