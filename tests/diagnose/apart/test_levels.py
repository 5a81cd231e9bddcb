"""Laws and a linear spring that do alike at one level: by how much another level tells them."""

from __future__ import annotations

import json
from typing import Any

import numpy as np
import pytest

import cvxupdate
from cvxupdate.commands.plan import plan
from cvxupdate.commands.planned import Diagnosed
from cvxupdate.diagnose.apart.levels import Levels, Rows
from cvxupdate.diagnose.apart.measurement import Measurement
from cvxupdate.report.plan_apart import apart_says
from cvxupdate.report.plan_page import plan_page
from tests.diagnose.motion.test_drift import problem
from validation.motions.laws import Law

WEAK = Law("cubic", (5e5,))  # 1 mm at mass 1: a few N/m beside 90 kN/m
PLACE = {"nodes": [1], "elements": [], "groups": [], "dof": "x"}


def content(*physics: str) -> dict[str, Any]:
    first, *others = ({"physics": p, "location": PLACE} for p in physics)
    return {"findings": [{**first, "equivalent": others}], "candidates": []}


BOTH = content("cubic_stiffness", "grounding_spring")


@pytest.fixture(scope="module")
def quiet(tmp_path_factory: pytest.TempPathFactory) -> Any:
    folder = tmp_path_factory.mktemp("quiet")
    return problem(folder, [(0.0, 0.0)] * 3, [1.0, 1.0, 1.0], WEAK)


@pytest.fixture(scope="module")
def planned(quiet: Any) -> Any:
    return plan(quiet, None, Diagnosed(BOTH, "diagnosis"))


def test_four_times_the_force_tells_what_a_quarter_does_not(planned: Any) -> None:
    law, spring = planned.apart.explanations
    assert max(law.misfit, spring.misfit) < 1.0  # alike at the level that was recorded
    told = {m.factor: m.least for m in planned.apart.measurements if m.kind == "level"}
    assert set(told) == {0.25, 0.5, 2.0, 4.0}
    assert told[4.0] > 3.0 > told[2.0] > told[0.5] >= told[0.25]
    assert told[0.25] < 0.3
    left = {m.factor: m.left for m in planned.apart.measurements if m.kind == "level"}
    assert left[4.0] < 0.1 < left[0.5]
    assert "4 times its force (level 4)" in apart_says(planned.apart)
    assert any("4 times the loudest run" in line for line in planned.apart.lines)
    page = plan_page(planned)
    assert "No level of excitation" not in page
    assert apart_says(planned.apart) in page


def test_a_gap_without_play_is_a_spring_at_every_level(quiet: Any) -> None:
    three = content("cubic_stiffness", "grounding_spring", "clearance")
    found = plan(quiet, None, Diagnosed(three, "diagnosis")).apart
    assert found is not None
    assert found.pairs == ((0, 1), (0, 2), (1, 2))
    assert found.same == ((1, 2),)
    assert sum("one and the same" in line for line in found.lines) == 1
    loud = next(m for m in found.measurements if m.factor == 4.0)
    assert loud.separations[0] == pytest.approx(loud.separations[1], rel=1e-3)
    assert loud.separations[2] < 1e-2 < 1e-2 * loud.separations[0], "as far as fits end"


def test_what_is_foretold_comes_true(tmp_path: Any) -> None:
    """The run that is proposed, recorded: the linear spring fits no longer, the law does."""
    loud = problem(tmp_path, [(0.0, 0.0)] * 3, [1.0, 4.0, 1.0], WEAK)
    law, spring = plan(loud, None, Diagnosed(BOTH, "diagnosis")).apart.explanations
    assert law.misfit < 1.0
    assert spring.misfit > 10.0 * law.misfit


def test_linear_explanations_are_told_by_no_level(tmp_path: Any) -> None:
    both = content("grounding_spring", "added_mass")
    path = problem(tmp_path, [(0.0, 0.0)] * 2, [1.0, 1.0])
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(both), encoding="utf-8")
    found = cvxupdate.plan(path, modes=2, diagnosis=file).data.apart
    assert sum("No level of excitation tells" in line for line in found.lines) == 1
    assert not any(m.kind == "level" for m in found.measurements)


def test_a_refit_takes_up_what_least_squares_does() -> None:
    """What is left of another prediction, by normal equations, is the minimum over the unknowns of
    the stacked problem, old rows, new rows and priors."""
    rng = np.random.default_rng(3)
    old, new, n = 30, 20, 4
    J, K = (tuple(rng.standard_normal((r, n)) for _ in range(2)) for r in (old, new))
    known, rows = (
        Rows(rng.standard_normal((2, r)), tuple(columns)) for r, columns in ((old, J), (new, K))
    )
    scales = rng.uniform(0.5, 2.0, n)

    class Setting:
        pass

    setting = Setting()
    setting.scales = scales  # type: ignore[attr-defined]

    class Fit:
        misfit, independent = 1.0, 10.0

    fit = Fit()
    fit.setting = setting  # type: ignore[attr-defined]

    class One:
        unknowns = 1

    one = One()
    one.fit = fit  # type: ignore[attr-defined]
    levels = Levels(None, (one, one), None)  # type: ignore[arg-type]
    levels.__dict__["_known"] = known
    bare = Measurement("response", "there", (), sensor="n1.x")
    told = levels._told(rows, bare)
    assert told is not None
    rest = []
    for i, j in ((0, 1), (1, 0)):
        A = np.vstack([J[j], K[j], np.diag(1.0 / scales)])
        parts = [r.values[j] - r.values[i] for r in (known, rows)]
        b = np.concatenate([*parts, np.zeros(n)])
        rest.append(float(np.sum((b - A @ np.linalg.lstsq(A, b, rcond=None)[0]) ** 2)))
    gap = 0.5 * 11.0 * np.log1p(min(rest) / (old + new))
    assert told.least == pytest.approx(np.sqrt(2.0 * gap), rel=1e-12)
