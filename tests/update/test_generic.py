"""Families of element matrices found by the one convex step, from modes and from responses."""

from typing import Any

import numpy as np
import pytest

from cvxupdate.convex import Generic
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import Spec
from cvxupdate.update.modal import update_modal
from cvxupdate.update.parts import step_problem
from tests.cases.elements import chain, held, lines
from tests.cases.structures import measured, structure

SPANS = [(x, 0.0, 0.0) for x in (0.0, 0.11, 0.3, 0.42, 0.6)]
BEAM = held(lines("beam2d", SPANS, chain(4), ["z", "ry"], mass="lumped"), ([1], ["z", "ry"]))


def beam(**tables: Any) -> tuple[Spec, Model]:
    return structure(BEAM, [{"elements": "all", "of": "generic"}], **tables)


def member(model: Model, name: str, p: np.ndarray) -> np.ndarray:
    use = next(u for u in model.families if u.name == name)
    number = [q.name for q in model.parameters]
    return use.families[0].relative(p[[number.index(c) for c in use.columns]])


@pytest.mark.parametrize("kept", [False, True], ids=["free", "mass kept"])
def test_run_finds_a_member_that_has_the_measured_modes(kept: bool) -> None:
    """Of four unequal spans that share one family: the frequencies and shapes are met, each element
    stays a structure, and its mass where it is asked for."""
    clauses = {"generic": {"mass": True}} if kept else {}
    spec, model = beam(constraints=clauses, update={"method": "sensitivity", "max_iterations": 60})
    truth = np.zeros(len(model.parameters))
    for i, q in enumerate(model.parameters):
        truth[i] = {"all.K[1,1]": 0.2, "all.K[2,2]": -0.15, "all.M[1,3]": -0.2}.get(q.name, 0.0)
    channels = ["n2.z", "n3.z", "n4.z", "n5.z"]
    table = measured(model, truth, range(1, 7), channels=channels, std=1e-4, shape_std=1e-3)
    found = update_modal(spec, model, [table])
    p = np.array([q.p for q in found.parameters])
    assert found.status == "converged"
    after = model_modes(model, 6, p).flexible().frequencies[:6]
    np.testing.assert_allclose(after, table.frequency, rtol=1e-3)
    for name in ("all.K", "all.M"):
        assert np.linalg.eigvalsh(member(model, name, p))[0] >= 1e-3 - 1e-6
    if kept:
        assert found.model["mass_after"] == pytest.approx(found.model["mass_before"], rel=1e-7)
    assert found.certificate["optimal"]
    assert [f["name"] for f in found.families] == ["all.K", "all.M"]
    use = next(u for u in model.families if u.name == "all.M").families[0]
    np.testing.assert_allclose(
        found.families[1]["X"],
        member(model, "all.M", p) * np.outer(use.sizes, use.sizes),
        rtol=1e-12,
    )
    assert "physical element: EI" in found.families[0]["says"]


def test_the_cone_is_there_without_a_table() -> None:
    """X ⪰ 0 is what makes the family, so no problem file has to ask for it."""
    spec, model = beam()
    problem = step_problem(spec, model, [])
    assert any(isinstance(c, Generic) for c in problem.constraints)
    assert any("all.M, modes 1, 3" in c.name for c in problem.clauses)
