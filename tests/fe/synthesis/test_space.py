"""Modes in a space around a model: those of the model itself there, of second order beside them,
exact in statics at the ports; nothing that a parameter does is lost."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.supports import held_dofs, regrown, release_from
from cvxupdate.errors import ModelError
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis.space import Space, space_of
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.growth import append_parameters, limited
from cvxupdate.spec import load_problem
from tests.cases.cantilever import load, text
from tests.cases.fine_plate import Plate, real

TOP = 330.0


@pytest.fixture
def plate(tmp_path):
    """A clamped plate of 120 DOFs and more with a patch whose thickness moves."""
    model = real(tmp_path, Plate(), (2, 2))
    patch = append_parameters(model, [limited("t", "thickness", [23, 24, 33, 34], (-0.5, 3.0))])
    return append_parameters(patch, [limited("m", "mass", [1, 2, 3], (-0.9, 3.0))])


def around(model, at, moving=(0, 1)):
    return space_of(model, np.asarray(at), TOP, np.flatnonzero(model.dof_kind < 3), moving)


def test_where_it_was_made_it_has_the_model_s_modes(plate):
    at = np.array([0.3, 0.1])
    space = around(plate, at)
    assert space.V.shape[1] < plate.size
    true, own = model_modes(plate, 6, at), space.modes(at).modes
    assert own.rigid == true.rigid == 0
    np.testing.assert_allclose(own.eigenvalues[:6], true.eigenvalues[:6], rtol=1e-8)
    m = plate.matrices(at)
    np.testing.assert_allclose(
        own.shapes[:, :6].T @ (m.M @ own.shapes[:, :6]), np.eye(6), atol=1e-8
    )


@pytest.mark.parametrize("to", [[0.4, 0.2], [-0.3, -0.4]])
def test_recentred_it_is_as_one_made_there(plate, to):
    """One inverse iteration from the modes of the old space: frequencies of the band to 1e-8."""
    to = np.array(to)
    moved = around(plate, [0.0, 0.0]).recentred(to)
    true = model_modes(plate, 6, to).eigenvalues
    own = moved.modes(to).modes.eigenvalues[:6]
    np.testing.assert_allclose(own, true[:6], rtol=1e-8)
    fresh = around(plate, to)
    assert moved.near == fresh.near and moved.wide == fresh.wide
    beside = to + np.array([0.05, 0.05])
    true = model_modes(plate, 6, beside).eigenvalues[:6]
    np.testing.assert_allclose(moved.modes(beside).modes.eigenvalues[:6], true, rtol=1e-5)


@pytest.mark.parametrize("name", ["grounding_spring", "flexible_support", "attached_resonator"])
def test_supports_set_free_open_it(plate, tmp_path, name):
    """The modes of a space that is made anew, without seeking them; where a support is soft, from
    there on: beside the shapes of the rigid one frequencies are off by a thousandth and more."""
    spec = load_problem(tmp_path / "real.toml")
    held, release = held_dofs(spec, plate), cache(release_from(spec))
    bare = plate.with_parameters(())
    m, place = bare.matrices(bare.zero()), lambda n, k: regrown(release(n, k), bare)
    context = SearchContext(bare, m.K, m.M, TOP, 20.0, ("n10.z",), held, place, 0.01)
    found = [e for e in candidates_of(context, (name,)) if e.change is None or e.change.series]
    root, seen = around(bare, bare.zero(), ()), list[bool]()
    classes = [e for e in found if len(e.place.nodes) > 1]
    for effect in (found[0], found[len(found) // 2], *classes[:3]):
        model = effect.action.plant(effect, bare, np.full(effect.count, 0.3), 1.0).model
        moving = range(len(model.parameters))
        ports = np.flatnonzero(model.dof_kind < 3)
        opened, grown = root.opened(model, ports, moving), root.grown(model, moving)
        if model.size == bare.size:
            assert opened is None and grown is not None
            continue
        assert opened is not None
        k, same = root.near, around(model, model.zero(), moving)
        for own in (opened, grown) if grown else (opened,):
            lowest, old = own.lowest(), around(model, model.zero(), moving).lowest()
            np.testing.assert_allclose(lowest[: k - 2], old[: k - 2], rtol=1e-5)
            assert own.wide == same.wide and bool(own.loose) == name.endswith(("spring", "support"))
            m = model.matrices(model.zero())
            found, p = own.matrices(model.zero()), np.full(len(model.parameters), 0.5)
            np.testing.assert_allclose(
                found["K"], own.V.T @ (m.K @ own.V), atol=1e-10 * np.abs(found["K"]).max()
            )
            for at, space, close in ((model.zero(), own, 1e-5), (p, own, 2e-3)):
                true = model_modes(model, k, at).eigenvalues
                np.testing.assert_allclose(space.modes(at).modes.eigenvalues[:k], true, rtol=close)
            if not own.loose:
                continue
            soft = model.zero()
            soft[list(own.loose)] = 300.0
            assert own.far(soft, 0.3) and not own.recentred(soft).far(1.1 * soft, 0.3)
            true = model_modes(model, k, soft).eigenvalues
            there = own.recentred(soft).modes(soft).modes.eigenvalues[:k]
            np.testing.assert_allclose(there, true, rtol=1e-4)
        seen.append(grown is not None)
    assert len(seen) > 1 and any(seen)


def test_another_structure_does_not_open_it(plate):
    root = around(plate, [0.0, 0.0])
    ports = np.flatnonzero(plate.dof_kind < 3)
    assert root.opened(plate, ports, (0, 1)) is None  # nothing is free that was not
    less = replace(plate, labels=("n77.z", *plate.labels[1:]))
    assert root.opened(less, ports, (0, 1)) is None


def test_beside_it_errors_are_of_high_order(plate):
    """With the answers to what the patch makes of the modes, four times the change makes an error
    at least sixteen times as large, and a small one."""
    space, bare = around(plate, [0.0, 0.0]), around(plate, [0.0, 0.0], ())
    errors = []
    for size in (0.05, 0.2):
        p = np.array([size, 0.0])
        true = model_modes(plate, 6, p).eigenvalues[:6]
        errors.append(np.abs(space.modes(p).modes.eigenvalues[:6] / true - 1.0).max())
        assert errors[-1] < 0.1 * np.abs(bare.modes(p).modes.eigenvalues[:6] / true - 1.0).max()
    assert errors[0] < errors[1] / 16.0 and errors[1] < 1e-4


def test_where_it_was_asked_last_it_is_not_solved_again(plate, monkeypatch):
    """A fit begins where another ended, and is judged where it ends."""
    space, calls = around(plate, [0.0, 0.0]), []
    solve = Space._modes
    monkeypatch.setattr(Space, "_modes", lambda self, p: calls.append(p) or solve(self, p))
    here, there = np.array([0.1, 0.0]), np.array([0.2, 0.1])
    found = [space.modes(p) for p in (here, there, here, there)]
    assert len(calls) == 2 and found[0] is found[2] and found[1] is found[3]
    space.modes(np.array([0.0, 0.3]))
    assert space.modes(here) is not found[0]  # of few only: they are large
    assert replace(space, near=1)._known == {}


def test_static_answers_at_the_ports_are_exact(plate):
    space = around(plate, [0.0, 0.0])
    m, port = plate.matrices(plate.zero()), int(np.flatnonzero(plate.dof_kind < 3)[7])
    force = np.zeros(plate.size)
    force[port] = 1.0
    answer = np.linalg.solve(m.K.toarray(), force)
    q = np.linalg.solve(space.matrices(plate.zero())["K"], space.V.T @ force)
    np.testing.assert_allclose(space.V @ q, answer, atol=1e-7 * np.abs(answer).max())


def test_a_free_bar_keeps_its_rigid_motions(tmp_path):
    spec, _ = load(tmp_path, text())
    from cvxupdate.fe.build import build_model

    free = build_model(replace(spec, model=spec.model.model_copy(update={"supports": ()})))
    space = space_of(free, free.zero(), 500.0, np.flatnonzero(free.dof_kind < 3), ())
    found = space.modes(free.zero()).modes
    assert found.rigid == model_modes(free, 4).rigid == 2
    np.testing.assert_array_equal(found.eigenvalues[:2], 0.0)


def test_a_negative_mass_is_no_structure(plate):
    with pytest.raises(ModelError, match="negative eigenvalue"):
        around(plate, [0.0, 0.0]).modes(np.array([0.0, -40.0]))
