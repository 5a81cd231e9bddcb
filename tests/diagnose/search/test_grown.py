"""Sets that grow where no single effect comes near, on plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.search import grown
from cvxupdate.diagnose.search.coarse import enough_alone
from cvxupdate.diagnose.search.grown import Grown, grown_from
from cvxupdate.diagnose.search.met import Met
from cvxupdate.diagnose.search.search import Smooth
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed

A, B = rig("sensor_mass", nodes=(1,)), rig("joint_flexibility", nodes=(2,))
SOUGHT = effect(nodes=(1,))
EVIDENCE = PlainEvidence((PlainFit(100.0),))
PAIR, SINGLE = supposed(PlainFit(9.0), A, B), supposed(PlainFit(20.0), A)


def test_what_a_rig_does_beside_something_is_no_end_of_a_search(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Springs, joints and a compression explained a portal on a fixture, which was never tried (the
    laboratory's table 2723)."""
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])
    beside = supposed(PlainFit(0.1), A, SOUGHT)
    assert EVIDENCE.clear(beside.fit) and not enough_alone(EVIDENCE, [beside])
    assert enough_alone(EVIDENCE, [supposed(PlainFit(0.1), A, B)])
    found = grown_from(EVIDENCE, [SINGLE], [beside], grown.NOTHING, print)  # type: ignore[arg-type]
    assert found.sets == [beside] and not found.ahead and not found.ended


def test_what_a_rig_does_alone_is_ahead_where_no_single_effect_is_a_structure(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """Time was over before another single effect than one that is none was fitted."""
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])

    def sets(coarse: list[object]) -> Grown:
        return grown_from(EVIDENCE, coarse, [PAIR], grown.NOTHING, print)  # type: ignore[arg-type]

    assert sets([]).ahead and sets([SINGLE]).ahead and not sets([supposed(PlainFit(9.0), A)]).ahead
    smooth = Smooth([], [], [PAIR], Grown([PAIR], True), pattern=False)
    assert smooth.reached, "nothing else is known"


@pytest.mark.parametrize(
    ("alone", "near", "looks"),
    [
        pytest.param(5.0, 0.1, 0, id="what grows explains"),
        pytest.param(5.0, 2.0, 1, id="what grows leaves something open"),
        pytest.param(15.0, 0.1, 1, id="with a rig the model does not follow the recordings yet"),
    ],
)
def test_another_look_is_taken_where_what_grows_does_not_explain(
    monkeypatch: pytest.MonkeyPatch, alone: float, near: float, looks: int
) -> None:
    """It takes half of the time: a frame on a fixture (the laboratory's 2728), whose rig alone left
    a hundredth of the squares, was not told, for the modes in its FRFs had their turn first."""
    taken = []

    class Look(type(grown.NOTHING)):  # type: ignore[misc]
        @property
        def calm(self) -> bool:
            taken.append("look")
            return False

    whole = supposed(PlainFit(near, errors=Errors(0.05, 0.05)), A, SOUGHT)
    monkeypatch.setattr(grown, "grown_near", lambda evidence, progress: [whole])
    monkeypatch.setattr(grown, "guided", lambda evidence, progress: [whole])
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])
    evidence = PlainEvidence((PlainFit(100.0, errors=Errors(0.9, 0.9)),))
    rigs = [supposed(PlainFit(alone, errors=Errors(0.3, 0.9)), A, B)]
    found = grown_from(evidence, [SINGLE], rigs, Look(), print)  # type: ignore[arg-type]
    assert found.ahead and found.sets[0] == whole and len(taken) == looks


@pytest.mark.parametrize("left", [0.5, 100.0])
def test_what_grows_has_its_turn_before_modes_that_are_as_far_off(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    """Five modes of a frame on a fixture with soft joints and two softer elements (the laboratory's
    4180) told nothing in 54 s, and what grows, which finds all of it, had no time."""

    class Far(PlainEvidence):
        def by_modes(self, fewest: int = 0) -> PlainEvidence:  # type: ignore[override]
            return PlainEvidence((PlainFit(left),))

    order = []

    class Look(type(grown.NOTHING)):  # type: ignore[misc]
        @property
        def calm(self) -> bool:
            order.append("look")
            return False

    whole = supposed(PlainFit(2.0), A, SOUGHT)
    near = lambda evidence, progress: order.append("grown") or [whole]  # noqa: E731
    monkeypatch.setattr(grown, "met", lambda evidence, progress: Met([], False))
    monkeypatch.setattr(grown, "grown_near", near)
    monkeypatch.setattr(grown, "guided", near)
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])
    evidence = Far((PlainFit(100.0, errors=Errors(0.9, 0.9)),))
    grown_from(evidence, [SINGLE], [], Look(), print)  # type: ignore[arg-type]
    assert order[0] == ("grown" if left > 1.0 else "look")


@pytest.mark.parametrize(
    ("near", "ends"), [pytest.param(0.1, True, id="explains"), pytest.param(3.0, False, id="not")]
)
def test_a_rig_is_met_by_the_modes_first(
    monkeypatch: pytest.MonkeyPatch, near: float, ends: bool
) -> None:
    """In seconds; a portal on soft feet with soft joints and a lump (the laboratory's 2768) ended
    after 100 s in a wrong sentence with 99 %."""
    whole, other = (supposed(PlainFit(left), A, e) for left, e in ((near, SOUGHT), (2.0, B)))
    alone = supposed(PlainFit(1.5), A)
    asked = []

    def guided(evidence: object, progress: object) -> list[object]:
        asked.append("guided")
        return [other]

    monkeypatch.setattr(grown, "met", lambda evidence, progress: Met([alone, whole], True))
    monkeypatch.setattr(grown, "guided", guided)
    monkeypatch.setattr(grown, "further", lambda evidence, sets, progress: [])
    found = grown_from(EVIDENCE, [SINGLE], [], grown.NOTHING, print)  # type: ignore[arg-type]
    assert found.ahead and not found.ended and found.freed == ends
    assert found.sets == ([whole] if ends else [other, whole])
    assert asked == ([] if ends else ["guided"])


@pytest.mark.parametrize(
    ("left", "spent", "rig_spent", "asked", "ahead"),
    [
        pytest.param(0.9, False, True, True, True, id="the tolerance hides what is missing"),
        pytest.param(0.9, False, False, True, False, id="nor is it the rig"),
        pytest.param(0.9, True, True, False, False, id="noise alone is left"),
        pytest.param(0.1, False, True, True, False, id="no rig is likelier"),
    ],
)
def test_whole_rigs_compete_in_tables(
    monkeypatch: pytest.MonkeyPatch,
    left: float,
    spent: bool,
    rig_spent: bool,
    asked: bool,
    ahead: bool,
) -> None:
    """Softer columns explained a frame whose feet gave way and whose sensors weighed (the
    laboratory's 4389) within tolerance; a fixture and a lump one with a loose joint (3329)."""
    whole, calls = supposed(PlainFit(0.2, spent=rig_spent), A, B), []

    def rigs(evidence: object, known: object, progress: object) -> list[object]:
        calls.append("rigs")
        return [whole]

    monkeypatch.setattr(grown, "on_rigs", rigs)
    evidence = PlainEvidence((PlainFit(100.0),), told_by="modes")
    single = supposed(PlainFit(left, spent=spent), SOUGHT)
    found = grown_from(evidence, [single], [], grown.NOTHING, print)  # type: ignore[arg-type]
    assert bool(calls) == asked and found.ahead == ahead
    assert found.sets == ([whole] if asked else [])
