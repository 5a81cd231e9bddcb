"""Modal identification: poles, shapes, residuals and their standard deviations from FRFs."""

from cvxupdate.recordings.identify.decay import DecayRates, decay_rates
from cvxupdate.recordings.identify.identify import identify_modes
from cvxupdate.recordings.identify.result import IdentifiedModes
from cvxupdate.recordings.identify.stabilisation import Criteria, Stabilisation
from cvxupdate.recordings.identify.synthesis import modal_frf, rest_of, synthesise

__all__ = [
    "Criteria",
    "DecayRates",
    "IdentifiedModes",
    "Stabilisation",
    "decay_rates",
    "identify_modes",
    "modal_frf",
    "rest_of",
    "synthesise",
]
