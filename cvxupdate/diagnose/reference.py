"""A reference state: the model is first brought to it, so that what remains is what changed."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.gather import Reference, gathered, responses_of, tables_of
from cvxupdate.diagnose.hypothesis import only_a_rig
from cvxupdate.diagnose.judge.acceptance import Case, Weighed, better
from cvxupdate.diagnose.judge.judge import Judgement, judge
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.judge.soundness import sound
from cvxupdate.diagnose.modes.levels import state_change as modes_change
from cvxupdate.diagnose.modes.tables import stated_of
from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.diagnose.output.export import updated_problem
from cvxupdate.diagnose.output.wording import nonlinear
from cvxupdate.diagnose.responses.data import signals_of
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.levels import state_change as responses_change
from cvxupdate.diagnose.responses.moving import NOTHING, Carried
from cvxupdate.diagnose.results import Further
from cvxupdate.diagnose.search.completed import completed, with_one_more
from cvxupdate.diagnose.search.nearest import nearest, with_near
from cvxupdate.diagnose.search.search import Found, search
from cvxupdate.diagnose.settings import CALIBRATED, COMPLETED, LOOK, STRONG
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import MODES
from cvxupdate.recordings.corrections import corrected
from cvxupdate.recordings.states import REFERENCE, parted
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec, read_text
from cvxupdate.spec.write import Written


@dataclass(frozen=True)
class Brought:
    """A problem whose model was brought to its reference, with the recordings of the other state,
    and how that went in words; as it came where there is no reference."""

    spec: Spec
    model: Model
    recordings: tuple[Recording, ...]
    reference: Reference | None = None
    lines: tuple[str, ...] = ()


def brought(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Progress,
    budget: Budget | None = None,
) -> Brought:
    """The likeliest hypothesis on the recordings of the reference becomes the model: it need not be
    claimed, for what changed is sought and not what it stands for.

    Raises
    ------
    InputError
        When there is no recording to fit of the reference, or of the other state.
    """
    (its_spec, its), (own_spec, own) = parted(spec, recordings)
    if not its:
        return Brought(spec, model, tuple(recordings))
    for part, what in ((its, "the reference"), (own, "the state that is looked into")):
        if not any(r.origin.use == "fit" for r in part):
            raise InputError(
                f"{spec.path}: beside a reference state diagnose needs a recording with "
                f'use = "fit" of each state; {what} has none. Add one.'
            )

    def tell(text: str) -> None:
        progress(f"reference: {text}")

    kinds = [any(r.origin.use == "fit" for r in responses_of(part)) for part in (its, own)]
    if kinds[0] != kinds[1]:
        raise InputError(
            f"{spec.path}: the recordings to fit of the reference are "
            f"{_kind(kinds[0])}, those of the other state {_kind(kinds[1])}. Give both states the "
            "same kind of recordings (identify makes tables of modes from responses)."
        )
    evidence, best = _sought(its_spec, model, its, tell, budget or Budget())
    fits = (best.fit, evidence.bases[-1])
    texts = ((_written(spec, recordings, evidence, fit), fit) for fit in fits)
    text, fit = next((pair for pair in texts if pair[0] is not None), (None, fits[-1]))
    if text is None:  # the grammar has no form for what the file itself holds
        return Brought(own_spec, model, own)
    there = read_text(text.text, spec.path)
    freed = [  # of the faults of channels that the reference has
        corrected(r, after.corrections[len(before.corrections) :])
        for r, before, after in zip(recordings, spec.recordings, there.recordings, strict=True)
    ]
    (_, its), (now, own) = parted(there, freed)
    left = spec.diagnose.model_copy(update={"scatter": CALIBRATED * spec.diagnose.scatter})
    now = replace(
        now,
        name=spec.name,
        title=spec.title,
        source=spec.source,
        diagnose=left,
        update=spec.update and now.update,
    )
    found = build_model(replace(now, update=None))
    reference = Reference(model, its, _carried(evidence, fit))
    return Brought(now, found, own, reference, (_line(best, evidence),))


def _carried(evidence: Evidence, fit: Fit) -> Carried:
    """What of a fit to the reference goes with the drive: a file has no word for it."""
    model = fit.setting.model
    return Carried.of(model, fit.p) if isinstance(evidence, ResponseEvidence) else NOTHING


def _sought(
    spec: Spec, model: Model, its: Sequence[Recording], tell: Progress, budget: Budget
) -> tuple[Evidence, Weighed]:
    """The likeliest of all effects on the recordings of the reference, in half of the time: the
    other half is for what changed."""
    everything = replace(spec, diagnose=spec.diagnose.model_copy(update={"physics": None}))
    evidence = gathered(everything, model, its, tell, budget=budget.part(LOOK))
    near = nearest(evidence, tell)
    found, judgement = _completed(evidence, near.found, tell)
    best = likeliest(judgement)
    there = bool(best.hypothesis.effects)  # what was held out may refute the first
    by_modes = evidence.told_by == MODES
    enough = near.enough or (by_modes and evidence.clear(best.fit))
    if not there or not (enough or evidence.hurried):
        found, judgement = _completed(evidence, with_near(search(evidence, tell), found), tell)
    return evidence, likeliest(judgement)


def _completed(evidence: Evidence, found: Found, tell: Progress) -> tuple[Found, Judgement]:
    """What was found, judged; by tables also with all that a rig does beside the likeliest."""
    judgement = judge(evidence, found)
    if evidence.told_by != MODES:
        return found, judgement
    first = [w.hypothesis for w in ranked(judgement)[:COMPLETED]]
    found = with_near(found, Found(several=tuple(completed(evidence, first, tell))))
    judgement = judge(evidence, found)
    more = with_one_more(evidence, likeliest(judgement).hypothesis, tell)
    found = with_near(found, Found(several=tuple(more)))
    return found, judge(evidence, found) if more else judgement


def _written(
    spec: Spec, recordings: Sequence[Recording], evidence: Evidence, fit: Fit
) -> Written | None:
    """The whole problem with the model of a fit to its reference; None where the grammar has no
    form for it."""
    updated = evidence.updated(fit, Further())
    places = [k for k, r in enumerate(recordings) if r.origin.state == REFERENCE]
    pairs = {places[k]: modes for k, modes in updated.pairs.items()}
    return updated_problem(replace(spec, update=None), recordings, replace(updated, pairs=pairs))


def _line(best: Weighed, evidence: Evidence) -> str:
    what = best.hypothesis.title if best.hypothesis.effects else "the usual scatter of its groups"
    return (
        f"The model was first brought to the reference state: {what} leaves "
        f"{evidence.left(best.errors)} of it. What is still left there is taken as common to both "
        "states."
    )


def _kind(responses: bool) -> str:
    return "responses" if responses else "tables of modes"


def changed(reference: Reference, recordings: Sequence[Recording]) -> str | None:
    """How the structure changed from the reference, in words, whatever the model is; None where
    noise and what a structure does from day to day explain it, or nothing compares."""
    its, own = (
        [r for r in rs if r.origin.use == "fit"] for rs in (reference.recordings, recordings)
    )
    before, after = ([s for r in responses_of(rs) for s in signals_of(r)] for rs in (its, own))
    if before and after:
        change = responses_change(before, after)
        if change is None or not nonlinear(change):
            return None
        return f"the transfer functions changed by {100 * change.change:.2g} %"
    moved = modes_change(*(stated_of(tables_of(rs)) for rs in (its, own)))
    return f"natural frequencies moved by up to {100 * moved:.2g} %" if moved else None


def not_unchanged(found: Diagnosis, change: str | None) -> Diagnosis:
    """A diagnosis beside a reference: where the recordings of both states differ by themselves,
    that a model too far off from them explains both is no proof that nothing is missing."""
    if change is None or found.verdict != "consistent":
        return found
    says = (
        f"Something changed from the reference ({change}), but the model is too far off from it to "
        "tell what. Bring the model nearer to the reference first."
    )
    return replace(found, verdict="undetermined", says=says)


def likeliest(judgement: Judgement) -> Weighed:
    """The likeliest hypothesis that rests on sizes that are there (a rig's may be small: nothing is
    claimed of it) and shows on what was held out, a rig alone unless something else is favoured
    strongly: every test has one, and both states have it in common; the nuisance parameters alone
    where there is none."""
    case: Case = judgement.case
    tried = ranked(judgement)
    best = tried[0]
    rig = next((w for w in tried if w.hypothesis.effects and only_a_rig(w.hypothesis)), best)
    return rig if log_odds(rig, case) >= log_odds(best, case) - STRONG / 2.0 else best


def ranked(judgement: Judgement) -> list[Weighed]:
    """All that were tried in which what is sought is of a size that is there, likeliest first; the
    nuisance parameters alone last."""
    case: Case = judgement.case
    tried = [
        w
        for w in (*judgement.several, *judgement.singles)
        if (only_a_rig(w.hypothesis) or sound(w.hypothesis, case.evidence, whole=False))
        and better(w, case.base, case)
    ]
    return [*sorted(tried, key=lambda w: -log_odds(w, case)), case.base]
