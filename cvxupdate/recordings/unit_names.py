"""Names of units, their prefixes and spellings, with factors to SI (see `units`)."""

from __future__ import annotations

import math

_G = 9.80665
_LBF = 0.45359237 * _G

# name: (factor to SI, (length, mass, time, voltage))
BASE: dict[str, tuple[float, tuple[int, int, int, int]]] = {
    "m": (1.0, (1, 0, 0, 0)),
    "metre": (1.0, (1, 0, 0, 0)),
    "meter": (1.0, (1, 0, 0, 0)),
    "in": (0.0254, (1, 0, 0, 0)),
    "inch": (0.0254, (1, 0, 0, 0)),
    "ft": (0.3048, (1, 0, 0, 0)),
    "mil": (2.54e-5, (1, 0, 0, 0)),
    "thou": (2.54e-5, (1, 0, 0, 0)),
    "micron": (1e-6, (1, 0, 0, 0)),
    "s": (1.0, (0, 0, 1, 0)),
    "sec": (1.0, (0, 0, 1, 0)),
    "min": (60.0, (0, 0, 1, 0)),
    "Hz": (1.0, (0, 0, -1, 0)),
    "rpm": (1.0 / 60.0, (0, 0, -1, 0)),
    "kg": (1.0, (0, 1, 0, 0)),
    "gram": (1e-3, (0, 1, 0, 0)),
    "t": (1e3, (0, 1, 0, 0)),
    "lbm": (0.45359237, (0, 1, 0, 0)),
    "slug": (_LBF / 0.3048, (0, 1, 0, 0)),
    "N": (1.0, (1, 1, -2, 0)),
    "newton": (1.0, (1, 1, -2, 0)),
    "newtons": (1.0, (1, 1, -2, 0)),
    "lbf": (_LBF, (1, 1, -2, 0)),
    "lb": (_LBF, (1, 1, -2, 0)),
    "lbs": (_LBF, (1, 1, -2, 0)),
    "kip": (1000.0 * _LBF, (1, 1, -2, 0)),
    "kips": (1000.0 * _LBF, (1, 1, -2, 0)),
    "ozf": (_LBF / 16.0, (1, 1, -2, 0)),
    "kgf": (_G, (1, 1, -2, 0)),
    "kp": (_G, (1, 1, -2, 0)),
    "dyn": (1e-5, (1, 1, -2, 0)),
    "poundal": (0.45359237 * 0.3048, (1, 1, -2, 0)),
    "g": (_G, (1, 0, -2, 0)),
    "gn": (_G, (1, 0, -2, 0)),
    "g0": (_G, (1, 0, -2, 0)),
    "Gal": (0.01, (1, 0, -2, 0)),
    "ips": (0.0254, (1, 0, -1, 0)),
    "Pa": (1.0, (-1, 1, -2, 0)),
    "bar": (1e5, (-1, 1, -2, 0)),
    "psi": (_LBF / 0.0254**2, (-1, 1, -2, 0)),
    "J": (1.0, (2, 1, -2, 0)),
    "V": (1.0, (0, 0, 0, 1)),
    "volt": (1.0, (0, 0, 0, 1)),
    "volts": (1.0, (0, 0, 0, 1)),
    "rad": (1.0, (0, 0, 0, 0)),
    "deg": (math.pi / 180.0, (0, 0, 0, 0)),
    "rev": (2.0 * math.pi, (0, 0, 0, 0)),
    "strain": (1.0, (0, 0, 0, 0)),
    "ustrain": (1e-6, (0, 0, 0, 0)),
    "microstrain": (1e-6, (0, 0, 0, 0)),
    "1": (1.0, (0, 0, 0, 0)),
    "%": (0.01, (0, 0, 0, 0)),
}
PREFIXED = ("m", "s", "Hz", "N", "Pa", "V", "rad", "g", "t", "strain", "lbf", "J", "Nm")
PREFIX = {"G": 1e9, "M": 1e6, "k": 1e3, "c": 1e-2, "d": 1e-1, "m": 1e-3, "u": 1e-6, "n": 1e-9}
# spellings that are not factors joined by an operator
ALIAS = {
    "Nm": "N*m",
    "g's": "g",
    "gs": "g",
    "newton-metre": "N*m",
    "in-lb": "in*lbf",
    "ft-lb": "ft*lbf",
    "lbs.": "lbf",
    "ue": "ustrain",
    "uE": "ustrain",
    "°": "deg",
    "degrees": "deg",
    "radians": "rad",
    "seconds": "s",
    "inches": "in",
    "feet": "ft",
    "newtonmeter": "N*m",
}
WRITTEN = (
    ("²", "^2"),
    ("³", "^3"),
    ("·", "*"),
    ("⋅", "*"),
    ("×", "*"),
    ("N-m", "N*m"),
    ("N.m", "N*m"),
    ("uε", "ustrain"),
    ("uϵ", "ustrain"),
)
