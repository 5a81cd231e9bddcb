"""A cantilever of nineteen elements with six lumps, and tables of its natural frequencies."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

MASS, NODES = 0.0127, (4, 7, 10, 13, 16, 19)  # kg; of the lumps
REPEATED = 0.003  # how well a frequency repeats from test to test
CLAMPED = '[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n'
SOFT = """[[model.elements]]
type = "spring"
dof = "z"
rows = [{{ id = 201, nodes = [1], k = {kz} }}]
[[model.elements]]
type = "spring"
dof = "ry"
rows = [{{ id = 202, nodes = [1], k = {kr} }}]
"""
TABLE = '[[recordings]]\nkind = "modes"\nuse = "fit"\n{state}rows = [{rows}]\n'


def cantilever(
    folder: Path,
    held: str = CLAMPED,
    lumps: Sequence[int] = NODES,
    tables: Sequence[tuple[str, np.ndarray]] = (),
) -> Path:
    """A problem file: ``held`` by a clamp or by springs, lumps at nodes, (state, frequencies in Hz)
    of each table."""
    nodes = ", ".join(f"{{ id = {i + 1}, x = {0.02 * i:.2f} }}" for i in range(20))
    bars = ", ".join(f'{{ id = {i}, nodes = [{i}, {i + 1}], group = "bar" }}' for i in range(1, 20))
    masses = ", ".join(
        f'{{ id = {100 + n}, nodes = [{n}], m = {MASS}, group = "masses" }}' for n in lumps
    )
    text = f"""title = "Six masses"
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.steel]
E = 200e9
nu = 0.3
rho = 7850.0
[model.sections.strip]
shape = "rectangle"
width = 0.025
height = 0.005
[[model.elements]]
type = "beam3d"
material = "steel"
section = "strip"
rows = [{bars}]
[[model.elements]]
type = "mass"
rows = [{masses}]
{held}"""
    for state, table in tables:
        rows = ", ".join(
            f"{{ frequency = {f:.6g}, frequency_std = {REPEATED * f:.3g}, mode = {k + 1} }}"
            for k, f in enumerate(table)
        )
        text += TABLE.format(state=f'state = "{state}"\n' if state else "", rows=rows)
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    return path
