"""Every further measurement of responses, and what it would tell: another sensor or drive, the same
with other transducers, another boundary; and several together."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.apart.boundaries import Freed, boundaries, told
from cvxupdate.diagnose.apart.laws import checks_of_responses, linear_says
from cvxupdate.diagnose.apart.measurement import (
    Apart,
    Explanation,
    Measurement,
    MeasurementSet,
    ranked,
)
from cvxupdate.diagnose.apart.questions import questions
from cvxupdate.diagnose.apart.responses import Points, Responses, responses_to_come, total
from cvxupdate.diagnose.apart.together import Asked, Pair, together
from cvxupdate.diagnose.apart.worth import Products
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.settings import UNTOLD

ALIKE = "one and the same to everything that was tried."


def compared_responses(
    evidence: ResponseEvidence,
    hypotheses: Sequence[Hypothesis],
    explained: tuple[Explanation, ...],
    noise: float | None,
    band: tuple[float, float] | None,
    count: int | None,
    freed: Freed,
) -> Apart:
    """What there is to measure, the most telling first, and a set of ``count`` responses (None: as
    many as are worth it); ``freed`` is the structure without supports."""
    asked = []
    for q in questions(evidence, hypotheses):
        r = responses_to_come(evidence, q, noise, band)
        asked.append(Asked(r, r.known, r.further()))
    found = [
        _measurement(
            asked,
            [a.further[k] for a in asked],
            Measurement("response", f"the response at {k[0]} to a force at {k[1]}", (), *k),
        )
        for k in asked[0].further
    ]
    found += [*_repeats(asked), *_boundaries(asked, freed)]
    order = ranked(found)
    some = together(asked, count)
    chosen = _set(asked, order, some) if len(some) > 1 else None
    known = [m.separations for m in order] + ([chosen.separations] if chosen else [])
    best: list[float] = np.max(known, axis=0).tolist()
    pairs = _pairs(asked, hypotheses)
    same = tuple(k for k, d in zip(pairs, best, strict=True) if d < UNTOLD)
    lines = [f"{explained[i].title} and {hypotheses[j].title}: {ALIKE}" for i, j in same]
    lines.append(linear_says(evidence, len(hypotheses)))
    laws = tuple(checks_of_responses([a.responses for a in asked]))
    return Apart(explained, order, tuple(lines), chosen, pairs, same, laws)


def _measurement(
    asked: Sequence[Asked], more: Sequence[Products], bare: Measurement
) -> Measurement:
    """With its figures."""
    parts = list(zip(asked, more, strict=True))
    return replace(
        bare,
        separations=tuple(d for a, x in parts for d in a.separations(x)),
        left=sum(a.left(x, listed=True) for a, x in parts),
    )


def _set(
    asked: Sequence[Asked], order: Sequence[Measurement], pairs: Sequence[Pair]
) -> MeasurementSet:
    by_pair = {(m.sensor, m.drive): m for m in order if m.kind == "response"}
    more = [total([a.further[k] for k in pairs[1:]], a.further[pairs[0]]) for a in asked]
    parts = list(zip(asked, more, strict=True))
    return MeasurementSet(
        tuple(by_pair[k] for k in pairs),
        tuple(d for a, x in parts for d in a.separations(x)),
        sum(a.left() for a in asked),
        sum(a.left(x) for a, x in parts),
        sum(a.left(x, listed=True) for a, x in parts),
    )


def _pairs(asked: Sequence[Asked], hypotheses: Sequence[Hypothesis]) -> tuple[tuple[int, int], ...]:
    """Which explanations each separation is of."""
    number = {id(h): k for k, h in enumerate(hypotheses)}
    out = []
    for a in asked:
        own = [number[id(h)] for h in a.responses.question.members]
        out += [(own[i], own[j]) for i in range(len(own)) for j in range(i + 1, len(own))]
    return tuple(out)


def _boundaries(asked: Sequence[Asked], freed: Freed) -> Iterator[Measurement]:
    first = asked[0].responses
    for b in boundaries(first.evidence, first.question, freed):
        more = [told(a.responses, b) for a in asked]
        known = [x for x in more if x is not None]
        if len(known) == len(asked):
            says = f"the same responses again with {b.says}"
            bare = Measurement(
                b.kind, says, (), node=b.node, mass=b.mass, dof=b.dof, stiffness=b.stiffness
            )
            yield _measurement(asked, known, bare)


def _repeats(asked: Sequence[Asked]) -> Iterator[Measurement]:
    """The same response once more with another transducer: no fault of the first is left."""
    hypotheses = [h for a in asked for h in a.responses.question.members]
    faults = [f for h in hypotheses for f in h.fit.setting.faults]
    faulty = {x for f in faults for x in f.labels}
    for s in asked[0].responses.evidence.data.sharp if faults else ():
        for sensor in s.sensors:
            for drive in s.inputs:
                if sensor not in faulty and not faulty & set(s.inputs):
                    continue
                more = [_sound(a.responses, sensor, drive) for a in asked]
                says = f"the response at {sensor} to a force at {drive} with other transducers"
                yield _measurement(asked, more, Measurement("repeat", says, (), sensor, drive))


def _sound(responses: Responses, sensor: str, drive: str) -> Products:
    """Of the response without the faults of its channel."""
    points = responses.points
    base, n = points.base, len(points.base.p) - len(points.base.setting.faults)
    places = np.where(np.arange(len(base.p)) < n, np.arange(len(base.p)), -1)
    bare = Points(_faultless(base), tuple(_faultless(p) for p in points.members), places)
    return responses.products(bare, (sensor,), drive)[0]


def _faultless(p: ResponsePoint) -> ResponsePoint:
    n = len(p.p) - len(p.setting.faults)
    return replace(p, setting=replace(p.setting, faults=()), p=p.p[:n])
