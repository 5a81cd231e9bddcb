"""Force appropriation (section 2.3.2): forces that excite one normal mode, and the modes they
excite."""

from cvxupdate.recordings.appropriate.indicators import (
    asher,
    extended_asher,
    mmif,
    modified_asher,
    nash,
    principal_forces,
    traill_nash,
)
from cvxupdate.recordings.appropriate.modes import METHODS, Appropriated, appropriate
from cvxupdate.recordings.appropriate.places import ExciterPlaces, exciter_places

__all__ = [
    "METHODS",
    "Appropriated",
    "ExciterPlaces",
    "appropriate",
    "asher",
    "exciter_places",
    "extended_asher",
    "mmif",
    "modified_asher",
    "nash",
    "principal_forces",
    "traill_nash",
]
