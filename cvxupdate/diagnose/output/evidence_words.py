"""What the recordings say, one line each, the same for every kind of them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.judge.acceptance import Case, Weighed, explained
from cvxupdate.diagnose.judge.judge import Judgement
from cvxupdate.diagnose.judge.posterior import log_odds, rivals
from cvxupdate.diagnose.output.rival_words import named, shortly, verbs
from cvxupdate.diagnose.output.strain_words import strained_lines
from cvxupdate.diagnose.output.wording import RIVALS, by_themselves, explains_untold, nonlinear
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import AS_LIKELY, LEAST_CHANGE, LEVEL_CHANGE, STATED
from cvxupdate.diagnose.types import Errors, Evidence, LevelChange
from cvxupdate.physics.effect import MOTION
from cvxupdate.physics.place import capital
from cvxupdate.physics.units import number

MOST = 6  # equivalents that are named
ALIKE = 1.5  # times the error of what was found: below, the error alone does not say why it lost
MOST_ODDS = float(np.log(1000.0))  # beyond, how unlikely it is no number says better
LEFT_OVER = 2.0  # times the noise from which a remaining error is told to be something else


def evidence_lines(
    judgement: Judgement,
    change: LevelChange | None,
    drift: str | None = None,
    distortion: bool = False,
) -> list[str]:
    """One line each: what in the recordings says so."""
    evidence = judgement.case.evidence
    level = nonlinear(change, distortion)
    if drift is not None:
        return [drift, *_base_lines(evidence, judgement.case.base)]
    out = [*_level_line(change, level), *evidence.lines()]
    level &= evidence.told_by != MOTION  # where laws that depend on the level are tried
    if not level:
        out += _base_lines(evidence, judgement.case.base)
    if judgement.findings and judgement.final is not None:
        out += _finding_lines(judgement, judgement.final)
    elif judgement.nearest is not None and not judgement.findings and not level:
        nearest = judgement.nearest
        left = evidence.left(nearest.errors)
        h = nearest.hypothesis
        says = f"{capital(shortly(h))} {' and '.join(verbs(h))} {left}"
        much = "" if explains_untold(judgement) else ": too much for it to be claimed"
        out.append(f"{says}{much}.")
        out += _remains(judgement, nearest)
    return out


def _level_line(change: LevelChange | None, level: bool) -> list[str]:
    if change is None:
        return []
    return [
        f"Between drive levels the {change.what} change by {100 * change.change:.2g} % "
        f"(noise alone: {100 * change.noise:.2g} %): "
        + (
            "the response depends on the level, so the structure is not linear."
            if level
            else "the response depends on the level, though little."
            if change.exceeds(LEAST_CHANGE)
            else "more than noise, and less than what laws that depend on the level are sought for "
            f"({100 * LEAST_CHANGE:.2g} %)."
            if change.exceeds(0.0)
            else "the structure is linear to that accuracy."
            if change.noise <= LEVEL_CHANGE
            else "too noisy to tell."
        )
    ]


def _base_lines(evidence: Evidence, base: Weighed) -> list[str]:
    noise = evidence.noise.fit
    alone = f" (noise alone: {evidence.left(Errors(noise, float('nan')))})"
    return [
        "The nominal model, without the error of its mesh, leaves "
        f"{evidence.left(evidence.nominal)}" + (f"{alone}." if np.isfinite(noise) else "."),
        "With stiffness, mass and damping of the groups fitted within their usual scatter it "
        f"leaves {evidence.left(base.errors)}; the mean square of the differences is then "
        f"{number(base.fit.misfit)} times what noise and the tolerance of a sound model "
        f"make{_though_more(evidence, base)}.",
        *filter(None, [by_themselves(evidence.departs(base.fit))]),
    ]


def _though_more(evidence: Evidence, base: Weighed) -> str:
    """Why a model with more freedom may leave more."""
    if base.errors.fit <= evidence.nominal.fit:
        return ""
    return (
        " (more than the nominal model leaves, because a fit weighs each line by its noise, and so "
        "most where the signal is small: what is wrong is not in the scatter)"
    )


def _remains(judgement: Judgement, w: Weighed) -> list[str]:
    """Where the rest is, where there is one."""
    if explained(w, judgement.case):
        return []
    says = judgement.case.evidence.remains(w.fit)
    return [says] if says else []


def _finding_lines(judgement: Judgement, final: Weighed) -> list[str]:
    evidence, single = judgement.case.evidence, judgement.single
    out = []
    if single is not None and single is not final:
        out.append(
            f"One effect alone, {single.hypothesis.title}, leaves {evidence.left(single.errors)}: "
            "one is not enough."
        )
    out.append(f"With {final.hypothesis.title} the model leaves {evidence.left(final.errors)}.")
    out += _remains(judgement, final)
    out += _beyond_noise(evidence, final)
    fit = final.fit
    out += strained_lines(evidence.model.parameters, fit.p)
    told = {(f.physics, f.place) for f in judgement.findings}
    out += [
        f"{capital(e.title)} is needed for the last of it, but others elsewhere would do as well: "
        "it is not claimed."
        for e in final.hypothesis.effects
        if (e.physics, e.place) not in told
    ]
    out += [line for f in judgement.findings for line in _equivalents(f)]
    out += _thereabouts(judgement)
    out += _next(judgement, final)
    mine = final.hypothesis.title  # another form of one law has the same
    others = [w for w in judgement.field if w.hypothesis.title != mine]
    out += [_other(judgement.case, final, w) for w in others[:RIVALS]]
    return out


def _other(case: Case, final: Weighed, w: Weighed) -> str:
    """What another hypothesis leaves, and why one that leaves as little was not taken: errors are
    of the frequencies or of the responses as a whole, odds of every figure with its weight."""
    h, more, why = w.hypothesis, w.unknowns - final.unknowns, ""
    what = named(h) if shortly(h) == h.title else f"{shortly(h)},"
    if w.errors.fit < final.errors.fit and more > 0:
        unknowns = "one unknown" if more == 1 else f"{more} unknowns"
        why = f": less, but with {unknowns} more, and for those the gain is too small"
    elif w.errors.fit < ALIKE * final.errors.fit:
        why = _odds(log_odds(final, case) - log_odds(w, case))
    return f"With {what} in its place the model leaves {case.evidence.left(w.errors)}{why}."


def _odds(log: float) -> str:
    """How much less likely something is, all figures with their weights."""
    if log < AS_LIKELY:
        return ""
    times = "more than a thousand" if log > MOST_ODDS else f"about {number(float(np.exp(log)), 2)}"
    return f"; all figures weighed, that is {times} times less likely"


def _beyond_noise(evidence: Evidence, final: Weighed) -> list[str]:
    """That what is left is not noise alone, and what then is sure."""
    noise, left = evidence.noise.fit, final.errors.fit
    if not np.isfinite(noise) or noise <= 0.0 or left <= LEFT_OVER * noise:
        return []
    return [
        f"That is {left / noise:.2g} times what noise alone would leave. The model still differs "
        "from the structure in smaller things (damping, edges, joints, the theory of its "
        "elements), which the deviations allow for; the confidence is that of the effect and its "
        "place, not that the model is complete."
    ]


def _next(judgement: Judgement, final: Weighed) -> list[str]:
    """Which measurement would tell the final hypothesis from the likeliest rival."""
    evidence = judgement.case.evidence
    mine = final.hypothesis.title  # another form of one law has the same
    near = rivals(final, judgement.field, judgement.case)
    near = [w for w in near if w.hypothesis.title != mine]
    if not near or evidence.hurried:
        return []
    titles = (mine, near[0].hypothesis.title)
    says = evidence.apart(final.fit, near[0].fit, titles)
    return [says] if says else []


def _equivalents(f: Finding) -> list[str]:
    told = (
        (f"These recordings do not tell {f.title} from ", f.alternatives),
        (f"Less likely than {f.title}, but not ruled out: ", f.unlikelier),
    )
    return [begins + _few(titles) for begins, titles in told if titles]


def _thereabouts(judgement: Judgement) -> list[str]:
    """How likely an effect is to stand where it was found or at a place hardly told from it, where
    that says more than the confidence in its very place."""
    told = {(f.physics, f.place): f for f in judgement.findings}
    final, out = judgement.final, []
    for e, s in zip(final.hypothesis.effects if final else (), judgement.standings, strict=False):
        near = min(s.here, s.most)
        if (e.physics, e.place) in told and near > s.confidence + STATED / 2.0:
            out.append(
                f"That {e.title} is needed there, or at one of the places hardly told from it, is "
                f"sure to {100.0 * near:.0f} %; {100.0 * s.confidence:.0f} % is the confidence in "
                "that very place."
            )
    return out


def _few(titles: Sequence[str]) -> str:
    more = len(titles) - MOST
    return ", ".join(titles[:MOST]) + (f" and {more} more." if more > 0 else ".")
