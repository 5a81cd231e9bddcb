"""Supports that give way in several of their directions at once."""

from __future__ import annotations

from dataclasses import replace
from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.search import held as module
from cvxupdate.diagnose.search.held import held, supports
from cvxupdate.diagnose.settings import TRIAGED
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.spec import load_problem
from cvxupdate.study import diagnose, open_problem
from tests.cases.cantilever_tables import SOFT, cantilever
from tests.cases.plain_evidence import effect, rig

KZ, KR = 2.0e6, 1300.0  # N/m, N·m/rad: of a beam that weighs 0.35 kg


@pytest.fixture(scope="module")
def problem(tmp_path_factory):
    """A cantilever drawn clamped; five frequencies of the one whose clamp moves and turns."""
    folder, rng = tmp_path_factory.mktemp("held"), np.random.default_rng(3)
    path = cantilever(folder, SOFT.format(kz=KZ, kr=KR), tables=[("", np.arange(1.0, 6.0))])
    real = build_model(replace(load_problem(path), update=None))
    f = model_modes(real, 5).frequencies * (1.0 + 0.001 * rng.standard_normal(5))
    return cantilever(folder, tables=[("", f)])


def test_a_clamp_that_moves_and_turns_is_one_thing(problem) -> None:
    """By itself either direction leaves most of it, and with five figures no second effect is
    sought; something that swings on its own was told for it."""
    found = {f.place.dof: f for f in diagnose(problem).findings}
    assert {f.physics for f in found.values()} == {"grounding_spring"}
    for dof, k in (("z", KZ), ("ry", KR)):
        own = found[dof]
        assert own.place.nodes == (1,)
        assert abs(own.parameters["k"] - k) <= 2.5 * own.deviations["k"]


def test_begun_where_the_grid_fits_best(problem) -> None:
    spec, model, recordings = open_problem(problem)
    evidence = gathered(spec, model, recordings, lambda text: None)
    best = held(evidence, (), lambda text: None)[0]
    assert {e.place.dof for e in best.effects} == {"z", "ry"}
    assert best.fit.misfit < 0.01 * evidence.bases[-1].misfit


@pytest.mark.parametrize(("left", "tried"), [(29.0, 4), (31.0, 1)])
def test_fewer_directions_are_not_sought_where_all_leave_far_more(monkeypatch, left, tried) -> None:
    """All three together, and the pairs of them unless these are left behind what is known."""
    own = [rig("grounding_spring", nodes=(1,), dof=dof) for dof in ("x", "z", "ry")]
    seen: list[int] = []

    def entered(evidence, seeds, progress):
        seen.append(len(seeds))
        return [SimpleNamespace(penalised=left)]

    monkeypatch.setattr(module, "_heard", lambda evidence, bare, effect: 1.0)
    monkeypatch.setattr(module, "_begun", lambda evidence, bare, some, sizes: list(some))
    monkeypatch.setattr(module, "entered", entered)
    module._grown(None, None, own, TRIAGED * 1.0, lambda text: None)
    assert seen == [3, 2, 2, 2][:tried]


def test_only_what_is_held_in_several_directions() -> None:
    def soft(dof: str, *nodes: int):
        one = rig("grounding_spring", nodes=nodes, dof=dof)
        return replace(one, action=replace(one.action, series=True))

    z, ry, other = soft("z", 1), soft("ry", 1), soft("z", 6)
    spring = effect("grounding_spring", nodes=(1,), dof="x")
    assert supports([z, other, spring, ry]) == [[z, ry]]
    assert supports([z, other]) == []


def test_of_an_edge_with_many_supports_the_classes() -> None:
    def soft(dof: str, *nodes: int):
        one = rig("grounding_spring", nodes=nodes, dof=dof)
        return replace(one, action=replace(one.action, series=True))

    each = [soft(dof, n) for n in range(1, 8) for dof in ("z", "ry")]
    every = [soft(dof, *range(1, 8)) for dof in ("z", "ry")]
    assert supports([*each, *every]) == [every]
