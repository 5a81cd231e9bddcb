"""The structure on purpose under another boundary: a known mass on it, a known spring to ground, a
support taken away, hung free. The responses that were measured are taken again there."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.apart.foretold import diverse
from cvxupdate.diagnose.apart.known_mass import with_known, with_lump
from cvxupdate.diagnose.apart.questions import Question
from cvxupdate.diagnose.apart.responses import Points, Responses, total
from cvxupdate.diagnose.apart.worth import Products
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import regrown
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.responses.point import ResponsePoint
from cvxupdate.diagnose.settings import KNOWN_MASS, KNOWN_SPRING
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import KINDS, Model
from cvxupdate.physics.added_mass import translations
from cvxupdate.physics.units import quantity
from cvxupdate.spec import Spec

PLACES = 12  # nodes tried for a known mass, DOFs for a known spring
FREED = 12  # supports that are taken away, one at a time

Freed = Callable[[], Model]


@dataclass(frozen=True)
class Boundary:
    """A change of the boundary: its ``kind`` ("mass", "spring", "support", "free"), in words, the
    ``node`` and ``dof`` that it is about (None, empty: the whole structure), the known ``mass``
    (kg) or ``stiffness`` (N/m); ``grown`` makes the model under it, of an explanation's own, with
    the value of the known part in units of its parameter (None: there is none)."""

    kind: str
    says: str
    grown: Callable[[Model], tuple[Model, float | None]]
    node: int | None = None
    dof: str = ""
    mass: float = 0.0
    stiffness: float = 0.0


def free_of(spec: Spec, mesh: Mesh) -> Freed:
    """The undamped nuisance model of a problem without its supports."""

    def freed() -> Model:
        text = spec.model.model_copy(update={"supports": ()})
        file = build_model(replace(spec, model=text, update=None))
        scatter = spec.diagnose.scatter
        return with_nuisance(undamped(mesh.on(file)), scatter=scatter, theory=mesh.theory)

    return freed


def boundaries(evidence: ResponseEvidence, question: Question, freed: Freed) -> Iterator[Boundary]:
    """Those that are tried."""
    model, point = evidence.model, question.members[0].fit.point
    whole, nodes = model.total_mass(), translations(model)
    if whole > 0.0 and nodes:
        moving = np.array(sorted(row for rows in nodes.values() for row in rows))
        some = diverse(point.modes.shapes, moving, 3 * PLACES)
        yield from _masses(evidence, KNOWN_MASS * whole, some)
        yield from _springs(evidence, KNOWN_SPRING * whole * _softest(point) ** 2, some)
    held = evidence.supports
    for node, kind in held[:: max(1, -(-len(held) // FREED))]:

        def without(m: Model, node: int = node, kind: str = kind) -> tuple[Model, None]:
            return regrown(evidence.release(node, kind), m), None

        yield Boundary("support", f"node {node} set free in {kind}", without, node, kind)
    if len(held) > 1:
        bare: list[Model] = []

        def hung(m: Model) -> tuple[Model, None]:
            bare.extend([] if bare else [freed()])
            return regrown(bare[0], m), None

        yield Boundary("free", "the structure hung free on soft cords", hung)


def _softest(point: ResponsePoint) -> float:
    """The lowest flexible natural frequency, rad/s."""
    f = point.modes.frequencies[point.modes.rigid :]
    return 2.0 * np.pi * float(f[0]) if len(f) else 0.0


def _masses(evidence: ResponseEvidence, mass: float, rows: Sequence[int]) -> Iterator[Boundary]:
    model = evidence.model
    at = dict.fromkeys(int(model.node_ids[model.dof_node[row]]) for row in rows)
    for node in list(at)[:PLACES]:

        def grown(m: Model, node: int = node) -> tuple[Model, float]:
            out = with_lump(evidence, m, node)
            return out, mass / out.parameters[-1].unit_size

        says = f"a known mass of {quantity(mass, 'kg')} at node {node}"
        yield Boundary("mass", says, grown, node, "", mass)


def _springs(evidence: ResponseEvidence, k: float, rows: Sequence[int]) -> Iterator[Boundary]:
    model = evidence.model
    for row in rows[:PLACES] if k > 0.0 else ():
        node, dof = int(model.node_ids[model.dof_node[row]]), KINDS[int(model.dof_kind[row])]

        def grown(m: Model, node: int = node, dof: str = dof) -> tuple[Model, float]:
            out = with_known(evidence, m, "grounding_spring", node, dof)
            return out, k / out.parameters[-1].unit_size

        says = f"a known spring of {quantity(k, 'N/m')} to ground at node {node} ({dof})"
        yield Boundary("spring", says, grown, node, dof, stiffness=k)


def under(evidence: ResponseEvidence, question: Question, boundary: Boundary) -> Points:
    """The explanations of a question under another boundary.

    Raises
    ------
    CvxupdateError
        Where one is no structure there, or has an effect that stands on what is taken away.
    """
    base, places = _moved(evidence, question.base, boundary)
    members = tuple(_moved(evidence, h.fit.point, boundary)[0] for h in question.members)
    return Points(base, members, places)


def _moved(
    evidence: ResponseEvidence, point: ResponsePoint, boundary: Boundary
) -> tuple[ResponsePoint, NDArray[np.int64]]:
    """A point under the boundary, and where its unknowns stand there (-1: nowhere)."""
    setting, p = point.setting, point.p
    grown, value = boundary.grown(setting.model)
    n, more = len(setting.model.parameters), 0 if value is None else 1
    again = evidence.setting(grown, setting.faults, None)
    own, tail = min(setting.damped, again.damped), len(setting.faults)
    places = np.full(len(p), -1, dtype=np.int64)
    places[:n] = np.arange(n)
    damping = np.arange(n, setting.ratios.start + own)
    places[damping] = damping + more
    places[len(p) - tail :] = np.arange(len(again.columns) - tail, len(again.columns))
    q = np.zeros(len(again.columns))
    q[places[places >= 0]] = p[places >= 0]
    if value is not None:
        q[n] = value
    return again.evaluate(q), places


def told(responses: Responses, boundary: Boundary) -> Products | None:
    """What the responses that were measured tell when they are taken again under a boundary; None
    where the explanations have none."""
    try:
        points = under(responses.evidence, responses.question, boundary)
        parts = []
        for s in responses.evidence.data.sharp:
            there = points.base.setting.model.place
            sensors = [x for x in s.sensors if x in there]
            for drive in s.inputs:
                if sensors and drive in there:
                    parts += responses.products(points, sensors, drive)
    except CvxupdateError:
        return None
    return total(parts[1:], parts[0]) if parts else None
