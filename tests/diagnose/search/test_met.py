"""A rig met by the modes in responses, on plain figures."""

from __future__ import annotations

import pytest

from cvxupdate.diagnose.search import met
from cvxupdate.diagnose.types import Errors
from tests.cases.plain_evidence import PlainEvidence, PlainFit, effect, rig, supposed

RIG, BED = rig("sensor_mass", nodes=(1,)), rig("joint_flexibility", nodes=(2,))
SOUGHT = effect(nodes=(1,))
EVIDENCE = PlainEvidence((PlainFit(100.0),))


@pytest.mark.parametrize("left", [0.1, 30.0])
def test_a_rig_that_does_not_explain_the_modes_is_completed(
    monkeypatch: pytest.MonkeyPatch, left: float
) -> None:
    """A fixture with a mass is none of what is alike everywhere (the laboratory's 2764); one effect
    more is sought beside the likeliest in either case, and others in its place."""
    first, fixed = supposed(PlainFit(left), RIG), supposed(PlainFit(1.5), RIG, BED)
    whole = supposed(PlainFit(0.01), RIG, BED, SOUGHT)
    beside = []

    def with_one_more(evidence: object, best: object, progress: object) -> list[object]:
        beside.append(best)
        return [whole]

    monkeypatch.setattr(met, "on_a_rig", lambda evidence, progress: [first])
    monkeypatch.setattr(met, "completed", lambda evidence, near, progress: [*near, fixed])
    other = supposed(PlainFit(0.02), RIG, BED, effect(nodes=(2,)))

    def in_its_place(evidence: object, best: object, progress: object) -> list[object]:
        beside.append(best)
        return [other]

    monkeypatch.setattr(met, "with_one_more", with_one_more)
    monkeypatch.setattr(met, "in_its_place", in_its_place)
    found = met._told(EVIDENCE, print)  # type: ignore[arg-type]
    assert beside == [first if left < 1.0 else fixed, whole]
    assert {whole.keys, other.keys} < {h.keys for h in found}
    assert whole in found and found == sorted(found, key=met.merit, reverse=True)


def test_without_modes_nothing_is_met() -> None:
    assert met.met(EVIDENCE, print) == met.Met([], False)  # type: ignore[arg-type]


class Seen(PlainEvidence):
    def by_modes(self, fewest: int = 0) -> PlainEvidence:  # type: ignore[override]
        return EVIDENCE


def test_what_the_modes_are_too_few_to_tell_is_sought_in_the_responses(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A softer member of a space frame on soft feet with soft joints (the laboratory's 4100): the
    modes are explained by the rig alone, the responses not; beside it the member shows at once. Of
    each thing that the modes say beside a rig the likeliest is carried over, until one explains."""
    lump = effect("added_mass", nodes=(3,))
    told = [
        supposed(PlainFit(0.1), RIG, BED),
        supposed(PlainFit(0.2), RIG),
        supposed(PlainFit(0.3), RIG, SOUGHT),
        supposed(PlainFit(0.4), RIG, lump),
    ]
    left = {frozenset(h.keys): x for h, x in zip(told, (30.0, 20.0, 10.0, 9.0), strict=True)}
    carried, freed, error = [], [], [0.2, 0.2]

    def here(evidence: object, h: object, progress: object) -> list[object]:
        carried.append(h)
        mine = PlainFit(left[frozenset(h.keys)], errors=Errors(*error))  # type: ignore[attr-defined]
        return [supposed(mine, *h.effects)]  # type: ignore[attr-defined]

    whole = supposed(PlainFit(0.5), RIG, BED, lump)

    def backward(
        evidence: object, h: object, progress: object
    ) -> tuple[list[object], list[object]]:
        freed.append(h)
        return [], [supposed(PlainFit(0.45), BED, lump)]

    monkeypatch.setattr(met, "_told", lambda modes, progress: told)
    monkeypatch.setattr(met, "_here", here)
    monkeypatch.setattr(met, "with_one_more", lambda evidence, best, progress: [whole])
    monkeypatch.setattr(met, "backward", backward)
    far = Seen((PlainFit(100.0, errors=Errors(0.9, 0.9)),))
    told_by_modes = met.met(far, print)  # type: ignore[arg-type]
    found = told_by_modes.sets
    assert told_by_modes.sure
    assert carried == [told[0], told[2], told[3]], "one for each thing beside a rig"
    assert freed == [whole] and [e.physics for e in found[0].effects] == [BED.physics, "added_mass"]
    freed.clear()
    error[:] = [0.6, 0.6]
    met.met(far, print)  # type: ignore[arg-type]
    assert not freed, "most of the responses are left: nothing more shows in them"
    left[frozenset(told[0].keys)] = 0.5
    carried.clear()
    met.met(far, print)  # type: ignore[arg-type]
    assert carried == [told[0]], "it explains"
    left[frozenset(told[0].keys)] = 30.0
    carried.clear()
    told[0] = supposed(PlainFit(5.0), RIG, BED)
    asked: list[object] = []
    monkeypatch.setattr(met, "with_one_more", lambda *args: asked.append(args) or [])
    assert not met.met(far, print).sure  # type: ignore[arg-type]
    assert carried == [told[0]] and not asked, "the modes are not explained"
