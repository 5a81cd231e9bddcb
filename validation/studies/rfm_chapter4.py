"""Figs 4.3 to 4.7 and the claims of 2.9 and 4.8: the chain at 10 and 15 % noise and the bay at 1 %
by truncated SVD, total least squares, least squares and maximum entropy, the levels swept.

Chain: five coordinates, 25 lines below 200 Hz, Gaussian noise, 21 p-values. Bay: FE1 against X1, 21
coordinates, force at node 1 along z, 40 p-values. Every method takes the force balance weighted by
the dynamic flexibility (3.37) at the present p and solves it for all of p, until p stays (at most
30 times). Errors: ‖p − p_true‖ / ‖p_true‖, and the mean difference of 20 log₁₀|α₅₅| from the exact
one over 5 to 200 Hz, in dB (of the bay α₃₃, n3.z to n3.z). A run that ends in no structure, or does
not settle, counts as diverged; its last p is judged all the same.

``python -m validation.studies rfm_chapter4 --draws 20`` for 20 draws; docs/studies.md has their
table.
"""

from __future__ import annotations

import csv
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import CvxupdateError, ModelError
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_points import choose_points
from cvxupdate.study import open_problem
from cvxupdate.update.classic_curves import entropy
from cvxupdate.update.classic_solvers import (
    conjugate_gradients,
    landweber,
    picard,
    svd_least_squares,
    total_least_squares,
)
from validation.studies.bay_case import NINETEEN, PROBLEMS, bay, data_of, fe1, make_rfm
from validation.studies.bay_case import TRUTH as BAY_TRUTH

SEEN, DRIVEN = tuple(f"n{i}.x" for i in (1, 4, 6, 7, 10)), ("n1.x",)
EPSILONS = (1e-8, 0.01, 0.02, 0.05, 0.1, 0.2, 0.4)
ALPHAS = (1e-2, 1.0, 1e1, 1e2, 1e3, 1e4)
LOST = 5.0
"""Size of p beyond which an iteration has run away."""


@dataclass(frozen=True)
class Run:
    """The last ``p``, the ``iterations``, and whether it ``settled``."""

    p: np.ndarray
    iterations: int
    settled: bool


def iterated(model, data, solve, most=30):
    """p ← solve(A, b) of the equations at p, until it stays."""
    p = model.zero()
    for number in range(1, most + 1):
        try:
            system = FrfResidual(model, (data,), "flexibility", p).evaluate(p).system()
            new = solve(*system.weighted())
            if not np.all(np.abs(new) < LOST):
                return Run(p, number, False)
            model.matrices(new)
        except (CvxupdateError, ModelError, np.linalg.LinAlgError):
            return Run(p, number, False)
        moved, p = float(np.max(np.abs(new - p))), new
        if moved < 1e-4:
            return Run(p, number, True)
    return Run(p, most, False)


def curve(model, p, frequency, label):
    """|α| of a point receptance, (lines,)."""
    m = model.matrices(p)
    K, M, at = m.K.toarray(), m.M.toarray(), model.place[label]
    unit = np.eye(len(K))[at]
    return np.array(
        [abs(np.linalg.solve(K - (2 * np.pi * f) ** 2 * M, unit)[at]) for f in frequency]
    )


def decibels(a, b):
    """Mean difference of two curves."""
    return float(np.mean(np.abs(20 * np.log10(a / b))))


class Case:
    """A model, its truth, exact receptances to draw noise on, and the curve to compare."""

    def __init__(self, model, truth, lines, exact, labels, point):
        self.model, self.truth, self.lines = model, truth, lines
        self.exact, (self.seen, self.driven) = exact, labels
        self.shown, self.point = np.arange(5.0, 200.5, 1.0), point
        self.target = curve(model, truth, self.shown, point)

    def data(self, noise, seed):
        """Receptances with Gaussian noise."""
        rng = np.random.default_rng(seed)
        H = self.exact * (1 + noise * rng.standard_normal(self.exact.shape))
        return data_of(self.model, self.lines, H, self.seen, self.driven, noise)

    def judged(self, run):
        """(error of p, of the curve in dB, iterations, settled)."""
        gap = np.linalg.norm(run.p - self.truth) / np.linalg.norm(self.truth)
        seen = decibels(curve(self.model, run.p, self.shown, self.point), self.target)
        return float(gap), seen, run.iterations, run.settled


