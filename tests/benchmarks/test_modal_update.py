"""Modal updating of the footbridge and the concrete frame (smu-modal-data) from the nominal model,
against scipy.optimize.least_squares (trf) with the analytic Jacobian of the same residual in the
same run, in processor time.

least_squares is run in three ways. ``written out``: with SciPy alone, as one would write it: eigsh
at sigma = 0 at every point, modes paired by MAC, Nelson's method with a factorisation for each
mode. ``modes from nothing``: our own rows and derivatives, the modes anew at every point.
``continued modes``: those as well, so that what is left is the loop alone. With its default finite
differences (on our own rows) it is ended after `CAP` times our own time; its least objective until
then counts. ``modes`` and ``shapes`` are the parts of our own time that the eigen-solutions and the
derivatives of the shapes take.

`python tests/benchmarks/test_modal_update.py` prints the table.
"""

from __future__ import annotations

import os
import sys
import time
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

for _name in ("OPENBLAS_NUM_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[_name] = "1"

import numpy as np  # noqa: E402
import pytest  # noqa: E402
import scipy.sparse as sp  # noqa: E402
from scipy.optimize import least_squares, linear_sum_assignment  # noqa: E402
from scipy.sparse.linalg import eigsh, splu  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.residual import modal_point  # noqa: E402
from cvxupdate.residual.misfit import eigenvalue_row  # noqa: E402
from cvxupdate.residual.modal import ModalPoint  # noqa: E402
from cvxupdate.residual.shape_forms import FORMS  # noqa: E402
from cvxupdate.study import open_problem  # noqa: E402
from cvxupdate.update.modal_fit import ModalFit, modal_fit  # noqa: E402
from cvxupdate.update.modal_loop import MET  # noqa: E402
from cvxupdate.update.trust_region import objective_at  # noqa: E402

FOLDER = ROOT / "problems/real/smu-modal-data"
NAMES = ("footbridge", "concrete_frame")
DATA = Path(os.environ.get("CVXUPDATE_DATA", "")) / "smu-modal-data"


CAP = 60.0  # times our own time
RUNS = 9  # of what is written out: ARPACK starts at random, and pairs and evaluations with it


class Enough(Exception):
    """The time that finite differences may take is over."""


@dataclass
class Last:
    """The latest point, so that values and Jacobian of one p are evaluated once."""

    fit: ModalFit
    point: ModalPoint

    def at(self, p: np.ndarray) -> ModalPoint:
        if not np.array_equal(p, self.point.p):
            self.point = self.fit.residual.evaluate(p, self.point)
        return self.point

    def values(self, p: np.ndarray) -> np.ndarray:
        r, w, _ = self.at(p).differences
        return w * r

    def jacobian(self, p: np.ndarray) -> np.ndarray:
        return self.at(p).system().weighted()[0]


def opened(name: str) -> ModalFit:
    return modal_fit(*open_problem(FOLDER / f"problem_{name}.toml"))


def ours(fit: ModalFit) -> tuple[float, float, float, float]:
    """(objective, seconds, those of them in the eigen-solutions, and in shapes' derivatives)."""
    spent = {"continued_modes": 0.0, "natural_modes": 0.0, "shape_gradients": 0.0}

    def timed(name: str) -> Any:
        plain = getattr(modal_point, name)

        def run(*arguments: Any) -> Any:
            begin = time.process_time()
            found = plain(*arguments)
            spent[name] += time.process_time() - begin
            return found

        return run

    with pytest.MonkeyPatch.context() as patch:
        for name in spent:
            patch.setattr(modal_point, name, timed(name))
        begin = time.process_time()
        loop, _ = fit.run(fit.residual.model.zero())
        seconds = time.process_time() - begin
    modes = spent["continued_modes"] + spent["natural_modes"]
    return objective_at(loop.problem, loop.point), seconds, modes, spent["shape_gradients"]


class Written:
    """The same rows with SciPy alone: K(p) = K + Σ p_j ∂K_j, eigsh, MAC, Nelson's method."""

    def __init__(self, fit: ModalFit) -> None:
        r = fit.residual
        self.rows, self.form, self.scale = r.shape_table, FORMS[r.form], r.shape_weight
        m, unit = r.model.matrices(r.model.zero()), np.eye(len(r.model.parameters))
        self.K, self.M, self.count = m.K, m.M, r.count
        self.parts = [sp.csc_array(r.model.matrices(e).K - m.K) for e in unit]
        self.measured = [eigenvalue_row(r.fit[0], i) for i in range(len(r.fit[0].frequency))]
        self.at = np.full(len(unit), np.nan)

    def modes(self, p: np.ndarray) -> None:
        if np.array_equal(p, self.at):
            return
        self.at = p.copy()
        self.now = sp.csc_array(
            self.K + sum((x * k for x, k in zip(p, self.parts, strict=True)), 0.0 * self.K)
        )
        self.values, self.shapes = eigsh(self.now, self.count, self.M, sigma=0.0)
        like = np.array(
            [
                (x @ phi) ** 2 / (x @ x) / np.sum(phi**2, axis=0)
                for x, phi in ((s.measured, self.shapes[s.sensors]) for s in self.rows)
            ]
        )
        self.pairs = linear_sum_assignment(like, maximize=True)[1].tolist()

    def residual(self, p: np.ndarray) -> np.ndarray:
        self.modes(p)
        out = []
        for (value, weight), s, k in zip(self.measured, self.rows, self.pairs, strict=True):
            found = self.form.rows(self.shapes[s.sensors, k], s.measured, s.std)
            out += [[weight * (self.values[k] - value)], self.scale * found.weights * found.values]
        return np.concatenate(out)

    def jacobian(self, p: np.ndarray) -> np.ndarray:
        self.modes(p)
        out = []
        for (_, weight), s, k in zip(self.measured, self.rows, self.pairs, strict=True):
            value, phi = self.values[k], self.shapes[:, k]
            pushed = np.column_stack([part @ phi for part in self.parts])
            slope = phi @ pushed
            load = self.M @ phi[:, None] * slope - pushed
            keep = np.flatnonzero(np.arange(len(phi)) != np.argmax(np.abs(phi)))
            A = sp.csc_array(self.now - value * self.M)[keep][:, keep]
            moved = np.zeros_like(load)
            moved[keep] = splu(sp.csc_array(A)).solve(load[keep])
            moved -= phi[:, None] * ((self.M @ phi) @ moved)
            found = self.form.rows(phi[s.sensors], s.measured, s.std)
            d = self.form.derivative(phi[s.sensors], s.measured, s.std) @ moved[s.sensors]
            out += [weight * slope[None, :], self.scale * found.weights[:, None] * d]
        return np.concatenate(out)


def written_out(fit: ModalFit) -> tuple[float, float, int]:
    """(objective, seconds, evaluations) of least_squares on `Written`."""
    begin = time.process_time()
    written = Written(fit)
    lower, upper = limits(fit)
    found = least_squares(
        written.residual,
        np.zeros(len(lower)),
        written.jacobian,
        bounds=(lower - 1e-9, upper + 1e-9),
        x_scale=upper - lower,
        max_nfev=100,
    )
    return 2.0 * float(found.cost), time.process_time() - begin, int(found.nfev)


def limits(fit: ModalFit) -> tuple[np.ndarray, np.ndarray]:
    """Bounds of the parameters."""
    parameters = fit.residual.model.parameters
    return np.array([q.lower for q in parameters]), np.array([q.upper for q in parameters])


def theirs(fit: ModalFit, continued: bool, most: int = 100) -> tuple[float, float]:
    """(objective, seconds) of least_squares with the same bounds, rows and derivatives."""
    model = fit.residual.model
    lower, upper = limits(fit)
    plain = replace(fit, residual=replace(fit.residual, continued=continued, repaired=False))
    begin = time.process_time()
    last = Last(plain, plain.residual.evaluate(model.zero()))
    found = least_squares(
        last.values,
        model.zero(),
        last.jacobian,
        bounds=(lower - 1e-9, upper + 1e-9),
        x_scale=upper - lower,
        max_nfev=most,
    )
    return 2.0 * float(found.cost), time.process_time() - begin


def differenced(fit: ModalFit, most: float) -> tuple[float, float, bool]:
    """(least objective, seconds, whether it came to an end) of least_squares with its default
    finite differences, ended after ``most`` seconds of the processor."""
    model = fit.residual.model
    lower, upper = limits(fit)
    plain = replace(fit, residual=replace(fit.residual, continued=False, repaired=False))
    begin, least = time.process_time(), [np.inf]
    last = Last(plain, plain.residual.evaluate(model.zero()))

    def values(p: np.ndarray) -> np.ndarray:
        if time.process_time() - begin > most:
            raise Enough
        found = last.values(p)
        least[0] = min(least[0], float(found @ found))
        return found

    ended = True
    try:
        least_squares(values, model.zero(), bounds=(lower - 1e-9, upper + 1e-9))
    except Enough:
        ended = False
    return least[0], time.process_time() - begin, ended


def rows(fit: Any) -> int:
    """How many rows are fitted."""
    return len(fit.residual.evaluate(fit.residual.model.zero()).differences[0])


needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="needs the data set smu-modal-data under CVXUPDATE_DATA"
)


