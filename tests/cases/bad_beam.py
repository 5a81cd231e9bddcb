"""The strangers' cantilever with one thing wrong: problem files and recordings, all derived from
one good recording.

A steel cantilever, 0.8 m, 40 x 8 mm, with 0.3 kg at node 13 that the model lacks; driven at node 9,
five accelerometers, 1 % of noise (tests/strangers/README.md).
"""

from __future__ import annotations

import gzip
from collections.abc import Callable
from pathlib import Path

import numpy as np

FOLDER = Path(__file__).parents[1] / "strangers" / "beam"
NODES = (5, 9, 13, 17, 21)

MODEL = """title = "Cantilever, steel 40 x 8 mm, 0.8 m"

[model]
dofs = ["y", "rz"]
nodes = { file = "nodes.csv" }
materials = { steel = { E = 210e9, rho = 7850 } }
sections = { bar = { shape = "rectangle", width = 0.008, height = 0.04 } }
supports = [{ nodes = [1], dofs = ["y", "rz"] }]
damping = { kind = "modal", zeta = 0.01 }

[[model.elements]]
type = "beam2d"
material = "steel"
section = "bar"
rows = { file = "beams.csv" }

[[recordings]]
kind = "frf"
response = "acceleration"
"""


def good_text() -> str:
    """The good table: frequency, re_5, im_5, ..., in m/s² per newton."""
    return gzip.decompress((FOLDER / "beam.csv.gz").read_bytes()).decode()


def good_table() -> np.ndarray:
    """The numbers of `good_text` (lines, 11)."""
    return np.loadtxt(good_text().splitlines()[1:], delimiter=",")


def csv_text(table: np.ndarray) -> str:
    """A table under the good table's header."""
    rows = "\n".join(",".join(f"{v:.8g}" for v in row) for row in table)
    return good_text().splitlines()[0] + "\n" + rows + "\n"


def channels(nodes: tuple[int, ...] = NODES, quantity: str = "acceleration", more: str = "") -> str:
    """The keys of a recording of the table, its columns at ``nodes``."""
    rows = "\n".join(
        f'  {{ column = "re_{n}", pair = "im_{n}", form = "real-imaginary", '
        f'quantity = "{quantity}", node = {at}, dof = "y"{more} }},'
        for n, at in zip(NODES, nodes, strict=True)
    )
    return (
        'frequency_column = "frequency"\nreferences = [{ node = 9, dof = "y" }]\n'
        f"channels = [\n{rows}\n]\n"
    )


def uff_text(table: np.ndarray, nodes: tuple[int, ...] = NODES, dofs: tuple[int, ...] = ()) -> str:
    """The same FRFs as a universal file, data sets 58 in text, response directions ``dofs``."""
    out = []
    for k, node in enumerate(nodes):
        dof = dofs[k] if dofs else 2
        head = [
            "    -1",
            "    58",
            *["FRF", "cantilever", "NONE", "NONE", "NONE"],
            f"    4         0    0         0       NONE{node:10d}{dof:4d}"
            f"       NONE{nodes[1]:10d}   2",
            f"         6{len(table):10d}         1{table[0, 0]:13.5e}"
            f"{table[1, 0] - table[0, 0]:13.5e}{0:13.5e}",
            "        18    0    0    0 Frequency            Hz",
            "        12    0    0    0 Acceleration         m/s^2",
            "        13    0    0    0 Force                N",
            "         0    0    0    0 NONE                 NONE",
        ]
        flat = table[:, 2 * k + 1 : 2 * k + 3].ravel()
        body = ["".join(f"{v:20.11e}" for v in flat[i : i + 4]) for i in range(0, len(flat), 4)]
        out += [*head, *body, "    -1"]
    return "\n".join(out) + "\n"


def write(
    folder: Path,
    recording: str,
    text: str,
    name: str = "beam.csv",
    change: Callable[[str], str] = str,
) -> Path:
    """A problem in ``folder``: the model as ``change`` leaves it, and one recording in the file
    ``name`` with the keys ``recording``."""
    for table in ("nodes.csv", "beams.csv"):
        (folder / table).write_bytes((FOLDER / table).read_bytes())
    (folder / name).write_text(text, encoding="utf-8")
    path = folder / "problem.toml"
    path.write_text(change(MODEL) + f'file = "{name}"\n' + recording, encoding="utf-8")
    return path
