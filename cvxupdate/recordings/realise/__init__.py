"""Real (normal) modes from complex ones (section 2.3.1); every method's assumption is in its
docstring."""

from cvxupdate.recordings.realise.frf import (
    chen_hsu_tsuei,
    normal_frf,
    normal_poles,
    normal_stiffness,
    resonance_shapes,
)
from cvxupdate.recordings.realise.indicators import (
    complexity_area,
    complexity_phase,
    mean_phase_deviation,
    phase_collinearity,
)
from cvxupdate.recordings.realise.routes import ROUTES, NormalModes, Route, realised
from cvxupdate.recordings.realise.shape import ahmadian_gladwell, imregun_ewins, niedbal, simple
from cvxupdate.recordings.realise.starts import ModelModes, ModeSet
from cvxupdate.recordings.realise.state import ibrahim_fill, ibrahim_state
from cvxupdate.recordings.realise.subspace import (
    ibrahim_fullekrug,
    wei_zhang,
    zhang_lallement,
)

__all__ = [
    "ROUTES",
    "ModeSet",
    "ModelModes",
    "NormalModes",
    "Route",
    "ahmadian_gladwell",
    "chen_hsu_tsuei",
    "complexity_area",
    "complexity_phase",
    "ibrahim_fill",
    "ibrahim_fullekrug",
    "ibrahim_state",
    "imregun_ewins",
    "mean_phase_deviation",
    "niedbal",
    "normal_frf",
    "normal_poles",
    "normal_stiffness",
    "phase_collinearity",
    "realised",
    "resonance_shapes",
    "simple",
    "wei_zhang",
    "zhang_lallement",
]
