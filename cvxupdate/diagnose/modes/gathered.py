"""From tables of modes to their evidence: the mesh that does, nuisance parameters, what is common
to a reference, rows that are no mode of the model."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

from cvxupdate.diagnose.budget import Budget
from cvxupdate.diagnose.modes.common import common_of
from cvxupdate.diagnose.modes.coupled import without_coupling
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.foreign import foreign, line, was_there, without
from cvxupdate.diagnose.modes.gains import suspect
from cvxupdate.diagnose.modes.identified import Identified, without_shapes_at
from cvxupdate.diagnose.modes.same import as_before
from cvxupdate.diagnose.modes.tables import prepared, stated_tables
from cvxupdate.diagnose.modes.worth import mesh_for
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import NONE, mesh_error
from cvxupdate.diagnose.nominal.refinement import PLAIN
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import elements_of, held_dofs, release_from
from cvxupdate.diagnose.types import Progress
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import ModeTable
from cvxupdate.spec import Spec

SHEAR = "shear_deformation"  # an effect that changes what the mesh is worth


@dataclass(frozen=True)
class Sought:
    """Effects that are tried: on frequencies and shapes (``names``), on ratios (``damping``)."""

    names: tuple[str, ...]
    damping: tuple[str, ...]


def modes_evidence(
    spec: Spec,
    model: Model,
    tables: Sequence[ModeTable],
    sought: Sought,
    progress: Progress,
    budget: Budget,
    reference: tuple[Model, Sequence[ModeTable]] | None = None,
    seen: Sequence[Identified] = (),
    later: Callable[[], Sequence[Identified]] = tuple,
) -> ModesEvidence:
    """Of ``tables``, in the order of the file; ``reference``: the model as it came and the tables
    of the reference state to which it was brought; ``seen``: the first of these tables as they were
    identified from FRFs: sensors may stand beside their nodes, and channels have another gain;
    ``later``: what FRFs that are held out say of that."""
    top = max(float(t.frequency.max()) for t in tables)
    fine = PLAIN if reference else mesh_for(spec, model, top, SHEAR in sought.names)
    start = undamped(fine.on(model))
    own = None if reference is None else elements_of(reference[0])
    start = with_nuisance(start, spec.diagnose.scatter, fine.theory, own)
    mesh = NONE if fine.finer else mesh_error(spec, model, top)
    common = None
    if reference is not None:
        tables = as_before(start, tables, reference[1])
        common = common_of(start, stated_tables(start, reference[1], mesh))

    def evidence(tables: Sequence[ModeTable]) -> ModesEvidence:
        return ModesEvidence(
            model,
            start,
            replace(
                prepared(start, tables, mesh, common, bool(seen)), seen=tuple(seen), later=later
            ),
            mesh,
            fine,
            sought.names,
            sought.damping,
            held_dofs(spec, model),
            release_from(spec, fine),
            _order(spec),
            progress,
            None if reference is None else reference[0],
            budget,
        )

    whole = evidence(tables)
    base = whole.bases[-1]
    odd = None if whole.explained(base, whole.errors(base)) else suspect(base.point, seen)
    if odd is not None:
        tables = [*(without_shapes_at(own, odd) for own in seen), *tables[len(seen) :]]
        whole = evidence(tables)
    whole = without_coupling(evidence, whole, tables)
    if whole.tables.told:
        return whole
    return _known(evidence, whole, tables, None if reference is None else reference[1])


def _order(spec: Spec) -> tuple[int, ...]:
    """The places of tables in the file, those to fit first."""
    return tuple(
        k
        for fitted in (True, False)
        for k, r in enumerate(spec.recordings)
        if r.kind == "modes" and (r.use == "fit") == fitted
    )


def _known(
    evidence: Callable[[Sequence[ModeTable]], ModesEvidence],
    whole: ModesEvidence,
    tables: Sequence[ModeTable],
    before: Sequence[ModeTable] | None,
) -> ModesEvidence:
    """The ``whole`` evidence without the rows that are no mode of the model, where all others are
    explained. A reference (its tables ``before``) had them too: a mode that came since is what
    changed."""
    base = whole.bases[-1]
    odd = {} if whole.explained(base, whole.errors(base)) else foreign(whole.nominal_point)
    fitted = [t for t in tables if t.origin.use == "fit"]
    if before is not None and not all(
        was_there(fitted[k], i, before) for k, rows in odd.items() for i, _ in rows
    ):
        return whole
    left = {k: without(fitted[k], [i for i, _ in rows]) for k, rows in odd.items()}
    if not left or any(t is None for t in left.values()):
        return whole
    kept = [t for k, u in enumerate(fitted) if (t := left.get(k, u)) is not None]
    rest = evidence([*kept, *(t for t in tables if t.origin.use != "fit")])
    base = rest.bases[-1]
    if not rest.explained(base, rest.errors(base)):
        return whole
    gone = {k: {i: line(fitted[k], i, best) for i, best in rows} for k, rows in odd.items()}
    return replace(rest, tables=replace(rest.tables, gone=gone))
