# ruff: noqa: E501 - the notes are prose for source.md
"""Writes the problems of chapters 3 and 5: problems/chain10, bay and plate_complex.
``python -m validation.make_rfm`` again gives the same files (seeds are fixed)."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from validation import make_bay as bay

PROBLEMS = Path(__file__).resolve().parents[1] / "problems"

CHAIN_M = (1.1, 0.9, 1.0, 1.2, 0.8, 1.0, 0.95, 1.05, 0.85, 1.15)
CHAIN_K = (3.9e5, 3.4e5, 3.6e5, 3.2e5, 3.8e5, 3.5e5, 3.3e5, 3.7e5, 3.4e5, 3.6e5, 3.1e5)
CHAIN_CHANGE = {"m": {1: 0.90, 4: 0.75, 7: 1.15}, "k": {3: 1.10, 5: 1.30, 9: 1.10}}
"""Factors on the experimental model's masses and springs (section 3.3)."""
CHAIN_POINTS = (20, 30, 60, 80, 90, 110, 120, 150, 170, 180)

PLATE = (0.25, 0.45, 0.001)
PLATE_E, PLATE_NU, PLATE_RHO, PLATE_ETA = 206e9, 0.3, 7860.0, 0.01
PLATE_HIGH = {
    "mass": (1, 6, 11, 16, 21, 26, 31, 36, 41),
    "stiffness": (3, 8, 13, 18, 23, 28, 33, 38, 43),
    "damping": (5, 10, 15, 20, 25, 30, 35, 40, 45),
}
"""Elements whose matrix is 10 % high in the model (section 3.5.4), so p = 1/1.1 − 1."""

BOTH = (
    'parameters = [ { elements = "all", of = "stiffness", each = "element" }, { elements = '
    '"all", of = "mass", each = "element" } ]'
)


def chain_toml(experimental: bool = False) -> str:
    """The [model] of the chain: 10 masses, 11 springs, both ends held."""
    change = CHAIN_CHANGE if experimental else {"m": {}, "k": {}}
    m = [v * change["m"].get(i, 1.0) for i, v in enumerate(CHAIN_M, 1)]
    k = [v * change["k"].get(i, 1.0) for i, v in enumerate(CHAIN_K, 1)]
    nodes = ", ".join(f"{{ id = {i}, x = {i}.0 }}" for i in range(1, 11))
    ends = [[1], *([i, i + 1] for i in range(1, 10)), [10]]
    springs = ",\n".join(
        f"  {{ id = {i}, nodes = {e}, k = {v:.10g} }}"
        for i, (e, v) in enumerate(zip(ends, k, strict=True), 1)
    )
    masses = ",\n".join(
        f"  {{ id = {100 + i}, nodes = [{i}], m = {v:.10g} }}" for i, v in enumerate(m, 1)
    )
    return (
        f'[model]\ndofs = ["x"]\nnodes = [ {nodes} ]\n\n[[model.elements]]\ntype = '
        f'"spring"\ndof = "x"\nrows = [\n{springs},\n]\n\n[[model.elements]]\ntype = '
        f'"mass"\nrows = [\n{masses},\n]\n'
    )


def plate_toml(model: bool) -> str:
    """The [model] of the free plate, 5 x 9 elements of 60 nodes; ``model``: the erroneous one, else
    the uniform 'experiment'."""
    a, b, h = PLATE
    nodes = ",\n".join(
        f"  {{ id = {1 + i + 6 * j}, x = {a * i / 5:.10g}, y = {b * j / 9:.10g} }}"
        for j in range(10)
        for i in range(6)
    )
    high = {i: kind for kind, some in PLATE_HIGH.items() for i in some} if model else {}
    rows = []
    for j in range(9):
        for i in range(5):
            e, n = 1 + i + 5 * j, 1 + i + 6 * j
            kind = high.get(e)
            rows.append(
                f"  {{ id = {e}, nodes = [{n}, {n + 1}, {n + 7}, {n + 6}]"
                + (f', material = "{kind}"' if kind else "")
                + " }"
            )
    E, rho, eta = PLATE_E, PLATE_RHO, PLATE_ETA
    # D = eta K: an E that is 10 % high with eta/1.1 leaves D as it is.
    materials = {
        "steel": (E, rho, eta),
        "mass": (E, 1.1 * rho, eta),
        "stiffness": (1.1 * E, rho, eta / 1.1),
        "damping": (E, rho, 1.1 * eta),
    }
    text = "\n".join(
        f"[model.materials.{name}]\nE = {e:.10g}\nnu = {PLATE_NU}\nrho = {r:.10g}\neta = {t:.10g}\n"
        for name, (e, r, t) in materials.items()
        if model or name == "steel"
    )
    return (
        '[model]\ndofs = ["z", "rx", "ry"]\nnodes = '
        f'[\n{nodes},\n]\n\n{text}\n[model.sections.sheet]\nshape = "plate"\nthickness = '
        f'{h}\n\n[[model.elements]]\ntype = "plate"\nmaterial = "steel"\nsection = '
        '"sheet"\nrows = [\n' + ",\n".join(rows) + ",\n]\n"
    )


