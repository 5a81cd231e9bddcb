"""First-order scores are those of the models that grow."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.modes.first_order import first_order
from cvxupdate.errors import ModelError


def test_fractions_are_those_of_the_models_that_grow(tried):
    """Columns against differences of the grown model's own modes, fractions against plain least
    squares beside the nuisance parameters."""
    _, base, candidates = tried
    few = [c for k, c in enumerate(candidates) if k % 5 == 0 and c.change and not c.change.series]
    assert {c.physics for c in few} >= {
        "stiffness_change",
        "mass_change",
        "added_mass",
        "grounding_spring",
    }
    values, weights, _ = base.point.differences
    scales, h = base.setting.scales, 1e-5
    A = np.vstack([base.point.system().weighted()[0], np.diag(1.0 / scales)])
    r = np.concatenate([-weights * values, -base.point.p / scales])
    told = {s.effect.name: s for s in first_order(base, candidates)}
    for c in few:
        residual = replace(base.point.residual, model=c.change.model)
        ends = [
            residual.evaluate(np.append(base.point.p, side * h)).differences[0]
            for side in (-1.0, 1.0)
        ]
        J = np.concatenate([weights * (ends[1] - ends[0]) / (2.0 * h), np.zeros(len(scales))])
        x, before, after = (
            np.linalg.lstsq(A if B is None else np.column_stack([A, B]), r, rcond=None)[0]
            for B in (J, None, J)
        )
        fraction = 1.0 - np.sum((r - np.column_stack([A, J]) @ after) ** 2) / np.sum(
            (r - A @ before) ** 2
        )
        if c.sign > 0 and x[-1] < 0.0:
            assert told[c.name].fraction == 0.0
        else:
            assert told[c.name].fraction == pytest.approx(fraction, abs=2e-4) and told[c.name].p[
                0
            ] == pytest.approx(x[-1], rel=1e-2, abs=1e-6), c.name


def test_nothing_is_scored_where_a_repeated_eigenvalue_has_no_derivatives(tried, monkeypatch):
    """A free bar on its two cords, one effect taken out as it was: the diagnosis ended in an
    error."""
    evidence, base, candidates = tried

    def repeated(point):
        raise ModelError("its shapes are not determined one by one.")

    monkeypatch.setattr(type(base.point), "system", repeated)
    assert {s.fraction for s in evidence.first_order(base, candidates)} == {0.0}
    found = evidence.finite_size(base, base, (), candidates)
    assert not found.scores and not found.seeds
