"""Structure A: does the answer depend on the mesh? The plate is fitted again on 5 x 7 to 40 x 56
elements.

Every mesh is written as a problem file of its own and run through the public functions. The table
shows the nominal frequencies, the fitted parameters and the errors; the figure shows how they
settle. The order of close modes depends on the mesh (three lie near 200 Hz), so each measured mode
is paired with the model's mode of its family: (4, 1) has four nodal lines across the length and one
across the width, as `FAMILIES` says (problems/structure_a/source.md tells how they were found).
Where the middle of a short edge is not a node (5 elements along it), the string holds the two nodes
beside it, each with half its stiffness.
"""

import csv
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

import cvxupdate
from cvxupdate.fe.modes import model_modes

ROOT = Path(__file__).resolve().parents[2]
PROBLEM = ROOT / "problems" / "structure_a"
LENGTH, WIDTH = 0.665, 0.455
MESHES = ((7, 5), (14, 10), (28, 20), (56, 40))

FAMILIES = {
    29.6: (1, 1),
    32.5: (2, 0),
    66.6: (0, 2),
    67.7: (2, 1),
    84.5: (3, 0),
    93.9: (1, 2),
    124.7: (3, 1),
    140.4: (2, 2),
    175.2: (4, 0),
    182.6: (0, 3),
    202.9: (1, 3),
    209.5: (4, 1),
    210.9: (3, 2),
    259.1: (2, 3),
    287.8: (5, 0),
    301.7: (4, 2),
    319.9: (5, 1),
    339.7: (3, 3),
    360.4: (0, 4),
    376.9: (1, 4),
}
"""Measured frequency (Hz): nodal lines across the length and across the width."""
ROOTS = (0.0, 0.0, 4.730040744862704, 7.853204624095838, 10.995607838001671, 14.137165491257464)
"""β L of the free-free beam: cos βL cosh βL = 1."""

TEXT = """
title = "Structure A, {nx} x {ny} elements"

[model]
dofs = ["z", "rx", "ry"]
nodes = {{ file = "nodes.csv" }}

[model.materials.steel]
E = 206e9
nu = 0.3
rho = 7860.0

[model.sections.sheet]
shape = "plate"
thickness = 0.0025

[[model.elements]]
type = "plate"
mass = "consistent"
material = "steel"
section = "sheet"
rows = {{ file = "elements.csv" }}
{strings}
[[recordings]]
kind = "modes"
use = "fit"
name = "fitted"
file = "modes_fit.csv"

[[recordings]]
kind = "modes"
use = "hold-out"
name = "held out"
file = "modes_hold_out.csv"

[update]
method = "sensitivity"
parameters = [
{rows}
]
"""
RIGIDITIES = tuple(
    f'  {{ group = "plate", of = "{of}", lower = -0.25, upper = 0.25 }},'
    for of in ("Dx", "Dy", "D1", "Dxy")
)


def node_at(i, j, nx):
    """Number of the node at place (i, j) of the grid, rows along the length."""
    return 1 + i + j * (nx + 1)


