"""Noise where the thesis diverged (3.4.2): FE1 against X1, ten coordinates, 0.5 to 5 % noise.
``python -m validation.studies rfm_bay_noise --draws 50`` runs 50 draws a level (a quarter of an
hour), ``--levels 0.005`` one level, ``--draws 5 --every`` every penalty.

Plain: the thesis's own iteration, force balance by SVD least squares, no bounds, no trust region,
the same lines. Then the package's loop without a penalty and with each of several; the p-error of
each against the truth. problems/bay/noise.md has the table of 50 draws a level.
"""

from __future__ import annotations

import csv

import numpy as np

from cvxupdate.convex import L1, Entropy, GroupL1, Tikhonov
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_points import choose_points
from cvxupdate.update.trust_region import objective_at
from validation.studies.bay_case import CORNER, bay, data_of, error, fe1, fit, ranked
from validation.studies.classic_loop import classic_loop

LEVELS = (0.005, 0.01, 0.02, 0.05)
POINTS = 40
LINES = np.arange(10.0, 400.5, 1.0)
# One standard deviation of the p-values that an engineer would expect (5 %), as the weight of a
# squared penalty.
PENALTIES = {
    "none": (),
    "tikhonov (5 % prior)": (Tikhonov(1 / 0.05**2),),
    "entropy (5 % prior)": (Entropy(2 / 0.05**2),),
    "l1 (gcv)": (L1("gcv"),),
    "group-l1 (gcv)": (GroupL1("gcv"),),
    "l1 (discrepancy)": (L1("discrepancy"),),
    "l1 (l-curve)": (L1("l-curve"),),
}


def draw(model, exact, level, seed, names=tuple(PENALTIES)):
    """One draw: {name: (error, ranked, status, never worse than the start, iterations)}."""
    data = data_of(model, LINES, bay.noisy(exact, level, seed), bay.TEN, CORNER, level / np.sqrt(3))
    data = data.at(choose_points(model, data, "between", POINTS).lines)
    out = {}
    balance = FrfResidual(model, (data,), "flexibility")
    plain = classic_loop(balance.evaluate, model.zero(), tolerance=1e-4, max_iterations=30)
    out["plain SVD"] = (
        error(plain.p),
        ranked(plain.p),
        "converged" if plain.converged else "diverged",
        None,
        plain.iterations,
    )
    judge = FrfResidual(model, (data,), "receptance")
    for name in names:
        loop = fit(model, data, PENALTIES[name])
        before, after = (
            objective_at(loop.problem, judge.evaluate(p)) for p in (model.zero(), loop.point.p)
        )
        out[name] = (
            error(loop.point.p),
            ranked(loop.point.p),
            loop.status,
            bool(after <= before),
            len(loop.history),
        )
    return out


def study(draws, level, names=tuple(PENALTIES)):
    """Draws of one level; seeds 1e8·level + draw."""
    model, real = fe1(), bay.build("X1")
    exact = bay.receptance(real, LINES, bay.TEN, CORNER)
    return [draw(model, exact, level, round(1e5 * level) * 1000 + k, names) for k in range(draws)]


COLUMNS = (
    "noise",
    "method",
    "draws",
    "mean error",
    "median error",
    "worst error",
    "converged",
    "ranked",
    "not worse than the start",
    "mean iterations",
)


def summary(level, some, name):
    """A row of `COLUMNS`."""
    e = np.array([d[name][0] for d in some])
    better = "" if name == "plain SVD" else sum(bool(d[name][3]) for d in some)
    return (
        level,
        name,
        len(some),
        f"{e.mean():.4g}",
        f"{np.median(e):.4g}",
        f"{e.max():.4g}",
        sum(d[name][2] == "converged" for d in some),
        sum(d[name][1] for d in some),
        better,
        f"{np.mean([d[name][4] for d in some]):.1f}",
    )


def say(rows):
    """The table of one level."""
    print(
        f"\n{100 * rows[0][0]:g} % noise, {rows[0][2]} draws: ‖p − p_true‖/‖p_true‖ mean "
        "(worst); converged; ranked right; not worse than the start"
    )
    for _, name, _, mean, _, worst, converged, right, better, iterations in rows:
        print(
            f"  {name:22s} {mean:>9s} ({worst:>9s})   {converged:3d}   {right:3d}   "
            f"{better!s:>3s}   {iterations} iterations",
            flush=True,
        )


def asked(wish):
    """(levels, penalties) of a wish."""
    if wish.quick:
        return (0.02,), ("none", "tikhonov (5 % prior)")
    if wish.every:
        names = tuple(PENALTIES)
    else:
        names = ("none", "l1 (gcv)") if wish.draws else ("none", "tikhonov (5 % prior)", "l1 (gcv)")
    return wish.levels or (LEVELS if wish.draws else (LEVELS[0], LEVELS[-1])), names


def main(folder, wish):
    """Draw and print the table of every level; gives the tables."""
    import matplotlib.pyplot as plt

    levels, names = asked(wish)
    rows, found = ["plain SVD", *names], {}
    for level in levels:
        some = study(wish.draws or 1, level, names)
        found[level] = [summary(level, some, name) for name in rows]
        say(found[level])
    with (folder / "rfm_bay_noise.csv").open("w", newline="") as file:
        csv.writer(file).writerows([COLUMNS, *(row for table in found.values() for row in table)])
    figure, ax = plt.subplots(figsize=(6.5, 4.2))
    percent = [100 * v for v in found]
    for k, name in enumerate(rows):
        ax.loglog(
            percent,
            [float(table[k][4]) for table in found.values()],
            "o-",
            color=f"C{k}",
            label=name,
        )
        ax.loglog(
            percent, [float(table[k][5]) for table in found.values()], ":", color=f"C{k}", lw=0.9
        )
    ax.axhline(1.0, color="0.6", lw=0.8)
    ax.set(
        xlabel="noise (%)",
        ylabel="relative error of p: median, dotted the worst",
        ylim=(None, 20),
        title="Bay, ten coordinates: FE1 against X1",
    )
    ax.set_xticks(percent, [f"{v:g}" for v in percent])
    ax.minorticks_off()
    ax.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "rfm_bay_noise.png", dpi=130)
    return found
