"""A frame of three storeys on a shaking table, put together as a problem file, and what is recorded
there, by exact partition of the dynamic stiffness: no base, no big mass."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.fe.build import build_model
from cvxupdate.fe.responses import combined, matrices_with_damping
from cvxupdate.spec import read_text

Complex = NDArray[np.complex128]
HEIGHTS = (0.0, 0.42, 0.80, 1.15)
FEET, FLOORS = (1, 5), (2, 3, 4)
LUMPS = {2: 1.1, 6: 1.1, 3: 1.0, 7: 1.0, 4: 0.8, 8: 0.9}
DAMPING = '[model.damping]\nkind = "structural"\neta = 0.02\n'


def structure(softer: float = 1.0, held: str = '["x", "y", "rz"]') -> str:
    """[model] of the frame; ``softer`` is a factor on the columns of the second storey, ``held``
    what its feet are held in."""
    nodes = [(i + 1 + 4 * s, 0.5 * s, h) for s in (0, 1) for i, h in enumerate(HEIGHTS)]
    points = ", ".join(f"{{ id = {i}, x = {x}, y = {y} }}" for i, x, y in nodes)
    columns = ", ".join(
        f'{{ id = {2 * i + s + 1}, nodes = [{i + 1 + 4 * s}, {i + 2 + 4 * s}], group = "storey '
        f'{i + 1}", stiffness_factor = {softer if i == 1 else 1.0} }}'
        for i in range(3)
        for s in (0, 1)
    )
    floors = ", ".join(
        f'{{ id = {7 + i}, nodes = [{n}, {n + 4}], group = "floors" }}'
        for i, n in enumerate(FLOORS)
    )
    lumps = ", ".join(f"{{ id = {10 + n}, nodes = [{n}], m = {m} }}" for n, m in LUMPS.items())
    return f"""
[model]
dofs = ["x", "y", "rz"]
nodes = [{points}]
[model.materials.steel]
E = 2.05e11
rho = 7850.0
[model.sections.column]
shape = "rectangle"
width = 0.03
height = 0.0025
[model.sections.floor]
shape = "rectangle"
width = 0.10
height = 0.02
[[model.elements]]
type = "beam2d"
material = "steel"
section = "column"
rows = [{columns}]
[[model.elements]]
type = "beam2d"
material = "steel"
section = "floor"
rows = [{floors}]
[[model.elements]]
type = "mass"
rows = [{lumps}]
[[model.supports]]
nodes = {list(FEET)}
dofs = {held}
{DAMPING}"""


def tower(softer: float = 1.0, held: str = '["x", "y", "rz"]') -> str:
    """[model] of a mast with three platforms, two elements to a storey; ``softer`` and ``held`` as
    of `structure`."""
    points = ", ".join(f"{{ id = {i + 1}, x = 0.0, y = {0.2 * i} }}" for i in range(7))
    rows = ", ".join(
        f'{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], group = "storey {i // 2 + 1}", '
        f'material = "{"other" if i // 2 == 1 else "steel"}" }}'
        for i in range(6)
    )
    return f"""
[model]
dofs = ["x", "y", "rz"]
nodes = [{points}]
[model.materials.steel]
E = 2.05e11
rho = 7850.0
[model.materials.other]
E = {softer * 2.05e11}
rho = 7850.0
[model.sections.mast]
shape = "rectangle"
width = 0.04
height = 0.01
[[model.elements]]
type = "beam2d"
section = "mast"
rows = [{rows}]
[[model.elements]]
type = "mass"
rows = [{{ id = 13, nodes = [3], m = 1.1 }}, {{ id = 15, nodes = [5], m = 1.4 }}]
[[model.supports]]
nodes = [1]
dofs = {held}
{DAMPING}"""


def transmissibilities(
    s: Complex,
    softer: float = 1.0,
    text: Callable[[float, str], str] = structure,
    feet: Sequence[int] = FEET,
    floors: Sequence[int] = FLOORS,
) -> Complex:
    """Motion of the floors by that of the feet along x, (points, floors), at ``s`` (rad/s)."""
    free = build_model(read_text(text(softer, '["y", "rz"]'), "frame.toml"))
    moved = [free.place[f"n{n}.x"] for n in feet]
    rest = np.setdiff1d(np.arange(free.size), moved)
    seen = np.searchsorted(rest, [free.place[f"n{n}.x"] for n in floors])
    m = matrices_with_damping(free)
    out = []
    for point in s:
        Z = combined(m, point, True).toarray()
        carried = Z[np.ix_(rest, moved)].sum(axis=1)
        out.append(-np.linalg.solve(Z[np.ix_(rest, rest)], carried)[seen])
    return np.array(out)
