"""One of a class that is not like the others."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import at_once
from cvxupdate.diagnose.search.unlike import _one_of, with_one_unlike
from cvxupdate.diagnose.settings import ALIKE_STD, STRAINED
from cvxupdate.physics import candidates_of
from cvxupdate.physics.alike import AlikeChange
from cvxupdate.study import open_problem
from tests.cases.effects import context_of
from tests.diagnose.search.test_classes import FEET, KZ, problem, quiet

FIFTEENTH = Path(__file__).resolve().parents[3] / "problems" / "strange" / "fifteenth"


def apart(h, number: int) -> float:
    """How far members of a class are from alike, in units of their scatter."""
    return float(np.abs(h.sizes(number)[h.effects[number].count :]).max(initial=0.0)) / ALIKE_STD


def test_a_foot_that_is_not_like_the_others_is_one_by_itself(tmp_path) -> None:
    """The middle one is eight times as stiff: no scatter, and no size of all three."""
    evidence = problem(tmp_path, middle=8.0)
    known = at_once(evidence, quiet)
    best = max(known, key=merit)
    (up,) = [k for k, e in enumerate(best.effects) if e.place.dof == "y"]
    assert isinstance(best.effects[up].change, AlikeChange) and apart(best, up) > STRAINED
    likeliest = max(with_one_unlike(evidence, known, quiet), key=merit)
    assert merit(likeliest) > merit(best)
    each = {
        (e.place.nodes, e.place.dof): v.get("k")
        for e, v in zip(likeliest.effects, likeliest.values, strict=True)
    }
    assert each[FEET, "y"] == pytest.approx(KZ, rel=0.1)
    assert each[(5,), "y"] == pytest.approx(7.0 * KZ, rel=0.15)


def test_a_foot_that_is_softer_than_the_others_is_one_by_itself(tmp_path) -> None:
    """A fifth as stiff, the middle one (another laboratory's f09, a shim of rubber): no spring
    beside it makes it softer."""
    evidence = problem(tmp_path, middle=0.2)
    known = at_once(evidence, quiet)
    best = max(known, key=merit)
    likeliest = max(with_one_unlike(evidence, known, quiet), key=merit)
    assert merit(likeliest) > merit(best)
    each = {
        (e.place.nodes, e.place.dof): v.get("k")
        for e, v in zip(likeliest.effects, likeliest.values, strict=True)
    }
    (others,) = [nodes for nodes, dof in each if dof == "y" and len(nodes) == 2]
    assert set(others) == {*FEET} - {5}
    assert each[others, "y"] == pytest.approx(KZ, rel=0.15)
    assert each[(5,), "y"] == pytest.approx(0.2 * KZ, rel=0.15)


def test_one_end_of_a_beam_in_space_is_one_of_its_class(tmp_path) -> None:
    """Both turn about all axes; a support that turns about one is none of feet that rock."""
    spec, model, _ = open_problem(FIFTEENTH / "f02_table" / "problem.toml")
    context = context_of(spec, model)
    joints = [c for c in candidates_of(context) if c.physics == "joint_flexibility"]
    (ends,) = [c for c in joints if len(c.place.elements) == 12]
    loose = next(c for c in joints if (c.place.nodes, c.place.elements) == ((6,), (24,)))
    assert ends.place.dof is None and loose.place.dof == "rx" and _one_of(loose, ends)
    springs = [c for c in candidates_of(context) if c.physics == "grounding_spring"]
    rocking = next(c for c in springs if len(c.place.nodes) == 4 and c.place.dof is None)
    foot = next(c for c in springs if (c.place.nodes, c.place.dof) == ((3,), "rx"))
    along = next(c for c in springs if len(c.place.nodes) == 4 and c.place.dof == "rx")
    assert not _one_of(foot, rocking) and _one_of(foot, along)


def test_members_that_differ_as_usual_are_one_class(tmp_path) -> None:
    evidence = problem(tmp_path, middle=1.3)
    assert with_one_unlike(evidence, at_once(evidence, quiet), quiet) == []
    assert with_one_unlike(evidence, [], quiet) == []
