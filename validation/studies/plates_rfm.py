"""Sections 9.5, 9.7.1 and 9.7.2 by the response function method: 140 physical parameters of the
plates from receptances.

The thesis's mesh (7 x 5 elements, 48 nodes), 48 receptances along z under a force at node 1, no
damping, thickness, E, rho and nu of each of the 35 elements. The measured responses were not
printed: they are synthesised from the measured frequencies (Tables 9.1 and 9.3) with the model's
shapes, rigid-body modes and the model's higher modes included, so they hold what the tables say and
nothing else. Lines as printed: 20 for Structure A, 24 for Structure B. The frequencies of the
tables are never fitted, only scored.

9.7.1, simulated: the elements along both middle lines 40 % thicker, which moves the frequencies by
about as much as Table 9.3, with 0, 0.5 and 1 % noise.

Bounds, and with them a small Tikhonov weight, hold p where receptances say nothing; *plain* is the
thesis's way, least squares by singular values without either.
"""

from __future__ import annotations

import csv
import tempfile
from pathlib import Path

import numpy as np
from scipy.optimize import linear_sum_assignment

from cvxupdate import study
from cvxupdate.correlate import mac
from cvxupdate.errors import ModelError
from cvxupdate.fe.modes import model_modes
from validation import make_bay as bay
from validation.studies.structure_a_mesh import (
    FAMILIES,
    PROBLEM,
    family_numbers,
    write_problem,
)

