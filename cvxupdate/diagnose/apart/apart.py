"""What to measure next: explanations of a `diagnosis.json` fitted again, and the measurement that
tells most of them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from cvxupdate.diagnose.apart.boundaries import free_of
from cvxupdate.diagnose.apart.compared import ALIKE, compared_responses
from cvxupdate.diagnose.apart.explanations import Named, explanations_of, refitted
from cvxupdate.diagnose.apart.laws import checks_of_tables, linear_says
from cvxupdate.diagnose.apart.measurement import Apart, Explanation, pairs_of, ranked
from cvxupdate.diagnose.apart.tables import Figures
from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.gather import gathered, in_simulation
from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.motion.component import rigs_of
from cvxupdate.diagnose.nominal.members import divided
from cvxupdate.diagnose.reference import brought
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.settings import UNTOLD
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.errors import InputError
from cvxupdate.fe.model import Model
from cvxupdate.physics.place import capital
from cvxupdate.recordings.states import states_of
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec


def told_apart(
    spec: Spec,
    model: Model,
    recordings: Sequence[Recording],
    told: Any,
    where: str,
    noise: float | None,
    band: tuple[float, float] | None,
    progress: Progress,
    count: int | None = None,
) -> Apart:
    """The measurements that would tell the explanations of a diagnosis apart, best first. ``told``:
    the content of `diagnosis.json`, which lies at ``where``; ``noise`` relative, of responses to
    come in ``band`` (None: as they were); ``count`` responses make a set (None: as many as are
    worth it).

    Raises
    ------
    InputError
        Where the diagnosis is none of this problem, lists nothing that is alike, or is one of
        several states or of a part on a rig.
    """
    wanted = explanations_of(told, where)
    if rigs_of(model, recordings) or states_of(spec, recordings):
        raise InputError(
            f"{spec.path}: what tells explanations apart is planned for one structure in one state "
            "(or one beside a reference). Leave --diagnosis out."
        )
    members = divided(spec, model, recordings)
    if members is not None:
        spec, model = members.spec, members.model
    budget = Budget.of(True)
    now = brought(spec, model, recordings, progress, budget)
    evidence: Evidence = gathered(
        now.spec, now.model, now.recordings, progress, now.reference, budget
    )
    if not _all_named(wanted) <= set(evidence.names):
        # laws that depend on the level were found in simulation
        evidence = in_simulation(now.spec, now.recordings, evidence, progress) or evidence
    fitted: dict[frozenset[Any], Hypothesis] = {}
    for k, one in enumerate(wanted, start=1):
        progress(f"refitting explanation {k} of {len(wanted)}")
        h = refitted(evidence, one, progress, where)
        if h is not None:
            fitted.setdefault(h.keys, h)
    hypotheses = tuple(fitted.values())
    if len(hypotheses) < 2:
        raise InputError(
            f"{where}: fitted again, fewer than two of its explanations are a structure. There is "
            "nothing to tell apart."
        )
    progress("comparing what they foretell")
    return _compared(now.spec, evidence, hypotheses, noise, band, count)


def _all_named(wanted: Sequence[Sequence[Named]]) -> set[str]:
    return {one.physics for effects in wanted for one in effects}


def _compared(
    spec: Spec,
    evidence: Evidence,
    hypotheses: tuple[Hypothesis, ...],
    noise: float | None,
    band: tuple[float, float] | None,
    count: int | None,
) -> Apart:
    """What there is to measure for this kind of evidence; of responses also a set."""
    explained = tuple(Explanation(capital(h.title), h.fit.misfit) for h in hypotheses)
    if isinstance(evidence, ResponseEvidence):
        freed = free_of(spec, evidence.fine)
        return compared_responses(evidence, hypotheses, explained, noise, band, count, freed)
    if isinstance(evidence, ModesEvidence):
        figures = Figures(evidence, hypotheses)
        laws = tuple(checks_of_tables(hypotheses, figures.moved))
        lines = (linear_says(evidence, len(hypotheses)),)
        return Apart(explained, ranked(figures.found()), lines, laws=laws)
    return _in_time(evidence, hypotheses, explained, noise)


def _in_time(
    evidence: Evidence,
    hypotheses: tuple[Hypothesis, ...],
    explained: tuple[Explanation, ...],
    noise: float | None,
) -> Apart:
    """Of time histories with laws among the explanations: levels, sensors and drives, and where in
    frequency each pair differs most."""
    # the compiler of the loops over time loads with the first simulation
    from cvxupdate.diagnose.apart.levels import Levels
    from cvxupdate.diagnose.motion.columns import is_law
    from cvxupdate.diagnose.motion.evidence import MotionEvidence

    if not isinstance(evidence, MotionEvidence):
        return Apart(explained, ())
    found = ranked(Levels(evidence, hypotheses, noise).found())
    depends = [any(is_law(e) for e in h.effects) for h in hypotheses]
    if not any(depends):
        return Apart(explained, found, (linear_says(evidence, len(hypotheses)),))
    known = [m.separations for m in found]
    best = np.max(known, axis=0) if known else np.zeros(0)
    pairs = tuple(pairs_of(len(hypotheses)))
    same = tuple(k for k, d in zip(pairs, best, strict=False) if d < UNTOLD)
    said = [f"{explained[i].title} and {hypotheses[j].title}: {ALIKE}" for i, j in same]
    said += [
        evidence.apart(a.fit, b.fit, (a.title, b.title))
        for i, j in pairs
        for a, b in [(hypotheses[i], hypotheses[j])]
        # linear ones differ by as much at every level
        if (depends[i] or depends[j]) and (i, j) not in same
    ]
    lines = tuple(line for line in said if line)
    return Apart(explained, found, lines, pairs=pairs, same=same)