@needs_data
@pytest.mark.parametrize("name", NAMES)
def test_footbridge_and_frame(benchmark: Any, name: str) -> None:
    fit = opened(name)
    objective, seconds, modes, shapes = benchmark.pedantic(ours, (fit,), rounds=1)
    other, plain, _ = written_out(fit)
    crude, long, ended = differenced(fit, CAP * seconds)
    benchmark.extra_info.update(
        {"ratio": plain / seconds, "modes": modes / seconds, "shapes": shapes / seconds}
        | {"objectives": (objective, other)}
        | {"differences": (crude, long / seconds, ended)}
    )
    met = rows(fit) * MET**2  # a fit whose rows are met so closely ends
    assert objective <= min(other, crude) * (1.0 + 1e-6) + met


if __name__ == "__main__":
    for problem in NAMES:
        case = opened(problem)
        ours(case)  # what is made once is made
        mine, took, inside, shapes = min((ours(case) for _ in range(3)), key=lambda r: r[1])
        print(
            f"{problem}: objective {mine:.6g}, {took:.2f} s: modes {inside:.2f} s, derivatives of "
            f"shapes {shapes:.2f} s, the rest {took - inside - shapes:.2f} s"
        )
        runs = sorted((written_out(case) for _ in range(RUNS)), key=lambda r: r[1])
        cost, long, evaluations = runs[RUNS // 2]
        print(
            f"  least_squares, written out: {cost:.6g}, {long:.2f} s ({long / took:.1f} times; "
            f"{runs[0][1]:.2f} to {runs[-1][1]:.2f} s), {evaluations} evaluations",
            flush=True,
        )
        for shared in (False, True):
            cost, long = theirs(case, shared)
            kind = "continued modes" if shared else "modes from nothing"
            print(f"  least_squares, {kind}: {cost:.6g}, {long:.2f} s ({long / took:.1f} times)")
        cost, long, ended = differenced(case, CAP * took)
        how = "to its end" if ended else "cut off"
        print(f"  least_squares, finite differences, {how}: {cost:.6g}, {long:.1f} s")
