"""Case 3 of 6.4.1 without damping, and what Figs 6.9 and 6.10 draw: whether target and model
belong to one domain.

Undamped case 3: receptances of X1 with a loss of 0.001, 5 % noise, all 114 coordinates, forces at
the corner; ten identified modes assigned to FE1's stiffnesses, and scored by p against the truth,
by the frequencies of X1 and by its accelerances from 1 to 250 Hz.

Domains: the assignment of ten complete modes to 20 stiffness and 20 mass p-values, A p = b (6.21),
rows scaled by the diagonal of K. p = −1 solves it whatever the modes, because it takes the model
away: where the target is one of the family, a second exact solution exists, A has a null vector,
the two differ by it, and ‖A (1 + p_true)‖ = 0. Its least singular value over the largest says how
far the target is from the family: what the two figures sketch.
"""

from __future__ import annotations

import tempfile
from pathlib import Path

import numpy as np

from cvxupdate import study
from cvxupdate.residual.shape_rows import channel_rows
from validation import make_bay as bay
from validation import make_ceam
from validation.studies.bay_case import PROBLEMS, TRUTH, fe1

LOSS = 0.001
"""What is left of damping in the receptances: an exactly undamped structure has poles on the axis,
where stable and unstable ones cannot be told, and identification from noise fails."""

UNDAMPED = """title = "FE1 from modes of nearly undamped receptances of X1 with 5 % noise"

[model]
include = "{fe1}"

[[recordings]]
kind = "modes"
use = "fit"
name = "X1, identified"
file = "modes.npz"
channels = {{ file = "channels.csv" }}

[update]
method = "ceam"
parameters = [
  {{ elements = "all", of = "stiffness", each = "element", lower = -0.2, upper = 0.2 }},
]
"""


def undamped():
    """(result, relative errors of the ten identified frequencies, errors of p, and for the model
    before and after (largest error of its ten frequencies, mean difference of accelerances in dB))
    of the undamped case 3."""
    target = bay.build("X1")
    lossy = bay.build("X1", f'[model.damping]\nkind = "structural"\neta = {LOSS}')
    with tempfile.TemporaryDirectory() as made:
        folder = Path(made)
        make_ceam.identified(folder, lossy)
        make_ceam.channels(folder, target.labels)
        path = folder / "problem.toml"
        fe1_toml = (PROBLEMS / "bay/fe1.toml").as_posix()
        path.write_text(UNDAMPED.format(fe1=fe1_toml), encoding="utf-8")
        updated = study.run(path)
        _, model, recordings = study.open_problem(path)
    values, _ = make_ceam.modes_of(target, 10)
    exact = np.sqrt(values) / (2 * np.pi)
    found = recordings[0].frequency
    p = np.array([q.p for q in updated.parameters])
    wanted = make_ceam.accelerance(target)
    scores = []
    for at in (model.zero(), p):
        m = model.matrices(at)
        K, M = m.K.toarray(), m.M.toarray()
        own, _ = make_ceam.modes_of_matrices(K, M, 10)
        H = np.array([response(K, M, model, f) for f in make_ceam.LINES])
        seen = wanted != 0.0
        gap = 20 * np.log10(np.abs(H[seen] / wanted[seen]))
        off = np.abs(np.sqrt(own) / (2 * np.pi) - exact) / exact
        scores.append((float(off.max()), float(np.mean(np.abs(gap[np.isfinite(gap)])))))
    return updated, (found - exact) / exact, p - TRUTH[:20], scores


def response(K, M, model, f):
    """Accelerance at one line."""
    at = [model.place[q] for q in make_ceam.SEEN]
    by = [model.place[q] for q in make_ceam.FORCES]
    unit = np.zeros((model.size, len(by)))
    unit[by, np.arange(len(by))] = 1.0
    w2 = (2 * np.pi * f) ** 2
    return -w2 * np.linalg.solve(K - w2 * M, unit)[at]


