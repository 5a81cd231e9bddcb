"""A cantilever of unequal spans as a problem file with tables of modes."""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.spec import load_problem

NODES = np.cumsum(
    [0.0, 0.03, 0.034, 0.028, 0.031, 0.036, 0.03, 0.033, 0.029, 0.035, 0.032, 0.03, 0.034]
)  # unequal spans
BAR = """
title = "Cantilever"
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.steel]
E = {E}
nu = 0.3
rho = 7850.0
[model.sections.strip]
shape = "rectangle"
width = 0.04
height = {height}
[[model.elements]]
type = "beam3d"
material = "steel"
section = "strip"
rows = [{elements}]
{extra}
[[model.supports]]
nodes = [1]
dofs = ["z", "ry"]
[[recordings]]
kind = "modes"
{table}
"""


def text(rows="{ frequency = 10.0 }", extra="", E="207e9", hold=""):
    nodes = ", ".join(f"{{ id = {i + 1}, x = {x:.6g} }}" for i, x in enumerate(NODES))
    elements = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "bar" }}'
        for i in range(len(NODES) - 1)
    )
    table = f"rows = [{rows}]\n{hold}"
    return BAR.format(nodes=nodes, elements=elements, height=0.006, extra=extra, E=E, table=table)


def load(folder, content):
    path = folder / "problem.toml"
    path.write_text(content, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)


def rows_of(f):
    return ", ".join(
        f"{{ frequency = {v:.8g}, frequency_std = {1e-3 * v:.3g}, mode = {i + 1} }}"
        for i, v in enumerate(f)
    )
