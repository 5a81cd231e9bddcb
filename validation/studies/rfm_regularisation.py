"""Fig. 4.8 again: one set of equations, 105 x 40, with noise in A and b, solved by each method of
chapter 4 (4.7.3), and what is claimed of TLS.

The equations are the force balance of FE1 against X1 at 21 coordinates and five lines (3.26),
linearised at the model as it stands, its rows scaled by the dynamic flexibility and the receptances
(3.34). The error is against the solution without noise. Two truncations: the best that exists in
hindsight, as the thesis chose its n_t and epsilon, and the one that Picard's condition finds. TLS
also with its columns scaled by the deviation of the noise in each (T of 4.14), found by simulation
on the model alone. ``python -m validation.studies rfm_regularisation --draws 50`` for 50
draws; problems/bay/noise.md has their table.

What the thesis claims of TLS, after 50 draws a level (4.7.3, 10.1 viii):
 "superior to LLS when the noise variance is large": confirmed only with the rank lowered in
 hindsight (a fifth of LLS's error at 1e-3). At full rank
 TLS is never better than LLS and blows up from a variance of 3e-5 on, because the smallest singular
 value of A falls below the noise.
 "superior to TSVD when the noise variance is large": refuted. At the best rank of each they agree
 within 6 %, TSVD a little ahead from 3e-5 on: the
 gain comes from the lower rank, not from the errors in A. Columns scaled by their noise make it
 worse.
 "differences are not significant within the radius of convergence (below 1e-4)": refuted. At 1e-4
 LLS has three times the error of TSVD or TLS,
 and L1, which the thesis lacked, has less than two thirds of theirs.
 "accuracy substantially deteriorates for TLSQ and LLS at large variance" (chapter 10, at odds with
 4.7.3): confirmed for full rank.
"""

from __future__ import annotations

import csv

import numpy as np

from cvxupdate.convex import L1, Norm, Robust, Tikhonov, solve_step
from cvxupdate.fe.synthesis import receptance
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.system import LinearSystem
from cvxupdate.update.classic_solvers import picard, svd_least_squares, total_least_squares
from validation.studies.bay_case import NINETEEN, bay, data_of, fe1, step

LINES = np.array([30.0, 75.0, 118.0, 145.0, 190.0])
VARIANCES = (0.0, 1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)


def equations(model, H):
    """A p = b of (3.37) for receptances H, weighted by the noise-free deviations of 1 %."""
    data = data_of(model, LINES, H, NINETEEN, ("n1.z",), 0.01)
    return FrfResidual(model, (data,), "flexibility").evaluate(model.zero()).system()


def scaled(system, weights):
    """The same rows with other weights."""
    return LinearSystem(system.A, system.b, weights, system.columns, system.rows)


def noise_of_columns(model, weights, draws=20):
    """The r.m.s. deviation of each column of W [A b] for a relative noise of 1 in every receptance,
    by simulation on the model alone."""
    at = [np.array([model.place[q] for q in names]) for names in (NINETEEN, ("n1.z",))]
    H = receptance(model, LINES, *at)
    rng = np.random.default_rng(4_801)
    both = []
    for k in range(draws + 1):
        A, b = scaled(
            equations(model, H * (1 + 1e-3 * rng.standard_normal(H.shape) * (k > 0))), weights
        ).weighted()
        both.append(np.column_stack([A, b]))
    return np.sqrt(np.mean((np.array(both[1:]) - both[0]) ** 2, axis=(0, 1))) / 1e-3


def total(A, b, T):
    """Total least squares of every rank from 20 on; ``T`` scales the columns."""
    s, n = np.linalg.svd(np.column_stack([A, b]) * T, compute_uv=False), A.shape[1]
    noise = [
        np.sqrt(0.5 * (s[k - 1] ** 2 + s[k] ** 2) / (2 * max(A.shape))) if k < n else None
        for k in range(20, n + 1)
    ]
    return [total_least_squares(A, b, T=T, noise=v).p for v in noise]