NX, NY = 7, 5
LINES_A = (20, 25, 35, 40, 60, 70, 90, 100, 105, 115, 126, 145, 150, 165, 170, 177, 184, 191)
LINES_A = np.array((*LINES_A, 195, 215), dtype=float)
LINES_B = (21, 25, 27, 40, 43, 54, 61, 70, 76, 85, 95, 105, 115, 125, 140, 152, 165, 180, 190, 200)
LINES_B = np.array((*LINES_B, 210, 221, 230, 240), dtype=float)
LABELS = ("target", "before", "after")
SHOWN = np.arange(10.25, 240.5, 0.5)  # beside the frequencies of the tables
PROPERTIES = ("thickness", "E", "rho", "nu")
THICKER = 0.4
CROSS = sorted({e for e in range(1, 36) if (e - 1) // NX == NY // 2 or (e - 1) % NX == NX // 2})

TABLES = """
[[recordings]]
kind = "frf"
use = "fit"
name = "receptances"
file = "frf.npz"
response = "displacement"

[update]
method = "rfm"
frequency_points = "all"
noise = {noise}
max_iterations = 60
{solution}parameters = [
{rows}
]
{clauses}"""


def base(folder):
    """The path of a problem of the plate on the thesis's mesh, for its model and its families."""
    return write_problem(folder, NX, NY, (), 1.0)


def written(folder, start, H, lines, labels, noise, bound, plain):
    """The problem that fits ``H``."""
    bay.save_frf(folder / "frf.npz", lines, H, labels, ("n1.z",))
    text = start.read_text(encoding="utf-8")
    text = text[: text.index("[[recordings]]")]
    edges = "" if plain else f", lower = {-bound}, upper = {bound}"
    rows = "\n".join(
        f'  {{ group = "plate", of = "{of}", each = "element"{edges} }},' for of in PROPERTIES
    )
    made = TABLES.format(
        noise=noise,
        solution='solution = "truncated-svd"\n' if plain else "",
        rows=rows,
        clauses="" if plain else '\n[[regularisation]]\nkind = "tikhonov"\nweight = 1.0\n',
    )
    path = folder / f"{'plain' if plain else 'bounded'}.toml"
    path.write_text(text + made, encoding="utf-8")
    return path


def families_of_b():
    """Measured frequency of Table 9.3 → family: it was paired with the same model as Table 9.1."""
    with open(PROBLEM / "table_9_1.csv", encoding="utf-8") as file:
        by_model = {float(r["model"]): float(r["measured"]) for r in csv.DictReader(file)}
    printed = (27.9, 30.8, 64.7, 66.7, 81.3, 92.8, 120.8, 134.6, 173.8, 183.1, 201.0, 201.3, 205.0)
    measured = (36.8, 38.5, 75.0, 82.6, 91.8, 108.8, 142.2, 149.7, 195.5, 204.2, 210.7, 223.1)
    return {x: FAMILIES[by_model[a]] for x, a in zip((*measured, 235.4), printed, strict=True)}


def synthesised(model, numbers, frequencies, lines, labels):
    """(lines, 48, 1) receptances with the model's shapes, ``frequencies`` in place of those of its
    flexible modes ``numbers`` (from 1)."""
    modes = model_modes(model, model.size)
    lam = np.maximum(np.array(modes.eigenvalues), 0.0)
    lam[: modes.rigid] = 0.0
    for number, f in zip(numbers, frequencies, strict=True):
        lam[modes.rigid + number - 1] = (2 * np.pi * f) ** 2
    at = [model.place[q] for q in labels]
    seen, driven = modes.shapes[at], modes.shapes[model.place["n1.z"]]
    w2 = (2 * np.pi * lines) ** 2
    return np.einsum("ir,r,fr->fi", seen, driven, 1.0 / (lam[None] - w2[:, None]))[:, :, None]


def exact(model, p, lines, labels):
    """Receptances of the model itself at ``p``, (lines, 48, 1)."""
    m = model.matrices(p)
    K, M = m.K.toarray(), m.M.toarray()
    at, unit = [model.place[q] for q in labels], np.eye(model.size)[:, model.place["n1.z"]]
    return np.array([np.linalg.solve(K - (2 * np.pi * f) ** 2 * M, unit)[at] for f in lines])[
        :, :, None
    ]


def decibels(H, target):
    """Mean difference of two sets of receptances."""
    return float(np.mean(np.abs(20 * np.log10(np.abs(H / target)))))


def measured(which, folder, plain=False):
    """What `scored` gives of Structure A or B, from synthesised receptances."""
    start = base(folder)
    _, model, _ = study.open_problem(start)
    labels = tuple(q for q in model.labels if q.endswith(".z"))
    families = FAMILIES if which == "A" else families_of_b()
    numbers = family_numbers(start, list(families.values()))
    lines, bound = (LINES_A, 0.3) if which == "A" else (LINES_B, 0.7)
    H = synthesised(model, numbers, families, lines, labels)
    path = written(folder, start, H, lines, labels, 0.01, bound, plain)
    target = synthesised(model, numbers, families, SHOWN, labels)
    return scored(path, target, labels, families, numbers)


def scored(path, target, labels, families=(), numbers=()):
    """(result, mean frequency errors and dB, each before and after, and |receptance| at n1.z of
    target, before and after); the model's modes are found again in the updated one by MAC."""
    updated = study.run(path)
    _, model, _ = study.open_problem(path)
    p = np.array([q.p for q in updated.parameters])
    both = [exact(model, q, SHOWN, labels) for q in (model.zero(), p)]
    seen = [decibels(H, target) for H in both]
    point = [np.abs(H[:, labels.index("n1.z"), 0]) for H in (target, *both)]
    first = model_modes(model, 40, model.zero()).flexible()
    places = np.array(numbers, dtype=int) - 1
    found = [first.frequencies[places]]
    try:
        last = model_modes(model, 40, p).flexible()
        alike = linear_sum_assignment(-mac(first.shapes, last.shapes))[1]
        found.append(last.frequencies[alike[places]])
    except ModelError:  # the plain iteration may leave a plate that is none
        found.append(np.full(len(places), np.nan))
    wanted = np.array(list(families), dtype=float)
    error = [float(np.mean(100 * np.abs(f - wanted) / wanted)) for f in found]
    return updated, tuple(error), tuple(seen), point


def simulated(noise, folder, plain=False):
    """(result, dB before and after, receptances as of `scored`, part of all changes of thickness
    that stands on the cross) of 9.7.1."""
    start = base(folder)
    _, model, _ = study.open_problem(start)
    labels = tuple(q for q in model.labels if q.endswith(".z"))
    path = written(
        folder, start, np.zeros((24, 48, 1)), LINES_B, labels, max(noise, 1e-3), 0.7, plain
    )
    _, full, _ = study.open_problem(path)
    truth = np.zeros(len(full.parameters))
    truth[[e - 1 for e in CROSS]] = THICKER
    H = exact(full, truth, LINES_B, labels)
    H = bay.noisy(H, noise, 97) if noise else H
    path = written(folder, start, H, LINES_B, labels, max(noise, 1e-3), 0.7, plain)
    updated, _, seen, point = scored(path, exact(full, truth, SHOWN, labels), labels)
    thick = np.array([q.p for q in updated.parameters[:35]])
    part = float(np.abs(thick[[e - 1 for e in CROSS]]).sum() / np.abs(thick).sum())
    return updated, seen, point, part


def drawn(folder, name, point):
    """The point receptance at node 1: target, before and after (Figs 9.14, 9.17, 9.20)."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(8, 3.6), layout="constrained")
    for values, style, label in zip(point, ("k-", "C1:", "C0--"), LABELS, strict=True):
        ax.semilogy(SHOWN, values, style, label=label)
    ax.set(xlabel="frequency (Hz)", ylabel="|receptance| n1.z, n1.z (m/N)")
    ax.legend()
    figure.savefig(folder / f"plates_rfm_{name}.png", dpi=120)
    plt.close(figure)


def main(folder, wish):
    """Every case, printed and drawn; gives them."""
    found = {}
    for which in ("A",) if wish.quick else ("A", "B"):
        for plain in (False,) if wish.quick else (False, True):
            with tempfile.TemporaryDirectory() as made:
                updated, error, seen, point = measured(which, Path(made), plain)
            found[which, plain] = updated, error, seen
            how = "plain" if plain else "bounded"
            drawn(folder, f"{which}_{how}", point)
            print(
                f"Structure {which}, {how}: {updated.status}, {updated.iterations} iterations, "
                f"{updated.time:.0f} s; mean frequency error {error[0]:.2f} -> {error[1]:.2f} %; "
                f"receptances {seen[0]:.2f} -> {seen[1]:.2f} dB"
            )
    for noise in () if wish.quick else (0.0, 0.005, 0.01):
        for plain in (False, True):
            with tempfile.TemporaryDirectory() as made:
                updated, seen, point, part = simulated(noise, Path(made), plain)
            found[noise, plain] = updated, seen, part
            how = "plain" if plain else "bounded"
            drawn(folder, f"simulated_{noise}_{how}", point)
            print(
                f"simulated B, {100 * noise:g} %, {how}: {updated.status}, {updated.iterations} "
                f"iterations; receptances {seen[0]:.2f} -> {seen[1]:.2f} dB; {100 * part:.0f} % of "
                f"the thickness found stands on the cross ({100 * len(CROSS) / 35:.0f} % by chance)"
            )
    return found
