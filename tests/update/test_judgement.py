"""What stands beside a good fit: correlations against closed forms, bounds that decide, shapes that
were given up for frequencies."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.parameters import Parameter
from cvxupdate.report.words import together_sentence, verdict
from cvxupdate.system import LinearSystem
from cvxupdate.update.covariance import uncertainty
from cvxupdate.update.judgement import correlation_of, judgement
from cvxupdate.update.modal import update_modal
from cvxupdate.update.result import Correlation, Updated
from tests.cases.structures import PORTAL, measured, portal, structure

FREE = np.zeros((0, 3))
CHANNELS = ("n2.x", "n3.y", "n4.x", "n4.y", "n6.y")


def found(A: np.ndarray, equalities: np.ndarray = FREE) -> Correlation | None:
    n = A.shape[1]
    own = tuple(Parameter(f"p{i}", "k", (), -9.0, 9.0, 0.0, 1.0, "1") for i in range(n))
    names = tuple(q.name for q in own)
    rows = tuple(str(i) for i in range(len(A)))
    system = LinearSystem(A, np.zeros(len(A)), np.full(len(A), 100.0), names, rows)
    return correlation_of(uncertainty(system, np.zeros(n), own, equalities, False), own)


def test_correlations_are_those_of_the_inverse() -> None:
    A = np.random.default_rng(3).normal((2.0, 2.0, 0.0), 1.0, (9, 3))
    V = np.linalg.inv(A.T @ A)
    r = V / np.sqrt(np.outer(np.diag(V), np.diag(V)))
    c = found(A)
    assert c is not None
    np.testing.assert_allclose(c.matrix, r, atol=1e-12)
    a, b, strongest = c.strongest[0]
    upper = np.abs(r[np.triu_indices(3, 1)])
    assert abs(strongest) == pytest.approx(upper.max())
    assert r[int(a[1]), int(b[1])] == pytest.approx(strongest)
    assert [abs(x) for *_, x in c.strongest] == pytest.approx(sorted(upper, reverse=True))


def test_two_that_only_their_sum_is_known_of() -> None:
    """Rows p0 + p1 of deviation s and p0 − p1 of deviation S: r = (s² − S²)/(s² + S²)."""
    A = np.array([[1.0, 1.0], [0.05, -0.05]])
    c = found(A, np.zeros((0, 2)))
    assert c is not None
    assert c.strongest[0][2] == pytest.approx((1.0 - 400.0) / (1.0 + 400.0))


def test_what_is_tied_or_not_determined_is_left_out() -> None:
    A = np.random.default_rng(4).standard_normal((9, 3))
    tied = found(A, np.array([[1.0, -1.0, 0.0]]))
    assert tied is not None
    assert ("p0", "p1") not in [(a, b) for a, b, _ in tied.strongest]
    A[:, 1] = 0.0
    seen = found(A)
    assert seen is not None and seen.parameters == ("p0", "p2")
    A[:, 2] = 0.0
    assert found(A) is None


@pytest.fixture(scope="module")
def fitted() -> Updated:
    """Frequencies alone, of a structure whose lump moved: stiffnesses in narrow bounds take it
    up."""
    spec, model = structure(
        portal(), PORTAL[:3], constraints={"bounds": {"lower": -0.05, "upper": 0.05}}
    )
    truth = structure(portal(), PORTAL[3:6])[1]
    table = measured(truth, [0.0, 1.4, 0.3], [1, 2, 3, 4], channels=CHANNELS)
    return update_modal(spec, model, [table])


def test_bounds_that_decide_are_no_good_fit(fitted: Updated) -> None:
    on = [q.name for q in fitted.parameters if q.at_bound]
    assert len(on) >= 2
    found = judgement(fitted)
    assert (found.on_bounds, found.parameters) == (len(on), 3)
    assert any("parameters ended on a bound, so the bounds decide" in d for d in found.doubts)
    assert verdict(replace(fitted, status="converged", judgement=found)).tone == "fair"


def test_a_shape_given_up_for_a_frequency_is_told(fitted: Updated) -> None:
    m = replace(fitted.modes[0], mac_before=0.98, mac_after=0.9, error_before=2.0, error_after=0.1)
    same = tuple(replace(x, mac_after=x.mac_before) for x in fitted.modes[1:])
    found = judgement(replace(fitted, modes=(m, *same)))
    assert [x["measured"] for x in found.shapes_lost] == [m.measured]
    assert any("bought with the shapes" in d and "0.980 to 0.900" in d for d in found.doubts)
    kept = judgement(replace(fitted, modes=same))
    assert not kept.shapes_lost and not any("MAC" in d for d in kept.doubts)


def test_the_sentence_says_what_is_known(fitted: Updated) -> None:
    def said(r: float) -> str:
        return together_sentence(
            replace(fitted, correlations=Correlation(("a", "b"), (), (("a", "b", r),)))
        )

    assert "fix the sum" in said(-0.97) and "fix the difference" in said(0.97)
    assert not said(0.9)
