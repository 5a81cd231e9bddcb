"""PySINDy on the Silverbox, by recipes that were tuned: the free run over the growing noise beside
that of the model that `diagnose` writes (problems/real/silverbox/problem_multisine.toml).

States are the output and its rate, the input is known, the library holds all polynomials up to the
third degree (Brunton, Proctor and Kutz 2016; weak form: Reinbold, Gurevich and Grigoriev 2020).
`usual`: second-order differences of the samples as they are. `strong`: band-limited interpolation
between samples and differences of the sixth order. `weak`: that rate and integrals over windows.
Thresholds, windows and powers are chosen by the free run over the last multisines while the others
are fitted; with the choice all are fitted. The growing noise chooses nothing.

``python -m validation.studies silverbox_sindy``; needs CVXUPDATE_DATA and PySINDy (extra "bench").
"""

from __future__ import annotations

import csv
import time
import warnings
from dataclasses import dataclass
from itertools import product

import numba
import numpy as np
from scipy.optimize import least_squares

from cvxupdate.study import open_problem
from validation.real.laws import FINER, finer, free_run
from validation.real.table import PROBLEMS

PROBLEM = PROBLEMS / "silverbox" / "problem_multisine.toml"
UNIT = 2.0 * np.pi * 70.0  # rad/s: of time, near the resonance, so that coefficients compare
LEARNT = 0.8  # of the multisines, while settings are chosen
EDGE = 400  # points at either end, where differences and interpolation are poor
THIN = 4  # every so many fine samples are equations of the strong form
THRESHOLDS = (0.1, 0.03, 0.01, 0.003, 0.001)
WINDOWS, POWERS = (1.5, 3.0, 6.0, 20.0), (4, 8)  # half-lengths (radians at UNIT), of test functions
DOMAINS = 5000
SEED = 1
NAMES = ("y", "v", "u")
RIDGE = 1e-6
SETTLED = 200  # samples after which a free run from a recorded state is compared


@dataclass(frozen=True)
class Record:
    """Output ``y``, its rate ``v`` per radian, its second rate ``a`` and the input ``u``, all in
    units of their r.m.s. in the multisines, ``per`` points in a sample, ``step`` (radians) apart;
    the input also halfway between points, ``half``."""

    y: np.ndarray
    v: np.ndarray
    a: np.ndarray
    u: np.ndarray
    half: np.ndarray
    step: float
    per: int

    def part(self, begin: int, end: int) -> Record:
        """From one point to another."""
        cut = slice(begin, end)
        half = self.half[2 * begin : 2 * end - 1]
        return Record(self.y[cut], self.v[cut], self.a[cut], self.u[cut], half, self.step, self.per)


def records() -> tuple[Record, Record, Record, float]:
    """(the multisines as sampled, the same and the growing noise between samples, the unit of the
    output in V)."""
    both = open_problem(PROBLEM)[2]
    fit, held = (next(r for r in both if (r.origin.use == "fit") == use) for use in (True, False))
    unit = fit.data.std(axis=0)
    return (
        record(fit.data - fit.data.mean(axis=0), fit.rate, unit, 1, 2),
        record(finer(fit).data, fit.rate, unit, FINER, 6),
        record(finer(held).data, held.rate, unit, FINER, 6),
        float(unit[1]),
    )


def record(data: np.ndarray, rate: float, unit: np.ndarray, per: int, order: int) -> Record:
    """Of samples (points, 2) of input and output, differentiated to an ``order``."""
    from pysindy import FiniteDifference

    step = UNIT / (rate * per)
    u, y = (data / unit).T
    at = step * np.arange(len(y))
    differ = FiniteDifference(order=order)
    v = np.asarray(differ._differentiate(y[:, None], at))
    a = np.asarray(differ._differentiate(v, at))
    half = np.interp(0.5 * np.arange(2 * len(u) - 1), np.arange(len(u)), u)
    return Record(y, v[:, 0], a[:, 0], u, half, step, per)


