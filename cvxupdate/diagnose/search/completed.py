"""What else a rig may do beside what brought a model to the tables of its reference.

A search ends with the first set that leaves no more than noise and tolerance, and what a rig does
in small measure (sensors that weigh, soft joints) stays in the shapes: a change is then sized by
shapes that are not the structure's. Of a reference nothing is claimed, so the likeliest model is
wanted, and all of it at once is a fit or two.
"""

from __future__ import annotations

from collections.abc import Sequence

from cvxupdate.diagnose.hypothesis import Hypothesis, further
from cvxupdate.diagnose.search.classes import likelier_with, widest
from cvxupdate.diagnose.search.race import merged
from cvxupdate.diagnose.types import Evidence, Progress

REST = "what else a rig does, beside what brings the model near"


def completed(
    evidence: Evidence, near: Sequence[Hypothesis], progress: Progress
) -> list[Hypothesis]:
    """Each of ``near`` with all else that a rig does everywhere, freed of what the evidence is
    better without; best first."""
    out: list[Hypothesis] = []
    for h in near:
        if evidence.hurried:
            evidence.leave(REST)
            break
        progress(f"fitting what else a rig does beside {h.name}")
        others = further(widest(evidence.candidates(h.fit.setting.model)), h)
        out += likelier_with(evidence, h, [others])
    return merged(out)
