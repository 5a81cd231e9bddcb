"""Mirror images that the recordings cannot tell, and the measurement that does: by the laws of a
chain that is its own mirror image."""

import json
from typing import Any

import numpy as np
import pytest

import cvxupdate
from cvxupdate import Frf, InputError, Model, Modes, Problem
from cvxupdate.commands.plan import plan
from cvxupdate.commands.planned import Diagnosed
from cvxupdate.report.plan_apart import (
    apart_csv,
    apart_rows,
    apart_says,
    boundary_says,
    together_says,
)
from cvxupdate.report.plan_page import plan_csv, plan_page

LINES = np.arange(3.0, 33.0, 0.1)


def chain(lump: int | None = None, more: float = 0.08) -> Model:
    """Five masses between two walls; ``lump``: a node with so much ``more`` (kg)."""
    ends = [[1], [1, 2], [2, 3], [3, 4], [4, 5], [5]]
    springs: dict[str, Any] = {"type": "spring", "dof": "x", "nodes": ends, "k": [1.0e4] * 6}
    m = [1.0 + more * (i == lump) for i in range(1, 6)]
    masses: dict[str, Any] = {"type": "mass", "nodes": [[i] for i in range(1, 6)], "m": m}
    x = np.array([[float(i), 0.0] for i in range(5)])
    return Model(x, [springs, masses], dofs=["x"], damping={"kind": "modal", "zeta": 0.01})


def told(*places: int, physics: str = "added_mass") -> dict[str, Any]:
    """A diagnosis of a lump at the first node, equivalent to those at the others."""
    at = [
        {"physics": physics, "location": {"nodes": [n], "elements": [], "groups": [], "dof": "x"}}
        for n in places
    ]
    return {"findings": [{**at[0], "equivalent": at[1:]}], "candidates": []}


@pytest.fixture(scope="module")
def driven_in_the_middle() -> Problem:
    exact = chain(2).frf(LINES, ["n3.x"], ["n3.x"], "acceleration").H
    rng = np.random.default_rng(5)
    std = 0.005 * np.abs(exact)
    noise = std * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape))
    keys: dict[str, Any] = {"quantity": "acceleration", "variance": 2 * std**2}
    return Problem(chain(), [Frf(LINES, exact + noise, ["n3.x"], ["n3.x"], **keys)])


@pytest.fixture(scope="module")
def planned(driven_in_the_middle: Problem) -> Any:
    return cvxupdate.plan(driven_in_the_middle, modes=3, diagnosis=told(2, 4)).data


def test_mirror_images_do_alike_on_what_was_measured(planned: Any) -> None:
    one, other = planned.apart.explanations
    assert one.title == "An added mass at node 2 (x)"
    assert other.title == "An added mass at node 4 (x)"
    assert one.misfit == pytest.approx(other.misfit, rel=1e-3)
    assert one.misfit < 2.0


def test_what_stands_in_the_middle_tells_nothing_and_what_stands_aside_does(planned: Any) -> None:
    found = {(m.kind, m.sensor or m.node, m.drive): m.least for m in planned.apart.measurements}
    assert planned.apart.measurements[0].least > 5.0
    aside = ("response", "n2.x", "n3.x")
    assert found[aside] == pytest.approx(found["response", "n4.x", "n3.x"], rel=1e-2)
    assert found[aside] > 3.0
    by_mass = {m.node: m.least for m in planned.apart.measurements if m.kind == "mass"}
    assert by_mass[3] < 0.05  # the mirror image of itself
    assert by_mass[1] > 10.0 * by_mass[3]
    assert ("response", "n3.x", "n3.x") not in found  # was measured


