"""Writes the problems of chapter 8: problems/physical. ``python -m validation.make_physical`` again
gives the same files (seeds are fixed)."""

from __future__ import annotations

import tempfile
from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.study import open_problem
from validation import make_bay as bay

FOLDER = Path(__file__).resolve().parents[1] / "problems" / "physical"
PLATE = (0.25, 0.45, 0.001)
PLATE_ERRORS = {
    "thickness": (1.15, range(1, 46, 3)),
    "E": (1.08, range(1, 46, 4)),
    "rho": (1.10, range(1, 46, 5)),
    "nu": (1.12, range(2, 46, 3)),
}
"""Section 8.5: factor on the model's property, and its elements."""
PLATE_LINES = (12.0, 19.0, 33.0, 47.0, 58.0, 71.0, 84.0, 97.0, 118.0, 133.0, 151.0, 168.0)
EXACT_ERRORS = {
    "rho": (0.9, (1, 5, 9, 13, 17)),
    "E": (1.1, (1, 2, 3, 4, 8, 13, 17, 18, 19, 20)),
    "G": (1.1, (5, 6, 7, 8, 12, 13, 19, 20)),
    "height": (1.1, (1, 6, 11, 16)),
}
"""Table 8.2; the thesis's width b = 1 cm is the height of a strip that lies flat."""
EXACT_LINES = (30.0, 70.0, 110.0, 135.0, 155.0, 180.0, 210.0, 230.5)
FORCE = "n1.z"
"""Where every study is driven."""
BEAM_LINES = (20.0, 40.0, 75.0, 80.0, 135.0, 142.0, 190.0, 210.0, 245.0)
LIKELY = 0.2
"""Deviation of p before anything is recorded, where noise leaves combinations open."""
BOUNDS = "\n[constraints]\nbounds = { lower = -0.5, upper = 0.5 }\n"


def nominal_of(errors: Mapping[str, tuple[float, Sequence[int]]], element: int) -> dict[str, float]:
    """The factor on each property of one element of the erroneous model."""
    return {of: f if element in some else 1.0 for of, (f, some) in errors.items()}


def truth(errors: Mapping[str, tuple[float, Sequence[int]]], of: str, count: int) -> np.ndarray:
    """The p that takes the errors out, by element."""
    return np.array([1.0 / nominal_of(errors, e)[of] - 1.0 for e in range(1, count + 1)])


def wide(count: int = 20) -> dict[str, np.ndarray]:
    """Errors up to ±30 % in every property of every element, seeded."""
    rng = np.random.default_rng(8)
    return {of: rng.uniform(0.7, 1.3, count) for of in EXACT_ERRORS}


def plate_toml(errors: Mapping[str, tuple[float, Sequence[int]]]) -> str:
    """[model] of the free plate, 5 × 9 elements of 60 nodes, 180 DOFs, undamped."""
    a, b, h = PLATE
    nodes = ",\n".join(
        f"  {{ id = {1 + i + 6 * j}, x = {a * i / 5:.10g}, y = {b * j / 9:.10g} }}"
        for j in range(10)
        for i in range(6)
    )
    materials: dict[tuple[float, ...], str] = {}
    sections: dict[float, str] = {}
    rows = []
    for j in range(9):
        for i in range(5):
            e, n = 1 + i + 5 * j, 1 + i + 6 * j
            f = {**dict.fromkeys(("E", "rho", "nu", "thickness"), 1.0), **nominal_of(errors, e)}
            made = (206e9 * f["E"], 0.3 * f["nu"], 7860.0 * f["rho"])
            material = materials.setdefault(made, f"m{len(materials) + 1}")
            section = sections.setdefault(h * f["thickness"], f"s{len(sections) + 1}")
            rows.append(
                f"  {{ id = {e}, nodes = [{n}, {n + 1}, {n + 7}, {n + 6}], "
                f'material = "{material}", section = "{section}" }}'
            )
    text = f'[model]\ndofs = ["z", "rx", "ry"]\nnodes = [\n{nodes},\n]\n'
    for (E, nu, rho), name in materials.items():
        text += f"\n[model.materials.{name}]\nE = {E:.10g}\nnu = {nu:.10g}\nrho = {rho:.10g}\n"
    for thickness, name in sections.items():
        text += f'\n[model.sections.{name}]\nshape = "plate"\nthickness = {thickness:.10g}\n'
    return text + '\n[[model.elements]]\ntype = "plate"\nrows = [\n' + ",\n".join(rows) + ",\n]\n"


