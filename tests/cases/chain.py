"""A chain of four masses and a pinned bar, as problem files."""

from __future__ import annotations

from cvxupdate.fe.build import build_model
from cvxupdate.spec import load_problem

CHAIN = """
title = "Chain of four"
[model]
dofs = ["x"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 1.0 }, { id = 3, x = 2.0 }, { id = 4, x = 3.0 }]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{ id = 101, nodes = [1], k = 6.0e4, group = "spring 1" },
        { id = 102, nodes = [1, 2], k = 4.0e4, group = "spring 2" },
        { id = 103, nodes = [2, 3], k = 5.2e4, group = "spring 3" },
            { id = 104, nodes = [3, 4], k = 3.1e4, group = "spring 4" }]
[[model.elements]]
type = "mass"
rows = [{ id = 201, nodes = [1], m = 2.0, group = "floors" },
        { id = 202, nodes = [2], m = 1.4, group = "floors" },
        { id = 203, nodes = [3], m = 1.1, group = "floors" },
            { id = 204, nodes = [4], m = 1.7, group = "floors" }]
[model.damping]
kind = "modal"
zeta = 0.005
"""
BAR = """
title = "Pinned bar"
[model]
dofs = ["z", "ry"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.11 }, { id = 3, x = 0.23 }, { id = 4, x = 0.37 },
         { id = 5, x = 0.48 }, { id = 6, x = 0.6 }]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.04
height = 0.008
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [{ id = 1, nodes = [1, 2], group = "bar" }, { id = 2, nodes = [2, 3], group = "bar" },
        { id = 3, nodes = [3, 4], group = "bar" },
        { id = 4, nodes = [4, 5], group = "bar" }, { id = 5, nodes = [5, 6], group = "bar" }]
[[model.supports]]
nodes = [1, 6]
dofs = ["z"]
"""


def load(folder, text):
    """(spec, model) of a problem file's text; a recording that is never read stands in for those
    that tests make."""
    path = folder / "problem.toml"
    path.write_text(text, encoding="utf-8")
    spec = load_problem(path)
    return spec, build_model(spec)
