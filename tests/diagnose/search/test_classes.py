"""What a rig does alike everywhere, all of it at once."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, together
from cvxupdate.diagnose.modes.identified import FEW
from cvxupdate.diagnose.search import classes
from cvxupdate.diagnose.search.backward import merit
from cvxupdate.diagnose.search.carried import carried
from cvxupdate.diagnose.search.classes import (
    alike_everywhere,
    at_once,
    in_directions,
    lightened,
    of_classes,
    on_a_rig,
    widest,
)
from cvxupdate.diagnose.search.completed import completed
from cvxupdate.diagnose.search.nearest import nearest, with_near
from cvxupdate.diagnose.search.race import refitted
from cvxupdate.diagnose.search.rigs import a_rig_alone
from cvxupdate.diagnose.search.search import Found
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.place import Place, drive_point
from cvxupdate.physics.shaker import at_drive
from cvxupdate.spec import load_problem
from cvxupdate.study import open_problem
from tests.cases.elements import STEEL, chain, lines, toml
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed
from validation.rigs import generate

KZ, KR = 4.0e5, 900.0  # N/m, N·m/rad: of a bridge of 4.6 kg on three legs' ends
AT = [(0.3 * i, 0.0, 0.0) for i in range(9)]
BAR = {"shape": "rectangle", "width": 0.03, "height": 0.01}
FEET = (1, 5, 9)


def quiet(text: str) -> None:
    """No progress."""


def bridge(soft: bool, lump: float = 0.0, each: float = 0.0, middle: float = 1.0):
    """A beam that is held rigidly at both ends and in the middle; ``soft``: on springs there, the
    ``middle`` one so many times as stiff, with a sensor of mass ``each`` at every node."""
    m = lines("beam2d", AT, chain(8), ["y", "rz"], BAR, STEEL)
    for b in m["elements"]:
        for r in b["rows"]:
            r["group"] = "bar"
    if soft:
        springs = [
            {"id": 100 + 10 * i + j, "nodes": [n], "dof": dof, "k": k * (middle if n == 5 else 1.0)}
            for i, n in enumerate(FEET)
            for j, (dof, k) in enumerate((("y", KZ), ("rz", KR)))
        ]
        m["elements"].append({"type": "spring", "rows": springs})
    else:
        m["supports"] = [{"nodes": list(FEET), "dofs": ["y", "rz"]}]
    if lump:
        m["elements"].append({"type": "mass", "rows": [{"id": 90, "nodes": [7], "m": lump}]})
    if each:
        rows = [{"id": 200 + n, "nodes": [n], "m": each} for n in range(1, 10)]
        m["elements"].append({"type": "mass", "rows": rows})
    return m


def problem(
    folder,
    lump: float = 0.0,
    each: float = 0.0,
    quantity: str = "displacement",
    middle: float = 1.0,
):
    """The rigid one, with six modes of the soft one."""
    real = folder / "real.toml"
    real.write_text(f"model = {toml(bridge(True, lump, each, middle))}\n", encoding="utf-8")
    model = build_model(replace(load_problem(real), update=None))
    modes, rng = model_modes(model, 6), np.random.default_rng(2)
    channels = [f"n{n}.y" for n in range(1, 10)]
    rows = modes.shapes[[model.place[c] for c in channels]].T
    rows = rows / np.abs(rows).max(axis=1, keepdims=True)
    rows = rows + 0.005 * rng.standard_normal(rows.shape)
    f = modes.frequencies * (1.0 + 1e-3 * rng.standard_normal(6))
    table = {
        "kind": "modes",
        "channels": [
            {"node": n, "dof": "y", "quantity": quantity, "column": n - 1} for n in range(1, 10)
        ],
        "rows": [
            {"frequency": float(x), "frequency_std": float(1e-3 * x), "shape": r.tolist()}
            for x, r in zip(f, rows, strict=True)
        ],
    }
    path = folder / "problem.toml"
    path.write_text(
        f"model = {toml(bridge(False))}\nrecordings = [{toml(table)}]\n", encoding="utf-8"
    )
    spec, model, recordings = open_problem(path)
    return gathered(spec, model, recordings, quiet)


@pytest.fixture(scope="module")
def evidence(tmp_path_factory):
    """Of the soft supports alone."""
    return problem(tmp_path_factory.mktemp("classes"))


@pytest.fixture(scope="module")
def lumped(tmp_path_factory):
    """With a lump besides."""
    return problem(tmp_path_factory.mktemp("classes"), 1.0)


def sizes(h: Hypothesis) -> dict[str | None, float]:
    return {e.place.dof: v["k"] for e, v in zip(h.effects, h.values, strict=True) if "k" in v}


def test_supports_that_give_way_in_all_directions_are_one_fit(evidence) -> None:
    """From a tenth of the frequencies off to within noise; what is rigid goes out of the set."""
    assert evidence.errors(evidence.bases[-1]).fit > 0.05
    best = at_once(evidence, quiet)[0]
    assert evidence.clear(best.fit)
    assert {e.place.nodes for e in best.effects} == {FEET}
    assert sizes(best)["y"] == pytest.approx(KZ, rel=0.05)
    of = {e.place.dof: f for e, f in zip(best.effects, best.figures, strict=True)}
    off = abs(of["rz"].values["k"] - KR)
    assert off <= 2.5 * of["rz"].deviations["k"] and off < 0.3 * KR


def test_a_reference_asks_for_nothing_more(evidence) -> None:
    near = nearest(evidence, quiet)
    assert near.enough
    best = max((*near.found.singles, *near.found.several), key=merit)
    assert set(sizes(best)) == {"y", "rz"}
    assert alike_everywhere(evidence, quiet)[0].keys == best.keys
    found = with_near(Found(), near.found)
    assert {h.keys for h in found.several} == {h.keys for h in near.found.several}


def test_what_stands_beside_a_rig_shows_beside_all_of_it(lumped) -> None:
    """The supports alone do not explain; a lump beside them does, and no other place as well."""
    assert not lumped.clear(at_once(lumped, quiet)[0].fit)
    best = on_a_rig(lumped, quiet)[0]
    assert lumped.clear(best.fit)
    (own,) = [
        (e.place.nodes, v["m"])
        for e, v in zip(best.effects, best.values, strict=True)
        if e.physics == "added_mass"
    ]
    assert own == ((7,), pytest.approx(1.0, rel=0.1))
    assert sizes(best)["y"] == pytest.approx(KZ, rel=0.2)


def test_all_of_a_rig_is_fitted_beside_the_best_effects_of_tables(lumped) -> None:
    """A mass on a portal whose feet and joints were soft was beside its place with 0.18, after all
    pairs (the laboratory's table 2729): each part of a rig by itself brings it no nearer."""
    bare = Hypothesis((), lumped.bases[-1])
    lumps = {e.place.nodes: e for e in lumped.candidates(lumped.model, ("added_mass",))}
    begun = [together(lumped, bare, [lumps[(n,)]], 0.1).onward for n in (3, 6, 7, 8)]
    singles = [h for h in (refitted(lumped, s, "sharp") for s in begun) if h is not None]
    assert not any(lumped.clear(h.fit) for h in singles)
    found = a_rig_alone(lumped, sorted(singles, key=lambda h: h.penalised), 1.0, quiet)
    best = max(found, key=merit)
    said = {(e.physics, e.place.nodes): v for e, v in zip(best.effects, best.values, strict=True)}
    assert said["added_mass", (7,)]["m"] == pytest.approx(1.0, rel=0.1)
    assert sizes(best)["y"] == pytest.approx(KZ, rel=0.2)
    assert all(len(h.effects) > 1 and lumped.clear(h.fit) for h in found)


def test_a_set_is_freed_of_what_it_is_likelier_without(evidence) -> None:
    """A part that does nothing, of little size as yet, goes again."""
    best = at_once(evidence, quiet)[0]
    model = best.fit.setting.model
    lumps = [e for e in evidence.candidates(model, ("added_mass",)) if e.place.nodes == (3,)]
    whole = together(evidence, best, lumps[:1], 1e-6)
    assert len(whole.effects) > len(best.effects)
    assert {e.place.dof for e in lightened(evidence, whole)[-1].effects} == {"y", "rz"}
    assert lightened(evidence, best) == []


def test_what_else_a_rig_does_completes_what_brings_a_model_near(tmp_path) -> None:
    """Accelerometers weigh, whatever quantity their shapes are said to be."""
    found = problem(tmp_path, each=0.1)
    bare = Hypothesis((), found.bases[-1])
    feet = [e for e in widest(found.candidates(found.model)) if e.physics == "grounding_spring"]
    near = refitted(found, together(found, bare, feet, 0.1).onward, "sharp")
    assert near is not None and {e.physics for e in near.effects} == {"grounding_spring"}
    sets = completed(found, [near], quiet)
    best = max(sets, key=merit)
    said = {e.physics: v for e, v in zip(best.effects, best.values, strict=True)}
    assert said["sensor_mass"]["m"] == pytest.approx(0.1, rel=0.2)
    assert merit(best) > merit(near) + 5.0


def test_a_vibrometer_weighs_nothing(tmp_path) -> None:
    found = problem(tmp_path, each=0.1, quantity="velocity")
    assert "sensor_mass" not in {e.physics for e in found.candidates(found.model)}


def test_the_widest_of_each_effect_and_direction() -> None:
    def soft(*nodes: int, dof: str | None = "y"):
        one = rig("grounding_spring", nodes=nodes, dof=dof)
        return replace(one, action=replace(one.action, series=True))

    all_feet, two, turned = soft(1, 5, 9), soft(1, 5), soft(1, dof="rz")
    undirected, lump = soft(1, 5, 9, dof=None), effect("added_mass", nodes=(3,))
    assert widest([two, all_feet, turned, undirected, lump]) == [all_feet, turned]
    assert widest([two, all_feet, turned, undirected, lump], directed=False) == [undirected]
    assert widest([two, all_feet, turned], directed=False) == [all_feet, turned]
    assert in_directions([two, lump]) and not in_directions([turned, undirected, lump])
    assert of_classes([two, turned, lump]) == [two]
    assert of_classes([turned, lump]) == [turned]


def test_the_shear_that_theory_wants_stands_beside_all_of_a_rig(monkeypatch) -> None:
    """A fit of the modes without it has joints or feet that are too soft."""
    begun = supposed(PlainFit(5.0), effect("shear_deformation", elements=(1,)))
    monkeypatch.setattr(classes, "by_theory", lambda evidence, parent: begun)
    monkeypatch.setattr(classes, "at_once_beside", lambda evidence, parent: [parent])
    assert at_once(PlainEvidence(stocky=True), quiet, again=False) == [begun]


def test_feet_that_give_way_alike_are_told_by_one_number(tmp_path) -> None:
    """Springs in each direction bend to what is missing besides: of a space frame (the rigs'
    4402, its modes) all six were wrong, and the lump was told for another thing."""
    generate.make(4402, tmp_path)
    spec, model, recordings = open_problem(tmp_path / "problem.toml")
    responses = gathered(spec, model, recordings, quiet)
    found = at_once(responses.by_modes(FEW), quiet)
    (feet,) = [k for k, e in enumerate(found[0].effects) if e.physics == "grounding_spring"]
    assert found[0].effects[feet].place.dof is None
    # the foot under the leg that is softer has most of that, as far as feet differ
    _, *own = found[0].sizes(feet)
    others = found[0].values[feet]["k"] * (1.0 + np.array(own[1:]))
    assert len(own) == 4 and own[0] < -0.5 and np.abs(own[1:]).max() < 0.2
    assert others == pytest.approx(3.98e4, rel=0.8)
    lumps = {e.place.nodes for h in found for e in h.effects if e.physics == "added_mass"}
    assert lumps == {(15,)}  # where the shaker stood

    def springs(h):
        return [e.place.dof for e in h.effects if e.physics == "grounding_spring"]

    here = carried(responses, found[0])
    assert springs(responses.approach.rigged(here, held=True)) == [None]
    assert len(springs(responses.approach.rigged(here))) > 1


def test_a_shaker_has_a_spring_by_modes_and_is_one_thing_on_the_responses(tmp_path) -> None:
    """Of a cantilever whose first mode a shaker's suspension stiffens (the rigs' 4890) no set came
    near: its modes had the armature's mass alone."""
    generate.make(4890, tmp_path)
    responses = gathered(*open_problem(tmp_path / "problem.toml"), quiet)
    modes = responses.by_modes(FEW)
    tried = {e.key: e for h in at_once(modes, quiet, False) for e in h.effects if at_drive(e)}
    assert {e.physics for e in tried.values()} == {*classes.ARMATURE}
    bare = Hypothesis((), modes.bases[-1])
    told = together(modes, bare, classes._brought(modes.candidates(modes.model)), 0.5)
    sizes = {name: v for own in told.values for name, v in own.items()}
    here = carried(responses, told)
    (shaker,) = here.effects
    assert shaker.physics == "flexible_support" and here.values[0] == pytest.approx(sizes)
    rest = together(modes, bare, [e for e in widest(modes.candidates(modes.model))][:1], 0.1)
    assert rest.effects and not any(map(at_drive, carried(responses, rest).effects))


def test_of_a_hammer_that_goes_about_modes_have_no_spring() -> None:
    def at(node: int, physics: str):
        place = Place(nodes=(node,), dof="z")
        return replace(effect(physics, nodes=(node,)), spot=drive_point(place, (f"n{node}.z",)))

    few = [at(n, p) for n in (1, 2) for p in classes.ARMATURE]
    assert {e.physics for e in classes._brought(few)} == {*classes.ARMATURE}
    many = [at(n, p) for n in (1, 2, 3) for p in classes.ARMATURE]
    assert {e.physics for e in classes._brought(many)} == {"added_mass"}