def exact_toml(factors: Mapping[str, Sequence[float]]) -> str:
    """[model] of the bay with exact members, their properties times ``factors`` by element."""
    points, pairs = bay.mesh()
    nodes = ",\n".join(
        f"  {{ id = {i}, x = {x:.10g}, y = {y:.10g}, z = {z:.10g} }}"
        for i, (x, y, z) in enumerate(points, 1)
    )
    materials: dict[tuple[float, ...], str] = {}
    sections: dict[float, str] = {}
    rows = []
    for e, (u, v) in enumerate(pairs, 1):
        f = {of: values[e - 1] for of, values in factors.items()}
        made = (207e9 * f["E"], 79.6e9 * f["G"], 7850.0 * f["rho"])
        material = materials.setdefault(made, f"m{len(materials) + 1}")
        section = sections.setdefault(0.01 * f["height"], f"s{len(sections) + 1}")
        rows.append(
            f'  {{ id = {e}, nodes = [{u}, {v}], material = "{material}", section = "{section}" }}'
        )
    text = f'[model]\ndofs = ["x", "y", "z", "rx", "ry", "rz"]\nnodes = [\n{nodes},\n]\n'
    text += '\n[model.damping]\nkind = "structural"\neta = 0.02\n'
    for (E, G, rho), name in materials.items():
        text += f"\n[model.materials.{name}]\nE = {E:.10g}\nG = {G:.10g}\nrho = {rho:.10g}\n"
    for height, name in sections.items():
        text += (
            f'\n[model.sections.{name}]\nshape = "rectangle"\nwidth = 0.1\n'
            f"height = {height:.10g}\nkappa = 0.85\n"
        )
    return (
        text + '\n[[model.elements]]\ntype = "exact_beam"\norientation = [0.0, 0.0, 1.0]\n'
        "rows = [\n" + ",\n".join(rows) + ",\n]\n"
    )


def table_8_2() -> dict[str, list[float]]:
    """The factors of Table 8.2 by element."""
    return {of: [nominal_of(EXACT_ERRORS, e)[of] for e in range(1, 21)] for of in EXACT_ERRORS}


def built(text: str) -> Model:
    """The package's model of a [model] table."""
    with tempfile.TemporaryDirectory() as made:
        path = Path(made) / "problem.toml"
        path.write_text(text, encoding="utf-8")
        return open_problem(path)[1]


def measured(
    model: Model, lines: Sequence[float], responses: Sequence[str], force: str
) -> np.ndarray:
    """Receptances (lines, responses, 1) of the reference, line by line."""
    at, by = [np.array([model.place[q] for q in names]) for names in (responses, [force])]
    return frequency_responses(model, np.array(lines), at, by, way="direct")


ALL = tuple(f"n{i}.{k}" for i in range(1, 20) for k in bay.KINDS)
PLATE_POINTS = tuple(f"n{i}.z" for i in range(1, 61))
CLOSE_LINES = tuple(np.arange(20.0, 246.0, 5.0).tolist())


def parameters(groups: Sequence[tuple[str, Sequence[int] | str, bool]]) -> str:
    """The parameters of an [update] table: (property, elements, whether each by itself)."""
    rows = []
    for of, elements, each in groups:
        some = '"all"' if isinstance(elements, str) else str(list(elements))
        rows.append(
            f'  {{ elements = {some}, of = "{of}"' + (', each = "element"' if each else "") + " },"
        )
    return "parameters = [\n" + "\n".join(rows) + "\n]\n"


def write(
    path: str,
    title: str,
    thesis: str,
    model: str,
    data: str,
    wanted: str,
    more: str = "",
    end: str = "",
) -> None:
    """One problem file; ``model`` is what its [model] includes, or a [model] table; ``more`` of
    [update], and the ``end``."""
    table = model if model.startswith("[") else f'[model]\ninclude = "{model}"\n'
    text = (
        f'title = "{title}"\nsource = "Thesis {thesis}; simulated by validation/make_physical.py, '
        f'see ../source.md"\n\n{table}\n[[recordings]]\nkind = "frf"\nname = "simulated FRFs"\n'
        f'file = "{data}.npz"\nresponse = "displacement"\n\n[update]\nmethod = "rfm"\n{wanted}'
        f'frequency_points = "all"\n{more}{BOUNDS}{end}'
    )
    (FOLDER / path).parent.mkdir(parents=True, exist_ok=True)
    (FOLDER / path).write_text(text, encoding="utf-8")


