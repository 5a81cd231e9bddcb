"""Detect, screen, search, judge, write: what the recordings say the model leaves out."""

from __future__ import annotations

import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from cvxupdate.diagnose.motion.evidence import MotionEvidence
    from cvxupdate.diagnose.nominal.coarse import Coarse
    from cvxupdate.diagnose.output.diagnosis import Diagnosis
    from cvxupdate.diagnose.reference import Brought
    from cvxupdate.diagnose.types import Evidence
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.types import Recording
    from cvxupdate.spec import Spec


def diagnose_problem(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Callable[[str], None] | None = None,
    thorough: bool = False,
    jobs: int | None = None,
) -> Diagnosis:
    """Diagnose responses where there are any, else tables of modes; time histories that no linear
    model explains, or that differ at one level, once more, with laws that depend on the level; the
    force of a part on a rig, whose model has no mass, by its law. Where there are recordings of a
    reference state the model is brought to it before; several states that all have a name are one
    fit. ``thorough``: however long the search takes; ``jobs``: processes that refit (None: one for
    each processor), which changes nothing where time does not end the search.

    Raises
    ------
    InputError
        When there is no recording to fit.
    """
    from cvxupdate.diagnose.budget import Budget
    from cvxupdate.diagnose.component import component_diagnosis
    from cvxupdate.diagnose.gather import discretisation, gathered
    from cvxupdate.diagnose.modes.evidence import ModesEvidence
    from cvxupdate.diagnose.motion.component import rigs_of
    from cvxupdate.diagnose.nominal.members import divided
    from cvxupdate.diagnose.output.file_numbers import in_file_numbers
    from cvxupdate.diagnose.output.mesh import with_mesh
    from cvxupdate.diagnose.reference import brought, changed, not_unchanged
    from cvxupdate.diagnose.states import states_diagnosis
    from cvxupdate.recordings.states import states_of

    begin = time.perf_counter()
    tell = progress or (lambda text: None)
    members = divided(spec, model, recordings)
    if members is not None:
        tell(members.says)
        found = diagnose_problem(members.spec, members.model, recordings, progress, thorough, jobs)
        found = in_file_numbers(found, members.mesh)
        return replace(found, evidence=(members.says, *found.evidence))
    rigs = rigs_of(model, recordings)
    if any(r.use == "fit" for r in rigs):
        return component_diagnosis(spec, rigs, begin)
    budget = Budget.of(thorough, jobs)
    tell(f"searching: {budget.says}")
    states = states_of(spec, recordings)
    if states:
        return states_diagnosis(spec, model, states, tell, begin, budget)
    now = brought(spec, model, recordings, tell, budget)
    now, file, coarse = _meshed(now, tell)
    evidence = gathered(now.spec, now.model, now.recordings, tell, now.reference, budget, file)
    found = _by_level(now.spec, now.recordings, evidence, tell, begin)
    if isinstance(evidence, ModesEvidence) and evidence.tables.left_out:
        found = replace(found, says=" ".join([found.says, *evidence.tables.left_out]))
    if now.reference is not None:
        said = not_unchanged(found, changed(now.reference, now.recordings))
        return replace(said, evidence=(*now.lines, *said.evidence))
    if coarse is not None:
        return with_mesh(in_file_numbers(found, coarse.mesh), coarse.told, coarse.says)
    return with_mesh(found, discretisation(evidence, found.fit["fit"]["before"]))


def _meshed(
    now: Brought, tell: Callable[[str], None]
) -> tuple[Brought, Model | None, Coarse | None]:
    """The problem on a mesh that does, the model as it came where that is another, and what was
    wrong with its mesh."""
    from cvxupdate.diagnose.nominal.coarse import too_coarse
    from cvxupdate.fe.analysis import as_stated

    if now.spec.model.refine is not None:
        return now, as_stated(now.spec, now.model), None
    coarse = None if now.reference else too_coarse(now.spec, now.model, now.recordings)
    if coarse is None:
        return now, None, None
    tell(coarse.says)
    return replace(now, spec=coarse.spec, model=coarse.model), coarse.file, coarse


def _by_level(
    spec: Spec,
    recordings: Sequence[Recording],
    evidence: Evidence,
    tell: Callable[[str], None],
    begin: float,
) -> Diagnosis:
    """By linear effects; where they do not explain, or runs at one level differ, with laws that
    depend on the level too: where several linear ones leave nothing, and only which is not told,
    no law has anything to explain. Where nothing is missing but that the recordings depend on the
    level a little, with laws alone. Drift, where runs at one level differ, is looked for first: of
    a structure that changed, no effect is claimed that a search would find."""
    from cvxupdate.diagnose.gather import in_simulation, may_drift
    from cvxupdate.diagnose.output.telltale_words import distorted
    from cvxupdate.diagnose.output.wording import depends_a_little, nonlinear

    simulated = in_simulation(spec, recordings, evidence, tell) if may_drift(evidence) else None
    if simulated is not None and simulated.drift:
        return _diagnosed(spec, recordings, simulated, tell, begin)
    found = _diagnosed(spec, recordings, evidence, tell, begin)
    if found.verdict == "consistent" and (laws := _laws_alone(spec, recordings, evidence, tell)):
        by_law = _diagnosed(spec, recordings, laws, tell, begin)
        return by_law if by_law.findings else depends_a_little(found, by_law, laws.level_change())
    if found.verdict != "undetermined" or "explained_by" in found.details:
        return found
    simulated = simulated or in_simulation(spec, recordings, evidence, tell)
    if simulated is None:
        return found
    again = _diagnosed(spec, recordings, simulated, tell, begin)
    unsought = nonlinear(evidence.level_change(), distorted(recordings))  # by linear effects alone
    return again if again.findings or simulated.drift or unsought else found


def _laws_alone(
    spec: Spec, recordings: Sequence[Recording], linear: Evidence, tell: Callable[[str], None]
) -> MotionEvidence | None:
    """What a linear model explains, beside nothing linear, where it depends on the level by more
    than a linear structure does: what a sound model may miss it misses at every level alike."""
    from cvxupdate.diagnose.gather import in_simulation
    from cvxupdate.diagnose.responses.evidence import ResponseEvidence
    from cvxupdate.diagnose.settings import LEAST_CHANGE

    change = linear.level_change()
    if not isinstance(linear, ResponseEvidence) or not change or not change.exceeds(LEAST_CHANGE):
        return None
    return in_simulation(spec, recordings, replace(linear, names=()), tell)


def _diagnosed(
    spec: Spec,
    recordings: Sequence[Recording],
    evidence: Evidence,
    tell: Callable[[str], None],
    begin: float,
) -> Diagnosis:
    """By as much of the recordings as can be followed."""
    from cvxupdate.diagnose.pipeline import diagnosed
    from cvxupdate.physics.effect import MOTION

    says = ""
    if evidence.told_by == MOTION:
        from cvxupdate.diagnose.gather import in_simulation
        from cvxupdate.diagnose.motion.horizon import foretold

        def again(linear: Evidence, part: float) -> MotionEvidence | None:
            return in_simulation(spec, recordings, linear, tell, part)

        evidence, says = foretold(evidence, again, tell)
    found = diagnosed(spec, recordings, evidence, tell, begin)
    return replace(found, evidence=(*found.evidence, says)) if says else found


__all__ = ["diagnose_problem"]
