"""Single effects on smooth recordings, and what a rig does alone."""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, only_a_rig
from cvxupdate.diagnose.search.beside import narrow
from cvxupdate.diagnose.search.race import entered, merged, raced
from cvxupdate.diagnose.search.rigs import a_rig_alone
from cvxupdate.diagnose.search.spread import spread_out
from cvxupdate.diagnose.settings import (
    ABREAST,
    CLEARLY,
    COARSE,
    EACH_SIZED,
    EXPLAINED,
    HALVED,
    HOPELESS,
    OPEN,
    SEVERAL_LEVEL,
    STAYING,
)
from cvxupdate.diagnose.types import Evidence, Progress


def coarsely(
    evidence: Evidence, entries: Sequence[Hypothesis], pattern: bool, progress: Progress
) -> tuple[list[Hypothesis], list[Hypothesis], list[Hypothesis]]:
    """Single effects on smooth recordings, those of them that show on sharper ones only, and what
    a rig does alone: tried first where the first pass leaves much, for beside a rig that is enough
    few others go on."""
    if pattern:
        return raced(evidence, entries, COARSE, progress), [], []
    much = bool(entries) and entries[0].penalised > HOPELESS * EXPLAINED
    alone = a_rig_alone(evidence, entries, HOPELESS * EXPLAINED, progress)
    if enough_alone(evidence, alone):
        few = tuple((level, STAYING) for level, _ in COARSE)
        return raced(evidence, entries, few, progress), [], alone
    coarse = raced(evidence, entries, COARSE, progress)
    sharper = _sharper(evidence, coarse, progress)
    coarse = spread_out(evidence, merged(coarse, sharper), COARSE, progress)
    if not much:
        alone = a_rig_alone(evidence, coarse, OPEN * EXPLAINED, progress)
    return coarse, sharper, alone


def _sharper(
    evidence: Evidence, coarse: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """What shows on sharper recordings only, where it comes as near as the best of ``coarse``; far
    off, it is sets that are grown there."""
    if not coarse or far_off(coarse) or evidence.hurried:
        return []
    found = entered(evidence, narrow(evidence), progress)
    found = raced(evidence, found, ((SEVERAL_LEVEL, EACH_SIZED),), progress)
    return [h for h in found if h.penalised <= ABREAST * coarse[0].penalised]


def enough_alone(evidence: Evidence, alone: Sequence[Hypothesis]) -> bool:
    """Whether what a rig does alone leaves nothing else to seek; what it does beside something else
    does not, for another rig may be all."""
    return any(evidence.clear(h.fit) and only_a_rig(h) for h in alone)


def far_off(coarse: Sequence[Hypothesis]) -> bool:
    """Whether no single effect comes near."""
    return bool(coarse) and coarse[0].fit.misfit > HOPELESS * EXPLAINED


def follows(evidence: Evidence, h: Hypothesis) -> bool:
    """Whether with a hypothesis the structure follows its model through most of the recordings: a
    tenth of the weighted squares is left, and half of the error. Then what is still missing shows
    in them; resonances that stand elsewhere hide it."""
    base = evidence.bases[-1]
    half = evidence.errors(h.fit).fit <= HALVED * evidence.errors(base).fit
    return h.fit.misfit <= CLEARLY * base.misfit and half