def solutions(model, system, reference, columns):
    """{method: p}; ``columns`` the deviation of the noise in each column of [A b]."""
    A, b = system.weighted()
    problem = lambda *r, loss=None: solve_step(step(model, r, loss=loss), system).p  # noqa: E731
    n = A.shape[1]
    tsvd = [svd_least_squares(A, b, k) for k in range(20, n + 1)]
    best = lambda some: min(some, key=lambda p: np.linalg.norm(p - reference))  # noqa: E731
    return {
        "LLS": svd_least_squares(A, b),
        "TLS (full rank)": total_least_squares(A, b).p,
        "TSVD (best level)": best(tsvd),
        "TLS (best rank)": best(total(A, b, np.ones(n + 1))),
        "TLS (scaled, best rank)": best(
            total(A, b, 1.0 / np.maximum(columns, 1e-3 * columns.max()))
        ),
        "TSVD (Picard)": svd_least_squares(A, b, picard(A, b).level),
        "Tikhonov (gcv)": problem(Tikhonov("gcv")),
        "L1 (gcv)": problem(L1("gcv")),
        "robust": problem(Robust(uncertainty(A)), loss=Norm()),
    }


def uncertainty(A):
    """An error of 0.2 % of [A b]: what a careful test may state beforehand."""
    return 0.002 * np.linalg.norm(A)


def study(draws, variances=VARIANCES):
    """{variance: {method: relative errors in %}}."""
    model, real = fe1(), bay.build("X1")
    exact = bay.receptance(real, LINES, NINETEEN, ("n1.z",))
    clean = equations(model, exact)
    keep = np.abs(clean.A).max(axis=1) > 0
    reference = svd_least_squares(*clean.weighted())
    columns = noise_of_columns(model, clean.weights)
    out = {}
    for variance in variances:
        errors = {}
        for k in range(draws if variance else 1):
            rng = np.random.default_rng(48_000 + k)
            H = exact * (1 + np.sqrt(variance) * rng.standard_normal(exact.shape))
            found = solutions(model, scaled(equations(model, H), clean.weights), reference, columns)
            for name, p in found.items():
                errors.setdefault(name, []).append(
                    100 * np.linalg.norm(p - reference) / np.linalg.norm(reference)
                )
        out[variance] = errors
    return out, int(keep.sum())


def main(folder, wish):
    """Print and draw the errors of every method; gives them."""
    import matplotlib.pyplot as plt

    draws = wish.draws or 1
    variances = (0.0, 1e-5, 1e-3) if wish.quick else VARIANCES
    found, rows = study(draws, variances)
    names = list(next(iter(found.values())))
    print(
        f"{rows} equations, 40 unknowns, {draws} draws. Mean relative error of p (%) "
        "against the noise variance:"
    )
    print(f"{'variance':>20s}" + "".join(f"{v:>10.0e}" for v in found))
    for name in names:
        print(f"{name:>20s}" + "".join(f"{np.mean(e[name]):>10.3g}" for e in found.values()))
    for low, high, word in ((VARIANCES[1], 1e-4, "up to 1e-4"), (3e-4, 1e-3, "above 1e-4")):
        ratios = {
            name: np.mean(
                [
                    np.mean(found[v][name]) / np.mean(found[v]["LLS"])
                    for v in variances
                    if low <= v <= high
                ]
            )
            for name in names
        }
        print(
            f"against LLS, variance {word}: "
            + ", ".join(f"{name} {r:.3g}" for name, r in ratios.items())
        )
    with (folder / "rfm_regularisation.csv").open("w", newline="") as file:
        csv.writer(file).writerows(
            [
                ("method", "variance", "draws", "mean relative error of p (%)", "worst"),
                *(
                    (name, v, len(e[name]), f"{np.mean(e[name]):.4g}", f"{np.max(e[name]):.4g}")
                    for name in names
                    for v, e in found.items()
                ),
            ]
        )
    figure, ax = plt.subplots(figsize=(6.5, 4.2))
    for name, style in zip(
        names, ("o-", "s-", "^-", "v--", "d:", "x-", "*-", "+-", "1-"), strict=True
    ):
        ax.loglog(
            variances[1:],
            [np.mean(found[v][name]) for v in variances[1:]],
            style,
            ms=4,
            lw=1,
            label=name,
        )
    ax.set_ylim(1, 1000)  # TLS of full rank leaves the figure
    ax.set(
        xlabel="noise variance",
        ylabel="relative error of p (%)",
        title="Fig. 4.8 again: noise in A and in b",
    )
    ax.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "rfm_regularisation.png", dpi=130)
    return found
