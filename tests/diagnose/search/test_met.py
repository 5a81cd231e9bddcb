"""A rig met by the modes in responses, on plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.search import met
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed

RIG, BED = rig("sensor_mass", nodes=(1,)), rig("joint_flexibility", nodes=(2,))
SOUGHT = effect(nodes=(1,))
EVIDENCE = PlainEvidence((PlainFit(100.0),))


@pytest.mark.parametrize("left", [0.1, 30.0])
def test_a_rig_that_does_not_explain_the_modes_is_completed(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    """A fixture with a mass is none of what is alike everywhere (the laboratory's 2764); one effect
    more is sought beside the likeliest in either case."""
    first, fixed = supposed(PlainFit(left), RIG), supposed(PlainFit(1.5), RIG, BED)
    whole = supposed(PlainFit(0.01), RIG, BED, SOUGHT)
    beside = []

    def with_one_more(evidence: object, best: object, progress: object) -> list[object]:
        beside.append(best)
        return [whole]

    monkeypatch.setattr(met, "on_a_rig", lambda evidence, progress: [first])
    monkeypatch.setattr(met, "completed", lambda evidence, near, progress: [*near, fixed])
    monkeypatch.setattr(met, "with_one_more", with_one_more)
    found = met._told(EVIDENCE, print)  # type: ignore[arg-type]
    assert beside == [first if left < 1.0 else fixed]
    assert whole in found and found == sorted(found, key=met.merit, reverse=True)


def test_without_modes_nothing_is_met() -> None:
    assert met.by_modes(EVIDENCE, print) == ([], False)  # type: ignore[arg-type]
