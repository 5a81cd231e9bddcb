"""The problems that `new` writes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.commands.new_parts import DAMPED, HEAD, MODEL, STEEL, Made, Mesh, recorded


def _beam() -> Made:
    mesh = Mesh()
    mesh.line([(0.05 * k, 0.0) for k in range(9)], "root")
    mesh.line([(0.05 * k, 0.0) for k in range(8, 17)], "tip")
    section = {"bar": {"shape": "rectangle", "width": 0.008, "height": 0.04}}
    block = {"type": "beam2d", "material": "steel", "section": "bar"}
    truth = mesh.tables(
        block,
        dofs=["y", "rz"],
        supports=[{"nodes": [1], "dofs": ["y", "rz"]}],
        materials=STEEL,
        sections=section,
        damping=DAMPED,
    )
    truth["elements"].append({"type": "mass", "rows": [{"id": 99, "nodes": [12], "m": 0.3}]})
    text = MODEL.format(
        dofs='["y", "rz"]',
        held="[1]",
        section="bar",
        shape='shape = "rectangle"\nwidth = 0.008                     # m, out of plane: along z\n'
        "height = 0.04",
        element="beam2d",
    )
    head = HEAD.format(
        kind="beam", changed="0.3 kg sit at node 12", title="Cantilever, steel 40 x 8 mm, 0.8 m"
    )
    sensors = ("n4.y", "n8.y", "n12.y", "n14.y", "n17.y")
    return Made(
        {"problem.toml": head + text + recorded("root", "tip"), **mesh.files()}, truth, sensors, 5
    )


def _frame() -> Made:
    mesh = Mesh()
    mesh.line([(0.0, 0.15 * k) for k in range(9)], "left column")
    mesh.line([(0.2 * k, 1.2) for k in range(9)], "beam")
    mesh.line([(1.6, 1.2 - 0.15 * k) for k in range(9)], "right column")
    last = mesh.nodes[-1][0]
    section = {"tube": {"shape": "general", "A": 6.84e-4, "Iz": 3.7141e-7}}
    block = {"type": "beam2d", "material": "steel", "section": "tube"}
    truth = mesh.tables(
        block,
        dofs=["x", "y", "rz"],
        supports=[
            {"nodes": [1], "dofs": ["x", "y", "rz"]},
            {"nodes": [last], "dofs": ["x", "y"]},
        ],
        materials=STEEL,
        sections=section,
        damping=DAMPED,
    )
    foot = {"id": 99, "nodes": [last], "k": 6.0e4}
    truth["elements"].append({"type": "spring", "dof": "rz", "rows": [foot]})
    text = MODEL.format(
        dofs='["x", "y", "rz"]',
        held=f"[1, {last}]",
        section="tube",
        shape='shape = "general"                 # RHS 60 x 60 x 3\n'
        "A = 6.84e-4                       # m²\nIz = 3.7141e-7                    # m⁴",
        element="beam2d",
    )
    head = HEAD.format(
        kind="frame",
        changed=f"the foot at node {last} gives way, with 60 kN·m/rad",
        title="Portal frame, RHS 60 x 60 x 3",
    )
    sensors = ("n4.x", "n9.x", "n11.y", "n13.y", "n15.y", "n20.x", "n22.x")
    return Made(
        {
            "problem.toml": head + text + recorded("left column", "beam", "right column"),
            **mesh.files(),
        },
        truth,
        sensors,
        6,
    )


FINER = 4
"""The plate of the recordings has that many elements along each of the model's: of a coarse mesh
they would have its error, which a diagnosis takes out of the model."""
ACROSS, ALONG, PITCH = 7, 9, 0.05
"""Nodes of the plate's model in both directions, and how far apart they are (m)."""


def _sheet(times: int) -> tuple[Mesh, list[int]]:
    """The plate's mesh with ``times`` elements along each of the model's, and the nodes of its
    clamped edge. Nodes of the model keep their numbers."""
    mesh, numbers = Mesh(), {}
    width, length = (ACROSS - 1) * times + 1, (ALONG - 1) * times + 1
    everywhere = [(j, i) for j in range(width) for i in range(length)]
    for j, i in sorted(everywhere, key=lambda at: at[0] % times + at[1] % times > 0):
        numbers[j, i] = len(mesh.nodes) + 1
        mesh.nodes.append((numbers[j, i], PITCH * i / times, PITCH * j / times))
    for j, i in ((j, i) for j, i in everywhere if j < width - 1 and i < length - 1):
        corners = tuple(numbers[at] for at in ((j, i), (j, i + 1), (j + 1, i + 1), (j + 1, i)))
        group = "clamped half" if i < (length - 1) // 2 else "free half"
        mesh.elements.append((len(mesh.elements) + 1, corners, group))
    return mesh, [numbers[j, 0] for j in range(width)]


