"""Which places tables of modes hardly tell from that of an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.alike import places_alike
from cvxupdate.diagnose.settings import NEIGHBOURING


def grounded(candidates, node):
    """A spring to ground across the bar."""
    place = {"nodes": [node], "elements": [], "groups": [], "dof": "z"}
    springs = [e for e in candidates if e.physics == "grounding_spring"]
    return next(e for e in springs if e.place.to_json() == place)


def test_places_are_alike_whose_springs_move_what_was_measured_in_proportion(tried):
    """Against differences of the models that grow: the angle between what two springs do, beside
    what the nuisance parameters do."""
    _, base, candidates = tried
    own = grounded(candidates, 8)
    near = places_alike(base, own, candidates)
    assert all(e.physics == own.physics and e.place.dof == "z" for e in near)
    assert own.key not in {e.key for e in near}
    scales, h = base.setting.scales, 1e-5
    A = np.vstack([base.point.system().weighted()[0], np.diag(1.0 / scales)])
    weights = base.point.differences[1]

    def direction(effect):
        grown = replace(base.point.residual, model=effect.change.model)
        ends = [grown.evaluate(np.append(base.point.p, s * h)).differences[0] for s in (-1, 1)]
        J = np.concatenate([weights * (ends[1] - ends[0]), np.zeros(len(scales))])
        J = J - A @ np.linalg.lstsq(A, J, rcond=None)[0]
        return J / np.linalg.norm(J)

    mine = direction(own)
    cosines = {n: float(mine @ direction(grounded(candidates, n))) for n in range(2, 14) if n != 8}
    alike = {n for n, c in cosines.items() if c > 0.0 and c**2 >= NEIGHBOURING}
    assert {e.place.nodes[0] for e in near} == alike
    order = [cosines[e.place.nodes[0]] for e in near]
    assert order == sorted(order, reverse=True)


def test_an_effect_that_has_no_like_is_alone(tried):
    _, base, candidates = tried
    own = grounded(candidates, 8)
    masses = [e for e in candidates if e.physics == "added_mass"]
    assert places_alike(base, own, [own, *masses]) == []
    assert places_alike(base, own, masses) == []


def test_the_evidence_has_places_alike_but_none_that_no_recording_tells(tried):
    evidence, base, candidates = tried
    own = grounded(candidates, 8)
    near = [e.key for e in evidence.alike(base, own)]
    assert near == [e.key for e in places_alike(base, own, candidates)]
    assert evidence.alike(base, own, strictly=True) == ()