def chain():
    """The chain of 3.3 at its 25 lines."""
    model = open_problem(PROBLEMS / "chain10/noisy/problem.toml")[1]
    change = make_rfm.CHAIN_CHANGE
    truth = np.array(
        [change["k"].get(i, 1.0) - 1 for i in range(1, 12)]
        + [change["m"].get(i, 1.0) - 1 for i in range(1, 11)]
    )
    m = model.matrices(truth)
    band = np.arange(5.0, 200.5, 1.0)
    places = [np.array([model.place[q] for q in names]) for names in (SEEN, DRIVEN)]
    K, M = m.K.toarray(), m.M.toarray()
    H = np.array([np.linalg.inv(K - (2 * np.pi * f) ** 2 * M)[np.ix_(*places)] for f in band])
    lines = choose_points(model, data_of(model, band, H, SEEN, DRIVEN, 0.1), "between", 25).lines
    return Case(model, truth, band[lines], H[lines], (SEEN, DRIVEN), "n5.x")


def frame(count):
    """The bay of 3.4.2 at ``count`` lines between its resonances, 10 to 200 Hz."""
    model, real = fe1(), bay.build("X1")
    band = np.arange(10.0, 200.5, 1.0)
    exact = bay.receptance(real, band, NINETEEN, ("n1.z",))
    data = data_of(model, band, exact, NINETEEN, ("n1.z",), 0.01)
    lines = choose_points(model, data, "between", count).lines
    return Case(model, BAY_TRUTH, band[lines], exact[lines], (NINETEEN, ("n1.z",)), "n3.z")


def swept(case, noise, draws, solvers, first=4_300):
    """{name: [(error, dB, iterations, settled) of each draw]}."""
    out = {}
    for k in range(draws):
        data = case.data(noise, first + k)
        for name, solve in solvers.items():
            out.setdefault(name, []).append(case.judged(iterated(case.model, data, solve)))
    return out


def by_levels(levels, solve):
    """Solvers with each level, by its number."""
    return {f"{n}": (lambda A, b, n=n: solve(A, b, n)) for n in levels}


def tls(A, b, rank):
    """Total least squares of a given rank."""
    return total_least_squares(A, b, rank=rank).p


def tls_epsilon(A, b, epsilon):
    """Total least squares whose rank is lowered until |α| ≥ ε (step 4 of 4.5)."""
    return total_least_squares(A, b, epsilon=epsilon).p


def table(title, found, rows):
    """Print and keep the medians."""
    print(title)
    for name, runs in found.items():
        gap, seen, steps, settled = (np.array(v, dtype=float) for v in zip(*runs, strict=True))
        row = (title, name, np.median(gap), np.median(seen), np.median(steps), int(settled.sum()))
        rows.append((*row, len(runs)))
        print(
            f"  {name:>22s}: p {row[2]:.3g}, curve {row[3]:.2f} dB, {row[4]:.0f} iterations, "
            f"settled {row[5]} of {len(runs)}"
        )


def sweeps(case, draws):
    """How many iterations Landweber and conjugate gradients need to the noise on the first
    equations of each draw (2.9)."""
    out = {"landweber": [], "conjugate gradients": []}
    for k in range(draws):
        data = case.data(0.1, 4_300 + k)
        zero = case.model.zero()
        A, b = FrfResidual(case.model, (data,), "flexibility").evaluate(zero).system().weighted()
        noise = picard(A, b).noise * np.sqrt(len(b))
        for name, way in (("landweber", landweber), ("conjugate gradients", conjugate_gradients)):
            out[name].append(way(A, b, 20_000, noise).iterations)
    return out