def build(text: str):
    """The package's model of a [model] table."""
    import tempfile

    from cvxupdate.study import open_problem

    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return open_problem(path)[1]


SHARED = '[model]\ninclude = "../model.toml"\n'
"""The [model] of a problem whose study has one model."""


def share(study: str, model: str) -> None:
    """Write the model of a study."""
    folder = PROBLEMS / study
    folder.mkdir(exist_ok=True)
    (folder / "model.toml").write_text(model, encoding="utf-8")


def write(
    name: str,
    title: str,
    source: str,
    model: str,
    update: str,
    frequency,
    H,
    responses,
    references,
    notes: str,
    regularisation: str = "",
) -> None:
    """One problem folder: problem.toml, frf.npz, source.md."""
    folder = PROBLEMS / name
    folder.mkdir(exist_ok=True)
    text = (
        f'title = "{title}"\nsource = "{source}; simulated by validation/make_rfm.py, see '
        f'source.md"\n\n{model}\n[[recordings]]\nkind = "frf"\nname = "simulated FRFs"\nfile '
        '= "frf.npz"\nresponse = "displacement"\n\n[update]\nmethod = '
        f'"rfm"\n{update}\n{regularisation}'
    )
    (folder / "problem.toml").write_text(text, encoding="utf-8")
    (folder / "source.md").write_text(f"# {title}\n\n{notes.strip()}\n", encoding="utf-8")
    bay.save_frf(folder / "frf.npz", frequency, H, responses, references)


def chains() -> None:
    """3.3: chain10/{complete,incomplete,noisy}."""
    share("chain10", chain_toml())
    real = build(chain_toml(True))
    every = [f"n{i}.x" for i in range(1, 11)]
    five = [f"n{i}.x" for i in (1, 4, 6, 7, 10)]
    note = """Section 3.3. Fig. 3.1 is lost: **the masses and springs are a reconstruction**, unequal so that nothing is symmetric, both ends held, natural
frequencies from 27 to 192 Hz. The 'experiment' has m1 −10 %, m4 −25 %, m7 +15 %, k3 +10 %, k5 +30 %, k9 +10 % (3.3), so these are the p-values.
Undamped receptances by dense inversion (`validation/make_bay.py`), one load case: a unit force at mass 1. """
    bounds = "\n[constraints]\nbounds = { lower = -0.6, upper = 0.6 }\n"
    complete = np.array(CHAIN_POINTS, dtype=float)
    write(
        "chain10/complete",
        "Ten-DOF chain, all coordinates measured",
        "Thesis 3.3.1",
        SHARED,
        f'{BOTH}\nfrequency_points = "all"\n{bounds}',
        complete,
        bay.receptance(real, complete, every, ["n1.x"]),
        every,
        ["n1.x"],
        note + "All ten coordinates at the ten frequencies that 3.3.1 prints.",
    )
    low = np.array([20.0, 24, 30, 36, 42, 48, 58, 63, 70, 80])
    write(
        "chain10/incomplete",
        "Ten-DOF chain, five coordinates measured",
        "Thesis 3.3.2",
        SHARED,
        f'{BOTH}\nfrequency_points = "all"\ntrust_radius = 0.1\n{bounds}',
        low,
        bay.receptance(real, low, five, ["n1.x"]),
        five,
        ["n1.x"],
        note + "Coordinates 1, 4, 6, 7 and 10, ten points from 20 to 80 Hz (3.3.2 does not print "
        "which).",
    )
    fine = np.arange(20.0, 200.5, 1.0)
    H = bay.noisy(bay.receptance(real, fine, five, ["n1.x"]), 0.10, seed=310)
    write(
        "chain10/noisy",
        "Ten-DOF chain, five coordinates, 10 % noise",
        "Thesis 3.3.3",
        SHARED,
        f'{BOTH}\nfrequency_points = "between"\npoints = 25\nnoise = 0.0577\ntrust_radius = '
        f"0.1\n{bounds}",
        fine,
        H,
        five,
        ["n1.x"],
        note + "Coordinates 1, 4, 6, 7 and 10; every entry times 1 + 0.10 u, u uniform in [−1, 1] "
        "(3.27; standard deviation 0.10/√3), seed 310. 25 points.",
        '\n[regularisation]\nkind = "l1"\nweight = "discrepancy"\n',
    )


