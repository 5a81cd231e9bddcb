"""A model against recordings of responses, with a damping ratio of its own for every mode."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from cvxupdate.diagnose.fit import Fit, fitted
from cvxupdate.diagnose.nominal.damping import file_damping
from cvxupdate.diagnose.nominal.mesh import NONE, MeshError
from cvxupdate.diagnose.responses.point import ResponseSetting
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.diagnose.settings import WIDE
from cvxupdate.diagnose.types import Evidence
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.fe.rigid import rigid_body_modes
from cvxupdate.physics.fault import Fault
from cvxupdate.update.trust_region import Options

# tolerance, iterations and first trust region of a fit by its effort
EFFORTS = {
    "first pass": Options(1e-2, 3, 0.5),
    "base": Options(3e-3, 12, 0.5),
    "coarse": Options(1e-2, 12, 0.5),
    "sharp": Options(1e-3, 12, 0.5),
}


def setting_for(
    model: Model,
    original: Model,
    signals: Sequence[Signal],
    top: float,
    faults: Sequence[Fault] = (),
    mesh: MeshError = NONE,
) -> ResponseSetting:
    """Give every mode in the band a damping ratio of its own, starting from the problem file's."""
    m = model.matrices(model.zero())
    rigid = rigid_body_modes(model, m.K, m.M)
    count = min(model.size, 40)
    while True:
        modes = natural_modes(m.K, m.M, count, rigid).flexible()
        if (
            len(modes.frequencies) < count
            or modes.frequencies[-1] > 1.3 * top
            or count >= model.size
        ):
            break
        count = min(2 * count, model.size)
    band = int(np.sum(modes.frequencies < 1.25 * top))
    f = modes.frequencies[:band]
    return ResponseSetting(
        model, tuple(signals), file_damping(original, f), top, tuple(faults), mesh.at(f)
    )


def let_go(evidence: Evidence) -> Fit:
    """The nuisance parameters fitted far beyond their scatter, level by level."""
    free = [replace(q, lower=-WIDE, upper=WIDE) for q in evidence.model.parameters]
    setting = evidence.setting(evidence.model.with_parameters(free), ())
    found = fitted(setting, np.zeros(len(setting.columns)), EFFORTS["base"])
    for level in range(1, evidence.levels):
        found = fitted(evidence.at_level(setting, level), found.p, EFFORTS["base"])
    return found
