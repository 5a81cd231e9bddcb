"""The simulated target of problems/real/smu-modal-data/problem_concrete_frame.toml: its first modes
at the published sensors, from the matrices of the data set (CVXUPDATE_DATA).

python -m validation.make_concrete_frame   (prints the rows and the channels)
"""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from cvxupdate.fe.build import build_model
from cvxupdate.fe.elements.matrix import read_matrix
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem

FOLDER = Path(__file__).resolve().parents[1] / "problems/real/smu-modal-data"
ALPHA = (-0.1, 0.2, 0.2, -0.05, 0.2, 0.15, 0.15, 0.10, -0.10, -0.15, 0.20, 0.15)
"""The published answer, on E_1 … E_12."""
MODES = 3


def main() -> None:
    """Print the rows of the table, each shape divided by its largest entry, and its channels."""
    model = build_model(load_problem(FOLDER / "problem_concrete_frame.toml"))
    data = Path(os.environ["CVXUPDATE_DATA"]) / "smu-modal-data/ConcreteBuildingFrame.mat"
    nodes = np.asarray(read_matrix(data, "measDOFs").toarray(), dtype=int).reshape(-1)
    places = [model.place[f"n{node}.x"] for node in nodes.tolist()]
    modes = model_modes(model, MODES, np.array(ALPHA))
    print("rows = [")
    for k in range(MODES):
        shape = modes.shapes[places, k]
        shape = shape / shape[np.argmax(np.abs(shape))]
        frequency = float(modes.frequencies[k])
        print(f"  {{ frequency = {frequency!r}, shape = {[float(v) for v in shape]!r} }},")
    print("]\nchannels = [")
    for column, node in enumerate(nodes.tolist()):
        print(f'  {{ column = {column}, quantity = "displacement", node = {node}, dof = "x" }},')
    print("]")


if __name__ == "__main__":
    main()