BAY = """Section {section}. The structure is `problems/bay` (its geometry is a **reconstruction** of the lost Fig. 3.7; see `problems/bay/source.md`).
{what} Receptances by dense inversion (`validation/make_bay.py`), undamped{but}.
"""
TEN_POINTS = (20.0, 30.0, 43.5, 66.0, 75.0, 90.0, 117.0, 124.0, 145.0, 160.0)
PUBLISHED = (135.0, 155.0, 180.0, 210.0, 230.0, 257.0, 280.0, 300.0, 310.0, 325.0)
"""The source's ten optimum points (5.5), those of its own geometry."""
TRUE_FE1 = (
    "The ten elements whose E is 8 % high need the factor 1/1.08: p = −0.0741 of their "
    "stiffness, every other p is 0."
)
BOUNDS = "\n[constraints]\nbounds = { lower = -0.5, upper = 0.5 }\n"
ALL_LINES = f'{BOTH}\nfrequency_points = "all"\ntrust_radius = 0.1\n{BOUNDS}'


def bays() -> None:
    """3.4 and 5.5: bay/fe1_x1_{complete,incomplete,noisy}, fe2_x1, fe1_x2, accuracy."""
    real = bay.build("X1")
    ten, corner = list(bay.TEN), ["n1.x", "n1.y", "n1.z"]
    spread = np.array([30.0, 70, 120, 145, 190, 240, 281, 300, 330, 380])
    write(
        "bay/fe1_x1_complete",
        "Bay structure, FE1 against X1, all 114 coordinates",
        "Thesis 3.4.1",
        bay.including("FE1"),
        ALL_LINES,
        spread,
        bay.receptance(real, spread, real.labels, ["n1.z"]),
        real.labels,
        ["n1.z"],
        BAY.format(
            section="3.4.1, first case",
            what="Model FE1, all rotations and translations of X1 under a force at node 1 along "
            "z, ten lines. " + TRUE_FE1,
            but=", free of noise",
        ),
    )
    points = np.array(TEN_POINTS)
    write(
        "bay/fe1_x1_incomplete",
        "Bay structure, FE1 against X1, ten coordinates",
        "Thesis 3.4.1",
        bay.including("FE1"),
        ALL_LINES,
        points,
        bay.receptance(real, points, ten, corner),
        ten,
        corner,
        BAY.format(
            section="3.4.1, second case",
            what="Model FE1; x, y, z at node 1 and z at nodes 5, 7, 9, 11, 13, 15, 18 under "
            "forces at node 1 along x, y and z, ten lines of our choice between 20 and 160 "
            "Hz (the source does not print its own). " + TRUE_FE1,
            but=", free of noise",
        ),
    )
    fine = np.arange(10.0, 400.5, 1.0)
    exact = bay.receptance(real, fine, ten, corner)
    write(
        "bay/fe1_x1_noisy",
        "Bay structure, FE1 against X1, ten coordinates, 0.5 % noise",
        "Thesis 3.4.2",
        bay.including("FE1"),
        f'{BOTH}\nfrequency_points = "between"\npoints = 40\nnoise = 0.00289\ntrust_radius = '
        f"0.1\n{BOUNDS}",
        fine,
        bay.noisy(exact, 0.005, seed=342),
        ten,
        corner,
        BAY.format(
            section="3.4.2",
            what="As fe1_x1_incomplete, 10 to 400 Hz in steps of 1 Hz, every entry times 1 + "
            "0.005 u with u uniform in [−1, 1] (3.27; standard deviation 0.005/√3), seed "
            "342. " + TRUE_FE1,
            but="",
        ),
    )
    write(
        "bay/fe2_x1",
        "Bay structure, FE2 against X1",
        "Thesis 3.4.3",
        bay.including("FE2"),
        f'parameters = [ {{ elements = "all", of = "I", each = "element" }}, {{ elements = '
        f'"all", of = "rho", each = "element" }} ]\nfrequency_points = "all"\ntrust_radius = '
        f"0.1\n{BOUNDS}",
        points,
        bay.receptance(real, points, ten, corner),
        ten,
        corner,
        BAY.format(
            section="3.4.3",
            what="Model FE2: Iy and Iz of eight elements 30 % high, in K and in M. The source's "
            "p-values (one factor on K, one on M of each element) cannot say that; here the "
            "parameters are the second moments and the density themselves, so the answer is "
            "p = 1/1.3 − 1 = −0.2308 for the I of elements 2, 4, 8, 10, 12, 15, 17, 20.",
            but=", free of noise",
        ),
    )
    twice = bay.build("X2")
    low = np.arange(5.0, 250.5, 2.5)
    write(
        "bay/fe1_x2",
        "Bay structure, FE1 against the twice finer X2",
        "Thesis 3.4.4",
        bay.including("FE1"),
        f'{BOTH}\nfrequency_points = "all"\nnoise = 0.001\ntrust_radius = '
        f"0.1\n\n[constraints]\nbounds = {{ lower = -0.2, upper = 0.2 }}\n",
        low,
        bay.receptance(twice, low, real.labels, ["n1.x", "n1.z"]),
        real.labels,
        ["n1.x", "n1.z"],
        BAY.format(
            section="3.4.4",
            what="Model FE1 against X2, the same structure with every element in two: all 114 "
            "coordinates of the coarse mesh, forces at node 1 along x and z. The error is "
            "FE1's E (8 % in ten elements) and the mesh, which no p-value can say; 0.1 % is "
            "a stated accuracy, so that the report can tell that what remains is not noise.",
            but=", free of noise",
        ),
    )
    every = ["n1.x", "n1.y", *(f"n{i}.z" for i in range(1, 20))]
    band = np.arange(20.0, 350.5, 1.0)
    write(
        "bay/accuracy",
        "Bay structure: how accurate the recordings must be",
        "Thesis 5.5",
        bay.including("FE1"),
        f'{BOTH}\nfrequency_points = "log-function"\npoints = 10\nnoise = '
        f"0.00289\ntrust_radius = 0.1\n{BOUNDS}",
        band,
        bay.noisy(bay.receptance(real, band, every, ["n1.z"]), 0.005, seed=55),
        every,
        ["n1.z"],
        BAY.format(
            section="5.5",
            what="Model FE1; z at all nodes, x and y at node 1 (21 coordinates) under a force at "
            "node 1 along z; every entry times 1 + 0.005 u, u uniform in [−1, 1], seed 55; "
            "the ten lines with the lowest characteristic log function (5.32). " + TRUE_FE1,
            but="",
        ),
    )


