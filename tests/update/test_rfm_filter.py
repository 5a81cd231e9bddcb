"""Mottershead's recursive filter (2.8.4): exact for exact responses, unbiased as the instruments of
all lines are, and settled where all lines at once end, whatever the first lines made of it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.convex import SolverChoice, StepProblem, Tikhonov
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.residual.frf import FrfPoint
from cvxupdate.residual.frf_data import FrfData
from cvxupdate.spec import Spec
from cvxupdate.update import rfm_filter
from cvxupdate.update.classical import asked_of
from cvxupdate.update.parts import step_problem
from cvxupdate.update.rfm_filter import single_lines, turn, whitening
from cvxupdate.update.rfm_loop import fit_responses
from cvxupdate.update.trust_region import LoopResult, Options
from tests.cases.structures import free_chain, structure
from tests.update.test_rfm_instruments import ROWS, TRUTH, recorded

FAR = np.array([0.5, -0.4, 0.45, -0.35, 0.4])
SEEDS = (0, 21, 26)  # one sweep ends 0.2 to 0.5 off
DRAWS = (*SEEDS, 6, 12)


@pytest.fixture(scope="module")
def chain() -> tuple[Spec, Model]:
    return structure(free_chain(), ROWS, constraints={"bounds": {"lower": -0.6, "upper": 0.6}})


def end(
    chain: tuple[Spec, Model], data: FrfData, kind: str, problem: StepProblem | None = None
) -> LoopResult[FrfPoint]:
    problem = problem or step_problem(*chain, [])
    options = Options(1e-8, 40, 0.3)
    return fit_responses(chain[1], [data], problem, SolverChoice(), options, kind)


@pytest.fixture(scope="module")
def settled(chain: tuple[Spec, Model]) -> dict[int, np.ndarray]:
    """Of each draw the estimate of the filter."""
    return {k: end(chain, recorded(chain[1], 0.1, k), "filter").point.p for k in DRAWS}


def test_exact_for_exact_responses(chain: tuple[Spec, Model]) -> None:
    loop = end(chain, recorded(chain[1], 1e-9, 0), "filter")
    assert loop.status == "converged" and "24 lines" in loop.reason
    np.testing.assert_allclose(loop.point.p, TRUTH, atol=1e-7)


def test_instruments_belong_to_the_estimate_before_the_line(chain: tuple[Spec, Model]) -> None:
    """A line's own noise does not move its instruments, but moves its balance."""
    model = chain[1]
    lines = single_lines([recorded(model, 0.05, 1)]), single_lines([recorded(model, 0.05, 2)])
    assert [d.frequency[0] for d in lines[0]] == sorted(d.frequency[0] for d in lines[0])
    one, other = (turn(model, d[4], FAR) for d in lines)
    np.testing.assert_allclose(one.instruments, other.instruments)
    assert np.abs(one.equations(FAR)[0] - other.equations(FAR)[0]).max() > 0.0


def test_whitening_keeps_what_the_instruments_span() -> None:
    root = np.random.default_rng(0).standard_normal((3, 5)) * [1.0, 1e6, 1e-3, 1.0, 1.0]
    R = whitening(root.T @ root)
    assert R.shape == (3, 5)
    np.testing.assert_allclose(R @ root.T @ root @ R.T, np.eye(3), atol=1e-8)


def test_order_of_the_lines_does_not_count_in_the_end(chain: tuple[Spec, Model]) -> None:
    """From high to low it goes another way, and ends at the same estimate."""
    data = recorded(chain[1], 0.1, 3)
    with pytest.MonkeyPatch.context() as patch:
        up = end(chain, data, "filter").point.p
        patch.setattr(rfm_filter, "single_lines", lambda d: single_lines(d)[::-1])
        down = end(chain, data, "filter").point.p
    np.testing.assert_allclose(down, up, atol=2e-3)
    assert np.any(down != up)


def test_one_sweep_is_not_the_end(
    chain: tuple[Spec, Model], settled: dict[int, np.ndarray]
) -> None:
    """Instruments of the first lines belong to an estimate that knows nothing yet."""
    model, off = chain[1], []
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(rfm_filter, "SWEEPS", 1)
        for seed in SEEDS:
            loop = end(chain, recorded(model, 0.1, seed), "filter")
            assert loop.status == "stopped" and "still moved the filter" in loop.reason
            off.append(np.abs(loop.point.p - TRUTH).max())
    left = [np.abs(settled[seed] - TRUTH).max() for seed in SEEDS]
    assert max(left) < 0.02 and min(off) > 0.1


def test_a_penalty_by_a_rule_is_weighed_once(chain: tuple[Spec, Model]) -> None:
    problem = replace(step_problem(*chain, []), regularisers=(Tikhonov("gcv"),))
    loop = end(chain, recorded(chain[1], 0.02, 1), "filter", problem)
    assert loop.status == "converged" and loop.weight is not None
    assert np.abs(loop.point.p - TRUTH).max() < 0.05


def test_it_ends_where_the_instruments_of_all_lines_do(
    chain: tuple[Spec, Model], settled: dict[int, np.ndarray]
) -> None:
    """So it is as unbiased as that form, of which `test_rfm_instruments` shows it."""
    for k in DRAWS:
        ended = end(chain, recorded(chain[1], 0.1, k), "instrumental").point.p
        np.testing.assert_allclose(settled[k], ended, atol=2e-3)


def test_a_classical_solution_knows_no_filter(chain: tuple[Spec, Model]) -> None:
    spec, model = chain
    assert spec.update is not None
    asked = {"residual": "filter", "solution": "truncated-svd", "method": "rfm"}
    spec = replace(spec, update=spec.update.model_copy(update=asked))
    with pytest.raises(InputError, match='residual = "filter" is of the convex loop'):
        asked_of(spec, StepProblem(columns=tuple(q.name for q in model.parameters)))
