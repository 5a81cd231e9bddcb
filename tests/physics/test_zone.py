"""A stretch of a member that does not keep to the elements' lines."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.physics.chains import beside, chains, inner_joint
from cvxupdate.physics.zone import BENDS, BOTH, JOINT, WHOLE, SoftZone, covered, zone
from tests.cases.chain import BAR, load


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    return load(tmp_path_factory.mktemp("bar"), BAR)[1]


def test_a_straight_member_is_a_chain(model) -> None:
    (chain,) = chains(model)
    assert len(chain.nodes) == len(chain.elements) + 1 == len(chain.lengths) + 1
    first, last = chain.at(chain.elements[0]), chain.at(chain.elements[-1])
    assert first[0] == 0.0 and last[1] == pytest.approx(sum(chain.lengths))
    assert beside(chain, chain.elements) == (None, None)
    assert beside(chain, chain.elements[1:3]) == (chain.elements[0], chain.elements[3])


def test_a_joint_lies_within_a_chain_or_at_its_end(model) -> None:
    (chain,) = chains(model)
    assert inner_joint(chain, chain.nodes[1], chain.elements[0])
    assert inner_joint(chain, chain.nodes[1], chain.elements[1])
    assert not inner_joint(chain, chain.nodes[1], chain.elements[3])
    assert not inner_joint(chain, chain.nodes[-1], chain.elements[-1])


def test_without_size_it_changes_nothing_and_its_tangent_is_the_model_s(model) -> None:
    (chain,) = chains(model)
    found = zone(model, chain.elements[1:5], (BOTH, JOINT))
    assert found is not None and found.change is not None
    grown = found.change.model
    assert found.count == 4 == len(grown.parameters) - len(model.parameters)
    K, L = (m.matrices(m.zero()).K.toarray() for m in (model, grown))
    inner = slice(model.size, None)
    schur = L[: model.size, : model.size] - L[: model.size, inner] @ np.linalg.solve(
        L[inner, inner], L[inner, : model.size]
    )
    assert np.allclose(schur, K, rtol=0.0, atol=1e-3 * np.abs(K).max())


@pytest.mark.parametrize("part", [0.1, 0.25, 0.5, 0.8])
def test_factor_and_joint_are_a_stepped_beam(part: float) -> None:
    """Of an element whose part next to its inner end is softer: sum and first moment of what it
    gives way by are exact, the second is near."""
    c = 2.0 / 3.0
    xi = (np.arange(20000) + 0.5) / 20000
    more = np.where(xi > 1.0 - part, c, 0.0)
    a, b = c * part**2, c * part * (1.0 - part)
    true = [np.mean(more * xi**k) for k in range(3)]
    said = [a / (k + 1) + b for k in range(3)]
    assert said[:2] == pytest.approx(true[:2], rel=1e-3)
    assert abs(said[2] - true[2]) <= 0.06 * c


def test_no_stretch_where_nothing_lies_wholly_inside(model) -> None:
    (chain,) = chains(model)
    assert zone(model, chain.elements[1:3], (JOINT, JOINT)) is None
    assert zone(model, (chain.elements[0], chain.elements[2]), (WHOLE, JOINT)) is None


def figures(f: float, first: float, dev: float = 0.01):
    """Values and deviations of a stretch of which one end is partly inside."""
    return {"factor": f, "give_first": first}, {"factor": dev, "give_first": dev}


def test_an_end_gives_way_no_more_than_what_lies_inside() -> None:
    plainly = SoftZone().plainly
    assert not plainly(*figures(0.5, 0.5)) and not plainly(*figures(0.5, 1.01))
    assert plainly(*figures(0.5, 1.2)), "the end is softer than the stretch"
    assert plainly(*figures(0.5, -0.2)), "the end is stiffer, the stretch softer"
    assert not plainly(*figures(1.5, -0.2)) and plainly(*figures(1.5, 0.2))


def test_the_sentence_says_from_where_to_where(model) -> None:
    (chain,) = chains(model)
    found = zone(model, chain.elements[1:5], (JOINT, JOINT))
    assert found is not None
    values = {"factor": 0.5, "give_first": 0.25, "give_last": 0.5}
    assert covered(values, "first") == 0.25 and covered(values, "last") == 0.5
    said = found.says(values)
    start, stop = chain.at(chain.elements[1])[1], chain.at(chain.elements[4])[0]
    part = chain.lengths[1] * 0.25
    assert f"{start - part:.3g}" in said and "in part" in said and "50 % softer" in said
    assert stop > start and BENDS == 4.0


def test_an_end_that_gives_more_than_the_inside_makes_the_sentence_an_average(model) -> None:
    (chain,) = chains(model)
    found = zone(model, chain.elements[1:3], (JOINT, WHOLE))
    assert found is not None
    a, b = chain.lengths[1:3]
    mean = (0.6 * a + 0.25 * b) / (a + b)
    said = found.says({"factor": 0.8, "give_first": 0.6})
    assert f"{100 * (1 - 1 / (1 + mean)):.2g} % softer than modelled on average" in said


def test_it_stands_on_another_model_as_on_its_own(model) -> None:
    (chain,) = chains(model)
    found = zone(model, chain.elements[1:5], (JOINT, WHOLE))
    other = zone(model, found.place.elements, (JOINT, WHOLE))
    assert found.key == other.key
    assert found.key != zone(model, found.place.elements, (WHOLE, JOINT)).key
