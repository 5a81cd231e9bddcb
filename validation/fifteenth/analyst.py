"""The model of the drawing: its mesh, numbers and TOML."""

from __future__ import annotations

from typing import Any

import numpy as np

from validation.fifteenth.shapes import Case, Structure

LOSS = 0.01


class Mesh:
    """Node and element numbers of the analyst's model."""

    def __init__(self, s: Structure) -> None:
        self.s = s
        self.nodes: dict[int, tuple[float, float, float]] = {}
        self.elements: dict[int, tuple[list[int], str, str]] = {}  # nodes, group, section name
        self.of_point: dict[str, int] = {}
        self.inner: dict[Any, int] = {}
        self.of_member: dict[str, list[int]] = {}
        (self._plate if s.plate else self._chain if s.chain else self._frame)()

    def _frame(self) -> None:
        s = self.s
        for p, c in s.points.items():
            self.of_point[p] = len(self.nodes) + 1
            self.nodes[len(self.nodes) + 1] = c
        for m in s.members:
            a, b = (np.array(s.points[p]) for p in (m.a, m.b))
            self.inner[m.name, 0], self.inner[m.name, m.n] = self.of_point[m.a], self.of_point[m.b]
            for i in range(1, m.n):
                self.inner[m.name, i] = len(self.nodes) + 1
                self.nodes[len(self.nodes) + 1] = tuple(np.round(a + (b - a) * i / m.n, 6).tolist())
            self.of_member[m.name] = []
            for i in range(m.n):
                e = len(self.elements) + 1
                self.elements[e] = (
                    [self.inner[m.name, i], self.inner[m.name, i + 1]],
                    m.group,
                    m.name,
                )
                self.of_member[m.name].append(e)

    def _plate(self) -> None:
        p = self.s.plate
        assert p
        for i in range(p.nx + 1):
            for j in range(p.ny + 1):
                n = self.inner[i, j] = len(self.nodes) + 1
                self.nodes[n] = (round(p.a * i / p.nx, 6), round(p.b * j / p.ny, 6), 0.0)
        for i in range(p.nx):
            for j in range(p.ny):
                corners = [self.inner[c] for c in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))]
                self.elements[len(self.elements) + 1] = (corners, "plate", "plate")

    def _chain(self) -> None:
        chain = self.s.chain
        assert chain
        for i in range(len(chain.carts)):
            self.inner[i + 1, 0] = i + 1
            self.nodes[i + 1] = (round(0.3 * (i + 1), 3), 0.0, 0.0)
        for i in range(len(chain.springs)):
            self.elements[i + 1] = ([i, i + 1] if i else [1], "springs", "")

    def node(self, a: Any, b: Any) -> int:
        """Number of a station."""
        return self.inner[a, 0] if self.s.chain else self.inner[a, b]

    def position(self, at: Any) -> np.ndarray:
        """Coordinates of a place."""
        s = self.s
        if isinstance(at, str):
            return np.array(s.points[at])
        if s.chain:
            return np.array(self.nodes[at])
        if s.plate:
            return np.array([at[0], at[1], 0.0])
        m = next(m for m in s.members if m.name == at[0])
        a, b = (np.array(s.points[p]) for p in (m.a, m.b))
        return a + (b - a) * at[1]

    def nearest(self, at: Any) -> int:
        """The node nearest to a place."""
        x = self.position(at)
        return min(self.nodes, key=lambda n: float(np.linalg.norm(np.array(self.nodes[n]) - x)))

    def edge(self, name: str) -> list[int]:
        """Nodes of a plate's edge."""
        p = self.s.plate
        assert p
        line = {
            "left": [(0, j) for j in range(p.ny + 1)],
            "right": [(p.nx, j) for j in range(p.ny + 1)],
            "bottom": [(i, 0) for i in range(p.nx + 1)],
            "top": [(i, p.ny) for i in range(p.nx + 1)],
        }[name]
        return [self.inner[c] for c in line]


def _quoted(names: tuple[str, ...]) -> str:
    return "[" + ", ".join(f'"{n}"' for n in names) + "]"


def _materials(s: Structure) -> list[str]:
    out = []
    mats = {m.material.name: m.material for m in s.members}
    if s.plate:
        mats[s.plate.material.name] = s.plate.material
    for m in mats.values():
        out += [f"[model.materials.{m.name}]", f"E = {m.E}", f"nu = {m.nu}", f"rho = {m.rho}", ""]
    return out


