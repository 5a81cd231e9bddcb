"""Which of several places is named that no recording tells apart."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.judge.acceptance import Case, Weighed
from cvxupdate.diagnose.judge.posterior import log_odds
from cvxupdate.diagnose.settings import AS_LIKELY
from cvxupdate.fe.model import Model
from cvxupdate.physics.effect import Effect


def in_the_middle(final: Weighed, others: Sequence[Weighed], case: Case) -> Weighed:
    """Of ``final`` and those of ``others`` that have one of its effects at another node of what
    moves as one (the girder of a frame, along itself), where they are about as likely, the one in
    the middle of these: which of them is ahead says nothing, and from the middle what is sought is
    nearest on the average (the median of places that are alike likely)."""
    for effect in final.hypothesis.effects:
        places = [effect, *case.evidence.alike(final.fit, effect, strictly=True)]
        if len(places) < 3 or any(len(e.place.nodes) != 1 for e in places):
            continue
        rest = final.hypothesis.keys - {effect.key}
        likely = log_odds(final, case) - AS_LIKELY
        fitted = {w.hypothesis.keys: w for w in others if not w.freed}
        fitted[final.hypothesis.keys] = final
        each = [(e, fitted.get(rest | {e.key})) for e in places]
        # where it was not fitted it may be as well
        each = [(e, w) for e, w in each if w is None or log_odds(w, case) >= likely]
        far = _far([e for e, _ in each], case.evidence.model)
        order = sorted(range(len(each)), key=lambda i: round(far[i], 9))
        final = next((w for i in order if (w := each[i][1]) is not None), final)
    return final


def _far(places: Sequence[Effect], model: Model) -> list[float]:
    """How far each place is from all others together, m."""
    at = {int(n): x for n, x in zip(model.node_ids, model.xyz, strict=True)}
    xyz = np.array([at[e.place.nodes[0]] for e in places])
    apart = np.linalg.norm(xyz[:, None] - xyz[None], axis=-1)
    return [float(v) for v in apart.sum(axis=1)]
