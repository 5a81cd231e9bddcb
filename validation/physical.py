"""Chapter 8's studies, measured: ``python -m validation.physical [beam] [exact] [plate]``.

Each row is a fit of `update.rfm_loop` as `run` makes it: status, iterations, the largest error of
the parameters (or of what the recordings can tell of them), seconds.
"""

from __future__ import annotations

import sys
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import scipy.linalg as la

from cvxupdate.convex import Bounds, LeastSquares, SolverChoice, StepProblem
from cvxupdate.convex.regularisers.prior import Prior
from cvxupdate.fe.model import Model
from cvxupdate.fe.select import select_parameters
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.residual.frf_data import FrfData, frf_data
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.invisible import invisible
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import Options
from validation import make_bay as bay
from validation import make_physical as made


@dataclass(frozen=True)
class Wanted:
    """A parameter: `fe.select.Wanted`."""

    name: str
    of: str
    elements: tuple[int, ...]
    group: str | None = None
    lower: float | None = -0.5
    upper: float | None = 0.5
    scale: float | None = None


def with_parameters(model: Model, groups: Sequence[tuple[str, Sequence[int]]]) -> Model:
    """One parameter for each (property, elements)."""
    wanted = [Wanted(f"{of}{i}", of, tuple(e)) for i, (of, e) in enumerate(groups)]
    return model.with_parameters(select_parameters(wanted, model))


def data_of(
    model: Model,
    lines: Sequence[float],
    H: np.ndarray,
    responses: Sequence[str],
    force: str,
    noise: float,
    seed: int = 1,
) -> FrfData:
    """Receptances with ``noise`` (uniform, 3.27) as the method takes them."""

    def channel(label: str, quantity: str) -> Channel:
        node, dof = label[1:].split(".")
        return Channel(int(node), dof, quantity)  # type: ignore[arg-type]

    recording = FrequencyResponse(
        Origin("simulated", "simulated"),
        np.array(lines),
        bay.noisy(H, noise, seed) if noise else H,
        "displacement",
        tuple(channel(q, "displacement") for q in responses),
        (channel(force, "force"),),
    )
    return frf_data(recording, model, noise / np.sqrt(3) or 1e-3)


@dataclass(frozen=True)
class Row:
    """One fit: what is printed of it."""

    name: str
    status: str
    iterations: int
    worst: float
    seen: float
    open: int
    silent: int
    seconds: float
    p: np.ndarray


def fitted(
    name: str,
    model: Model,
    data: FrfData,
    truth: np.ndarray,
    options: Options,
    prior: float | None = None,
) -> Row:
    """A fit from p = 0, and its errors: of all parameters, and of those combinations that the
    recordings determine (deviation below a tenth). ``prior``: the deviation of every p before."""
    n = len(model.parameters)
    problem = StepProblem(
        LeastSquares(),
        () if prior is None else (Prior(1.0, np.full(n, prior**2)),),
        (Bounds(np.full(n, -0.5), np.full(n, 0.5)),),
        tuple(q.name for q in model.parameters),
    )
    begin = time.perf_counter()
    loop = fit_responses(model, (data,), problem, SolverChoice(), options)
    seconds = time.perf_counter() - begin
    p = loop.point.p
    known = uncertainty(
        loop.point.system(), p, model.parameters, np.zeros((0, n)), False, invisible(model, p)
    )
    J, _ = loop.point.system().weighted()
    _, s, Vt = la.svd(J, full_matrices=False, lapack_driver="gesvd")
    told = Vt[s > max(10.0, 1e-9 * s[0])]
    seen = float(np.abs(told @ (p - truth)).max(initial=0.0))
    row = Row(
        name,
        loop.status,
        len(loop.history),
        float(np.abs(p - truth).max()),
        seen,
        len(known.undetermined),
        len(invisible(model, p)),
        seconds,
        p,
    )
    print(
        f"{name:46s} {row.status:10s} {row.iterations:3d} it  max |Δp| {row.worst:.2e}  "
        f"determined part {row.seen:.2e} ({len(told)} of {n})  open {row.open}, of the model "
        f"{row.silent}  {seconds:.1f} s  objective {loop.history[-1].objective:.3g}",
        flush=True,
    )
    return row


ALL = tuple(f"n{i}.{k}" for i in range(1, 20) for k in bay.KINDS)


def of_members(factors: Mapping[str, Sequence[float]], p: np.ndarray) -> dict[str, float]:
    """The largest relative error of what motion across the frame shows of a member: E h³, rho h,
    G h³ (80 p: rho, E, G and height of twenty members, over ``factors`` on the nominal ones)."""
    now = {
        of: np.array(factors[of]) * (1.0 + p[20 * k : 20 * k + 20])
        for k, of in enumerate(made.EXACT_ERRORS)
    }
    h = now["height"]
    seen = {"E h³": now["E"] * h**3, "rho h": now["rho"] * h, "G h³": now["G"] * h**3}
    return {what: float(np.abs(v - 1.0).max()) for what, v in seen.items()}


