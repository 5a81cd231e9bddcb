"""What was done, in short words and numbers."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.fifteenth.analyst import Mesh
from validation.fifteenth.shapes import Case, Effect

WORDS = {
    "lump": "added_mass",
    "joint": "joint_flexibility",
    "member": "stiffness_change",
    "prop": "grounding_spring",
    "dashpot": "viscous_damper",
    "resonator": "attached_resonator",
    "foot": "grounding_spring",
    "cord": "grounding_spring",
    "shaker": "added_mass",
    "patch": "thickness_change",
    "edge": "grounding_spring",
    "spring": "stiffness_change",
    "soft_foot": "grounding_spring",
}
ALSO = {
    "foot": ["flexible_support", "joint_flexibility"],
    "cord": ["flexible_support"],
    "shaker": ["grounding_spring", "flexible_support", "attached_resonator"],
    "edge": ["flexible_support", "joint_flexibility"],
    "joint": ["grounding_spring", "flexible_support"],
}


def _where(e: Effect, case: Case, mesh: Mesh) -> tuple[list[int], list[int]]:
    """Nodes and elements of the analyst's model at an effect."""
    s = case.structure
    if e.kind == "member":
        ids = mesh.of_member[e.at]
        lo, hi = e.numbers.get("part", (0.0, 1.0))
        return [], [i for k, i in enumerate(ids) if lo - 1e-9 <= (k + 0.5) / len(ids) <= hi + 1e-9]
    if e.kind == "joint":
        m = next(m for m in s.members if m.name == e.at[0])
        ids = mesh.of_member[m.name]
        return [mesh.of_point[m.a if e.at[1] == "a" else m.b]], [
            ids[0] if e.at[1] == "a" else ids[-1]
        ]
    if e.kind == "patch":
        x0, x1, y0, y1 = e.at
        mid = {
            i: np.mean([mesh.nodes[n] for n in el[0]], axis=0) for i, el in mesh.elements.items()
        }
        return [], [i for i, c in mid.items() if x0 <= c[0] <= x1 and y0 <= c[1] <= y1]
    if e.kind == "edge":
        return mesh.edge(e.at), []
    if e.kind == "spring":
        return [], [e.at]
    return [mesh.nearest(e.at)], []


def _word(e: Effect) -> str:
    if e.kind == "member" and "height" in e.numbers:
        return "thickness_change"
    if e.kind == "member" and set(e.numbers) - {"part"} == {"mass"}:
        return "mass_change"
    return WORDS[e.kind]


def _entry(head: str, e: Effect, case: Case, mesh: Mesh) -> list[str]:
    nodes, elements = _where(e, case, mesh)
    near: list[int] = []
    if nodes and not isinstance(e.at, str) and e.kind not in ("joint", "edge"):
        x = mesh.position(e.at)
        by = sorted(mesh.nodes, key=lambda n: float(np.linalg.norm(np.array(mesh.nodes[n]) - x)))
        near = sorted(by[:3])
    groups = sorted({mesh.elements[i][1] for i in elements})
    numbers = ", ".join(
        f"{k} = {list(v) if isinstance(v, tuple) else v!r}"
        for k, v in e.numbers.items()
        if not isinstance(v, bool)
    )
    out = [
        f"[[{head}]]",
        f'physics = "{_word(e)}"',
        f'done = "{e.kind}"',
        f"nodes = {nodes}",
        f"elements = {elements}",
        f"groups = {groups}".replace("'", '"'),
    ]
    if near:
        out.append(f"accept_nodes = {near}")
    if e.kind in ALSO:
        out.append(f"also = {ALSO[e.kind]}".replace("'", '"'))
    return [*out, f'says = "{e.says}"', "parameters = { " + numbers.replace("'", '"') + " }", ""]


def _hz(v: Any) -> str:
    return "[" + ", ".join(f"{x:.4f}" for x in v) + "]"


def truth_text(
    case: Case,
    hz: dict[str, Any],
    shift: Any,
    change: float,
    scatter: dict[str, tuple[float, float]],
) -> str:
    """The truth file."""
    mesh = Mesh(case.structure)
    out = [
        f'case = "{case.name}"',
        f'kind = "{case.kind}"',
        f"null = {str(not case.concealed).lower()}",
        f"reference = {str(case.reference).lower()}",
        f'structure = "{case.title}"',
        f'rig_in_words = "{case.words}"',
        f"sensor_nodes = {[mesh.node(a, i) for a, i, _ in case.sensors]}",
        f"drive_nodes = {[mesh.node(a, i) for a, i, _ in case.drives]}",
        "",
        "[visibility]",
        f"relative_shift_by_effect = {_hz(shift)}    "
        "# of each mode of the rig alone, paired by shape",
        f"largest_in_sd = {np.abs(shift).max() / case.f_scatter:.1f}",
        f"response_change = {change:.3f}",
        f"model_Hz = {_hz(hz['model'])}",
        f"rig_only_Hz = {_hz(hz['rig_only'])}",
        f"real_Hz = {_hz(hz['real'])}",
        "",
    ]
    return "\n".join(out + _effects(case, mesh, scatter))


def _effects(case: Case, mesh: Mesh, scatter: dict[str, tuple[float, float]]) -> list[str]:
    """Concealed effects, then the rig."""
    out: list[str] = []
    for e in case.concealed:
        out += _entry("concealed", e, case, mesh)
    for e in case.rig:
        out += _entry("rig", e, case, mesh)
    if case.sensor_mass:
        out += [
            "[[rig]]",
            'physics = "sensor_mass"',
            'also = ["added_mass", "mass_change"]',
            'says = "each accelerometer"',
            f"parameters = {{ m = {case.sensor_mass} }}",
            "",
        ]
    if case.force_gain != 1.0:
        out += [
            "[[rig]]",
            'physics = "sensor_fault"',
            'says = "the force channel reads low (FRFs too large)"',
            f"parameters = {{ gain = {case.force_gain} }}",
            "",
        ]
    for g, (e, d) in scatter.items():
        out += [
            "[[rig]]",
            'physics = "stiffness_change"',
            'also = ["mass_change"]',
            f'groups = ["{g}"]',
            'says = "material off"',
            f"parameters = {{ stiffness = {e:.4f}, mass = {d:.4f} }}",
            "",
        ]
    if case.reference:
        out += [
            "[[rig]]",
            'physics = "stiffness_change"',
            'says = "drift between the two states: moduli, and damping"',
            "parameters = { stiffness = 0.9995, damping_scatter = 0.02 }",
            "",
        ]
    return out
