"""The verdict in plain words, the same for every kind of recording."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.judge.acceptance import Weighed, explained, refuted
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.output.rival_words import shortly, verbs
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import (
    DISTORTED_NOISE,
    EXPLAINED,
    HALVED,
    LEVEL_CHANGE,
    LEVEL_NOISE,
    OPEN,
    SLIGHT_CHANGE,
)
from cvxupdate.diagnose.types import Errors, LevelChange
from cvxupdate.physics.effect import MOTION
from cvxupdate.physics.place import listed

if TYPE_CHECKING:
    from cvxupdate.diagnose.output.diagnosis import Diagnosis

FEW = 2  # effects that a sentence names together
RIVALS = 3  # other hypotheses whose errors are stated
LEVEL = (
    "Something in the structure depends on the vibration level (contact, friction, a stiffening "
    "spring): no linear change of the model is the whole explanation of these recordings."
)
TELL = (
    "Time histories from rest at two levels or more, with the force recorded, would tell which law "
    "it is and where: these recordings cannot."
)

SOUND = (
    "Nothing is missing by the modes in the responses: their natural frequencies, shapes and modal "
    "constants are explained within what a sound model may miss and the usual scatter of its "
    "parameters, their damping by its usual scatter."
)
NARROW = "a light resonance is narrower than any model is near, and no effect explains that."


def nonlinear(change: LevelChange | None, distortion: bool = False) -> bool:
    """Whether the recordings depend on the drive level by more than noise and reason;
    ``distortion``: they answer where nothing was forced, too."""
    times = DISTORTED_NOISE if distortion else LEVEL_NOISE
    return change is not None and change.exceeds(LEVEL_CHANGE, times)


def slightly(change: LevelChange | None) -> bool:
    """Whether they depend on it by more than noise, be it little."""
    return change is not None and change.exceeds(SLIGHT_CHANGE)


def verdict_of(
    judgement: Judgement,
    further: Sequence[Finding],
    level: bool,
    drift: str | None = None,
    unsure: str = "",
) -> tuple[str, str]:
    """(verdict, sentence); ``unsure``: what is missing for sure though nobody knows what."""
    if drift is not None:
        return "undetermined", (
            "The structure changed while it was measured (temperature, creep, loosening): nothing "
            f"that stays the same explains these recordings, so nothing is claimed. {drift}"
        )
    laws = judgement.case.evidence.told_by == MOTION  # that depend on the level are tried
    if level and not laws:
        return "undetermined", f"{LEVEL} {TELL}"
    findings = (*judgement.findings, *further)
    if findings:
        groups = all(
            f.physics in ("stiffness_change", "mass_change") and f.place.groups for f in findings
        )
        says = " ".join(f.says for f in findings)
        if judgement.graded is not None:  # right whatever the rest is
            says += f" This is so whatever else is wrong; it {judgement.graded.part}"
        return "parameter_error" if groups else "missing_physics", says
    base = judgement.case.base
    if level and judgement.final is None and base.fit.misfit <= OPEN * EXPLAINED:
        return "undetermined", f"{LEVEL} It is too small for a law to be told by it."
    if not level and explained(base, judgement.case):
        if unsure := unsure or _cut_short(judgement):
            return "undetermined", unsure
        return "consistent", (
            "Nothing is missing: the model explains the recordings within noise, what a sound "
            "model may miss, and the usual scatter of its parameters."
        )
    if judgement.sound and not level:
        left = judgement.case.evidence.left(base.errors)
        return "consistent", f"{SOUND} The responses differ by {left}: {NARROW}"
    graded = "" if judgement.graded is None else f" {judgement.graded.says}"
    odd = judgement.case.evidence.departs(base.fit)
    before = f"{LEVEL} " if level else f"{by_themselves(odd)} " if odd else ""
    return "undetermined", before + _undetermined(judgement, level) + graded


def by_themselves(odd: str) -> str:
    """That some figures of a table are off though the whole hides it; empty where none are."""
    return odd and (
        f"Taken by themselves {odd} are not explained, though all figures of the table together "
        "are (tolerance: the stated deviation, and what a sound model may miss)."
    )


def depends_a_little(found: Diagnosis, by_law: Diagnosis, change: LevelChange | None) -> Diagnosis:
    """What a linear model explains by itself, where the recordings depend on their level all the
    same and no law that was tried is told by that."""
    if change is None:
        return found
    near = by_law.candidates[0] if by_law.candidates else None
    nearest = "" if near is None else f" Nearest comes {near['title']}."
    return replace(
        found,
        time=by_law.time,  # since the same beginning
        verdict="undetermined",
        says=(
            "A linear model explains these recordings within what a sound one may miss, but they "
            f"depend on the vibration level: from one to another the {change.what} change by "
            f"{100 * change.change:.2g} %, and noise makes {100 * change.noise:.2g} % of it. No "
            f"law at a node of the model explains that.{nearest}"
        ),
    )


def _cut_short(judgement: Judgement) -> str:
    """Where time ended the search: what halves the misfit beyond noise, and was not refitted to the
    end or not told from the rest; empty where nothing does."""
    nearest, base = judgement.nearest, judgement.case.base
    if nearest is None or not judgement.case.evidence.unfinished:
        return ""
    if nearest.fit.excess > HALVED * base.fit.excess:
        return ""
    return (
        "The time for one diagnosis ended the search before anything could be told: "
        f"{nearest.hypothesis.title} {' and '.join(verbs(nearest.hypothesis))} "
        f"{judgement.case.evidence.left(nearest.errors)}, the usual scatter alone "
        f"{judgement.case.evidence.left(base.errors)}."
    )


def _linear(h: Hypothesis, level: bool) -> str:
    """That what is named is linear, where something depends on the ``level``."""
    laws = any(MOTION in e.type.told_by for e in h.effects)
    return ", a linear change and so a part of it at most," if level and not laws else ""


def _undetermined(judgement: Judgement, level: bool) -> str:
    evidence, nearest = judgement.case.evidence, judgement.nearest
    if judgement.tied:
        names = [w.hypothesis.title for w in judgement.tied]
        more = len(names) - RIVALS
        rest = [f"{more} other{'s' if more > 1 else ''}"] if more > 0 else []
        head = "These" if level else "Something differs, but these"
        return (
            f"{head} recordings cannot tell what: {listed([*names[:RIVALS], *rest])} explain them "
            "about equally well."
        )
    if evidence.unfinished:
        return _ended_early(judgement, level)
    if judgement.final is not None and nearest is not None:
        most = max((len(w.hypothesis.effects) for w in judgement.several), default=2)
        few = (
            "one or two effects explain" if most <= 2 else "set of effects that was tried explains"
        )
        return (
            f"No {few} the recordings: {_nearest(nearest, level)} {evidence.left(nearest.errors)}."
        )
    base, told = judgement.case.base, explains_untold(judgement)
    if told and not level:
        return f"Something differs; {told}."
    head = "None" if level else "Something differs that none"
    return (
        f"{head} of the known effects explains {'it ' * level}at any one or two places; "
        f"what remains is {evidence.left(Errors(base.errors.fit, float('nan')))}."
    )


def explains_untold(judgement: Judgement) -> str:
    """What explains all that was fitted and is not claimed all the same, and why not: what was held
    out refutes it, or its size is not told; empty where nothing does."""
    case = judgement.case
    every = [w for w in (*judgement.singles, *judgement.several) if explained(w, case)]
    if judgement.final is not None or explained(case.base, case) or not every:
        return ""
    best = max(every, key=lambda w: log_odds(w, case))
    out = refuted(best, case)
    alike = sum(refuted(w, case) == out for w in every) - 1
    also = f", as {alike} other{'s' * (alike > 1)} would," if alike else ""
    explain = "explains" if len(best.hypothesis.effects) == 1 else "explain"
    left = f"({case.evidence.left(best.errors)})"
    why = f"but what was held out refutes that {left}" if out else "but at no size that they tell"
    what = f"{shortly(best.hypothesis)}{also} {explain}"
    return f"{what} what was fitted of these recordings, {why}: it is not claimed"


def _nearest(nearest: Weighed, level: bool) -> str:
    h = nearest.hypothesis
    come, leave = verbs(h)
    return f"{shortly(h)}{_linear(h, level)} {come}, but {leave}"


def _ended_early(judgement: Judgement, level: bool) -> str:
    """Where time ended the search: no word of what no effect explains, for not all were tried."""
    evidence, nearest = judgement.case.evidence, judgement.nearest
    start = (
        f"{'The' if level else 'Something differs, and the'} time for one diagnosis ended the "
        "search before what it is was found (--thorough goes on)"
    )
    if nearest is None:
        base = evidence.left(Errors(judgement.case.base.errors.fit, float("nan")))
        return f"{start}; what remains is {base}."
    left = evidence.left(nearest.errors)
    if len(nearest.hypothesis.effects) > FEW:
        return f"{start}; the nearest of what was tried leaves {left}."
    return f"{start}: {_nearest(nearest, level)} {left}."
