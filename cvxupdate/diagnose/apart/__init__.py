"""Explanations that a diagnosis could not tell apart, and the measurement that would."""

from cvxupdate.diagnose.apart.apart import told_apart
from cvxupdate.diagnose.apart.measurement import (
    Apart,
    Explanation,
    LawCheck,
    Measurement,
    MeasurementSet,
)

__all__ = [
    "Apart",
    "Explanation",
    "LawCheck",
    "Measurement",
    "MeasurementSet",
    "told_apart",
]
