"""What every test has, and what theory wants: the shear of beams too short to do without."""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig, together, without
from cvxupdate.diagnose.settings import BY_THEORY, NEAR_THEORY
from cvxupdate.diagnose.types import Evidence
from cvxupdate.physics.effect import MODES, Effect
from cvxupdate.physics.shaker import at_drive

SHEARS = "shear_deformation"


def by_tables_alone(evidence: Evidence) -> bool:
    """Whether tables of modes are all that there is: no reference state had its say of the rig, and
    much explains so few figures in the tolerance of a model."""
    return evidence.told_by == MODES and evidence.file is None


def by_theory(evidence: Evidence, parent: Hypothesis) -> Hypothesis | None:
    """A parent with the shear that theory wants of its beams, as large as that says; None where
    it wants none, or the parent has that much."""
    has = [k for k, e in enumerate(parent.effects) if e.physics == SHEARS]
    near = any(abs(parent.sizes(k)[0] - BY_THEORY) <= NEAR_THEORY for k in has)
    if not evidence.stocky or near or SHEARS not in evidence.names:
        return None
    rest = without(evidence, parent, *has) if has else parent
    if rest is None:
        return None
    found = evidence.candidates(rest.fit.setting.model, (SHEARS,))
    whole = max(found, key=lambda e: len(e.place.elements), default=None)
    return None if whole is None else together(evidence, rest, [whole], BY_THEORY)


def expected(evidence: Evidence, h: Hypothesis) -> bool:
    """Whether nothing is supposed but what a rig does, what stands at the drive being the shaker's,
    and what theory wants: neither had to be sought among many places."""
    return not sought(evidence, h)


def sought(evidence: Evidence, h: Hypothesis) -> int:
    """How many things are supposed that are not `expected`."""
    return sum(not usual(evidence, e) for e in h.effects)


def usual(evidence: Evidence, e: Effect) -> bool:
    """Whether a rig does it, or theory wants it."""
    return of_a_rig(e) or at_drive(e) or (evidence.stocky and e.physics == SHEARS)
