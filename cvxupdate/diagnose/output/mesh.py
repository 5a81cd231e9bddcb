"""A diagnosis whose file has a mesh that is too coarse: said before all else."""

from __future__ import annotations

from dataclasses import replace

from cvxupdate.diagnose.nominal.coarse import Discretisation
from cvxupdate.diagnose.output.diagnosis import Diagnosis


def with_mesh(found: Diagnosis, told: Discretisation | None, line: str = "") -> Diagnosis:
    """A diagnosis on the better mesh, with its ``line`` of evidence first; where the mesh explains
    most of what is off, and no effect is needed, it is what was wrong."""
    if told is None or not (line or told.explains):
        return found
    details = {**found.details, "discretisation": told.to_json()}
    evidence = (line, *found.evidence) if line else found.evidence
    plain = found.verdict == "consistent" and told.explains and not found.by_modes
    says = told.verdict if plain else found.says
    return replace(found, says=says, evidence=evidence, details=details)
