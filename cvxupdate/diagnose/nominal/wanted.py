"""What every test has, and what theory wants: the shear of beams too short to do without."""

from __future__ import annotations

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.hypothesis import Hypothesis, of_a_rig, together, without
from cvxupdate.diagnose.settings import BY_THEORY, NEAR_THEORY
from cvxupdate.diagnose.types import Evidence
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import MODES, Effect
from cvxupdate.physics.shaker import at_drive

SHEARS = "shear_deformation"


def by_tables_alone(evidence: Evidence) -> bool:
    """Whether tables of modes are all that there is: no reference state had its say of the rig, and
    much explains so few figures in the tolerance of a model."""
    return evidence.told_by == MODES and evidence.file is None


def nothing_left(evidence: Evidence, fit: Fit) -> bool:
    """Whether a fit leaves nothing to seek: it is clear, and of tables alone, whose tolerance hides
    what else is missing, noise alone is left."""
    return evidence.clear(fit) and (fit.spent or not by_tables_alone(evidence))


def by_theory(evidence: Evidence, parent: Hypothesis) -> Hypothesis | None:
    """A parent with the shear that theory wants of its beams, as large as that says; None where
    it wants none, or the parent has that much."""
    has, near = _sheared(parent)
    if not evidence.stocky or near or SHEARS not in evidence.names:
        return None
    rest = without(evidence, parent, *has) if has else parent
    if rest is None:
        return None
    whole = shear_of_all(evidence, rest.fit.setting.model)
    return None if whole is None else together(evidence, rest, [whole], BY_THEORY)


def _sheared(h: Hypothesis) -> tuple[list[int], list[int]]:
    """Which effects are shear, and which of these are near the size that theory says."""
    has = [k for k, e in enumerate(h.effects) if e.physics == SHEARS]
    return has, [k for k in has if abs(h.sizes(k)[0] - BY_THEORY) <= NEAR_THEORY]


def shear_of_all(evidence: Evidence, model: Model) -> Effect | None:
    """The effect that all beams that lack it deform in shear; None where none does."""
    found = evidence.candidates(model, (SHEARS,)) if SHEARS in evidence.names else []
    return max(found, key=lambda e: len(e.place.elements), default=None)


def foreseen(evidence: Evidence, h: Hypothesis) -> list[int]:
    """Effects that theory foresees, with their size, however little they may do: the shear of all
    beams that lack it."""
    near = _sheared(h)[1]
    whole = shear_of_all(evidence, evidence.model) if near else None
    return [k for k in near if whole is not None and h.effects[k].key == whole.key]


def expected(evidence: Evidence, h: Hypothesis) -> bool:
    """Whether nothing is supposed but what a rig does, what stands at the drive being the shaker's,
    and what theory wants: neither had to be sought among many places."""
    return not sought(evidence, h)


def sought(evidence: Evidence, h: Hypothesis) -> int:
    """How many things are supposed that are not `expected`."""
    theory = foreseen(evidence, h)
    return sum(not usual(evidence, e) for k, e in enumerate(h.effects) if k not in theory)


def usual(evidence: Evidence, e: Effect) -> bool:
    """Whether a rig does it, or theory wants it."""
    return of_a_rig(e) or at_drive(e) or (evidence.stocky and e.physics == SHEARS)