def test_a_set_tells_what_none_of_its_responses_tells_alone(
    driven_in_the_middle: Problem,
) -> None:
    """Four explanations in mirrored pairs: the set tells the worst pair better than the best single
    response does, and better the larger it is; its first response is the best one."""
    least = []
    for size in (2, 4):
        found = cvxupdate.plan(
            driven_in_the_middle, modes=3, further=size, diagnosis=told(2, 4, 1, 5)
        ).data.apart
        alone = max(m.least for m in found.measurements if m.kind == "response")
        first = next(m for m in found.measurements if m.kind == "response")
        assert len(found.together.measurements) == size
        assert found.together.measurements[0].worth > first.worth - 0.1
        pairs = [(m.sensor, m.drive) for m in found.together.measurements]
        assert len({sensor for sensor, _ in pairs}) == size
        assert not any(a != b and (b, a) in pairs for a, b in pairs)  # reciprocity: the same
        least.append(found.together.least)
        assert least[-1] >= alone
    assert least[1] > least[0]
    assert "Together, the responses at" in together_says(found)
    rows = [row for row in apart_csv(found) if row[0] == "together"]
    assert [(r[2], r[3]) for r in rows] == [
        (m.sensor, m.drive) for m in found.together.measurements
    ]


def test_a_known_spring_in_the_middle_tells_nothing_and_one_aside_does(planned: Any) -> None:
    springs = {m.node: m for m in planned.apart.measurements if m.kind == "spring"}
    assert springs[3].least < 0.05  # the mirror image of itself
    assert springs[1].least > 10.0 * springs[3].least
    assert springs[1].left < springs[3].left
    # what has no supports is set free of none
    assert not {"support", "free"} & {m.kind for m in planned.apart.measurements}


def beam(lump: int | None = None) -> Model:
    """Six elements between two clamps; ``lump``: a node with 5 % of the mass."""
    x = np.array([[float(i) / 6.0, 0.0] for i in range(7)])
    bars: dict[str, Any] = {
        "type": "beam2d",
        "material": "steel",
        "section": "bar",
        "nodes": [[i, i + 1] for i in range(1, 7)],
    }
    m = [0.12 * (i == lump) for i in range(2, 7)]
    lumps: dict[str, Any] = {"type": "mass", "nodes": [[i] for i in range(2, 7)], "m": m}
    return Model(
        x,
        [bars, lumps],
        dofs=["x", "z", "ry"],
        materials={"steel": {"E": 207e9, "nu": 0.3, "rho": 7850.0}},
        sections={"bar": {"shape": "rectangle", "width": 0.03, "height": 0.01}},
        supports=[{"nodes": [1, 7], "dofs": ["x", "z", "ry"]}],
        damping={"kind": "modal", "zeta": 0.01},
    )


def test_taking_away_one_support_tells_mirror_images_and_all_of_them_does_not() -> None:
    lines = np.arange(20.0, 320.0, 1.0)
    exact = beam(3).frf(lines, ["n4.z"], ["n4.z"], "acceleration").H
    rng = np.random.default_rng(6)
    std = 0.003 * np.abs(exact)
    noise = std * (rng.standard_normal(exact.shape) + 1j * rng.standard_normal(exact.shape))
    keys: dict[str, Any] = {"quantity": "acceleration", "variance": 2 * std**2}
    problem = Problem(beam(), [Frf(lines, exact + noise, ["n4.z"], ["n4.z"], **keys)])
    place = {"elements": [], "groups": [], "dof": None}
    at = [{"physics": "added_mass", "location": {**place, "nodes": [n]}} for n in (3, 5)]
    content = {"findings": [{**at[0], "equivalent": at[1:]}], "candidates": []}
    found = cvxupdate.plan(problem, modes=3, diagnosis=content).data.apart
    kinds: dict[str, float] = {}
    for m in found.measurements:
        kinds[m.kind] = max(kinds.get(m.kind, 0.0), m.least)
    assert kinds["support"] > 3.0  # one clamp away: no mirror image any more
    assert kinds["free"] < 0.1  # both away: one again
    assert kinds["spring"] > 1.0
    assert "boundary" in boundary_says(found)


def test_less_noise_tells_more(driven_in_the_middle: Problem) -> None:
    def best(noise: float) -> float:
        found = cvxupdate.plan(
            driven_in_the_middle, modes=3, noise=noise, diagnosis=told(2, 4)
        ).data.apart
        return float(found.measurements[0].least)

    assert best(0.2) < best(0.01)