def drawn(case, found, folder, names, noise, first=4_300):
    """The curve of the first draw by some of the solvers, over the target."""
    import matplotlib.pyplot as plt

    figure, ax = plt.subplots(figsize=(8, 4), layout="constrained")
    ax.semilogy(case.shown, case.target, "k-", lw=1.2, label="target")
    ax.semilogy(
        case.shown, curve(case.model, case.model.zero(), case.shown, case.point), ":", label="model"
    )
    data = case.data(noise, first)
    for name, solve in names.items():
        p = iterated(case.model, data, solve).p
        ax.semilogy(case.shown, curve(case.model, p, case.shown, case.point), "--", label=name)
    ax.set(xlabel="frequency (Hz)", ylabel=f"|receptance| at {case.point} (m/N)")
    ax.legend(fontsize=8)
    figure.savefig(folder / f"{found}.png", dpi=120)
    plt.close(figure)


def main(folder, wish):
    """Every comparison; gives the rows (title, name, medians …)."""
    draws = wish.draws or (2 if wish.quick else 4)
    rows = []
    ten = chain()
    full = len(ten.truth)
    levels = (full, 17) if wish.quick else (full, 20, 19, 18, 17, 16, 15, 14, 12, 10, 8)
    table(
        "chain, 10 %: truncated SVD, n_t (Fig. 4.3)",
        swept(ten, 0.1, draws, by_levels(levels, svd_least_squares)),
        rows,
    )
    epsilons = EPSILONS[3:4] if wish.quick else EPSILONS
    table(
        "chain, 10 %: total least squares, epsilon (Fig. 4.4)",
        swept(ten, 0.1, draws, by_levels(epsilons, tls_epsilon)),
        rows,
    )
    for noise in (0.15,) if wish.quick else (0.1, 0.15):
        own = {"LLS": svd_least_squares}
        own |= {f"TSVD {n}": s for n, s in by_levels(levels[1:], svd_least_squares).items()}
        own |= {
            f"TLS {n}": s for n, s in by_levels(levels[:1] if wish.quick else levels, tls).items()
        }
        table(
            f"chain, {100 * noise:g} %: TSVD, TLS, LLS (Fig. 4.5)",
            swept(ten, noise, draws, own),
            rows,
        )
    alphas = ALPHAS[2:4] if wish.quick else ALPHAS
    table(
        "chain, 10 %: maximum entropy, alpha (Fig. 4.6)",
        swept(ten, 0.1, 1 if wish.quick else draws, by_levels(alphas, entropy)),
        rows,
    )
    counts = sweeps(ten, draws)
    print(
        "iterations to the noise (2.9): "
        + ", ".join(f"{name} {np.median(n):.0f}" for name, n in counts.items())
    )
    for count in (5,) if wish.quick else (5, 10, 20, 40):
        some = {"LLS": svd_least_squares}
        ranks = (32,) if wish.quick else (38, 36, 34, 32, 28, 24)
        some |= {f"TSVD {n}": s for n, s in by_levels(ranks, svd_least_squares).items()}
        some |= {
            f"TLS {n}": s for n, s in by_levels(ranks if wish.quick else (40, *ranks), tls).items()
        }
        table(
            f"bay, 1 %, {count} lines (Fig. 4.7)",
            swept(frame(count), 0.01, 1 if wish.quick else draws, some),
            rows,
        )
    drawn(
        ten,
        "rfm_chapter4_chain",
        folder,
        {f"TSVD {n}": s for n, s in by_levels((full, 20, 17), svd_least_squares).items()},
        0.1,
    )
    with (folder / "rfm_chapter4.csv").open("w", newline="") as file:
        head = ("comparison", "level", "error of p", "dB", "iterations", "settled", "draws")
        csv.writer(file).writerows([head, *rows])
    return rows, counts
