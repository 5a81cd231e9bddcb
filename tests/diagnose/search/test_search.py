"""What is worth a search, on plain figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.search.search import _enough, _mesh_may, damping_only, names_tried, search
from cvxupdate.diagnose.settings import CLEAR, DAMPING_GAIN, EXPLAINED, OPEN, SPARE
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, supposed

NAMES = ("added_mass", "viscous_damper", "structural_damping")


def evidence(misfit: float, strain: float = 0.0, rows: int = 1000) -> PlainEvidence:
    base = PlainFit(misfit, damping_strain=strain, rows=rows)
    return PlainEvidence((PlainFit(99.0), base), names=NAMES)


def test_all_is_tried_where_nuisance_parameters_do_not_explain() -> None:
    """The sharpest of their fits counts."""
    e = evidence(1.01 * EXPLAINED)
    assert not damping_only(e) and names_tried(e) == NAMES  # type: ignore[arg-type]


def test_only_damping_where_they_do_and_its_pattern_departs() -> None:
    e = evidence(EXPLAINED, 1.01 * DAMPING_GAIN)
    assert damping_only(e) and names_tried(e) == NAMES[1:]  # type: ignore[arg-type]


def test_nothing_where_all_is_as_usual() -> None:
    e = evidence(EXPLAINED, DAMPING_GAIN)
    assert names_tried(e) == () and search(e, lambda text: None).singles == ()  # type: ignore[arg-type]


def test_one_effect_is_enough_where_it_is_clear() -> None:
    e = evidence(100.0)
    for left, enough in ((CLEAR, True), (1.01 * CLEAR, False)):
        single = supposed(PlainFit(9.0, beyond_noise=left), effect())
        assert _enough(e, [single]) == enough  # type: ignore[arg-type]
    assert not _enough(e, [])  # type: ignore[arg-type]
    for spent in (True, False):  # of tables alone, whose tolerance hides what else is missing
        tables = replace(e, told_by="modes")
        near = supposed(PlainFit(CLEAR, beyond_noise=CLEAR, spent=spent), effect(nodes=(1,)))
        assert _enough(tables, [near]) == spent  # type: ignore[arg-type]


def test_no_second_is_sought_where_little_is_wrong_or_little_was_measured() -> None:
    poor = supposed(PlainFit(9.0), effect())
    known = len(PlainEvidence().model.parameters)
    assert _enough(evidence(OPEN * EXPLAINED), [poor])  # type: ignore[arg-type]
    assert _enough(evidence(99.0, rows=known + SPARE - 1), [poor])  # type: ignore[arg-type]
    assert not _enough(evidence(99.0, rows=known + SPARE), [poor])  # type: ignore[arg-type]


def test_what_is_left_may_be_the_mesh_s() -> None:
    h = supposed(PlainFit(9.0, errors=Errors(0.05, np.nan)), effect())
    assert _mesh_may(replace(PlainEvidence(), mesh=0.05), h)  # type: ignore[arg-type]
    assert not _mesh_may(replace(PlainEvidence(), mesh=0.049), h)  # type: ignore[arg-type]