@dataclass(frozen=True)
class Found:
    """A polynomial model: ``coefficients`` (2, terms) of y' and v', ``powers`` (terms, 3) of y, v
    and u; ``seconds`` of the processor that it took."""

    coefficients: np.ndarray
    powers: np.ndarray
    seconds: float

    @property
    def text(self) -> str:
        """v' in words."""
        parts = []
        for value, powers in zip(self.coefficients[1], self.powers, strict=True):
            if value:
                term = "·".join(
                    n if p == 1 else f"{n}^{p}" for n, p in zip(NAMES, powers, strict=True) if p
                )
                parts.append(f"{value:+.4f} {term or '1'}")
        return " ".join(parts)


def fitted(r: Record, threshold: float, window: float | None, power: int) -> Found:
    """By PySINDy: the strong form, or with a ``window`` the weak one."""
    import pysindy as ps

    begin = time.process_time()
    library = ps.PolynomialLibrary(degree=3, include_bias=False)
    states = np.column_stack([r.y, r.v])
    optimizer = ps.STLSQ(threshold=threshold, alpha=RIDGE)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        if window is None:
            model = ps.SINDy(optimizer=optimizer, feature_library=library)
            cut = slice(None, None, THIN if r.per > 1 else 1)
            rates = np.column_stack([r.v, r.a])[cut]
            at = r.step * (THIN if r.per > 1 else 1)
            model.fit(states[cut], t=at, x_dot=rates, u=r.u[cut], feature_names=list(NAMES))
        else:
            np.random.seed(SEED)  # the domains are drawn from numpy's own generator
            at = r.step * np.arange(len(r.y))
            weak = ps.WeakPDELibrary(
                function_library=library,
                spatiotemporal_grid=at,
                K=DOMAINS,
                H_xt=window,
                p=power,
            )
            model = ps.SINDy(optimizer=optimizer, feature_library=weak)
            model.fit(states, t=at, u=r.u, feature_names=list(NAMES))
    powers = np.array([powers_of(name) for name in model.get_feature_names()])
    return Found(np.array(model.coefficients()), powers, time.process_time() - begin)


def powers_of(term: str) -> tuple[int, ...]:
    """Of y, v and u in a term as PySINDy writes it."""
    out = dict.fromkeys(NAMES, 0)
    for factor in term.split():
        name, _, power = factor.partition("^")
        out[name] += int(power or 1)
    return tuple(out.values())


@numba.njit
def rate_of(c, powers, y, v, u):  # type: ignore[no-untyped-def]
    """(y', v') of a polynomial model."""
    first, second = 0.0, 0.0
    for j in range(len(powers)):
        term = y ** powers[j, 0] * v ** powers[j, 1] * u ** powers[j, 2]
        first += c[0, j] * term
        second += c[1, j] * term
    return first, second


