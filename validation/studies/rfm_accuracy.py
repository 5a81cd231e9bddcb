"""Chapter 5: how accurate the recordings of the bay must be, which lines are best, and p → −1 when
noise swamps (Figs 5.2 to 5.7).

FE1 against X1, 21 coordinates, force at node 1 along z. The characteristic log function (5.32) is
computed from FE1 alone, with a deviation of 5 % on every parameter; the thesis used the true ΔZ,
which is shown beside it. Then 20 draws of random lines (away from resonances) against the best
lines at 0.5 % noise, for the thesis's iteration and for the loop that ends with the output error.
``python -m validation.studies rfm_accuracy --draws 20`` for 20 draws.
"""

from __future__ import annotations

import numpy as np

from cvxupdate.fe.modes import model_modes
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_accuracy import accuracy
from cvxupdate.residual.frf_points import choose_points
from cvxupdate.update.classic_solvers import svd_least_squares
from validation.studies.bay_case import CORNER, NINETEEN, TRUTH, bay, data_of, error, fe1, fit
from validation.studies.classic_loop import classic_loop

NOISE = 0.005
LEVELS = (0.001, 0.005, 0.01, 0.05, 0.1)
RULES = ("best", "log-function", "between", "random")
LINES = np.arange(20.0, 600.5, 1.0)
BAND = np.arange(20.0, 350.5, 1.0)


def curves(model):
    """(Accuracy from the model alone, Accuracy with the true change) at 0.5 % over 20 to 600 Hz."""
    at = np.array([model.place[q] for q in NINETEEN])
    return accuracy(model, LINES, at, NOISE / np.sqrt(3), rounds=0), accuracy(
        model, LINES, at, NOISE / np.sqrt(3), TRUTH, rounds=0
    )


def compare(model, count, draws, rules=RULES):
    """Errors of p: {rule: {"plain" or "auto": [error of each draw]}}; the last of ``rules`` is
    "random". Noise differs from draw to draw, alike for all rules."""
    real = bay.build("X1")
    exact = bay.receptance(real, BAND, NINETEEN, ("n1.z",))
    peaks = model_modes(model, 30).flexible().frequencies
    calm = np.flatnonzero(np.min(np.abs(BAND[:, None] - peaks) / peaks, axis=1) > 0.02)
    out = {key: {"plain": [], "auto": []} for key in rules}
    for k in range(draws):
        rng = np.random.default_rng(5_000 + k)
        data = data_of(
            model,
            BAND,
            bay.noisy(exact, NOISE, 55_000 + k),
            NINETEEN,
            ("n1.z",),
            NOISE / np.sqrt(3),
        )
        sets = {rule: choose_points(model, data, rule, count).lines for rule in rules[:-1]}
        sets["random"] = np.sort(rng.choice(calm, count, replace=False))
        for key, lines in sets.items():
            some = data.at(lines)
            plain = classic_loop(FrfResidual(model, (some,), "flexibility").evaluate, model.zero())
            out[key]["plain"].append(error(plain.p) if plain.converged else np.inf)
            out[key]["auto"].append(error(fit(model, some).point.p))
    return out


def swamped(model, levels=(0.01, 0.1, 1.0, 10.0, 100.0)):
    """Mean p of the equations (3.9) at complete coordinates when noise of these relative sizes
    stands in A and b."""
    real = bay.build("X1")
    lines = np.array([30.0, 75, 118, 145, 190, 240, 281, 330])
    exact = bay.receptance(real, lines, real.labels, CORNER)
    out = []
    for level in levels:
        rng = np.random.default_rng(530)
        H = exact * (1 + level * rng.standard_normal(exact.shape))
        system = (
            FrfResidual(
                model, (data_of(model, lines, H, real.labels, CORNER, 0.01),), "force-balance"
            )
            .evaluate(model.zero())
            .system()
        )
        p = svd_least_squares(*scaled_rows(system))
        out.append((level, float(p.mean()), float(np.abs(p + 1).max())))
    return out


def scaled_rows(system):
    """The rows as they are, in newtons (5.20)."""
    return system.A, system.b


def main(folder, wish):
    """Draw the curves, compare the rules, print; gives all of it."""
    import matplotlib.pyplot as plt

    rules = ("best", "random") if wish.quick else RULES
    model = fe1()
    guess, known = curves(model)
    figure, axes = plt.subplots(2, 1, figsize=(7, 7), sharex=True)
    for level in LEVELS:
        axes[0].plot(
            guess.frequency,
            guess.log_function + np.log10(level / NOISE),
            lw=0.8,
            label=f"{100 * level:g} %",
        )
    axes[0].axhline(0.0, color="k", lw=0.8)
    axes[0].set(ylabel="characteristic log function (5.32)")
    axes[0].legend(fontsize=8, ncols=5, title="noise, uniform")
    axes[1].plot(guess.frequency, guess.system, label="system component, 5 % on every p")
    axes[1].plot(known.frequency, known.system, label="system component, true change")
    axes[1].plot(guess.frequency, guess.error, label=f"error component, {100 * NOISE:g} %")
    axes[1].set(xlabel="frequency (Hz)", ylabel="log10")
    axes[1].legend(fontsize=8)
    figure.tight_layout()
    figure.savefig(folder / "rfm_log_function.png", dpi=130)
    below = guess.frequency <= 350
    print(
        "bearable noise (r.m.s.) below 350 Hz: median "
        f"{100 * np.median(guess.bearable[below]):.2g} %, best line "
        f"{100 * guess.bearable[below].max():.2g} % at "
        f"{guess.frequency[below][np.argmax(guess.bearable[below])]:g} Hz; with the true "
        f"change median {100 * np.median(known.bearable[below]):.2g} %"
    )
    print(
        "the same lines are best: rank correlation of the two curves "
        f"{rank_correlation(guess.log_function[below], known.log_function[below]):.2f}"
    )
    for count in (10,) if wish.quick else (10, 30):
        found = compare(model, count, wish.draws or 1, rules)
        for how in ("plain", "auto"):
            errors = {rule: np.array(found[rule][how]) for rule in rules}
            print(
                f"{count} lines, {how}: median error of p "
                + ", ".join(
                    f"{np.median(e):.3g} {rule} (better than random in "
                    f"{int(np.sum(e < errors['random']))} of {len(e)}; diverged "
                    f"{int(np.sum(~np.isfinite(e)))})"
                    for rule, e in errors.items()
                )
            )
    print(
        "mean of p at complete coordinates, and its largest distance from −1, as noise "
        "swamps (5.30):"
    )
    drowned = swamped(model)
    for level, mean, far in drowned:
        print(f"  noise {100 * level:g} %: mean p {mean:.3f}, |p + 1| at most {far:.3f}")
    return guess, known, found, drowned


def rank_correlation(a, b):
    """Spearman's."""
    ranks = [np.argsort(np.argsort(v)) for v in (a, b)]
    return float(np.corrcoef(*ranks)[0, 1])
