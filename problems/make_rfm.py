"""Writes the problems of thesis chapters 3 and 5: chain10_*, bay_* and plate_complex_*. Run it again to get the same files (seeds are fixed)."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE / "bay"))
import make as bay  # noqa: E402

CHAIN_M = (1.1, 0.9, 1.0, 1.2, 0.8, 1.0, 0.95, 1.05, 0.85, 1.15)
CHAIN_K = (3.9e5, 3.4e5, 3.6e5, 3.2e5, 3.8e5, 3.5e5, 3.3e5, 3.7e5, 3.4e5, 3.6e5, 3.1e5)
CHAIN_CHANGE = {"m": {1: 0.90, 4: 0.75, 7: 1.15}, "k": {3: 1.10, 5: 1.30, 9: 1.10}}
"""Factors on the experimental model's masses and springs (thesis 3.3)."""
CHAIN_POINTS = (20, 30, 60, 80, 90, 110, 120, 150, 170, 180)

PLATE = (0.25, 0.45, 0.001)
PLATE_E, PLATE_NU, PLATE_RHO, PLATE_ETA = 206e9, 0.3, 7860.0, 0.01
PLATE_HIGH = {"mass": (1, 6, 11, 16, 21, 26, 31, 36, 41), "stiffness": (3, 8, 13, 18, 23, 28, 33, 38, 43), "damping": (5, 10, 15, 20, 25, 30, 35, 40, 45)}
"""Elements whose matrix is 10 % high in the model (thesis 3.5.4), so p = 1/1.1 − 1."""

BOTH = ('parameters = [ { elements = "all", of = "stiffness", each = "element" }, { elements = "all", of = "mass", each = "element" } ]')


def chain_toml(experimental: bool = False) -> str:
    """The [model] of the chain: 10 masses, 11 springs, both ends held."""
    change = CHAIN_CHANGE if experimental else {"m": {}, "k": {}}
    m = [v * change["m"].get(i, 1.0) for i, v in enumerate(CHAIN_M, 1)]
    k = [v * change["k"].get(i, 1.0) for i, v in enumerate(CHAIN_K, 1)]
    nodes = ", ".join(f"{{ id = {i}, x = {i}.0 }}" for i in range(1, 11))
    ends = [[1], *([i, i + 1] for i in range(1, 10)), [10]]
    springs = ",\n".join(f"  {{ id = {i}, nodes = {e}, k = {v:.10g} }}" for i, (e, v) in enumerate(zip(ends, k, strict=True), 1))
    masses = ",\n".join(f"  {{ id = {100 + i}, nodes = [{i}], m = {v:.10g} }}" for i, v in enumerate(m, 1))
    return (f'[model]\ndofs = ["x"]\nnodes = [ {nodes} ]\n\n[[model.elements]]\ntype = "spring"\ndof = "x"\nrows = [\n{springs},\n]\n\n'
            f'[[model.elements]]\ntype = "mass"\nrows = [\n{masses},\n]\n')


def plate_toml(model: bool) -> str:
    """The [model] of the free plate, 5 x 9 elements of 60 nodes; ``model``: the erroneous one, else the uniform 'experiment'."""
    a, b, h = PLATE
    nodes = ",\n".join(f"  {{ id = {1 + i + 6 * j}, x = {a * i / 5:.10g}, y = {b * j / 9:.10g} }}" for j in range(10) for i in range(6))
    high = {i: kind for kind, some in PLATE_HIGH.items() for i in some} if model else {}
    rows = []
    for j in range(9):
        for i in range(5):
            e, n = 1 + i + 5 * j, 1 + i + 6 * j
            kind = high.get(e)
            rows.append(f"  {{ id = {e}, nodes = [{n}, {n + 1}, {n + 7}, {n + 6}]" + (f', material = "{kind}"' if kind else "") + " }")
    E, rho, eta = PLATE_E, PLATE_RHO, PLATE_ETA
    # D = eta K: an E that is 10 % high with eta/1.1 leaves D as it is.
    materials = {"steel": (E, rho, eta), "mass": (E, 1.1 * rho, eta), "stiffness": (1.1 * E, rho, eta / 1.1), "damping": (E, rho, 1.1 * eta)}
    text = "\n".join(f"[model.materials.{name}]\nE = {e:.10g}\nnu = {PLATE_NU}\nrho = {r:.10g}\neta = {t:.10g}\n" for name, (e, r, t) in materials.items()
                     if model or name == "steel")
    return (f'[model]\ndofs = ["z", "rx", "ry"]\nnodes = [\n{nodes},\n]\n\n{text}\n[model.sections.sheet]\nshape = "plate"\nthickness = {h}\n\n'
            f'[[model.elements]]\ntype = "plate"\nmaterial = "steel"\nsection = "sheet"\nrows = [\n' + ",\n".join(rows) + ",\n]\n")


