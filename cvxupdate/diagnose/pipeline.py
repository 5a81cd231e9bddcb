"""Detect, screen, search, judge, write: once, for every kind of evidence."""

from __future__ import annotations

import time
from collections.abc import Sequence

from cvxupdate.diagnose.judge.by_modes import ByModes
from cvxupdate.diagnose.judge.claim import claimed
from cvxupdate.diagnose.judge.judge import judge
from cvxupdate.diagnose.judge.pattern import pattern_of, told_beside
from cvxupdate.diagnose.judge.placebo import placebo
from cvxupdate.diagnose.output.diagnosis import (
    Diagnosis,
    candidates_table,
    details_of,
    fit_table,
)
from cvxupdate.diagnose.output.evidence_words import evidence_lines
from cvxupdate.diagnose.output.export import updated_problem, with_damping
from cvxupdate.diagnose.output.one_body import one_body_lines
from cvxupdate.diagnose.output.telltale_words import distorted, telltale_lines
from cvxupdate.diagnose.output.wording import nonlinear, verdict_of
from cvxupdate.diagnose.results import Further
from cvxupdate.diagnose.search.search import Found, names_tried, search
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.effect import MOTION
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec


def diagnosed(
    spec: Spec,
    recordings: Sequence[Recording],
    evidence: Evidence,
    progress: Progress,
    begin: float,
) -> Diagnosis:
    """The diagnosis of a problem by its evidence; ``begin``: when it began (`perf_counter`)."""
    change = evidence.level_change()
    drift = evidence.drift
    distortion = change is not None and distorted(recordings)
    depends = nonlinear(change, distortion)
    level = depends and evidence.told_by != MOTION
    sought = () if level or drift else names_tried(evidence)
    seen = ByModes(evidence, progress)
    found = Found() if level or drift else search(evidence, progress, seen)
    first = judge(evidence, found)
    judgement = claimed(seen.instead(first) if found.scores else first)
    last = judgement.last
    further = Further() if level or drift else evidence.further(last.fit)
    pattern = told_beside(pattern_of(further), judgement)
    findings = (*judgement.findings, *pattern.findings)
    open_ = depends and not evidence.foretold
    verdict, says = verdict_of(judgement, pattern.findings, open_, drift, pattern.unsure)
    lines = [
        *evidence_lines(judgement, change, drift, distortion),
        *telltale_lines(recordings, drift is not None),
    ]
    if depends and evidence.foretold:
        lines.append("The laws that the file has foretell that: half of it is left at the most.")
    lines += [*seen.lines(first, judgement), *pattern.lines]
    lines += one_body_lines(findings, evidence.model)
    sham = None
    if first.findings and first.final is not None:
        sham = placebo(first.final, found, first.case)
    elif judgement.findings:
        sham = seen.sham
    lines += [] if sham is None else [sham.says]
    updated = None
    if findings:
        model = with_damping(evidence.updated(last.fit, further), pattern.damped)
        updated = updated_problem(spec, recordings, model, [says])
    return Diagnosis(
        problem=spec.name,
        title=spec.title,
        path=spec.shown,
        verdict=verdict,
        says=says,
        findings=findings,
        candidates=candidates_table(judgement, found),
        fit=fit_table(judgement),
        metrics=evidence.metrics(last.fit),
        evidence=tuple(lines),
        time=time.perf_counter() - begin,
        details=details_of(judgement, found, sought),
        updated=updated,
        shown=evidence.shown(last.fit, found.scores),
        by_modes=judgement.sound,
    )
