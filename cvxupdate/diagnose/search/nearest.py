"""What brings a model to recordings of which nothing is to be claimed: a reference state."""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.search.classes import alike_everywhere
from cvxupdate.diagnose.search.driven import settled, shaken
from cvxupdate.diagnose.search.guided import brought_near
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.search.search import Found, names_tried
from cvxupdate.diagnose.settings import EXPLAINED, HOPELESS
from cvxupdate.diagnose.types import Evidence, Progress
from cvxupdate.physics.effect import MODES


def nearest(evidence: Evidence, progress: Progress) -> Found | None:
    """What brings a model that is far off to recordings of which nothing is to be claimed: the
    first sets that explain them, whatever else would; None where none does."""
    near = _brought_near(evidence, progress) if names_tried(evidence) else []
    if not near or near[0].fit.misfit > EXPLAINED:
        return None
    several = [h for h in near if len(h.effects) > 1]
    several = merged(several, shaken(evidence, several, progress))
    singles = [h for h in near if len(h.effects) == 1]
    return Found((), tuple(settled(evidence, singles)), tuple(settled(evidence, several)))


def _brought_near(evidence: Evidence, progress: Progress) -> list[Hypothesis]:
    """Tables of modes by what a rig does everywhere alone, where that leaves nothing; a model that
    is far off from responses by its approach."""
    if evidence.told_by == MODES:
        found = alike_everywhere(evidence, progress)
        return found if found and evidence.clear(found[0].fit) else []
    far = evidence.bases[-1].misfit > HOPELESS * EXPLAINED
    return brought_near(evidence, progress) if far else []
