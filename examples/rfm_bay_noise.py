"""Noise where the thesis diverged (3.4.2): FE1 against X1, ten coordinates, 0.5 to 5 % noise. ``python rfm_bay_noise.py OUT 50`` runs 50 draws a level
(a quarter of an hour), ``… OUT 50 0.005`` one level, ``… OUT 5 all`` every penalty.

Plain: the thesis's own iteration, force balance by SVD least squares, no bounds, no trust region, the same lines. Then the package's loop without a
penalty and with each of several; the p-error of each against the truth.
"""

from __future__ import annotations

import sys

import numpy as np
from shared.bay_case import CORNER, bay, data_of, error, fe1, fit, out_folder, ranked

from cvxupdate.convex import L1, Entropy, GroupL1, Tikhonov
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_points import choose_points
from cvxupdate.update.classic_loop import classic_loop
from cvxupdate.update.trust_region import objective_at

LEVELS = (0.005, 0.01, 0.02, 0.05)
POINTS = 40
LINES = np.arange(10.0, 400.5, 1.0)
# One standard deviation of the p-values that an engineer would expect (5 %), as the weight of a squared penalty.
PENALTIES = {
    "none": (), "tikhonov (5 % prior)": (Tikhonov(1 / 0.05**2),), "entropy (5 % prior)": (Entropy(2 / 0.05**2),), "l1 (gcv)": (L1("gcv"),),
    "group-l1 (gcv)": (GroupL1("gcv"),), "l1 (discrepancy)": (L1("discrepancy"),), "l1 (l-curve)": (L1("l-curve"),),
}


def draw(model, exact, level, seed, names=tuple(PENALTIES)):
    """One draw: {name: (error, ranked, status, never worse than the start, iterations)}."""
    data = data_of(model, LINES, bay.noisy(exact, level, seed), bay.TEN, CORNER, level / np.sqrt(3))
    data = data.at(choose_points(model, data, "between", POINTS).lines)
    out = {}
    balance = FrfResidual(model, (data,), "flexibility")
    plain = classic_loop(balance.evaluate, model.zero(), tolerance=1e-4, max_iterations=30)
    out["plain SVD"] = (error(plain.p), ranked(plain.p), "converged" if plain.converged else "diverged", None, plain.iterations)
    judge = FrfResidual(model, (data,), "receptance")
    for name in names:
        loop = fit(model, data, PENALTIES[name])
        before, after = (objective_at(loop.problem, judge.evaluate(p)) for p in (model.zero(), loop.point.p))
        out[name] = (error(loop.point.p), ranked(loop.point.p), loop.status, bool(after <= before), len(loop.history))
    return out


def study(draws, level, names=tuple(PENALTIES)):
    """Draws of one level; seeds 1e8·level + draw."""
    model, real = fe1(), bay.build("X1")
    exact = bay.receptance(real, LINES, bay.TEN, CORNER)
    return [draw(model, exact, level, round(1e5 * level) * 1000 + k, names) for k in range(draws)]


def say(level, some, rows):
    """The table of one level."""
    print(f"\n{100 * level:g} % noise, {len(some)} draws: ‖p − p_true‖/‖p_true‖ mean (worst); converged; ranked right; not worse than the start")
    for name in rows:
        e = np.array([d[name][0] for d in some])
        converged = sum(d[name][2] == "converged" for d in some)
        better = "-" if name == "plain SVD" else str(sum(bool(d[name][3]) for d in some))
        print(f"  {name:22s} {e.mean():9.3g} ({e.max():9.3g})   {converged:3d}   {sum(d[name][1] for d in some):3d}   {better:>3s}   "
              f"{np.mean([d[name][4] for d in some]):.0f} iterations", flush=True)


def main():
    import matplotlib.pyplot as plt

    chosen = tuple(v for v in LEVELS if f"{v:g}" in sys.argv[3:]) or LEVELS
    folder, draws = out_folder("rfm_bay_noise")
    names = tuple(PENALTIES) if "all" in sys.argv else ("none", "tikhonov (5 % prior)", "l1 (gcv)") if draws is None else ("none", "l1 (gcv)")
    rows, found = ["plain SVD", *names], {}
    for level in chosen if draws else (0.005, 0.05):
        found[level] = study(draws or 1, level, names)
        say(level, found[level], rows)
    figure, ax = plt.subplots(figsize=(6.5, 4.2))
    for name in rows:
        ax.loglog([100 * v for v in found], [np.median([d[name][0] for d in s]) for s in found.values()], "o-", label=name)
    ax.axhline(1.0, color="0.6", lw=0.8)
    ax.set(xlabel="noise (%)", ylabel="relative error of p (median)", ylim=(None, 1e2), title="Bay, ten coordinates: FE1 against X1")
    ax.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "rfm_bay_noise.png", dpi=130)


if __name__ == "__main__":
    main()
