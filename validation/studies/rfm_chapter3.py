"""Figures of chapter 3 again: the chain before and after (3.3 to 3.6), the bay's p-values and
receptances (3.10, 3.11), the dynamic stiffness and its reduced form (3.12, 3.13), the cost function
of two parameters (3.14, 3.15), the plate's three kinds of p-values (3.18; 3.19 with ``--every``).
"""

from __future__ import annotations

from functools import cache

import numpy as np

import cvxupdate
from cvxupdate.fe.responses import condense, dynamic_stiffness, held_frequencies
from cvxupdate.fe.synthesis import receptance
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.study import open_problem
from validation.studies.bay_case import CORNER, PROBLEMS, bay, data_of, fe1, make_rfm


@cache
def updated(name):
    """(result, model, p)."""
    path = PROBLEMS / name / "problem.toml"
    result = cvxupdate.run(path)
    return result, open_problem(path)[1], np.array([q.p for q in result.parameters])


def chain(plt, folder, names=("complete", "incomplete", "noisy")):
    """Figs 3.3, 3.4, 3.6: receptances before and after; 3.5: p over the iterations."""
    real = make_rfm.build(make_rfm.chain_toml(True))
    f = np.arange(20.25, 200, 0.5)
    figure, axes = plt.subplots(len(names), 1, figsize=(7, 8), sharex=True)
    said = {
        "complete": "Fig. 3.3, complete",
        "incomplete": "Fig. 3.4, five coordinates",
        "noisy": "Fig. 3.6, 10 % noise",
    }
    for ax, name in zip(axes, names, strict=True):
        result, model, p = updated(f"chain10/{name}")
        at = np.array([model.place["n5.x"]])
        ax.semilogy(
            f,
            np.abs(bay.receptance(real, f, ["n5.x"], ["n5.x"])[:, 0, 0]),
            "k",
            lw=1,
            label="experimental",
        )
        ax.semilogy(
            f, np.abs(receptance(model, f, at, at)[:, 0, 0]), ":", lw=1, label="model before"
        )
        ax.semilogy(
            f, np.abs(receptance(model, f, at, at, p)[:, 0, 0]), "--", lw=1, label="updated"
        )
        ax.set_title(f"{said[name]}: {result.iterations} iterations", fontsize=9)
        print(
            f"chain10_{name}: {result.status}, {result.iterations} iterations, largest |p| "
            f"{np.abs(p).max():.4f}"
        )
    axes[0].legend(fontsize=7)
    axes[1].set_ylabel("receptance 5, 5 (m/N)")
    axes[-1].set_xlabel("frequency (Hz)")
    figure.tight_layout()
    figure.savefig(folder / "chain.png", dpi=120)
    result, _, p = updated("chain10/incomplete")
    figure, axes = plt.subplots(3, 1, figsize=(6, 6), sharex=True, sharey=True)  # Fig. 3.5
    for ax, h in zip(axes, result.history[:3], strict=True):
        ax.bar(np.arange(21), h["p"])
        ax.set_title(f"after {h['number']}", fontsize=8)
    axes[2].set_xlabel("k1 … k11, m1 … m10")
    figure.tight_layout()
    figure.savefig(folder / "chain_convergence.png", dpi=120)


def frame(plt, folder):
    """Figs 3.10 and 3.11: p-values and receptances of the bay."""
    result, model, p = updated("bay/fe1_x1_incomplete")
    noisy, _, q = updated("bay/fe1_x1_noisy")
    print(
        f"bay, ten coordinates: {result.iterations} iterations, largest error of p "
        f"{np.abs(p[:20][[i - 1 for i in bay.STIFF]] - (1 / 1.08 - 1)).max():.1e}; with 0.5 % "
        f"noise {noisy.iterations}, "
        f"{np.abs(q[:20][[i - 1 for i in bay.STIFF]] - (1 / 1.08 - 1)).max():.4f}"
    )
    figure, axes = plt.subplots(2, 1, figsize=(7, 6))
    axes[0].bar(np.arange(40) - 0.2, p, 0.4, label="no noise (3.10)")
    axes[0].bar(np.arange(40) + 0.2, q, 0.4, label="0.5 % noise")
    axes[0].set(xlabel="20 stiffness, 20 mass p-values", ylabel="p")
    axes[0].legend(fontsize=8)
    f, at = np.arange(10.5, 400, 1.0), np.array([model.place["n3.z"]])
    axes[1].semilogy(
        f,
        np.abs(bay.receptance(bay.build("X1"), f, ["n3.z"], ["n3.z"])[:, 0, 0]),
        "k",
        lw=1,
        label="X1",
    )
    for values, style, label in (
        (model.zero(), ":", "FE1"),
        (q, "--", "updated, 0.5 % noise (3.11)"),
    ):
        axes[1].semilogy(
            f, np.abs(receptance(model, f, at, at, values)[:, 0, 0]), style, lw=1, label=label
        )
    axes[1].set(xlabel="frequency (Hz)", ylabel="receptance at n3.z (m/N)")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "bay.png", dpi=120)


