"""From a problem to its evidence: responses where there are any to fit, else tables of modes."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass, replace
from functools import partial
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.modes.gathered import SHEAR, Sought, modes_evidence
from cvxupdate.diagnose.modes.identified import FEWEST, identified
from cvxupdate.diagnose.nominal.coarse import Discretisation, of_sheets
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import mesh_error
from cvxupdate.diagnose.nominal.refinement import PLAIN, has_sheets
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import elements_of, held_dofs, release_from
from cvxupdate.diagnose.output.wording import nonlinear, slightly
from cvxupdate.diagnose.responses.aside import with_aside
from cvxupdate.diagnose.responses.common import common_of
from cvxupdate.diagnose.responses.data import Data, prepare
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.levels import level_change
from cvxupdate.diagnose.responses.moving import NOTHING, Carried
from cvxupdate.diagnose.responses.worth import mesh_for
from cvxupdate.diagnose.settings import EXPLAINED, LOOK, LOWER, OPEN
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.analysis.corners import corner_nodes
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.physics import effect_names
from cvxupdate.physics.effect import MODES, MOTION, RATIOS, RESPONSES
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import Spec

if TYPE_CHECKING:
    from cvxupdate.diagnose.motion.evidence import MotionEvidence


@dataclass(frozen=True)
class Reference:
    """The recordings of the reference state, to which a model was brought; ``file`` is the model as
    it came; ``carried``: what was added at the drive and goes with it."""

    file: Model
    recordings: tuple[Recording, ...]
    carried: Carried = NOTHING


def gathered(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    progress: Progress,
    reference: Reference | None = None,
    budget: Budget | None = None,
    file: Model | None = None,
) -> Evidence:
    """What the recordings of a problem say of its model, beside a reference where there is one;
    ``file``: the model as it came, where its mesh was too coarse and ``model`` is on a finer one.

    Raises
    ------
    InputError
        When there is no recording to fit, or elements are members of families.
    """
    if spec.model.families:
        raise InputError(
            f"{spec.path}: model.families: diagnose works on elements whose matrices follow from "
            "their properties. Take the families out; a mesh that is too coarse is told by itself."
        )
    if not any(r.origin.use == "fit" for r in recordings):
        raise InputError(f'{spec.path}: diagnose needs a recording with use = "fit". Add one.')
    usable = responses_of(recordings)
    if any(r.origin.use == "fit" for r in usable):
        beside = [] if reference else [t for t in tables_of(recordings) if t.origin.use == "fit"]
        found = _responses(spec, model, usable, beside, progress, reference, budget or Budget())
        return replace(found, came=file) if isinstance(found, ResponseEvidence) else found
    of_reference = None if reference is None else (reference.file, tables_of(reference.recordings))
    tables, sought = tables_of(recordings), _sought(spec)
    modes = modes_evidence(spec, model, tables, sought, progress, budget or Budget(), of_reference)
    return replace(modes, came=file)


def responses_of(recordings: Sequence[Recording]) -> list[FrequencyResponse | TimeHistory]:
    """Those that are responses."""
    return [r for r in recordings if isinstance(r, FrequencyResponse | TimeHistory)]


def tables_of(recordings: Sequence[Recording]) -> list[ModeTable]:
    """Those that are tables of modes."""
    return [r for r in recordings if isinstance(r, ModeTable)]


def _names(spec: Spec, told_by: str) -> tuple[str, ...]:
    asked = spec.diagnose.physics
    return tuple(n for n in effect_names(told_by) if asked is None or n in asked)


def _sought(spec: Spec) -> Sought:
    return Sought(_names(spec, MODES), _names(spec, RATIOS))


def _by_modes(
    spec: Spec,
    model: Model,
    recordings: Sequence[FrequencyResponse | TimeHistory],
    beside: Sequence[ModeTable],
    progress: Progress,
    budget: Budget,
    band: tuple[float, float],
    fewest: int,
) -> Evidence | None:
    """What the modes in responses tell that are in a band (Hz), with tables ``beside``; None where
    there are none, or the model has two at one frequency, of which no derivatives tell."""
    fitted, held = (
        [r for r in recordings if (r.origin.use == "fit") == use] for use in (True, False)
    )
    seen = identified(fitted, band, progress, fewest=fewest or FEWEST)
    tables = [*(s.table for s in seen), *beside]
    # more modes than a model has DOFs: what else is in these responses is no mode of it
    if not tables or max(len(t.frequency) for t in tables) > model.size:
        return None
    part, sought = budget.rest(LOOK), _sought(spec)
    later = partial(identified, held, band, progress, each=True)
    with suppress(ModelError):
        return modes_evidence(spec, model, tables, sought, progress, part, seen=seen, later=later)
    return None


def _responses(
    spec: Spec,
    model: Model,
    recordings: Sequence[FrequencyResponse | TimeHistory],
    beside: Sequence[ModeTable],
    progress: Progress,
    reference: Reference | None,
    budget: Budget,
) -> Evidence:
    """``beside``: tables of modes of the same structure, which are looked at with those in the
    responses."""
    names = _names(spec, RESPONSES)
    file = None if reference is None else reference.file
    plain = prepare(recordings)
    simulated = slightly(level_change(plain.sharp)) or is_nonlinear(model)

    modal = partial(_by_modes, spec, model, recordings, beside, progress, budget)

    def evidence(data: Data, corners: bool = True) -> ResponseEvidence:
        # what a model misses of its reference, mesh included, it misses of the other state too
        fine = PLAIN
        if reference is None:
            fine = mesh_for(spec, model, data, SHEAR in names, simulated, corners)
        else:
            data = replace(data, carried=reference.carried.where(data.driven))
        if not fine.finer:
            data = replace(data, mesh=mesh_error(spec, model, data.top))
            if SHEAR in names:
                data = replace(data, sheared=mesh_error(spec, model, data.top, sheared=True))
        start = undamped(fine.on(model))
        own = None if reference is None else elements_of(reference.file)
        start = with_nuisance(start, spec.diagnose.scatter, fine.theory, own)
        start = with_aside(start, data.driven, data.sensors, data.top)
        held, release = held_dofs(spec, model), release_from(spec, fine)
        found = ResponseEvidence(
            model, start, data, fine, names, held, release, progress, file, budget
        )
        return found if simulated or reference else replace(found, modal=modal)

    common = None
    if reference is not None:
        of_reference = evidence(prepare(responses_of(reference.recordings)))
        data = of_reference.data
        common = common_of(of_reference, data.sharp, data.sharp_hold_out)
    data = plain if common is None else prepare(recordings, common)
    linear = evidence(data)
    if _off_all_the_same(linear):
        bare = evidence(data, corners=False)
        if linear.bases[-1].misfit > LOWER * bare.bases[-1].misfit:
            linear = bare  # what lies within its corners is a small matter then
    if simulated:
        return in_simulation(spec, recordings, linear, progress) or linear
    return linear


def _off_all_the_same(evidence: ResponseEvidence) -> bool:
    """Whether a frame on finer beams is far off all the same: a search among their inner
    coordinates takes several times as long."""
    bent = corner_nodes(evidence.original) and not has_sheets(evidence.original)
    if not evidence.fine.finer or not bent:
        return False
    return bool(evidence.bases[-1].misfit > OPEN * EXPLAINED)


def discretisation(evidence: Evidence, before: float | None) -> Discretisation | None:
    """What the file's mesh of plates explains of the error ``before``, of the responses to fit by
    the file; None where nothing was divided."""
    if not isinstance(evidence, ResponseEvidence) or before is None:
        return None
    noise = evidence.noise.fit if np.isfinite(evidence.noise.fit) else 0.0
    return of_sheets(evidence.fine, before, evidence.nominal.fit, noise)


def may_drift(evidence: Evidence) -> bool:
    """Whether runs at one level differ by more than noise and reason: the structure may have
    changed in between, whatever a linear model makes of them."""
    if not isinstance(evidence, ResponseEvidence):
        return False
    return nonlinear(level_change(evidence.data.compared, one=True))


def in_simulation(
    spec: Spec,
    recordings: Sequence[Recording],
    linear: Evidence,
    progress: Progress,
    part: float = 1.0,
) -> MotionEvidence | None:
    """The same recordings, or a ``part`` of each from its beginning, with laws that depend on the
    level beside all else; None where they are not time histories."""
    if not isinstance(linear, ResponseEvidence):
        return None
    # the compiler of the loops over time loads with the first simulation
    from cvxupdate.diagnose.motion.evidence import MotionEvidence
    from cvxupdate.diagnose.motion.march import ready
    from cvxupdate.diagnose.motion.runs import (
        begun,
        from_rest,
        run_of,
        shortened,
        stages_of,
        thinned_signals,
    )

    fitted = [r for r in recordings if r.origin.use == "fit" and not isinstance(r, ModeTable)]
    came = [begun(r, part) for r in recordings if isinstance(r, TimeHistory)]
    whole = [from_rest(r) for r in came]
    histories = [shortened(h) if h.origin.use == "fit" else h for h in whole]
    if any(not isinstance(r, TimeHistory) for r in fitted):
        return None
    progress("simulating")
    with linear.budget.aside():  # the compiler works once for all diagnoses
        ready()
    runs = {h.origin.name: run for h in histories if (run := run_of(h)) is not None}
    fit = [h for h in histories if h.origin.name in runs and h.origin.use == "fit"]
    if not fit:
        return None
    held = [h for h in histories if h.origin.name in runs and h.origin.use != "fit"]
    mesh, sheared = linear.data.mesh, linear.data.sheared
    data = prepare([h for h in histories if h.origin.name in runs])
    before = prepare(came) if part < 1.0 else linear.data
    return MotionEvidence(
        replace(linear, data=replace(before, mesh=mesh, sheared=sheared)),
        replace(linear, data=replace(data, mesh=mesh, sheared=sheared)),
        runs,
        stages_of(fit, runs, data.sharp),
        thinned_signals(held, runs),
        _names(spec, MOTION),
        progress,
        budget=linear.budget,  # both searches are one diagnosis
    )
