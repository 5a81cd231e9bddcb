"""Real (normal) modes from complex ones (section 2.3.1); every method's assumption is in its
docstring."""

from cvxupdate.recordings.realise.frf import chen_hsu_tsuei, normal_frf, normal_stiffness
from cvxupdate.recordings.realise.indicators import (
    complexity_area,
    complexity_phase,
    phase_collinearity,
)
from cvxupdate.recordings.realise.shape import ahmadian_gladwell, imregun_ewins, niedbal, simple
from cvxupdate.recordings.realise.state import ibrahim_fill, ibrahim_state

__all__ = [
    "ahmadian_gladwell",
    "chen_hsu_tsuei",
    "complexity_area",
    "complexity_phase",
    "ibrahim_fill",
    "ibrahim_state",
    "imregun_ewins",
    "niedbal",
    "normal_frf",
    "normal_stiffness",
    "phase_collinearity",
    "simple",
]