def _plate() -> Made:
    mesh, held = _sheet(1)
    finer, held_finer = _sheet(FINER)
    section = {"sheet": {"shape": "plate", "thickness": 0.003}}
    block = {"type": "plate", "material": "steel", "section": "sheet"}
    truth = finer.tables(
        block,
        dofs=["z", "rx", "ry"],
        supports=[{"nodes": held_finer, "dofs": ["z", "rx", "ry"]}],
        materials=STEEL,
        sections=section,
        damping=DAMPED,
    )
    truth["elements"].append(
        {"type": "mass", "rows": [{"id": len(finer.elements) + 1, "nodes": [44], "m": 0.25}]}
    )
    text = MODEL.format(
        dofs='["z", "rx", "ry"]',
        held=str(held),
        section="sheet",
        shape='shape = "plate"\nthickness = 0.003                 # m',
        element="plate",
    )
    head = HEAD.format(
        kind="plate",
        changed="0.25 kg sit at node 44. They come from a mesh that is four times as\n"
        "# fine, so the error of this one stands between them, as it does in a real test",
        title="Steel plate, clamped along one edge",
    )
    sensors = ("n5.z", "n9.z", "n25.z", "n34.z", "n40.z", "n44.z", "n58.z", "n63.z")
    return Made(
        {
            "problem.toml": head
            + text
            + recorded("clamped half", "free half", example="9:+Z is node 9 along +z"),
            **mesh.files(),
        },
        truth,
        sensors,
        6,
    )


SPRINGS = (4.0e5, 3.0e5, 3.5e5, 2.0e5, 2.5e5)
STOREYS = tuple(f"storey {i}" for i in range(1, 6))
MASSES = (6.5, 5.0, 4.0, 4.5, 3.0)


def _chain_tables(springs: tuple[float, ...]) -> dict[str, Any]:
    rows = [
        {"id": i, "nodes": [i] if i == 1 else [i - 1, i], "k": k, "group": f"storey {i}"}
        for i, k in enumerate(springs, start=1)
    ]
    lumps = [{"id": 10 + i, "nodes": [i], "m": m} for i, m in enumerate(MASSES, start=1)]
    return {
        "dofs": ["x"],
        "damping": DAMPED,
        "nodes": [{"id": i, "x": 0.0, "z": 3.0 * i} for i in range(1, len(MASSES) + 1)],
        "elements": [
            {"type": "spring", "dof": "x", "rows": rows},
            {"type": "mass", "rows": lumps},
        ],
    }


def _weakened() -> tuple[float, ...]:
    return tuple(0.8 * k if i == 2 else k for i, k in enumerate(SPRINGS))


def _chain() -> Made:
    nodes = "".join(f"  {{ id = {i}, x = 0.0, z = {3.0 * i:g} }},\n" for i in range(1, 6))
    springs = "".join(
        f"  {{ id = {i}, nodes = {[i] if i == 1 else [i - 1, i]}, k = {k:g}, "
        f'group = "storey {i}" }},\n'
        for i, k in enumerate(SPRINGS, start=1)
    )
    lumps = "".join(
        f"  {{ id = {10 + i}, nodes = [{i}], m = {m:g} }},\n" for i, m in enumerate(MASSES, start=1)
    )
    text = (
        f'\n[model]\ndofs = ["x"]\ndamping = {{ kind = "modal", zeta = 0.01 }}\n'
        f"nodes = [\n{nodes}]\n\n"
        f'[[model.elements]]\ntype = "spring"                   # one node: to ground\ndof = "x"\n'
        f"rows = [\n{springs}]\n\n"
        f'[[model.elements]]\ntype = "mass"\nrows = [\n{lumps}]\n'
    )
    head = HEAD.format(
        kind="chain", changed="storey 3 has 0.8 of its stiffness", title="Five storeys"
    )
    sensors = tuple(f"n{i}.x" for i in range(1, 6))
    behind = recorded(*STOREYS, example="3:+X is node 3 along +x")
    return Made({"problem.toml": head + text + behind}, _chain_tables(_weakened()), sensors, 5)


def _matrices() -> Made:
    def stiffness(i: int) -> NDArray[np.float64]:
        out = np.zeros((len(SPRINGS), len(SPRINGS)))
        out[i, i] = SPRINGS[i]
        if i:
            out[i - 1, i - 1] = SPRINGS[i]
            out[i - 1, i] = out[i, i - 1] = -SPRINGS[i]
        return out

    matrices = {f"K{i + 1}.mtx": stiffness(i) for i in range(len(SPRINGS))}
    matrices["M.mtx"] = np.diag(MASSES)
    rows = "".join(
        f'  {{ id = {i}, stiffness = "K{i}.mtx", group = "storey {i}" }},\n' for i in range(1, 6)
    )
    text = (
        '\n[model]\ndofs = ["x"]                      # row i of a matrix is node i along x\n'
        'damping = { kind = "modal", zeta = 0.01 }\n\n'
        f'[[model.elements]]\ntype = "matrix"\nrows = [\n{rows}  {{ id = 9, mass = "M.mtx" }},\n]\n'
        '\n[[recordings]]\nkind = "frf"\nfile = "frf.npz"                  # frequency, H, '
        'response_node …\nresponse = "acceleration"\n'
        '\n[update]\nmethod = "rfm"\nresidual = "receptance"\nfrequency_points = "all"\n'
        "parameters = [\n"
        '  { groups = STOREYS, of = "stiffness", each = "group", lower = -0.5, upper = 0.5 },\n]\n'
    )
    head = HEAD.format(
        kind="matrices",
        changed="storey 3 has 0.8 of its stiffness",
        title="Five storeys, as matrices of another program",
    )
    sensors = tuple(f"n{i}.x" for i in range(1, 6))
    text = text.replace("STOREYS", str(list(STOREYS)).replace("'", '"'))
    return Made({"problem.toml": head + text}, _chain_tables(_weakened()), sensors, 5, matrices)


KINDS: dict[str, Callable[[], Made]] = {
    "beam": _beam,
    "frame": _frame,
    "plate": _plate,
    "matrices": _matrices,
    "chain": _chain,
}
"""What `new` makes, by its name on the command line."""