def assignment(case, count=10):
    """(A, b) of (6.21) for the first ``count`` modes of a case's table on FE1."""
    model = fe1()
    _, own, recordings = study.open_problem(PROBLEMS / f"ceam/case{case}/problem.toml")
    table = next(r for r in recordings if hasattr(r, "shapes"))
    rows = channel_rows(table, own)
    lam = (2 * np.pi * table.frequency[:count]) ** 2
    shapes = np.zeros((model.size, count))
    place = np.array([model.place[own.labels[k]] for k in rows])
    shapes[place] = np.real(table.shapes[:count]).T
    base = model.matrices()
    K, M = base.K.toarray(), base.M.toarray()
    scale = 1.0 / np.sqrt(np.diag(K))
    unit = 1.0 / np.linalg.norm(scale[:, None] * (K @ shapes), axis=0)
    columns = []
    for j in range(len(model.parameters)):
        m = model.matrices(np.eye(len(model.parameters))[j])
        dK, dM = m.K.toarray() - K, m.M.toarray() - M
        columns.append(((scale[:, None] * (dK @ shapes - dM @ shapes * lam)) * unit).T.ravel())
    b = -((scale[:, None] * (K @ shapes - M @ shapes * lam)) * unit).T.ravel()
    return np.array(columns).T, b


def domain(case):
    """(σ_min / σ_max, ‖A (1 + p_true)‖ / ‖A 1‖, largest |p + 1| of the least-squares solution, p of
    the stiffnesses alone against the truth, what those leave of b)."""
    A, b = assignment(case)
    s = np.linalg.svd(A, compute_uv=False)
    p = np.linalg.lstsq(A, b, rcond=1e-13)[0]
    stiff = np.linalg.lstsq(A[:, :20], b, rcond=None)[0]
    left = float(np.linalg.norm(A[:, :20] @ stiff - b) / np.linalg.norm(b))
    kept = float(np.linalg.norm(A @ (1.0 + TRUTH)) / np.linalg.norm(A @ np.ones(40)))
    away = float(np.abs(p + 1.0).max())
    return float(s[-1] / s[0]), kept, away, float(np.abs(stiff - TRUTH[:20]).max()), left, s


def main(folder, wish):
    """Print both and draw the singular values; gives them."""
    import matplotlib.pyplot as plt

    found = {"X1": domain(1), "X2": domain(6)}
    for name, (least, kept, away, off, left, _) in found.items():
        print(
            f"{name}: sigma_min / sigma_max {least:.2g}, |A (1 + p_true)| / |A 1| {kept:.2g}; "
            f"least squares of all 40: |p + 1| at most {away:.2g}; of the stiffnesses alone: p off "
            f"by {off:.2g} at most, {left:.2g} of b left"
        )
    figure, ax = plt.subplots(figsize=(6, 3.5), layout="constrained")
    for name, row in found.items():
        ax.semilogy(np.arange(1, 41), row[-1] / row[-1][0], "o-", ms=3, label=name)
    ax.set(xlabel="number", ylabel="singular value of A over the largest")
    ax.legend()
    figure.savefig(folder / "ceam_domains.png", dpi=120)
    plt.close(figure)
    if wish.quick:
        return found, None
    updated, frequencies, off, scores = undamped()
    print(
        f"case 3 undamped: {updated.status} in {updated.iterations} iterations; frequencies "
        f"identified within {100 * np.abs(frequencies).max():.2g} %; p off by "
        f"{np.abs(off).max():.2g} at most, r.m.s. {np.sqrt(np.mean(off**2)):.2g}; frequencies "
        f"off by {100 * scores[0][0]:.2g} -> {100 * scores[1][0]:.2g} % at most, accelerances by "
        f"{scores[0][1]:.2f} -> {scores[1][1]:.2f} dB"
    )
    return found, (updated, frequencies, off, scores)