def exact() -> None:
    """8.7 with exact elements: Table 8.2, with noise, ±30 %, with and without second-order terms;
    with noise also where every p is 0 ± 0.2 before."""
    reference = made.built(made.exact_toml(dict.fromkeys(made.EXACT_ERRORS, [1.0] * 20)))
    H = made.measured(reference, made.EXACT_LINES, ALL, "n1.z")
    groups = [(of, [e]) for of in made.EXACT_ERRORS for e in range(1, 21)]
    table = made.table_8_2()
    for name, factors in (("Table 8.2", table), ("±30 %", made.wide())):
        model = with_parameters(made.built(made.exact_toml(factors)), groups)
        truth = np.concatenate([1.0 / np.array(factors[of]) - 1.0 for of in made.EXACT_ERRORS])
        for noise in (0.0, 0.01, 0.05):
            data = data_of(model, made.EXACT_LINES, H, ALL, "n1.z", noise)
            for second in (False, True):
                row = fitted(
                    f"exact, {name}, noise {noise:.0%}, second order {second}",
                    model,
                    data,
                    truth,
                    Options(1e-6 if noise else 1e-9, 60, 0.3, second_order=second),
                    made.LIKELY if noise else None,
                )
                found = ", ".join(f"{k} {v:.2g}" for k, v in of_members(factors, row.p).items())
                print(f"   largest error of {found}")


def beam() -> None:
    """8.3: FE2 against X1, second moments 30 % high, finite elements; all DOFs, then ten with
    noise."""
    reference = bay.build("X1")
    groups = [("I", [e]) for e in range(1, 21)]
    model = with_parameters(bay.build("FE2"), groups)
    truth = np.array([1 / 1.3 - 1 if e in bay.THICK else 0.0 for e in range(1, 21)])
    for responses, lines, noises in (
        (ALL, made.BEAM_LINES, (0.0, 0.01, 0.05)),
        (bay.TEN, made.BEAM_LINES, (0.0, 0.01, 0.05)),
        (bay.TEN, tuple(np.arange(20.0, 246.0, 5.0)), (0.0, 0.01, 0.05)),
    ):
        H = bay.receptance(reference, lines, responses, ["n1.z"])
        for noise in noises:
            data = data_of(model, lines, H, responses, "n1.z", noise)
            fitted(
                f"FE2, {len(responses)} DOFs, {len(lines)} lines, noise {noise:.0%}",
                model,
                data,
                truth,
                Options(1e-9, 60, 0.1),
            )


def products(groups: Sequence[tuple[str, Sequence[int]]], p: np.ndarray) -> float:
    """The largest relative error of what a plate shows of an element: E h³, nu and rho h (8.4)."""
    now = {of: np.ones(45) for of in made.PLATE_ERRORS}
    for (of, elements), value in zip(groups, p.tolist(), strict=True):
        for e in elements:
            now[of][e - 1] = 1.0 + value
    for of in now:
        now[of] *= [made.nominal_of(made.PLATE_ERRORS, e)[of] for e in range(1, 46)]
    h = now["thickness"]
    seen = np.array([now["E"] * h**3, now["nu"], now["rho"] * h])
    return float(np.abs(seen - 1.0).max())


def plate() -> None:
    """8.5, Table 8.1: four macro elements, single-element macros, all 180."""
    reference = made.built(made.plate_toml({}))
    responses = [f"n{i}.z" for i in range(1, 61)]
    H = made.measured(reference, made.PLATE_LINES, responses, "n1.z")
    base = made.built(made.plate_toml(made.PLATE_ERRORS))
    kinds = made.PLATE_ERRORS
    choices = {
        "four macro elements": [(of, list(some)) for of, (_, some) in kinds.items()],
        "single elements of the macros": [(of, [e]) for of, (_, s) in kinds.items() for e in s],
        "all 180": [(of, [e]) for of in kinds for e in range(1, 46)],
    }
    for name, groups in choices.items():
        model = with_parameters(base, groups)
        truth = np.array([1.0 / made.nominal_of(kinds, e[0])[of] - 1.0 for of, e in groups])
        for noise in (0.0, 0.01, 0.05):
            data = data_of(model, made.PLATE_LINES, H, responses, "n1.z", noise)
            row = fitted(
                f"plate, {name}, noise {noise:.0%}", model, data, truth, Options(1e-9, 60, 0.3)
            )
            found = {}
            for (of, e), p in zip(groups, row.p.tolist(), strict=True):
                if e[0] in kinds[of][1]:
                    found.setdefault(of, []).append(100.0 * (1.0 / (1.0 + p) - 1.0))
            means = ", ".join(f"{of} {np.mean(v):+.2f} %" for of, v in found.items())
            print(f"   {means}; E h³, nu, rho h of every element to {products(groups, row.p):.1e}")


if __name__ == "__main__":
    for which in sys.argv[1:] or ["beam", "exact", "plate"]:
        {"beam": beam, "exact": exact, "plate": plate}[which]()
