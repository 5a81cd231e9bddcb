"""Groups beyond their scatter, on plain figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.groups import MOST, group_findings, loose_groups
from cvxupdate.diagnose.settings import CREDIBLE, MASS_STD, STIFFNESS_STD
from tests.cases.plain_evidence import PlainFit, PlainModel, PlainSetting, parameter


def found(*rows: tuple[str | None, str, float]) -> Hypothesis:
    """Of (group, of, p): nuisance parameters at p."""
    own = tuple(parameter(f"{g}.{of}", of, g) for g, of, _ in rows)
    p = np.array([x for *_, x in rows])
    fit = PlainFit(
        1.0, p=p, deviations=np.full(len(p), 0.004), setting=PlainSetting(PlainModel(own))
    )
    return Hypothesis((), fit)  # type: ignore[arg-type]


def test_a_group_is_off_beyond_its_credible_band() -> None:
    for of, std in (("stiffness", STIFFNESS_STD), ("mass", MASS_STD)):
        for side in (1.0, -1.0):
            (item,) = loose_groups(found(("bar", of, side * 1.01 * CREDIBLE * std)))
            assert item[0] == 0 and item[2] == pytest.approx(1.01 * CREDIBLE)
            assert loose_groups(found(("bar", of, side * 0.99 * CREDIBLE * std))) == []


def test_effects_are_no_groups() -> None:
    assert loose_groups(found((None, "k", 5.0))) == []


def test_a_calibrated_model_has_a_narrower_band() -> None:
    """`[diagnose] scatter`: bounds at `CREDIBLE` deviations say how far it goes."""
    one = parameter("bar.stiffness", group="bar", upper=0.1 * CREDIBLE * STIFFNESS_STD)
    p, std = np.array([0.009]), np.array([0.004])
    fit = PlainFit(1.0, p=p, deviations=std, setting=PlainSetting(PlainModel((one,))))
    assert loose_groups(Hypothesis((), fit))[0][2] == pytest.approx(4.5)  # type: ignore[arg-type]


def test_the_farthest_are_named_as_findings() -> None:
    h = found(
        ("a", "stiffness", 0.10),
        ("b", "stiffness", -0.24),
        ("c", "mass", 0.2),
        ("d", "stiffness", 0.16),
        ("e", "stiffness", 0.01),
    )
    assert [q.group for _, q, _ in loose_groups(h)] == ["c", "b", "d", "a"]
    findings = group_findings(h, 0.7)
    assert {f.confidence for f in findings} == {0.7}
    assert len(findings) == MOST and [f.place.groups for f in findings] == [("c",), ("b",), ("d",)]
    mass, stiff, _ = findings
    assert (mass.physics, stiff.physics) == ("mass_change", "stiffness_change")
    assert stiff.parameters == {"factor": pytest.approx(0.76)}
    assert stiff.deviations == {"factor": 0.004} and stiff.noise_deviations == {"factor": 0.002}
    assert "24 %" in stiff.says and stiff.title == "a change of stiffness in group 'b'"
    assert stiff.place.elements == (1, 2)


def test_a_group_that_may_be_as_drawn_is_not_off() -> None:
    """Beyond its scatter, but with a deviation as large as itself."""
    h = found(("a", "stiffness", 0.2))
    unsure = replace(h.fit, deviations=np.array([0.11]))  # type: ignore[type-var]
    assert loose_groups(h) and loose_groups(Hypothesis((), unsure)) == []
    assert group_findings(found(("a", "stiffness", 0.0)), 0.9) == ()
