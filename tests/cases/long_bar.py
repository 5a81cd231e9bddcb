"""A cantilever of many elements, too large for every DOF to be looked at each time."""

from __future__ import annotations


def text(elements: int, rows: str = "{ frequency = 10.0 }", extra: str = "") -> str:
    """A problem file: a bar of a metre in two groups of unequal lengths, with a table of modes."""
    nodes = ", ".join(f"{{ id = {i + 1}, x = {i / elements:.8g} }}" for i in range(elements + 1))
    first = 2 * elements // 5
    group = ["root"] * first + ["tip"] * (elements - first)
    parts = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "{group[i]}" }}'
        for i in range(elements)
    )
    return f"""
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.steel]
E = 207e9
rho = 7850.0
[model.sections.strip]
shape = "rectangle"
width = 0.04
height = 0.012
[[model.elements]]
type = "beam3d"
material = "steel"
section = "strip"
rows = [{parts}]
{extra}
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
[[recordings]]
kind = "modes"
{rows}
"""