def middle_of_short_edges(nx, ny):
    """The nodes that the two strings hold, and the share of a string on each."""
    rows = (ny // 2,) if ny % 2 == 0 else (ny // 2, ny // 2 + 1)
    return [node_at(i, j, nx) for i in (0, nx) for j in rows], 1.0 / len(rows)


def beam_shape(n, s):
    """Mode n of a free-free beam at s in 0 … 1: translation, rotation, then bending with n
    nodes."""
    if n < 2:
        return np.ones_like(s) if n == 0 else 2.0 * s - 1.0
    b = ROOTS[n]
    ratio = (np.cosh(b) - np.cos(b)) / (np.sinh(b) - np.sin(b))
    return np.cosh(b * s) + np.cos(b * s) - ratio * (np.sinh(b * s) + np.sin(b * s))


def family_numbers(path, families):
    """Number of the nominal model's flexible mode that is nearest (MAC) to each family, every mode
    used once."""
    _, model, _ = cvxupdate.open_problem(path)
    modes = model_modes(model, len(families), model.zero())
    shapes = modes.shapes[[k for k, label in enumerate(model.labels) if label.endswith(".z")]][
        :, modes.rigid :
    ]
    with open(path.parent / "nodes.csv", encoding="utf-8") as file:
        at = {
            int(row["id"]): (float(row["x"]) / LENGTH, float(row["y"]) / WIDTH)
            for row in csv.DictReader(file)
        }
    x, y = np.array([at[int(label[1:-2])] for label in model.labels if label.endswith(".z")]).T
    products = np.array([beam_shape(m, x) * beam_shape(n, y) for m, n in families]).T
    mac = (products.T @ shapes) ** 2 / np.outer(
        np.sum(products**2, axis=0), np.sum(shapes**2, axis=0)
    )
    return [int(k) + 1 for k in linear_sum_assignment(-mac)[1]]


def pair(path):
    """Write the modes of Table 9.1 beside a problem file, each paired with the mode of its
    family."""
    numbers = dict(zip(FAMILIES, family_numbers(path, list(FAMILIES.values())), strict=True))
    for name in ("modes_fit.csv", "modes_hold_out.csv"):
        with open(PROBLEM / name, encoding="utf-8") as file:
            rows = list(csv.DictReader(file))
        text = "".join(
            f"{row['frequency']},{row['damping']},{numbers[float(row['frequency'])]}\n"
            for row in rows
        )
        (path.parent / name).write_text("frequency,damping,mode\n" + text, encoding="utf-8")


def write_problem(folder, nx, ny, held, share):
    """A problem file with its tables; ``held`` nodes are on strings, each with ``share`` of one
    string's stiffness. Gives its path."""
    grid = [(i, j) for j in range(ny + 1) for i in range(nx + 1)]
    nodes = "".join(
        f"{node_at(i, j, nx)},{LENGTH * i / nx!r},{WIDTH * j / ny!r}\n" for i, j in grid
    )
    cells = [(i, j) for j in range(ny) for i in range(nx)]
    corners = [
        (node_at(i, j, nx), node_at(i + 1, j, nx), node_at(i + 1, j + 1, nx), node_at(i, j + 1, nx))
        for i, j in cells
    ]
    elements = "".join(
        f"{e},{a} {b} {c} {d},plate\n" for e, (a, b, c, d) in enumerate(corners, start=1)
    )
    rows, strings = list(RIGIDITIES), ""
    if held:
        springs = ", ".join(f"{{ id = {100000 + k}, nodes = [{n}] }}" for k, n in enumerate(held))
        strings = (
            '\n[[model.elements]]\ntype = "spring"\ndof = "z"\nk = 0.0\ngroup = "strings"\nrows '
            f"= [ {springs} ]\n"
        )
        rows.append(
            f'  {{ group = "strings", of = "k", lower = 0.0, upper = 0.5, scale = '
            f"{1e4 * share!r} }},"
        )
    folder.mkdir(parents=True, exist_ok=True)
    for name in ("modes_fit.csv", "modes_hold_out.csv"):
        (folder / name).write_text((PROBLEM / name).read_text(encoding="utf-8"), encoding="utf-8")
    (folder / "nodes.csv").write_text("id,x,y\n" + nodes, encoding="utf-8")
    (folder / "elements.csv").write_text("id,nodes,group\n" + elements, encoding="utf-8")
    path = folder / "problem.toml"
    path.write_text(
        TEXT.format(nx=nx, ny=ny, strings=strings, rows="\n".join(rows)), encoding="utf-8"
    )
    pair(path)
    return path


def study(meshes=MESHES):
    """One result for each mesh: {(nx, ny): (updated, share of a string on each spring)}."""
    out = {}
    with tempfile.TemporaryDirectory() as folder:
        for nx, ny in meshes:
            held, share = middle_of_short_edges(nx, ny)
            out[nx, ny] = (
                cvxupdate.run(write_problem(Path(folder) / f"{ny}x{nx}", nx, ny, held, share)),
                share,
            )
    return out


def values(updated, share):
    """Fitted parameters by name; the stiffness of a whole string, in N/m."""
    return {q.name: q.after / (share if q.of == "k" else 1.0) for q in updated.parameters}


def table(results):
    """The comparison as text."""
    lines = [
        "elements  mean error %  (before)  held out %  (before)      Dx      Dy      D1     "
        "Dxy  k of a string N/m  nominal f1, f2 ... f10 (Hz)"
    ]
    for (nx, ny), (updated, share) in results.items():
        fit, held = (
            updated.fit[key]["frequency_error_percent_mean"] for key in ("fit", "hold_out")
        )
        p = values(updated, share)
        nominal = sorted(m.before for m in updated.modes)[:10]
        lines.append(
            f"{ny:3d} x {nx:2d}  {fit['after']:12.3f}  {fit['before']:8.2f}  "
            f"{held['after']:10.3f}  {held['before']:8.2f}  {p['plate.Dx']:6.4f}  "
            f"{p['plate.Dy']:6.4f}  {p['plate.D1']:6.4f}  {p['plate.Dxy']:6.4f}  "
            f"{p['strings.k']:17.0f}  " + " ".join(f"{f:.1f}" for f in nominal)
        )
    return "\n".join(lines)


def figure(results, path):
    """Parameters with two standard deviations, and errors, against the size of an element."""
    from matplotlib.backends.backend_agg import FigureCanvasAgg
    from matplotlib.figure import Figure

    fig = Figure(figsize=(9, 3.8), layout="constrained")
    FigureCanvasAgg(fig)
    left, right = fig.subplots(1, 2)
    size = [1e3 * LENGTH / nx for nx, _ in results]
    for k, name in enumerate(("plate.Dx", "plate.Dy", "plate.D1", "plate.Dxy")):
        found = [next(q for q in u.parameters if q.name == name) for u, _ in results.values()]
        left.errorbar(
            size,
            [q.after for q in found],
            [2 * q.standard_deviation for q in found],
            marker="o",
            ms=4,
            capsize=3,
            color=f"C{k}",
            label=name[6:],
        )
    left.set(
        xlabel="length of an element (mm)",
        ylabel="factor on the isotropic rigidity",
        title="parameters, ± 2 standard deviations",
    )
    left.legend()
    for key, name in (("fit", "18 fitted modes"), ("hold_out", "2 held-out modes")):
        errors = [u.fit[key]["frequency_error_percent_mean"] for u, _ in results.values()]
        (line,) = right.plot(size, [e["after"] for e in errors], "o-", ms=4, label=f"{name}, after")
        right.plot(
            size,
            [e["before"] for e in errors],
            "o--",
            ms=4,
            mfc="none",
            color=line.get_color(),
            label=f"{name}, before",
        )
    right.set(xlabel="length of an element (mm)", ylabel="mean frequency error (%)", title="errors")
    right.legend(loc="center")
    right.set_ylim(bottom=0)
    for ax in (left, right):
        ax.grid(alpha=0.3)
        ax.set_xlim(left=0)
    fig.savefig(path, dpi=150)
    return path


def main(out, wish):
    """Fit on every mesh, print the table, write table and figure; gives the results."""
    results = study(MESHES[:2] if wish.quick else MESHES)
    text = table(results)
    (out / "table.txt").write_text(text + "\n", encoding="utf-8")
    print(text)
    print(figure(results, out / "mesh.png"))
    return results