def save(
    path: str, lines: Sequence[float], H: np.ndarray, responses: Sequence[str], noise: float
) -> None:
    """A recording, with noise of that level (3.27)."""
    (FOLDER / path).parent.mkdir(parents=True, exist_ok=True)
    noisy = bay.noisy(H, noise, 1) if noise else H
    bay.save_frf(FOLDER / path, lines, noisy, responses, [FORCE])


def beams() -> None:
    """8.3."""
    reference = bay.build("X1")
    wanted = parameters([("I", "all", True)])
    H = bay.receptance(reference, BEAM_LINES, ALL, [FORCE])
    save("beam/frf.npz", BEAM_LINES, H, ALL, 0.0)
    write(
        "beam/problem.toml",
        "FE2 by its second moments, all coordinates",
        "8.3",
        "../../bay/fe2.toml",
        "frf",
        wanted,
        "trust_radius = 0.1\n",
    )
    H = bay.receptance(reference, CLOSE_LINES, bay.TEN, [FORCE])
    for level in (1, 5):
        save(f"beam/ten_{level}.npz", CLOSE_LINES, H, bay.TEN, level / 100)
        write(
            f"beam/ten_{level}.toml",
            f"FE2 by its second moments, ten coordinates, {level} % noise",
            "8.3",
            "../../bay/fe2.toml",
            f"ten_{level}",
            wanted,
            f"trust_radius = 0.1\nnoise = {level / 100 / np.sqrt(3):.4g}\n",
        )


def exacts() -> None:
    """8.7."""
    reference = built(exact_toml(dict.fromkeys(EXACT_ERRORS, [1.0] * 20)))
    H = measured(reference, EXACT_LINES, ALL, FORCE)
    save("exact/frf.npz", EXACT_LINES, H, ALL, 0.0)
    save("exact/frf_5.npz", EXACT_LINES, H, ALL, 0.05)
    (FOLDER / "exact/model.toml").write_text(exact_toml(table_8_2()), encoding="utf-8")
    wanted = parameters([(of, "all", True) for of in EXACT_ERRORS])
    write("exact/problem.toml", "Table 8.2 with exact elements", "8.7", "model.toml", "frf", wanted)
    noise = f"second_order = true\nnoise = {0.05 / np.sqrt(3):.4g}\n"
    write(
        "exact/noisy.toml",
        "Table 8.2 with exact elements, 5 % noise",
        "8.7",
        "model.toml",
        "frf_5",
        wanted,
        noise,
        f'\n[regularisation]\nkind = "prior"\ndeviation = {LIKELY:g}\n',
    )
    write(
        "exact/wide.toml",
        "Exact elements, every property up to 30 % wrong",
        "8.7",
        exact_toml(wide()),
        "frf",
        wanted,
        "second_order = true\n",
    )


def plates() -> None:
    """8.5."""
    H = measured(built(plate_toml({})), PLATE_LINES, PLATE_POINTS, FORCE).real
    save("plate/frf.npz", PLATE_LINES, H, PLATE_POINTS, 0.0)
    (FOLDER / "plate/model.toml").write_text(plate_toml(PLATE_ERRORS), encoding="utf-8")
    kinds = PLATE_ERRORS.items()
    for name, title, groups in (
        ("macros", "four macro elements", [(of, list(e), False) for of, (_, e) in kinds]),
        ("singles", "single-element macros", [(of, list(e), True) for of, (_, e) in kinds]),
        ("all", "all 180 parameters", [(of, "all", True) for of in PLATE_ERRORS]),
    ):
        write(
            f"plate/{name}.toml",
            f"Table 8.1, {title}",
            "8.5",
            "model.toml",
            "frf",
            parameters(groups),
        )


if __name__ == "__main__":
    beams()
    exacts()
    plates()
