"""Explanations that a diagnosis could not tell apart, and the measurement that would."""

from cvxupdate.diagnose.apart.apart import told_apart
from cvxupdate.diagnose.apart.measurement import Apart, Explanation, Measurement, MeasurementSet

__all__ = ["Apart", "Explanation", "Measurement", "MeasurementSet", "told_apart"]