def _frame_blocks(s: Structure, mesh: Mesh) -> list[str]:
    out, sections = [], {}
    for m in s.members:
        sections.setdefault(m.section, f"sec{len(sections) + 1}")
    for sec, name in sections.items():
        out += [f"[model.sections.{name}]", sec.toml(), ""]
    kind = "beam3d" if len(s.dofs) == 6 else "beam2d"
    out += ["[[model.elements]]", f'type = "{kind}"', "rows = ["]
    by_name = {m.name: m for m in s.members}
    for e, (nodes, group, member) in mesh.elements.items():
        m = by_name[member]
        out.append(
            f'  {{ id = {e}, nodes = {nodes}, material = "{m.material.name}", '
            f'section = "{sections[m.section]}", group = "{group}" }},'
        )
    out += ["]", ""]
    if s.lumps:
        out += ["[[model.elements]]", 'type = "mass"', "rows = ["]
        for i, (p, m) in enumerate(s.lumps.items()):
            size = (m / 7850) ** (1 / 3)
            j = round(m * size**2 / 6, 6)
            turn = f", Ixx = {j}, Iyy = {j}, Izz = {j}" if len(s.dofs) == 6 else f", Iyy = {j}"
            out.append(
                f"  {{ id = {900 + i}, nodes = [{mesh.of_point[p]}], "
                f'm = {m}{turn}, group = "carried" }},'
            )
        out += ["]", ""]
    for p, dofs in s.held.items():
        held = tuple(d for d in dofs if d in s.dofs)
        out += [
            "[[model.supports]]",
            f"nodes = [{mesh.of_point[p]}]",
            f"dofs = {_quoted(held)}",
            "",
        ]
    return out


def _plate_blocks(s: Structure, mesh: Mesh) -> list[str]:
    p = s.plate
    assert p
    out = [
        "[model.sections.sheet]",
        'shape = "plate"',
        f"thickness = {p.t}",
        "",
        "[[model.elements]]",
        'type = "plate"',
        f'material = "{p.material.name}"',
        'section = "sheet"',
        'group = "plate"',
        "rows = [",
    ]
    out += [f"  {{ id = {e}, nodes = {nodes} }}," for e, (nodes, _, _) in mesh.elements.items()]
    out += ["]", ""]
    for edge in p.clamped:
        out += ["[[model.supports]]", f"nodes = {mesh.edge(edge)}", 'dofs = ["z", "rx", "ry"]', ""]
    return out


def _chain_blocks(s: Structure, mesh: Mesh) -> list[str]:
    c = s.chain
    assert c
    out = ["[[model.elements]]", 'type = "spring"', 'dof = "x"', "rows = ["]
    out += [
        f'  {{ id = {i + 1}, nodes = {mesh.elements[i + 1][0]}, k = {k}, group = "springs" }},'
        for i, k in enumerate(c.springs)
    ]
    out += ["]", "", "[[model.elements]]", 'type = "mass"', "rows = ["]
    out += [
        f'  {{ id = {101 + i}, nodes = [{i + 1}], m = {m}, group = "carts" }},'
        for i, m in enumerate(c.carts)
    ]
    return [*out, "]", ""]


def model_text(case: Case, mesh: Mesh) -> str:
    """Head and [model] of the problem file."""
    s = case.structure
    out = [
        f'title = "{case.title}"',
        'source = "drawing; nominal materials"',
        "",
        "[model]",
        f"dofs = {_quoted(s.dofs)}",
        "nodes = [",
    ]
    out += [f"  {{ id = {n}, x = {x}, y = {y}, z = {z} }}," for n, (x, y, z) in mesh.nodes.items()]
    out += ["]", "", *_materials(s)]
    out += (
        _plate_blocks(s, mesh)
        if s.plate
        else _chain_blocks(s, mesh)
        if s.chain
        else _frame_blocks(s, mesh)
    )
    out += ["[model.damping]", 'kind = "structural"', f"eta = {LOSS}", ""]
    return "\n".join(out)


def update_text(case: Case) -> str:
    """What the analyst holds for uncertain: moduli and densities of the groups, to 2 %."""
    s = case.structure
    if s.chain:
        rows = [
            '{ group = "springs", of = "stiffness", each = "element" }',
            '{ group = "carts", of = "mass" }',
        ]
    else:
        groups = ["plate"] if s.plate else sorted({m.group for m in s.members})
        rows = [f'{{ group = "{g}", of = "{of}" }}' for g in groups for of in ("E", "rho")]
    method = "rfm" if case.kind == "frf" else "sensitivity"
    return "\n".join(
        [
            "[update]",
            f'method = "{method}"',
            "parameters = [",
            *(f"  {r}," for r in rows),
            "]",
            "",
            "[regularisation]",
            'kind = "prior"',
            "deviation = 0.02",
            "",
        ]
    )
