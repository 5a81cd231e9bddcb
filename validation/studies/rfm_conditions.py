"""The two norm conditions of 5.4 (5.23 to 5.30), the end p → −1, and Fig. 5.5: p-values at the
thesis's ten lines with 0, 0.1 and 0.5 % of noise.

FE1 against X1. Conditions: all 114 coordinates, forces at the corner, eight lines, the plain force
balance (5.20) with noise of one relative size in A and b alike. For each size: ‖A†‖ ‖A_ε‖ (case 1:
≪ 1) and ‖A‖ ‖A_ε†‖ (case 2: ≪ 1), how far the noisy solution p' lies from the truth and from −1,
and what the series (5.27) and (5.29) leave of p' after twelve terms.

Fig. 5.5: 21 coordinates, force at node 1 along z, 135 to 325 Hz as printed (5.5), the thesis's
iteration and `run`'s loop with bounds. ``python -m validation.studies rfm_conditions --draws 20``
for 20 draws; docs/studies.md has their table.
"""

from __future__ import annotations

import csv

import numpy as np

from cvxupdate.residual.frf import FrfResidual
from validation.studies.bay_case import (
    CORNER,
    NINETEEN,
    TRUTH,
    bay,
    data_of,
    error,
    fe1,
    fit,
    ranked,
)
from validation.studies.classic_loop import classic_loop

LINES = np.array([30.0, 75, 118, 145, 190, 240, 281, 330])
PRINTED = np.array([135.0, 155, 180, 210, 230, 257, 280, 300, 310, 325])
SIZES = (1e-8, 1e-7, 1e-6, 1e-5, 1e-4, 1e-2, 1.0, 1e2, 1e4, 1e6)
TERMS = 12


def equations(model, H, labels):
    """A and b of (5.20), in newtons."""
    data = data_of(model, LINES, H, labels, CORNER, 0.01)
    system = FrfResidual(model, (data,), "force-balance").evaluate(model.zero()).system()
    return system.A, system.b


def series(first, ratio, gap):
    """first − R gap + R² gap − … (5.27, 5.29), to `TERMS` terms."""
    out, term = first.copy(), gap
    for _ in range(TERMS):
        term = -ratio @ term
        out = out + term
    return out


def conditions(model, sizes=SIZES):
    """A row for each size: (size, ‖A†‖‖A_ε‖, ‖A‖‖A_ε†‖, ρ₁, ρ₂, distance of p' from the truth and
    from −1, what (5.27) and (5.29) leave of p', and of p_ε from −1), distances relative."""
    real = bay.build("X1")
    exact = bay.receptance(real, LINES, real.labels, CORNER)
    A, b = equations(model, exact, real.labels)
    noise = np.random.default_rng(530).standard_normal(exact.shape)
    minus = -np.ones(len(TRUTH))
    out = []
    for size in sizes:
        # (5.22) is linear in the receptances: what noise adds is that of the difference, and the
        # unit force stands in b alone
        noisy_A, noisy_b = equations(model, exact * (1 + size * noise), real.labels)
        A_e, b_e = noisy_A - A, noisy_b - b
        p = np.linalg.lstsq(noisy_A, noisy_b, rcond=None)[0]
        p_e = np.linalg.lstsq(A_e, b_e, rcond=None)[0]
        one, two = np.linalg.pinv(A) @ A_e, np.linalg.pinv(A_e) @ A
        norm = lambda x: float(np.linalg.norm(x))  # noqa: E731
        out.append(
            (
                size,
                norm_of(np.linalg.pinv(A)) * norm_of(A_e),
                norm_of(A) * norm_of(np.linalg.pinv(A_e)),
                radius(one),
                radius(two),
                norm(p - TRUTH) / norm(TRUTH),
                norm(p - minus) / norm(minus),
                norm(series(TRUTH, one, TRUTH - p_e) - p) / norm(p),
                norm(series(p_e, two, p_e - TRUTH) - p) / norm(p),
                norm(p_e - minus) / norm(minus),
            )
        )
    return out


def norm_of(A):
    """The largest singular value."""
    return float(np.linalg.norm(A, 2))


def radius(A):
    """The spectral radius."""
    return float(np.abs(np.linalg.eigvals(A)).max())


def printed_lines(model, draws, levels=(0.0, 0.001, 0.005)):
    """{level: [(error by the thesis's iteration, by `run`'s loop, ranked by it) of each draw]} at
    the lines of Fig. 5.4."""
    real = bay.build("X1")
    exact = bay.receptance(real, PRINTED, NINETEEN, ("n1.z",))
    out = {}
    for level in levels:
        for k in range(draws if level else 1):
            H = bay.noisy(exact, level, 5_500 + k) if level else exact
            data = data_of(model, PRINTED, H, NINETEEN, ("n1.z",), max(level, 1e-4) / np.sqrt(3))
            plain = classic_loop(FrfResidual(model, (data,), "flexibility").evaluate, model.zero())
            mine = fit(model, data).point.p
            out.setdefault(level, []).append(
                (error(plain.p) if plain.converged else np.inf, error(mine), ranked(mine), plain.p)
            )
    return out


def main(folder, wish):
    """Print both, draw Fig. 5.5; gives them."""
    import matplotlib.pyplot as plt

    model = fe1()
    rows = conditions(model, SIZES[::3] if wish.quick else SIZES)
    head = (
        "noise",
        "|A+||Ae|",
        "|A||Ae+|",
        "rho 1",
        "rho 2",
        "p' - p",
        "p' + 1",
        "(5.27)",
        "(5.29)",
        "pe + 1",
    )
    print("".join(f"{h:>10s}" for h in head))
    for row in rows:
        print("".join(f"{v:>10.2g}" for v in row))
    found = printed_lines(model, wish.draws or 1)
    for level, runs in found.items():
        plain, mine = (np.array([r[i] for r in runs]) for i in (0, 1))
        print(
            f"{100 * level:g} % at the ten printed lines: median error of p {np.median(plain):.3g} "
            f"by the thesis's iteration (diverged {int(np.sum(~np.isfinite(plain)))} of "
            f"{len(runs)}), {np.median(mine):.3g} by run; all ten wrong elements above the sound "
            f"ones in {sum(r[2] for r in runs)} of {len(runs)}"
        )
    figure, axes = plt.subplots(len(found), 1, figsize=(8, 7), sharex=True, layout="constrained")
    for ax, (level, runs) in zip(np.atleast_1d(axes), found.items(), strict=True):
        ax.bar(np.arange(1, 41), runs[0][3])
        ax.set(ylabel=f"p, {100 * level:g} %")
    axes[-1].set(xlabel="stiffness of elements 1 to 20, mass of elements 1 to 20")
    figure.savefig(folder / "rfm_figure_5_5.png", dpi=120)
    plt.close(figure)
    with (folder / "rfm_conditions.csv").open("w", newline="") as file:
        csv.writer(file).writerows([head, *rows])
    return rows, found
