"""The mesh that recordings of responses need."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.refinement import (
    PLAIN,
    Mesh,
    Wanted,
    fine_enough,
    wants_finer,
    with_theory_of,
)
from cvxupdate.diagnose.responses.data import Data
from cvxupdate.diagnose.responses.errors import averaged, noise_errors, norms
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.responses.signals import Complex
from cvxupdate.diagnose.settings import MESH_NOISE, RESPONSE_DISCREPANCY
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec

LEAST = 1e-5  # relative: finer than this no frequency is asked for


def mesh_for(
    spec: Spec, file: Model, data: Data, sheared: bool, simulated: bool, corners: bool = True
) -> Mesh:
    """Fine enough for the responses in the band, damped as the file says; ``simulated``: laws that
    follow the motion will be sought, on the file's own beams as they are; ``corners``: with what
    lies within those of plane frames."""
    bare = undamped(file.with_parameters(()))
    finer = wants_finer(bare, simulated or not corners)
    if simulated and not finer:
        return PLAIN

    def modelled(model: Model) -> tuple[Complex, ...]:
        setting = setting_for(model, file, data.sharp, data.top)
        return setting.evaluate(np.zeros(len(setting.columns))).modelled()

    def differ(model: Model, better: Model) -> float:
        pairs = zip(modelled(model), modelled(better), strict=True)
        return averaged(data.sharp, [norms(np.abs(a - b)) for a, b in pairs])

    zeta = setting_for(bare, file, data.sharp, data.top).zeta
    typical = float(np.median(zeta)) if len(zeta) else 1.0
    noise = max(noise_errors(data.sharp), RESPONSE_DISCREPANCY * MESH_NOISE)
    precision = max(LEAST, MESH_NOISE * RESPONSE_DISCREPANCY * typical)
    wanted = Wanted(data.top, precision, MESH_NOISE * noise, differ, sheared)
    if not finer:
        return with_theory_of(bare, wanted)
    return fine_enough(spec, bare, wanted)
