"""What `plan` proposes: sensors, exciters, frequency lines, and what they can do."""

from __future__ import annotations

import json
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.diagnose.apart import Apart

Real = NDArray[np.float64]
USUAL_NOISE = 0.01
"""Of responses, relative, where nothing is said: what a careful test has near resonances."""


@dataclass(frozen=True)
class Options:
    """What the user may choose: how many ``sensors``, ``exciters`` (None: as many as are needed)
    and ``modes`` from the lowest; ``band`` (lowest, highest) Hz of the frequency lines; ``noise``
    of the responses (None: 0.01; beside a diagnosis that of its recordings), ``accuracy`` wanted of
    the parameters, both fractions; ``further`` responses that are to tell the explanations of a
    diagnosis apart together (None: as many as are worth it)."""

    sensors: int | None = None
    exciters: int | None = None
    modes: int = 6
    band: tuple[float, float] | None = None
    noise: float | None = None
    accuracy: float = 0.05
    further: int | None = None

    def __post_init__(self) -> None:
        for name in ("modes", "sensors", "exciters", "further"):
            value = getattr(self, name)
            if value is not None and value < 1:
                raise InputError(f"--{name} {value} is none; give 1 or more.")
        for name in ("noise", "accuracy"):
            value = getattr(self, name)
            if value is not None and not (np.isfinite(value) and value > 0.0):
                raise InputError(f"--{name} {value:g} is no fraction; give one above 0, as 0.01.")
        if self.band is not None and not 0.0 <= self.band[0] < self.band[1]:
            raise InputError(
                f"--band {self.band[0]:g} {self.band[1]:g} is no band: give the lower end "
                "first, in Hz."
            )

    @property
    def usual(self) -> float:
        """The noise, a hundredth where none was given."""
        return USUAL_NOISE if self.noise is None else self.noise

    def line(self) -> str:
        """The options that differ from the default, as on the command line."""
        plain, out = Options(), []
        for key, value in vars(self).items():
            if value != getattr(plain, key):
                shown = " ".join(f"{v:g}" for v in value) if isinstance(value, tuple) else value
                out.append(f"--{key} {shown}")
        return " ".join(out)


@dataclass(frozen=True)
class Diagnosed:
    """The ``content`` of a `diagnosis.json`, and ``where`` it is from, for messages."""

    content: Any
    where: str

    @property
    def name(self) -> str:
        """Of the file, for a command that can be read anywhere."""
        return Path(self.where).name

    @classmethod
    def of(cls, path: Path) -> Diagnosed:
        """That of a file.

        Raises
        ------
        InputError
            For a file that cannot be read, or is no JSON.
        """
        if not os.path.isfile(path):  # a pipe or a device might never end
            raise InputError(f"{path} is not a file. Give the diagnosis.json of diagnose.")
        try:
            return cls(json.loads(path.read_text(encoding="utf-8")), str(path))
        except (OSError, UnicodeError) as err:
            raise InputError(
                f"{path} cannot be read. Give the diagnosis.json of diagnose."
            ) from err
        except (ValueError, RecursionError) as err:
            raise InputError(f"{path} is no JSON. Give the diagnosis.json of diagnose.") from err


@dataclass(frozen=True)
class SensorSet:
    """Sensors ``labels`` in the order of their worth by one ``rule``; of the modes at them: the
    ``condition`` number, the largest MAC of two modes (``alike``), the least ``peak`` of a mode
    over its largest motion anywhere; ``deviation`` the median deviation of the parameters that they
    leave (None without parameters)."""

    rule: str
    says: str
    labels: tuple[str, ...]
    condition: float
    alike: float
    peak: float
    deviation: float | None


@dataclass(frozen=True)
class ExciterSet:
    """Exciters ``labels``; ``drive`` (modes,): modal force of each mode over what the best single
    place gives it; ``forces`` (modes, exciters) of unit length that drive one mode and as little as
    possible of the others, with ``purity`` (modes,); ``independent``: how many force patterns the
    structure answers to at these sensors."""

    labels: tuple[str, ...]
    drive: tuple[float, ...]
    forces: Real
    purity: tuple[float, ...]
    independent: int


@dataclass(frozen=True)
class Indicator:
    """MMIF ``curves`` (exciters, lines) over ``frequency`` (lines,) Hz, and ``dips`` (modes,): the
    lowest value within 2 % of each mode."""

    frequency: Real
    curves: Real
    dips: tuple[float, ...]


@dataclass(frozen=True)
class Lines:
    """Frequency ``lines`` (Hz) by one ``rule`` of chapter 5 or 3.5.5, the deviation of every
    parameter that they leave (NaN where it is open), and the noise at which the worst of them has
    the accuracy wanted."""

    rule: str
    says: str
    lines: tuple[float, ...]
    deviations: tuple[float, ...]
    bears: float


@dataclass(frozen=True)
class Planned:
    """All of it: ``sensors`` by every rule, the one to take first; ``frequencies`` Hz of the
    ``modes`` that are to be measured; ``parameters`` their names; ``apart`` what would tell the
    explanations of a diagnosis apart, where one was given."""

    problem: str
    title: str
    path: str
    time: float
    options: str
    frequencies: tuple[float, ...]
    sensors: tuple[SensorSet, ...]
    exciters: ExciterSet
    indicator: Indicator
    parameters: tuple[str, ...]
    lines: tuple[Lines, ...]
    log_function: tuple[tuple[float, ...], tuple[float, ...]]
    noise: float
    accuracy: float
    notes: tuple[str, ...]
    geometry: Geometry | None = None
    apart: Apart | None = None