def build(text: str):
    """The package's model of a [model] table."""
    import tempfile

    from cvxupdate.study import open_problem

    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return open_problem(path)[1]


def write(name: str, title: str, source: str, model: str, update: str, frequency, H, responses, references, notes: str, regularisation: str = "") -> None:
    """One problem folder: problem.toml, frf.npz, source.md."""
    folder = HERE / name
    folder.mkdir(exist_ok=True)
    text = (f'title = "{title}"\nsource = "{source}; simulated by problems/make_rfm.py, see source.md"\n\n{model}\n'
            f'[[recordings]]\nkind = "frf"\nname = "simulated FRFs"\nfile = "frf.npz"\nresponse = "displacement"\n\n'
            f'[update]\nmethod = "rfm"\n{update}\n{regularisation}')
    (folder / "problem.toml").write_text(text, encoding="utf-8")
    (folder / "source.md").write_text(f"# {title}\n\n{notes.strip()}\n", encoding="utf-8")
    bay.save_frf(folder / "frf.npz", frequency, H, responses, references)


def chains() -> None:
    """3.3: chain10_complete, chain10_incomplete, chain10_noisy."""
    real = build(chain_toml(True))
    every = [f"n{i}.x" for i in range(1, 11)]
    five = [f"n{i}.x" for i in (1, 4, 6, 7, 10)]
    note = """Thesis 3.3. Fig. 3.1 is lost: **the masses and springs are a reconstruction**, unequal so that nothing is symmetric, both ends held, natural
frequencies from 27 to 192 Hz. The 'experiment' has m1 −10 %, m4 −25 %, m7 +15 %, k3 +10 %, k5 +30 %, k9 +10 % (3.3), so these are the p-values.
Undamped receptances by dense inversion (`problems/bay/make.py`), one load case: a unit force at mass 1. """
    bounds = "\n[constraints]\nbounds = { lower = -0.6, upper = 0.6 }\n"
    complete = np.array(CHAIN_POINTS, dtype=float)
    write("chain10_complete", "Ten-DOF chain, all coordinates measured", "Thesis 3.3.1", chain_toml(),
          f'{BOTH}\nfrequency_points = "all"\n{bounds}', complete, bay.receptance(real, complete, every, ["n1.x"]), every, ["n1.x"],
          note + "All ten coordinates at the ten frequencies that 3.3.1 prints.")
    low = np.array([20.0, 24, 30, 36, 42, 48, 58, 63, 70, 80])
    write("chain10_incomplete", "Ten-DOF chain, five coordinates measured", "Thesis 3.3.2", chain_toml(),
          f'{BOTH}\nfrequency_points = "all"\ntrust_radius = 0.1\n{bounds}', low, bay.receptance(real, low, five, ["n1.x"]), five, ["n1.x"],
          note + "Coordinates 1, 4, 6, 7 and 10, ten points from 20 to 80 Hz (3.3.2 does not print which).")
    fine = np.arange(20.0, 200.5, 1.0)
    H = bay.noisy(bay.receptance(real, fine, five, ["n1.x"]), 0.10, seed=310)
    write("chain10_noisy", "Ten-DOF chain, five coordinates, 10 % noise", "Thesis 3.3.3", chain_toml(),
          f'{BOTH}\nfrequency_points = "between"\npoints = 25\nnoise = 0.0577\ntrust_radius = 0.1\n{bounds}', fine, H, five, ["n1.x"],
          note + "Coordinates 1, 4, 6, 7 and 10; every entry times 1 + 0.10 u, u uniform in [−1, 1] (3.27; standard deviation 0.10/√3), seed 310. 25 points.",
          '\n[regularisation]\nkind = "l1"\nweight = "discrepancy"\n')


if __name__ == "__main__":
    chains()
