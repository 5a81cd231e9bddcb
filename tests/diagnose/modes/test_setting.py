"""A pairing is taken over by a model that is the same structure today."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.modes.fits import paired
from cvxupdate.diagnose.modes.setting import setting_of
from cvxupdate.residual.modal import modal_residual


def test_a_pairing_is_taken_over_only_by_the_same_structure(tried):
    evidence, base, candidates = tried
    like, data = base.point.residual, evidence.tables
    for name in ("stiffness_change", "grounding_spring", "joint_flexibility"):
        c = next(
            c
            for c in candidates
            if c.physics == name and (name != "grounding_spring" or not c.change.series)
        )
        over, afresh = (
            setting_of(c.change.model, data, like).residual,
            modal_residual(c.change.model, data.fit, data.hold, data.shapes),
        )
        assert (over.start is like.start) == (
            c.change.model.labels == base.setting.model.labels
        ) and over.model is c.change.model
        assert (
            over.count == afresh.count
            and over.muted == afresh.muted
            and over.unseen == afresh.unseen
        )
        assert all(
            np.array_equal(a, b)
            for a, b in zip(over.start.places, afresh.start.places, strict=True)
        )
        n = min(len(m.start.modes.eigenvalues) for m in (over, afresh))
        np.testing.assert_allclose(
            over.start.modes.eigenvalues[:n], afresh.start.modes.eigenvalues[:n], rtol=1e-9
        )
    heavier = replace(
        base.setting.model,
        blocks=tuple(
            replace(b, properties={**b.properties, "rho": 1.1 * b.properties["rho"]})
            for b in base.setting.model.blocks
        ),
    )
    assert setting_of(heavier, data, like).residual.start is not like.start


def test_every_fit_pairs_its_modes_anew(tried) -> None:
    """A base whose pairing was mistaken at the start must not lose to effects whose pairing was
    found again."""
    evidence, base, _ = tried
    residual = base.setting.residual
    wrong = residual.start.places[0][[0, 2, 1, 3]]
    mistaken = replace(residual, start=replace(residual.start, places=(wrong,)))
    found = paired(replace(base.setting, residual=mistaken), evidence.model.zero())
    assert np.array_equal(found.point.places[0], base.point.places[0])
    assert found.cost == pytest.approx(base.cost, rel=1e-3)
