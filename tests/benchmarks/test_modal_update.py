"""Modal updating of the footbridge and the concrete frame (smu-modal-data) from the nominal model,
against scipy.optimize.least_squares (trf) with the analytic Jacobian of the same residual in the
same run, in processor time.

least_squares evaluates modes from nothing at every point (`continued` off), as it is used today;
``shared`` lets it have the continued modes too, so that what is left is the loop alone. The pairing
is fixed at the start for it. ``modes`` is the part of our own time that the eigen-solutions take.
With its default finite differences it is ended after `CAP` times our own time; its least objective
until then counts.

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
from scipy.optimize import least_squares  # noqa: E402

ROOT = Path(__file__).resolve().parents[2]
sys.path.insert(0, str(ROOT))

from cvxupdate.residual import modal_point  # noqa: E402
from cvxupdate.residual.modal import ModalPoint  # noqa: E402
from cvxupdate.study import open_problem  # noqa: E402
from cvxupdate.update.modal_fit import ModalFit, modal_fit  # noqa: E402
from cvxupdate.update.trust_region import objective_at  # noqa: E402

FOLDER = ROOT / "problems/real/smu-modal-data"
NAMES = ("footbridge", "concrete_frame")
DATA = Path(os.environ.get("CVXUPDATE_DATA", "")) / "smu-modal-data"


CAP = 60.0  # times our own time


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


def ours(fit: ModalFit) -> tuple[float, float, float]:
    """(objective, seconds, those of them in the eigen-solutions)."""
    spent, plain = [0.0], modal_point.continued_modes

    def timed(*arguments: Any) -> Any:
        begin = time.process_time()
        found = plain(*arguments)
        spent[0] += time.process_time() - begin
        return found

    modal_point.continued_modes = timed  # type: ignore[assignment]
    try:
        begin = time.process_time()
        loop, _ = fit.run(fit.residual.model.zero())
        seconds = time.process_time() - begin
    finally:
        modal_point.continued_modes = plain
    return objective_at(loop.problem, loop.point), seconds, spent[0]


def theirs(fit: ModalFit, continued: bool, most: int = 100) -> tuple[float, float]:
    """(objective, seconds) of least_squares with the same bounds, rows and derivatives."""
    model = fit.residual.model
    lower = np.array([q.lower for q in model.parameters])
    upper = np.array([q.upper for q in model.parameters])
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
    lower = np.array([q.lower for q in model.parameters])
    upper = np.array([q.upper for q in model.parameters])
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


needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="needs the data set smu-modal-data under CVXUPDATE_DATA"
)


@needs_data
@pytest.mark.parametrize("name", NAMES)
def test_footbridge_and_frame(benchmark: Any, name: str) -> None:
    fit = opened(name)
    objective, seconds, modes = benchmark.pedantic(ours, (fit,), rounds=1)
    other, plain = theirs(fit, False)
    crude, long, ended = differenced(fit, CAP * seconds)
    benchmark.extra_info.update(
        {"ratio": plain / seconds, "modes": modes / seconds, "objectives": (objective, other)}
        | {"differences": (crude, long / seconds, ended)}
    )
    assert objective <= min(other, crude) * (1.0 + 1e-6) + 1e-9


if __name__ == "__main__":
    for problem in NAMES:
        case = opened(problem)
        mine, took, inside = ours(case)
        print(f"{problem}: objective {mine:.6g}, {took:.2f} s, of which modes {inside:.2f} s")
        for shared in (False, True):
            cost, long = theirs(case, shared)
            kind = "continued modes" if shared else "modes from nothing"
            print(f"  least_squares, {kind}: {cost:.6g}, {long:.2f} s ({long / took:.1f} times)")
        cost, long, ended = differenced(case, CAP * took)
        how = "to its end" if ended else "cut off"
        print(f"  least_squares, finite differences, {how}: {cost:.6g}, {long:.1f} s")
