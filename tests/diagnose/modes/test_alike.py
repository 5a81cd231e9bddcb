"""Which places tables of modes hardly tell from that of an effect."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.modes.alike import oscillators_alike, places_alike
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import AS_ONE, NEIGHBOURING
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.attached_resonator import attach


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


def test_the_evidence_has_places_alike_and_which_of_them_move_as_one(tried):
    evidence, base, candidates = tried
    own = grounded(candidates, 8)
    near = [e.key for e in evidence.alike(base, own)]
    assert near == [e.key for e in places_alike(base, own, candidates)]
    strictly = [e.key for e in evidence.alike(base, own, strictly=True)]
    assert strictly == near[: len(strictly)]
    assert strictly == [e.key for e in places_alike(base, own, candidates, AS_ONE)]
    assert len(strictly) < len(near)


def test_places_are_alike_where_the_same_oscillator_moves_what_was_measured_in_proportion(tried):
    """Against models with a thousandth of the oscillator at each other place as well."""
    evidence, base, _ = tried
    effects = evidence.candidates(base.setting.model, ("attached_resonator",))
    own = next(e for e in effects if e.place.nodes == (8,) and e.place.dof == "z")
    f, m, known = 35.0, 0.05, len(base.p)

    def with_another(label, mass):
        """The comparison with the oscillator and one of ``mass`` more, at nominal sizes."""
        model = attach(base.setting.model, base.setting.model.place["n8.z"], f, m, 0.0)
        if label is not None:
            model = attach(model, model.place[label], f, mass, 0.0)
        modes = model_modes(model, 9)
        n = base.setting.model.size
        across = base.point.modes.shapes.T @ (
            base.point.matrices.M @ modes.shapes[:n]
        )  # the oscillators' own modes are like none of them
        places = tuple(np.abs(across[q]).argmax(axis=1) for q in base.point.places)
        residual = replace(
            base.point.residual,
            model=model,
            start=replace(base.point.residual.start, modes=modes, places=places),
        )
        return replace(base.setting, residual=residual)

    found = evidence.evaluated(with_another(None, 0.0), np.append(base.p, [0.0, 0.0]))
    near = oscillators_alike(found, own, effects, known)
    A = np.vstack([found.point.system().weighted()[0][:, :known], np.diag(1 / base.setting.scales)])
    values, weights, _ = found.point.differences

    def direction(node):
        more = with_another(f"n{node}.z", 1e-4 * m)
        there = evidence.evaluated(more, np.append(base.p, np.zeros(4)))
        J = np.append(weights * (there.point.differences[0] - values), np.zeros(known))
        J = J - A @ np.linalg.lstsq(A, J, rcond=None)[0]
        return J / np.linalg.norm(J)

    mine = direction(8)
    cosines = {n: float(mine @ direction(n)) for n in range(2, 14) if n != 8}
    alike = {n for n, c in cosines.items() if c > 0.0 and c**2 >= NEIGHBOURING}
    assert {e.place.nodes[0] for e in near} == alike
    assert alike and len(alike) < len(cosines)


def test_a_place_that_is_likelier_not_it_is_said_with_the_others(tried):
    evidence, base, _ = tried
    effects = evidence.candidates(base.setting.model, ("attached_resonator",))
    at = {e.place.nodes[0]: e for e in effects if e.place.dof == "z"}
    values, others = {"m": 1.0, "k": 4e3}, (at[9], at[7])
    sure, unsure = (
        Finding.of(at[8], values, {"m": 0.1, "k": 400.0}, c, equivalent=others) for c in (0.9, 0.3)
    )
    assert unsure.says == f"{sure.says} (Or at one of nodes 7 and 9: which of them is hardly told.)"
    alone = Finding.of(at[8], values, {"m": 0.1, "k": 400.0}, 0.3)
    assert alone.says == sure.says
    even, odd = (
        Finding.of(at[8], values, {"m": 0.1, "k": 400.0}, 0.5, equivalent=others, behind=(b, 20.0))
        for b in (1.1, 15.0)
    )
    assert even.says == f"{sure.says} (Or at node 9: which of them is hardly told.)"
    assert odd.says == sure.says
