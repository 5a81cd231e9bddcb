"""One of a class that is not like the others."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.classes import at_once
from cvxupdate.diagnose.search.unlike import with_one_unlike
from cvxupdate.diagnose.settings import ALIKE_STD, STRAINED
from cvxupdate.physics.alike import AlikeChange
from tests.diagnose.search.test_classes import FEET, KZ, problem, quiet


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


def test_members_that_differ_as_usual_are_one_class(tmp_path) -> None:
    evidence = problem(tmp_path, middle=1.3)
    assert with_one_unlike(evidence, at_once(evidence, quiet), quiet) == []
    assert with_one_unlike(evidence, [], quiet) == []