def plates() -> None:
    """3.5.4: plate_complex/{0,2}pct."""
    share("plate_complex", plate_toml(True))
    real = build(plate_toml(False))
    sensors = [f"n{i}.z" for i in range(1, 61)]
    three = (
        'parameters = [ { elements = "all", of = "stiffness", each = "element" }, { elements '
        '= "all", of = "mass", each = "element" },\n  { elements = "all", of = "damping", '
        'each = "element" } ]'
    )
    for percent in (0, 2):
        level = percent / 100
        fine = np.arange(4.0, 1000.5, 4.0) if percent else np.arange(4.0, 250.5, 2.0)
        exact = bay.receptance(real, fine, sensors, ["n1.z"])
        points = (
            'frequency_points = "all"' if percent else 'frequency_points = "between"\npoints = 20'
        )
        noise = f"noise = {level * np.sqrt(2 / 3) or 1e-3:.4g}\n"
        write(
            f"plate_complex/{percent}pct",
            f"Damped plate, complex receptances, {percent} % noise",
            "Thesis 3.5.4",
            SHARED,
            f"{three}\n{points}\n{noise}trust_radius = 0.1\n{BOUNDS}",
            fine,
            bay.noisy(exact, level, seed=354),
            sensors,
            ["n1.z"],
            f"""Section 3.5.4: a free plate of 0.25 × 0.45 × 0.001 m, ρ = 7860 kg/m³, 5 × 9 elements, 60 nodes, 1 % structural damping; z at all nodes under a force at
node 1 along z. E = 206 GPa and ν = 0.3 are not printed (usual for steel). The source took ANSYS shells of 360 DOFs; here the 12-DOF bending element, 180 DOFs.
The model has 10 % more mass in elements {", ".join(map(str, PLATE_HIGH["mass"]))}, 10 % more stiffness (E) in {", ".join(map(str, PLATE_HIGH["stiffness"]))}
and 10 % more damping in {", ".join(map(str, PLATE_HIGH["damping"]))}: p = 1/1.1 − 1 = −0.0909 of each.
The stiffness and the damping matrix are independent (3.22): the elements with 10 % more E keep their D.
"""
            + (
                f"Every entry times 1 + {level:g}(u + iv), u and v uniform in [−1, 1], seed "
                f"354 (deviation {level:g}·√(2/3)). 4 to 1000 Hz: the damping of single "
                "elements needs many modes."
                if percent
                else "No noise; the 0.1 % in the file are weights."
            ),
            '\n[regularisation]\nkind = "l1"\nweight = "gcv"\n' if percent else "",
        )


if __name__ == "__main__":
    chains()
    bays()
    plates()
