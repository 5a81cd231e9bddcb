"""Recordings as the rest of the package sees them: labelled, in SI units, frozen."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Real = NDArray[np.float64]
Complex = NDArray[np.complex128]

DOF_KINDS = ("x", "y", "z", "rx", "ry", "rz")
MOTIONS = ("displacement", "velocity", "acceleration")
QUANTITIES = ("force", "displacement", "velocity", "acceleration", "strain", "voltage", "unknown")


@dataclass(frozen=True)
class Channel:
    """One measured channel: where it sits, what it reads, in SI after ``scale`` was applied.

    ``node`` is the node id of the model, ``dof`` one of x, y, z, rx, ry, rz, ``quantity`` one of
    `QUANTITIES`; ``unit`` is the unit in the file before conversion, ``scale`` the factor from that
    unit to SI, sign and sensitivity included.
    """

    node: int
    dof: str
    quantity: str
    unit: str = ""
    scale: float = 1.0

    @property
    def label(self) -> str:
        """The DOF label that joins recordings and model, e.g. ``"n6.y"``."""
        return f"n{self.node}.{self.dof}"


@dataclass(frozen=True)
class Origin:
    """Where a recording comes from and what it may be used for.

    ``use`` is ``"fit"`` or ``"hold-out"`` (never fitted, only scored); ``level`` the drive level
    (dimensionless, None if unknown); ``damage`` what was left out of the file when it was read;
    ``state`` that of the structure (`cvxupdate.recordings.states`); ``remarks`` what was done to it
    that its reader should know.
    """

    name: str
    source: str
    use: str = "fit"
    level: float | None = None
    damage: tuple[str, ...] = ()
    state: str | None = None
    remarks: tuple[str, ...] = ()


@dataclass(frozen=True)
class TimeHistory:
    """Sampled channels. ``data`` is (samples, channels) in SI, ``rate`` in Hz; ``band`` the
    [[recordings]] table's own (lowest, highest) Hz, None where it gives none."""

    origin: Origin
    rate: float
    channels: tuple[Channel, ...]
    data: Real
    band: tuple[float, float] | None = None


@dataclass(frozen=True)
class FrequencyResponse:
    """Frequency response functions.

    ``frequency`` (lines,) Hz; ``H`` (lines, responses, references) in SI per newton (or newton
    metre); ``quantity`` of the response: displacement (receptance), velocity (mobility) or
    acceleration (accelerance); ``variance`` the variance of the complex estimate E|H - EH|², same
    shape, None where it is not known; ``coherence`` (lines, responses) or None.
    """

    origin: Origin
    frequency: Real
    H: Complex
    quantity: str
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    variance: Real | None = None
    coherence: Real | None = None


@dataclass(frozen=True)
class ModeTable:
    """Identified modes.

    ``frequency``, ``frequency_std`` (modes,) Hz; ``damping``, ``damping_std`` (modes,) fraction of
    critical, NaN where unknown; ``shapes`` (modes, channels) real or complex, NaN where unknown,
    None when no mode has one; ``shape_std`` likewise; ``pairs`` (modes,) the number of the model's
    flexible mode (1 = lowest above the rigid-body modes) that the problem file pairs it with, 0 for
    "find it"; ``relative_only`` is True when the deviations in ``frequency_std`` are weights (no
    measured deviation was given). ``covariance``: of the frequencies (modes, modes) in Hz², or of
    those and then of the shapes mode by mode, modes × (1 + channels) rows, NaN where there is no
    shape; the deviations are its own then. None where only deviations are known.
    """

    origin: Origin
    frequency: Real
    frequency_std: Real
    damping: Real
    damping_std: Real
    channels: tuple[Channel, ...]
    shapes: Complex | Real | None
    shape_std: Real | None
    pairs: NDArray[np.int64]
    relative_only: bool = False
    covariance: Real | None = None


Recording = TimeHistory | FrequencyResponse | ModeTable
