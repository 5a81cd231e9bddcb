"""Wrong numbers in groups: nuisance parameters found far beyond their scatter."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.nominal.scatter import scatter_of
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import CREDIBLE
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics import told
from cvxupdate.physics.place import Place

MOST = 3  # groups that are named


def loose_groups(h: Hypothesis) -> list[tuple[int, Parameter, float]]:
    """Nuisance parameters outside their credible band: (number, parameter, how many of their prior
    deviations), farthest first."""
    out = []
    for k, q in enumerate(h.fit.setting.model.parameters):
        far = abs(float(h.fit.p[k])) / scatter_of(q) if q.group is not None else 0.0
        if far > CREDIBLE:
            out.append((k, q, far))
    return sorted(out, key=lambda item: -item[2])


def group_findings(h: Hypothesis) -> tuple[Finding, ...]:
    """The farthest of `loose_groups` as findings."""
    out = []
    for k, q, far in loose_groups(h)[:MOST]:
        place = Place(elements=q.elements, groups=(q.group or q.name.rpartition(".")[0],))
        effect = told("stiffness_change" if q.of == "stiffness" else "mass_change", place)
        values = {"factor": 1.0 + float(h.fit.p[k])}
        sure = float(np.clip(1.0 - 3.0 / far**2, 0.5, 0.99))
        out.append(
            Finding(
                effect.physics,
                place,
                effect.title,
                values,
                {"factor": float(h.fit.deviations[k])},
                {"factor": float(h.fit.noise_deviations[k])},
                sure,
                1.0,
                (),
                effect.says(values),
            )
        )
    return tuple(out)
