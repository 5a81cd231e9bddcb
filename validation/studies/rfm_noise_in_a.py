"""The noise in A: H_X stands on both sides of the force balance (3.9), so least squares is biased
however many lines are fitted. FE1 against X1, ten coordinates, 40 lines.

Bias is ‖mean p − p_true‖ / ‖p_true‖ over the draws (its own scatter, from the finite number of
draws, is shown beside it), error the mean of ‖p − p_true‖ / ‖p_true‖. Compared: the force balance
with the weights of the start; the same with the weights taken anew at each solution, because the
noise enters the rows through Z(p); both with all the rows' covariance (the dynamic flexibility,
3.37); and the output error, in whose A the model's receptances stand for the measured ones: the
maximum-likelihood answer to errors in the variables, because x̂ = H(p) f is the nearest x that
balances.

``python -m validation.studies rfm_noise_in_a --draws 50`` for 50 draws a level, ``--levels 0.02``
for one level.
"""

from __future__ import annotations

import csv

import numpy as np

from cvxupdate.convex import SolverChoice
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_points import choose_points
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Options, iterate
from validation.studies.bay_case import CORNER, TRUTH, bay, data_of, fe1, step

LEVELS = (0.005, 0.02, 0.05)
LINES = np.arange(10.0, 400.5, 1.0)
METHODS = (
    "force balance, weights of the start",
    "force balance, re-weighted",
    "flexibility, weights of the start",
    "flexibility, re-weighted",
    "output error",
)


def draw(model, exact, level, seed, points=40):
    """{method: p} from so many lines."""
    data = data_of(model, LINES, bay.noisy(exact, level, seed), bay.TEN, CORNER, level / np.sqrt(3))
    data = (data.at(choose_points(model, data, "between", points).lines),)
    problem, choice, options = step(model), SolverChoice(), Options(1e-6, 60, 0.1)
    out = {}
    for kind, words in (("force-balance", "force balance"), ("flexibility", "flexibility")):
        held = iterate(
            FrfResidual(model, data, kind, model.zero()), problem, choice, options, model.zero()
        )
        out[f"{words}, weights of the start"] = held.point.p
        out[f"{words}, re-weighted"] = fit_responses(
            model, data, problem, choice, options, kind
        ).point.p
    out["output error"] = fit_responses(model, data, problem, choice, options).point.p
    return {name: out[name] for name in METHODS}


def study(draws, level, points=40):
    """{method: p of every draw (draws, 40)} at one level, from so many lines."""
    model = fe1()
    exact = bay.receptance(bay.build("X1"), LINES, bay.TEN, CORNER)
    seeds = [round(1e5 * level) * 1000 + k for k in range(draws)]
    found = [draw(model, exact, level, seed, points) for seed in seeds]
    return {name: np.array([f[name] for f in found]) for name in METHODS}


def summary(p):
    """(bias, its scatter, error) of p (draws, 40), relative to ‖p_true‖."""
    size = np.linalg.norm(TRUTH)
    bias = np.linalg.norm(p.mean(axis=0) - TRUTH) / size
    scatter = np.sqrt(np.sum(p.var(axis=0, ddof=1)) / len(p)) / size if len(p) > 1 else np.nan
    return float(bias), float(scatter), float(np.mean(np.linalg.norm(p - TRUTH, axis=1)) / size)


def main(folder, wish):
    """Print and draw bias and error of every method; gives p of all draws."""
    import matplotlib.pyplot as plt

    draws = wish.draws or (1 if wish.quick else 2)
    levels = wish.levels or (LEVELS if wish.draws else LEVELS[1:2])
    found = {}
    rows = [("noise", "method", "draws", "bias", "scatter of the bias", "error")]
    for level in levels:
        methods = found[level] = study(draws, level, 12 if wish.quick else 40)
        print(f"\n{100 * level:g} % noise, {draws} draws: bias of p (± its scatter), mean error")
        for name, p in methods.items():
            bias, scatter, error = summary(p)
            rows.append((level, name, len(p), f"{bias:.4g}", f"{scatter:.4g}", f"{error:.4g}"))
            print(f"  {name:36s} {bias:8.4f} ± {scatter:.4f}   {error:8.4f}", flush=True)
    with (folder / "rfm_noise_in_a.csv").open("w", newline="") as file:
        csv.writer(file).writerows(rows)
    figure, ax = plt.subplots(figsize=(7, 4))
    for name, colour in zip(
        METHODS, ("#d95f02", "#e6ab02", "#7570b3", "#66a61e", "#1f5f99"), strict=True
    ):
        done = [summary(m[name]) for m in found.values()]
        ax.loglog(
            [100 * v for v in found],
            [d[0] for d in done],
            "o-",
            color=colour,
            label=f"bias, {name}",
        )
        ax.loglog(
            [100 * v for v in found], [d[2] for d in done], "o--", color=colour, mfc="none", lw=0.8
        )
    ax.set(
        xlabel="noise (%)",
        ylabel="relative bias (full), error (dashed) of p",
        title="Noise in A: ten coordinates of the bay",
    )
    ax.set_xticks([100 * v for v in found], [f"{100 * v:g}" for v in found])
    ax.minorticks_off()
    ax.legend(fontsize=7)
    figure.tight_layout()
    figure.savefig(folder / "rfm_noise_in_a.png", dpi=130)
    return found