def surfaces(plt, folder, step=0.5):
    """Figs 3.12 to 3.15: dynamic stiffness every ``step`` Hz, reduced and not; the cost along one
    p-value."""
    model = fe1()
    ten = np.array([model.place[x] for x in bay.TEN])
    f = np.arange(5.0, 400, step)
    at = model.place["n1.z"]
    m = model.matrices()
    full = [dynamic_stiffness(m, 2 * np.pi * x)[at, at] for x in f]
    reduced = [condense(m, x, ten, ten[:1]).Z[2, 2] for x in f]
    held = held_frequencies(model, ten, 8)
    print(
        "frequencies of the bay held at the ten coordinates: "
        + ", ".join(f"{x:.1f}" for x in held[held > 1])
        + " Hz"
    )
    figure, axes = plt.subplots(1, 2, figsize=(9, 3.6))
    axes[0].plot(f, np.array(full) / full[0], label="Z (3.12)")
    axes[0].plot(
        f, np.clip(np.array(reduced) / reduced[0], -9, 9), lw=0.8, label="Z reduced (3.13)"
    )
    for x in held[held > 1]:
        axes[0].axvline(x, color="0.8", lw=0.8, zorder=0)
    axes[0].set(xlabel="frequency (Hz)", ylabel="over its value at 5 Hz, n1.z", ylim=(-4, 4))
    axes[0].legend(fontsize=8)
    lines = np.array([30.0, 75, 120, 145])
    data = data_of(
        model, lines, bay.receptance(bay.build("X1"), lines, bay.TEN, CORNER), bay.TEN, CORNER, 0.01
    )
    residuals = [FrfResidual(model, (data,), kind) for kind in ("force-balance", "receptance")]
    grid = np.linspace(-0.9, 0.9, 31)
    costs = [[], []]
    for k, residual in enumerate(residuals):
        for v in grid:
            p = model.zero()
            p[0] = v
            values, weights, _ = residual.evaluate(p).differences
            costs[k].append(float(np.sum((weights * values) ** 2)))
    for cost, label in zip(
        costs, ("force balance, J2 (3.33)", "receptance, J1 (3.31)"), strict=True
    ):
        axes[1].semilogy(grid, np.array(cost) / min(cost), label=label)
    axes[1].set(xlabel="stiffness p of element 1", ylabel="cost / least")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "surfaces.png", dpi=120)


def plate(plt, folder, percent):
    """Figs 3.18 and 3.19: p-values of the plate at so many per cent of noise."""
    result, _, p = updated(f"plate_complex/{percent}pct")
    figure, axes = plt.subplots(3, 1, figsize=(7, 6), sharex=True, sharey=True)
    for ax, values, words in zip(
        axes, p.reshape(3, 45), ("stiffness", "mass", "damping"), strict=True
    ):
        ax.bar(np.arange(1, 46), values)
        ax.set_title(words, fontsize=8)
    axes[2].set_xlabel("element")
    figure.tight_layout()
    figure.savefig(folder / f"plate_{percent}pct.png", dpi=120)
    truth = np.zeros((3, 45))
    for row, of in zip(truth, ("stiffness", "mass", "damping"), strict=True):
        row[[i - 1 for i in make_rfm.PLATE_HIGH[of]]] = 1 / 1.1 - 1
    print(
        f"plate, {percent} % noise: {result.iterations} iterations, largest error of p "
        f"{np.abs(p - truth.ravel()).max():.2e}, largest false |p| "
        f"{np.abs(p[truth.ravel() == 0]).max():.2e} against the true 0.0909"
    )


def main(folder, wish):
    """Every figure, each with a line of what it shows."""
    import matplotlib.pyplot as plt

    if wish.quick:
        chain(plt, folder, ("complete", "incomplete"))
        surfaces(plt, folder, 4.0)
        return
    chain(plt, folder)
    frame(plt, folder)
    surfaces(plt, folder)
    plate(plt, folder, 0)
    if wish.every:
        plate(plt, folder, 2)
