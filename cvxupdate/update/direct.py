"""Method ``direct``: the closed-form methods of the literature on the measured modes of a problem
(thesis 2.7), with what each does wrong."""

from __future__ import annotations

import time
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import scipy.linalg as la
from numpy.typing import NDArray

from cvxupdate.correlate.compare import geometry_of
from cvxupdate.direct.methods import METHODS, DirectMethod
from cvxupdate.direct.result import DirectUpdate, change_by_dof, faults
from cvxupdate.errors import CvxupdateError, InputError
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import Recording
from cvxupdate.spec import Spec
from cvxupdate.update.direct_beside import NAME, convex_version
from cvxupdate.update.direct_modes import direct_modes
from cvxupdate.update.direct_scene import Scene, scene
from cvxupdate.update.direct_written import written_matrices
from cvxupdate.update.measured_modes import metrics_of
from cvxupdate.update.outcome import model_facts
from cvxupdate.update.result import DirectResult, Updated

Real = NDArray[np.float64]
LARGEST = 2500
"""DOFs up to which dense matrices are worked with."""
NAMED = 3
"""Nodes that are named as those where a method changes most."""
NO_SHAPES = (
    'needs measured mode shapes: a recording of kind "modes" with use = "fit" whose rows have a '
    "`shape`. Of frequencies alone take pole-placement here, or method frequencies"
)
NO_CERTIFICATE = (
    "A closed formula was evaluated, not a convex program solved: there is nothing to certify. It "
    "knows no bounds, no clauses and, but for the weights of Park and Lee, no deviations of the "
    "recordings; what came of that is measured in the table of direct methods."
)


def update_direct(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Updated:
    """Matrices by the direct method that [update] names, beside all the others and the constrained
    convex update of the same request.

    Raises
    ------
    InputError
        Where there are no measured shapes, the model is too large, or the method named cannot be
        applied.
    """
    begin = time.perf_counter()
    if spec.update is None:
        raise InputError(f"{spec.path}: there is no [update] table. Add one with a method.")
    if model.size > LARGEST:
        raise InputError(
            f"{spec.path}: the direct methods work on dense matrices; {model.size} DOFs are more "
            f"than {LARGEST}. Take method ceam."
        )
    given = scene(spec, model, recordings)
    rows, chosen = [], None
    for method in METHODS:
        row, made = _tried(given, method)
        rows.append(row)
        if method.name == spec.update.direct:
            if made is None:
                raise InputError(f"{spec.path}: update.direct = {method.name!r}: {row.why}")
            chosen = made
    if chosen is None:
        raise InputError(f"{spec.path}: there is no direct method {spec.update.direct!r}.")
    rows.append(_convex(spec, given, recordings))
    results = direct_modes(given, chosen)
    written = written_matrices(spec, model, chosen)
    row = next(r for r in rows if r.name == spec.update.direct)
    return Updated(
        problem=spec.name,
        title=spec.title,
        source=spec.source,
        path=spec.shown,
        status="converged",
        reason=f"{row.title}: a formula, evaluated once",
        method=f"direct: {row.name}",
        solver="none",
        iterations=0,
        parameters=(),
        fit={
            key: metrics_of([r for r in results if r.use == use])
            for key, use in (("fit", "fit"), ("hold_out", "hold-out"))
        },
        certificate={"none": True, "says": NO_CERTIFICATE},
        time=time.perf_counter() - begin,
        modes=results,
        model={"clauses": (), **model_facts(model, model.zero())},
        notes=(_how(spec, given), *((written,) if isinstance(written, str) else ())),
        caveats=tuple(f"{line[:1].upper()}{line[1:]}." for line in row.says),
        direct=tuple(r if r.name in (row.name, NAME) else replace(r, by_node=()) for r in rows),
        geometry=geometry_of(spec, model),
        written=None if isinstance(written, str) else written[0],
        matrix_files={} if isinstance(written, str) else written[1],
    )


def _how(spec: Spec, given: Scene) -> str:
    """Where the shapes come from."""
    if not given.shaped:
        return (
            "the recordings have frequencies without shapes: the model's own shapes stand in the "
            "table, and only methods that assign frequencies alone were tried"
        )
    if given.partial and spec.update is not None:
        return f"shapes were expanded to all {given.model.size} DOFs by {spec.update.expansion}"
    return "shapes were measured at every DOF"


def _tried(given: Scene, method: DirectMethod) -> tuple[DirectResult, DirectUpdate | None]:
    """The figures of one method; those that cannot be had are None, and ``why`` says so."""
    r = given.request
    nothing = DirectResult(method.name, method.title, method.equations, method.changes)
    if method.needs_shapes and not given.shaped:
        return replace(nothing, why=NO_SHAPES), None
    try:
        made = method.apply(r)
        if not all(np.all(np.isfinite(a)) for a in (made.M, made.K)):
            raise InputError("gives entries that are no numbers")
    except (CvxupdateError, la.LinAlgError, ValueError) as error:
        return replace(nothing, why=str(error)), None
    return _measured(given, nothing, made), made


def _convex(spec: Spec, given: Scene, recordings: Sequence[Recording]) -> DirectResult:
    """The same figures of the constrained convex update of the same request."""
    try:
        found = convex_version(spec, recordings, given.shaped)
    except CvxupdateError as error:
        return DirectResult(NAME, "Constrained convex update", "", "", why=str(error))
    row = DirectResult(NAME, found.title, "", found.changes)
    return replace(_measured(given, row, found.made), says=found.says)


def _measured(given: Scene, nothing: DirectResult, made: DirectUpdate) -> DirectResult:
    """What was changed, what it reproduces, and what is wrong with it."""
    r = given.request
    found = faults(made, r.K, r.M, *r.asked(made))
    results = direct_modes(given, made)
    scores = {
        use: metrics_of([x for x in results if x.use == use]).get(
            "frequency_error_percent_mean", {}
        )
        for use in ("fit", "hold-out")
    }
    nodes = _by_node(given.model, made, r.K, r.M)
    return replace(
        nothing,
        stiffness_change=float(np.linalg.norm(made.K - r.K) / np.linalg.norm(r.K)),
        mass_change=float(np.linalg.norm(made.M - r.M) / np.linalg.norm(r.M)),
        fit_error=scores["fit"].get("after"),
        hold_out_error=scores["hold-out"].get("after"),
        reproduction=found.reproduction,
        mass_min=found.mass_min,
        stiffness_min=found.stiffness_min,
        new_entries=found.new_entries,
        spurious=found.spurious,
        where=tuple(f"node {n} ({100.0 * part:.2g} %)" for n, part in nodes[:NAMED]),
        by_node=nodes,
        says=found.says,
    )


def _by_node(model: Model, made: DirectUpdate, K: Real, M: Real) -> tuple[tuple[int, float], ...]:
    """Nodes with their parts of the change, the largest first; none that does not change."""
    part = change_by_dof(made, K, M)
    nodes, at = np.unique(model.dof_node, return_inverse=True)
    whole = np.bincount(at, weights=part)
    order = np.argsort(-whole, kind="stable")
    return tuple((int(model.node_ids[nodes[i]]), float(whole[i])) for i in order if whole[i] > 0.0)
