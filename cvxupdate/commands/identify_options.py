"""What the user of `identify` may choose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import InputError

METHODS = ("plscf", "realisation", "ibrahim", "appropriation", "ssi")
DAMPING = ("viscous", "hysteretic")


LONG_LIVED = 0.5
"""Fraction of the orders in which a pole of the time domain must be found: no refinement follows
that would drop what the ends of the band make up."""


@dataclass(frozen=True)
class Options:
    """What the user may choose: ``method`` of `METHODS`; ``normal`` a route to normal modes, "all"
    or None; ``band`` (lowest, highest) Hz; ``order`` the largest of the diagram; ``recording`` one
    of several, by number (1 = first) or name; ``rate`` Hz of a raw file that states none;
    ``damping`` viscous or hysteretic; ``estimator`` lpm, h1, h2 or hv of FRFs from time histories;
    ``decay`` 1/s of an exponential window to take out; ``indicator`` of force appropriation."""

    method: str = "plscf"
    normal: str | None = None
    band: tuple[float, float] | None = None
    order: int = 60
    recording: str | None = None
    rate: float | None = None
    damping: str = "viscous"
    estimator: str | None = None
    decay: float = 0.0
    indicator: str = "mmif"

    def __post_init__(self) -> None:
        if self.method not in METHODS:
            raise InputError(
                f"there is no method {self.method!r}; known: {', '.join(METHODS)}. "
                "Correct --method."
            )
        if self.damping not in DAMPING:
            raise InputError(f"there is no damping {self.damping!r}; known: {', '.join(DAMPING)}.")
        if self.band is not None and not 0.0 <= self.band[0] < self.band[1]:
            raise InputError(
                f"--band {self.band[0]:g} {self.band[1]:g} is no band: give the lower end "
                "first, in Hz."
            )
        if self.order < 4:
            raise InputError(f"--order {self.order} is too low for a diagram; give 4 or more.")
        if not np.isfinite(self.decay) or self.decay < 0.0:
            raise InputError(f"--decay {self.decay:g} is no decay in 1/s; give 0 or more.")
        if self.rate is not None and not (np.isfinite(self.rate) and self.rate > 0.0):
            raise InputError(f"--rate {self.rate:g} is no sampling rate; give one above 0, in Hz.")

    def line(self) -> str:
        """The options that differ from the default, as on the command line."""
        plain, out = Options(), []
        for key, value in vars(self).items():
            if value != getattr(plain, key):
                shown = " ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else value
                out.append(f"--{key} {shown}")
        return " ".join(out)
