"""Fig. 4.8 again: one set of equations, 105 x 40, with noise in A and b, solved by each method of chapter 4 (4.7.3), and what is claimed of TLS.

The equations are the force balance of FE1 against X1 at 21 coordinates and five lines (3.26), linearised at the model as it stands, its rows scaled by
the dynamic flexibility and the receptances (3.34). The error is against the solution without noise. Two truncations: the best that exists in
hindsight, as the thesis chose its n_t and epsilon, and the one that Picard's condition finds. ``python rfm_regularisation.py OUT 50`` for 50 draws.
"""

from __future__ import annotations

import numpy as np
from shared.bay_case import NINETEEN, bay, data_of, fe1, out_folder, step

from cvxupdate.convex import L1, Norm, Robust, Tikhonov, solve_step
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.system import LinearSystem
from cvxupdate.update.classic_solvers import picard, svd_least_squares, total_least_squares

LINES = np.array([30.0, 75.0, 118.0, 145.0, 190.0])
VARIANCES = (0.0, 1e-6, 1e-5, 3e-5, 1e-4, 3e-4, 1e-3)


def equations(model, H):
    """A p = b of (3.37) for receptances H, weighted by the noise-free deviations of 1 %."""
    data = data_of(model, LINES, H, NINETEEN, ("n1.z",), 0.01)
    return FrfResidual(model, (data,), "flexibility").evaluate(model.zero()).system()


def scaled(system, weights):
    return LinearSystem(system.A, system.b, weights, system.columns, system.rows)


def solutions(model, system, reference):
    """{method: p}."""
    A, b = system.weighted()
    problem = lambda *r, loss=None: solve_step(step(model, r, loss=loss), system).p  # noqa: E731
    n = A.shape[1]
    tsvd = [svd_least_squares(A, b, k) for k in range(20, n + 1)]
    tls = []
    for k in range(20, n + 1):
        s = np.linalg.svd(np.column_stack([A, b]), compute_uv=False)
        noise = np.sqrt(0.5 * (s[k - 1] ** 2 + s[k] ** 2) / (2 * max(A.shape))) if k < n else None
        tls.append(total_least_squares(A, b, noise=noise).p)
    best = lambda some: min(some, key=lambda p: np.linalg.norm(p - reference))  # noqa: E731
    return {
        "LLS": svd_least_squares(A, b), "TLS (full rank)": total_least_squares(A, b).p,
        "TSVD (best level)": best(tsvd), "TLS (best rank)": best(tls), "TSVD (Picard)": svd_least_squares(A, b, picard(A, b).level),
        "Tikhonov (gcv)": problem(Tikhonov("gcv")), "L1 (gcv)": problem(L1("gcv")), "robust": problem(Robust(uncertainty(A)), loss=Norm()),
    }


def uncertainty(A):
    """An error of 0.2 % of [A b]: what a careful test may state beforehand."""
    return 0.002 * np.linalg.norm(A)


def study(draws):
    """{variance: {method: relative errors in %}}."""
    model, real = fe1(), bay.build("X1")
    exact = bay.receptance(real, LINES, NINETEEN, ("n1.z",))
    clean = equations(model, exact)
    keep = np.abs(clean.A).max(axis=1) > 0
    reference = svd_least_squares(*clean.weighted())
    out = {}
    for variance in VARIANCES:
        errors = {}
        for k in range(draws if variance else 1):
            rng = np.random.default_rng(48_000 + k)
            H = exact * (1 + np.sqrt(variance) * rng.standard_normal(exact.shape))
            found = solutions(model, scaled(equations(model, H), clean.weights), reference)
            for name, p in found.items():
                errors.setdefault(name, []).append(100 * np.linalg.norm(p - reference) / np.linalg.norm(reference))
        out[variance] = errors
    return out, int(keep.sum())


def main():
    import matplotlib.pyplot as plt

    folder, draws = out_folder("rfm_regularisation")
    found, rows = study(draws or 1)
    names = list(next(iter(found.values())))
    print(f"{rows} equations, 40 unknowns, {draws or 1} draws. Mean relative error of p (%) against the noise variance:")
    print(f"{'variance':>20s}" + "".join(f"{v:>10.0e}" for v in found))
    for name in names:
        print(f"{name:>20s}" + "".join(f"{np.mean(e[name]):>10.3g}" for e in found.values()))
    for low, high, word in ((VARIANCES[1], 1e-4, "up to 1e-4"), (3e-4, 1e-3, "above 1e-4")):
        ratios = {name: np.mean([np.mean(found[v][name]) / np.mean(found[v]["LLS"]) for v in VARIANCES if low <= v <= high]) for name in names}
        print(f"against LLS, variance {word}: " + ", ".join(f"{name} {r:.3g}" for name, r in ratios.items()))
    figure, ax = plt.subplots(figsize=(6.5, 4.2))
    for name in names:
        ax.loglog(VARIANCES[1:], [np.mean(found[v][name]) for v in VARIANCES[1:]], "o-", ms=3, label=name)
    ax.set(xlabel="noise variance", ylabel="relative error of p (%)", title="Fig. 4.8 again: noise in A and in b")
    ax.legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "rfm_regularisation.png", dpi=130)


if __name__ == "__main__":
    main()
