"""Values with their units as a technician writes them."""

from __future__ import annotations

import math

from cvxupdate.physics.place import Place

PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "µ"))
PREFIXED = ("N/m", "N·m/rad", "N", "s", "N/m³", "m", "N·s/m", "N·m·s/rad")


def stiffness_unit(place: Place) -> str:
    """Of a spring that acts at a place."""
    return "N·m/rad" if place.turns else "N/m"


def damper_unit(place: Place) -> str:
    """Of a dashpot that acts at a place."""
    return "N·m·s/rad" if place.turns else "N·s/m"


def number(value: float, digits: int = 3) -> str:
    """Three significant digits without an exponent: 3.49, 0.0126, 12 300."""
    if value == 0.0 or not math.isfinite(value):
        return f"{value:g}"
    value = float(f"{value:.{digits - 1}e}")
    places = digits - 1 - math.floor(math.log10(abs(value)) + 1e-12)
    if -3 < places <= 8:
        return f"{round(value, places):.{max(places, 0)}f}".replace("-", "−")
    return f"{value:.{digits - 1}e}".replace("-", "−")


def quantity(value: float, unit: str) -> str:
    """With the prefix that suits it: "3.49 kN/m", "34.8 g", "1.2 ms"; units that have none stay as
    they are."""
    if unit == "kg":
        return f"{number(1e3 * value)} g" if 0.0 < abs(value) < 0.1 else f"{number(value)} kg"
    if unit not in PREFIXED or value == 0.0 or not math.isfinite(value):
        return f"{number(value)} {unit}".strip()
    fitting = [
        (f, letter) for f, letter in PREFIXES if (f <= 1.0 if unit in ("s", "m") else f >= 1.0)
    ]
    size = abs(float(f"{value:.2e}"))
    factor, letter = next(((f, letter) for f, letter in fitting if size >= f), fitting[-1])
    return f"{number(value / factor)} {letter}{unit}"
