"""A support with a mass of its own: its limits, and the structure put together by hand."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.fe.build import build_model
from cvxupdate.physics.flexible_support import FlexibleSupport
from cvxupdate.physics.low_rank import low_rank
from cvxupdate.spec import load_problem
from tests.cases.elements import toml
from tests.cases.rigs import FEET, eigenvalues, frame, frame_context, on_fixture


@pytest.fixture
def context(tmp_path: Path):
    return frame_context(tmp_path)


def along(context, dof, nodes=FEET):
    return [
        e
        for e in FlexibleSupport().candidates(context)
        if e.place.dof == dof and e.place.nodes == nodes
    ]


def at(effect, k, m):
    """The model of one with these figures."""
    model = effect.change.model
    rigid = float(model.blocks[-1].properties["a0"][0])
    p = model.zero()
    p[-2:] = (1.0 / k - rigid) / model.parameters[-2].unit_size, m / model.parameters[-1].unit_size
    said, _ = effect.reported(model, model.parameters[-2:], p[-2:], 0.0 * p[-2:])
    assert said == pytest.approx({"k": k, "m": m}, rel=1e-9)
    return eigenvalues(model, p)


def by_hand(folder, structure):
    path = folder / "real.toml"
    path.write_text(f"model = {toml(structure)}\n", encoding="utf-8")
    return eigenvalues(undamped(build_model(load_problem(path))))


@pytest.mark.parametrize(("dof", "k", "m"), [("x", 3e5, 2.0), ("x", 4e6, 9.0), ("z", 2e6, 0.3)])
def test_it_is_the_structure_put_together_by_hand(tmp_path, context, dof, k, m) -> None:
    effect = along(context, dof)[0]
    wanted = by_hand(tmp_path, on_fixture(frame(), dof, k, m))
    np.testing.assert_allclose(at(effect, k, m), wanted, rtol=1e-7)


def test_without_mass_it_is_a_spring(tmp_path, context) -> None:
    wanted = by_hand(tmp_path, on_fixture(frame(), "x", 3e5, 0.0))
    np.testing.assert_allclose(at(along(context, "x")[0], 3e5, 0.0), wanted, rtol=1e-7)


def test_on_a_stiff_spring_it_is_the_rigid_support(context) -> None:
    """The mass does nothing then; the gap falls with 1/k."""
    base = eigenvalues(context.model)
    effect = along(context, "x")[0]
    rigid = 1.0 / float(effect.change.model.blocks[-1].properties["a0"][0])
    near, nearer = (np.abs(at(effect, k, 2.0) / base - 1.0).max() for k in (rigid / 100, rigid))
    assert nearer < 1e-3 and nearer == pytest.approx(near / 100.0, rel=0.15)


def test_each_foot_and_all_together_are_tried_over_the_band(context) -> None:
    found = FlexibleSupport().candidates(context)
    assert {e.place.nodes for e in found} == {FEET, *((n,) for n in FEET)}
    assert {e.place.dof for e in found} == {"x", "z", "ry"}, "the plane of the frame is no fixture"
    tuned = sorted(_frequency(e) for e in along(context, "x"))
    assert tuned[0] == pytest.approx(context.bottom) and tuned[-1] == pytest.approx(context.top)


def _frequency(effect):
    """Of a trial fixture, from the unknowns that it begins with."""
    size = effect.change.start(0.7)
    model = effect.change.model
    said, _ = effect.reported(model, model.parameters[-2:], size, 0.0 * size)
    return np.sqrt(said["k"] / said["m"]) / (2.0 * np.pi)


def test_the_closed_form_follows_the_mass(context) -> None:
    """Where the fixture alone resonates, it gives way without end; far above, not at all."""
    effect = min(along(context, "x"), key=lambda e: abs(_frequency(e) - 60.0))
    change, f = low_rank(effect), _frequency(effect)
    s = 2j * np.pi * np.array([1e-3, 1.0, 1e3]) * f
    size = np.abs(change.at(np.array([1e-3]), s)[:, 0, 0])
    assert size[1] > 10.0 * size[0] and size[2] < 1e-4 * size[0]


def test_one_whose_mass_is_not_felt_is_a_support_that_gives_way() -> None:
    """Along an axis or about it."""
    for names in (("k", "m"), ("kr", "J")):
        values = dict(zip(names, (6e4, 0.4), strict=True))
        felt, not_felt = (dict(zip(names, (4e3, dm), strict=True)) for dm in (0.1, 0.3))
        assert FlexibleSupport().plainly(values, not_felt)
        assert not FlexibleSupport().plainly(values, felt)
