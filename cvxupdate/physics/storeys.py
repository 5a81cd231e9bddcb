"""What a brace or a damper of a frame is hung between: the corners at both ends of a column or a
beam, which move against each other across it."""

from __future__ import annotations

from collections import Counter
from itertools import pairwise

import numpy as np

from cvxupdate.fe.model import Model
from cvxupdate.physics.chains import chains
from cvxupdate.physics.place import TRANSLATIONS

ALONG = 0.9  # cosine of the angle to a member within which a direction is along it: it hardly gives


def storeys(model: Model) -> list[tuple[int, int, str]]:
    """(row, row, direction) of free DOFs at neighbouring corners of every straight member, across
    it; corners are nodes at which members meet."""
    lines = chains(model)
    meet = Counter(n for line in lines for n in {*line.nodes} if n)
    at = {int(number): k for k, number in enumerate(model.node_ids)}
    out: list[tuple[int, int, str]] = []
    for line in lines:
        corners = [n for n in line.nodes if n and meet[n] > 1]
        for a, b in pairwise(corners):
            axis = model.xyz[at[b]] - model.xyz[at[a]]
            cosines = np.abs(axis) / max(float(np.linalg.norm(axis)), 1e-300)
            for kind, cosine in zip(TRANSLATIONS, cosines, strict=True):
                one, two = (model.place.get(f"n{n}.{kind}", -1) for n in (a, b))
                if cosine < ALONG and min(one, two) >= 0:
                    out.append((one, two, kind))
    return out