def test_the_page_and_the_files_say_it(planned: Any, tmp_path) -> None:
    best = planned.apart.measurements[0]
    says = apart_says(planned.apart)
    assert best.says in says
    assert "tells the 2 explanations apart" in says
    assert says in plan_page(planned)
    assert apart_rows(planned.apart)[0]["told"] == "1 of 1"
    assert any(line.startswith("next,") for line in plan_csv(planned).splitlines())
    assert apart_csv(planned.apart)[0][2] == best.sensor


def table(mass: int) -> Problem:
    """Frequencies alone, which mirror images share."""
    f = chain(mass, 0.4).modes(3).frequencies
    return Problem(chain(), [Modes(f, frequency_std=1e-3 * f)])


def test_frequencies_need_shapes_or_a_mass_aside() -> None:
    found = cvxupdate.plan(table(2), modes=3, diagnosis=told(2, 4)).data.apart
    kinds = {m.kind: m for m in reversed(found.measurements)}
    assert kinds["modes"].least < 0.05  # further frequencies are shared as well
    assert kinds["mass"].least > 1.0
    assert kinds["mass"].node != 3
    by_node = {m.node: m.least for m in found.measurements if m.kind == "mass"}
    assert by_node[3] < 0.05
    assert kinds["shape"].least > 1.0


def test_what_is_one_and_the_same_is_said_to_be() -> None:
    same = {"nodes": [1], "elements": [], "groups": [], "dof": "x"}
    soft = {"nodes": [], "elements": [1], "groups": [], "dof": None}
    content = told(1, physics="grounding_spring")
    content["findings"][0]["location"] = same
    content["findings"][0]["equivalent"] = [{"physics": "stiffness_change", "location": soft}]
    f = chain().modes(3).frequencies * np.array([1.01, 1.015, 1.01])
    found = cvxupdate.plan(
        Problem(chain(), [Modes(f, frequency_std=1e-3 * f)]), modes=3, diagnosis=content
    ).data.apart
    assert max(m.least for m in found.measurements) < 0.1
    assert "one and the same" in apart_says(found)


@pytest.mark.parametrize(
    ("content", "words"),
    [
        (told(2), "nothing to tell apart"),
        ({"findings": [], "candidates": []}, "nothing to tell apart"),
        ({"findings": 2}, "is no diagnosis.json"),
        ({"findings": [{"physics": 3}]}, "not as diagnose writes them"),
        (told(2, 99), "has no place on this model"),
        (told(2, 4, physics="clearance"), "is not told by"),
    ],
)
def test_refusals(content: Any, words: str) -> None:
    with pytest.raises(InputError, match=words):
        cvxupdate.plan(table(2), modes=3, diagnosis=content)


def test_a_file_that_is_none(tmp_path) -> None:
    with pytest.raises(InputError, match="is not a file"):
        Diagnosed.of(tmp_path / "diagnosis.json")
    (tmp_path / "diagnosis.json").write_text("{", encoding="utf-8")
    with pytest.raises(InputError, match="is no JSON"):
        Diagnosed.of(tmp_path / "diagnosis.json")


def test_the_command_reads_the_file(tmp_path) -> None:
    path = table(2).save(tmp_path)
    file = tmp_path / "diagnosis.json"
    file.write_text(json.dumps(told(2, 4)), encoding="utf-8")
    found = plan(path, None, Diagnosed.of(file))
    assert found.apart is not None
    assert found.options.endswith("--diagnosis diagnosis.json")


def test_a_shaker_is_an_explanation_like_others(driven_in_the_middle: Problem) -> None:
    """It is never sought by itself, but a diagnosis may list it."""
    content = told(3)
    drive = {**content["findings"][0]["location"]}
    content["findings"][0]["equivalent"] = [{"physics": "flexible_support", "location": drive}]
    found = cvxupdate.plan(driven_in_the_middle, modes=3, diagnosis=content).data.apart
    one, shaker = found.explanations
    assert one.title.startswith("An added mass")
    assert "node 3 (x)" in shaker.title