@numba.njit
def marched(c, powers, half, step, y, v):  # type: ignore[no-untyped-def]
    """y at every point by Runge and Kutta's classical rule, the input given ``half``-way too; NaN
    from where it runs away."""
    out = np.full((len(half) + 1) // 2, np.nan)
    for t in range(len(out)):
        out[t] = y
        if t == len(out) - 1 or not abs(y) < 100.0:
            break
        a, b, d = half[2 * t], half[2 * t + 1], half[2 * t + 2]
        y1, v1 = rate_of(c, powers, y, v, a)
        y2, v2 = rate_of(c, powers, y + 0.5 * step * y1, v + 0.5 * step * v1, b)
        y3, v3 = rate_of(c, powers, y + 0.5 * step * y2, v + 0.5 * step * v2, b)
        y4, v4 = rate_of(c, powers, y + step * y3, v + step * v3, d)
        y += step / 6.0 * (y1 + 2.0 * y2 + 2.0 * y3 + y4)
        v += step / 6.0 * (v1 + 2.0 * v2 + 2.0 * v3 + v4)
    return out


def off(found: Found, r: Record, rest: bool) -> np.ndarray:
    """Error of a free run at the samples, from ``rest`` or from the recorded state."""
    first = (0.0, 0.0) if rest else (float(r.y[0]), float(r.v[0]))
    own = marched(found.coefficients, found.powers, r.half, r.step, *first)
    return (own - r.y)[:: r.per]


def size(error: np.ndarray) -> float:
    """R.m.s. without the mean; infinite where a run went away."""
    return float(np.std(error)) if np.all(np.isfinite(error)) else np.inf


def chosen(r: Record, options: list[tuple[float, float | None, int]]) -> tuple[float, ...]:
    """The settings whose model of the first multisines follows the last ones best."""
    split = int(LEARNT * len(r.y))
    learn, last = r.part(EDGE, split), r.part(split, len(r.y) - EDGE)
    return min(options, key=lambda o: size(off(fitted(learn, *o), last, False)))


def by_output_error(r: Record, even: bool, start: Found) -> Found:
    """The Duffing oscillator, with ``even`` a force in y² beside, by least squares of the free run
    over a record: how far the data go, with that part and without."""
    begin = time.process_time()
    powers = np.array([[1, 0, 0], [0, 1, 0], [0, 0, 1], [3, 0, 0], [2, 0, 0]])[: 4 + even]

    def of(p: np.ndarray) -> Found:
        c = np.array([[0.0, 1.0, *[0.0] * (len(p) - 2)], p])
        return Found(c, powers, time.process_time() - begin)

    there = [np.all(start.powers == q, axis=1) for q in powers]
    first = np.array([float(start.coefficients[1][at].sum()) for at in there])
    scale = np.maximum(np.abs(first), 0.01)
    found = least_squares(
        lambda p: off(of(p), r, False)[SETTLED:], first, x_scale=scale, diff_step=1e-4, max_nfev=4
    )
    return of(found.x)


def main(folder, wish):
    """Print and draw what each recipe makes of it; gives {recipe: (settings, model, mV)}."""
    import matplotlib.pyplot as plt

    raw, fine, held, unit = records()
    strong = [(t, None, 0) for t in (THRESHOLDS[3:4] if wish.quick else THRESHOLDS)]
    grid = [((0.003,), (3.0,), (4,))] if wish.quick else [(THRESHOLDS, WINDOWS, POWERS)]
    weak = [(t, w, p) for parts in grid for t, w, p in product(*parts)]
    if wish.quick:
        fine = fine.part(0, len(fine.y) // 4)
    usual = raw.part(1, len(raw.y) - 1)
    inner = fine.part(EDGE, len(fine.y) - EDGE)
    recipes = {
        "usual": (usual, chosen(raw, strong)),
        "strong": (inner, chosen(fine, strong)),
        "weak": (inner, chosen(fine, weak)),
    }
    own = {} if wish.quick else {"y³": False, "y³, y²": True}
    found, lines = {}, [("recipe", "threshold", "window", "power", "mV", "s", "v'")]
    figure, ax = plt.subplots(figsize=(7, 4))
    for name, (data, settings) in recipes.items():
        model = fitted(data, *settings)
        error = 1e3 * unit * off(model, held, True)
        found[name] = (settings, model, size(error))
        lines.append((name, *settings, size(error), model.seconds, model.text))
        print(f"{name:7s} {size(error):7.3f} mV, {model.seconds:5.1f} s: v' = {model.text}")
        blocks = error[: len(error) // 400 * 400].reshape(-1, 400)
        ax.semilogy(np.sqrt(np.mean(blocks**2, axis=1)), label=name)
    for name, even in own.items():
        model = by_output_error(inner, even, found["weak"][1])
        mv = size(1e3 * unit * off(model, held, True))
        lines.append((f"output error, {name}", "", "", "", mv, model.seconds, model.text))
        print(f"output error, {name:6s} {mv:7.3f} mV, {model.seconds:5.1f} s: v' = {model.text}")
    if not wish.quick:
        from validation.real.claim import folder_of, said_of

        begin = time.process_time()
        said_of(PROBLEM)
        own, seconds = 1e3 * free_run(PROBLEM, folder_of(PROBLEM)), time.process_time() - begin
        found["diagnose"] = own
        lines.append(("diagnose", "", "", "", own, seconds, "cubic_spring"))
        print(f"diagnose {own:6.3f} mV, {seconds:5.1f} s")
    ax.set(xlabel="blocks of 400 samples of the growing noise", ylabel="error (mV r.m.s.)")
    ax.legend()
    figure.tight_layout()
    figure.savefig(folder / "silverbox_sindy.png", dpi=130)
    with (folder / "silverbox_sindy.csv").open("w", newline="") as file:
        csv.writer(file).writerows(lines)
    return found
