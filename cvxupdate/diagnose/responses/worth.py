"""The mesh that recordings of responses need."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import mesh_error, shearing, stocky
from cvxupdate.diagnose.nominal.refinement import (
    PLAIN,
    Mesh,
    Wanted,
    fine_enough,
    has_sheets,
    wants_finer,
    with_theory_of,
)
from cvxupdate.diagnose.responses.data import Data
from cvxupdate.diagnose.responses.errors import averaged, noise_errors, norms
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.responses.signals import Complex
from cvxupdate.diagnose.settings import (
    MESH_NOISE,
    MOST_ALLOWANCE,
    RESPONSE_DISCREPANCY,
    SHEET_DISCREPANCY,
    UNEXPLAINED,
)
from cvxupdate.fe.analysis import DIVIDED
from cvxupdate.fe.model import Model
from cvxupdate.spec import Spec

LEAST = 1e-5  # relative: finer than this no frequency is asked for


def mesh_for(
    spec: Spec, file: Model, data: Data, sheared: bool, simulated: bool, corners: bool = True
) -> Mesh:
    """Fine enough for the responses in the band, damped as the file says; ``sheared``: beams may
    turn out to deform in shear, with more than short elements follow; ``simulated``: laws that
    follow the motion will be sought, on the file's own beams as they are; ``corners``: with what
    lies within those of plane frames."""
    bare = undamped(file.with_parameters(()))
    zeta = setting_for(bare, file, data.sharp, data.top).zeta
    typical = float(np.median(zeta)) if len(zeta) else 1.0
    finer = wants_finer(bare, simulated or not corners)
    if simulated and not finer:
        return PLAIN
    finer |= sheared and _short(spec, bare, data.top, typical)
    finer |= _coarse_rods(spec, bare, data.top, typical)

    known: list[tuple[Model, tuple[Complex, ...]]] = []  # one is compared with several

    def modelled(model: Model) -> tuple[Complex, ...]:
        for one, rows in known:
            if one is model:
                return rows
        setting = setting_for(model, file, data.sharp, data.top)
        rows = setting.evaluate(np.zeros(len(setting.columns))).modelled()
        known.append((model, rows))
        return rows

    def differ(model: Model, better: Model) -> float:
        pairs = zip(modelled(model), modelled(better), strict=True)
        return averaged(data.sharp, [norms(np.abs(a - b)) for a, b in pairs])

    noise = max(noise_errors(data.sharp), RESPONSE_DISCREPANCY * MESH_NOISE)
    precision = max(LEAST, MESH_NOISE * RESPONSE_DISCREPANCY * typical)
    wanted = Wanted(data.top, precision, MESH_NOISE * noise, differ, sheared)
    if not finer:
        return with_theory_of(bare, wanted)
    return fine_enough(spec, bare, wanted)


def _short(spec: Spec, bare: Model, top: float, zeta: float) -> bool:
    """Whether beams, were they to deform in shear, are of elements so short that extrapolation may
    miss more of the responses than any explanation may leave: frequencies in half-power bandwidths
    of a typical damping ratio ``zeta``."""
    if not stocky(shearing(bare)):
        return False
    return mesh_error(spec, bare, top, sheared=True).missed(top) > UNEXPLAINED * zeta


def _coarse_rods(spec: Spec, bare: Model, top: float, zeta: float) -> bool:
    """Whether all that can be divided are rods, whose frequencies converge with the square of their
    length only, and extrapolation may miss more than a sound model does: their inner coordinates
    are few, and nothing then hides behind what the mesh may leave."""
    if {b.kind.name for b in bare.blocks} & set(DIVIDED) != {"rod"}:
        return False
    return mesh_error(spec, bare, top).missed(top) > RESPONSE_DISCREPANCY * zeta


def may_leave(fine: Mesh, data: Data, base: Fit, model: Model) -> float:
    """Part of the responses of a model that extrapolation to a fine mesh may miss, or on a finer
    one that mesh and the theory of sheets (that of beams has parameters); frequencies in half-power
    bandwidths (2 ζ f) of the fit with nuisance parameters alone."""
    if not base.setting.damped or (fine.finer and not has_sheets(model)):
        return fine.left
    missed = SHEET_DISCREPANCY if fine.finer else data.mesh_of(model).missed(data.top)
    damping = float(np.median(base.point.damping[base.point.owner]))
    return fine.left + float(min(MOST_ALLOWANCE, missed / damping))
