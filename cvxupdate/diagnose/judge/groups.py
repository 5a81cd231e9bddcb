"""Wrong numbers in groups: nuisance parameters found far beyond their scatter."""

from __future__ import annotations

from cvxupdate.diagnose.hypothesis import Hypothesis
from cvxupdate.diagnose.nominal.scatter import scatter_of
from cvxupdate.diagnose.results import Finding
from cvxupdate.diagnose.settings import CREDIBLE, LEAST_SIZE
from cvxupdate.fe.parameters import Parameter
from cvxupdate.physics import told
from cvxupdate.physics.place import Place

MOST = 3  # groups that are named


def loose_groups(h: Hypothesis) -> list[tuple[int, Parameter, float]]:
    """Nuisance parameters outside their credible band and clearly not nothing: (number, parameter,
    how many of their prior deviations), farthest first."""
    out = []
    for k, q in enumerate(h.fit.setting.model.parameters):
        size = abs(float(h.fit.p[k]))
        far = size / scatter_of(q) if q.group is not None else 0.0
        if far > CREDIBLE and size >= LEAST_SIZE * float(h.fit.deviations[k]):
            out.append((k, q, far))
    return sorted(out, key=lambda item: -item[2])


def group_findings(h: Hypothesis, confidence: float) -> tuple[Finding, ...]:
    """The farthest of `loose_groups` as findings; they stand or fall together."""
    out = []
    for k, q, _ in loose_groups(h)[:MOST]:
        place = Place(elements=q.elements, groups=(q.group or q.name.rpartition(".")[0],))
        effect = told("stiffness_change" if q.of == "stiffness" else "mass_change", place)
        values = {"factor": 1.0 + float(h.fit.p[k])}
        spread, noise = (
            {"factor": float(d[k])} for d in (h.fit.deviations, h.fit.noise_deviations)
        )
        out.append(Finding.of(effect, values, spread, confidence, noise=noise))
    return tuple(out)
