"""What `correlate` gives back: one frozen object that the page and the JSON are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.correlate._shapes import Real
from cvxupdate.correlate.balance import ElementBalance
from cvxupdate.correlate.frf import FrfCorrelation
from cvxupdate.correlate.own_errors import OwnError
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.correlate.summary import Correlation

Complex = NDArray[np.complex128]
Index = NDArray[np.int64]


@dataclass(frozen=True)
class Part:
    """One element (or face of a solid) to draw: its id, its ``kind`` (the word of the problem
    file) and its nodes as rows of `Geometry.xyz`."""

    id: int
    kind: str
    nodes: tuple[int, ...]


@dataclass(frozen=True)
class Geometry:
    """Where things are: ``node_ids`` (nodes,), ``xyz`` (nodes, 3) in m, ``parts``; ``moves``
    (nodes, 3) tells which translations are free."""

    node_ids: Index
    xyz: Real
    parts: tuple[Part, ...]
    moves: NDArray[np.bool_]


@dataclass(frozen=True)
class ModePair:
    """A measured mode beside the model's: ``number`` its rank among the measured ones of its
    recording, ``mode`` the number of the model's flexible mode (1 = lowest), frequencies in Hz,
    ``error_percent`` (model − measured) / measured, ``by`` file, shape or frequency."""

    recording: str
    use: str
    number: int
    measured: float
    standard_deviation: float | None
    damping: float | None
    mode: int
    model: float
    error_percent: float
    mac: float | None
    by: str


@dataclass(frozen=True)
class SensorReport:
    """What the sensors of ``recordings`` see of the model's first modes; ``labels`` (n,),
    ``frequency`` (modes,) Hz of the model.

    ``rank``, ``condition``, ``alike``, ``peak``, ``independence`` as `reduction.Visibility` has
    them; ``says`` its sentences; ``better`` the labels of as many places chosen by QR with
    pivoting, with the condition number ``better_condition`` that they would have.
    """

    recordings: tuple[str, ...]
    labels: tuple[str, ...]
    frequency: Real
    rank: int
    condition: float
    alike: Real
    peak: Real
    independence: Real
    says: tuple[str, ...]
    better: tuple[str, ...]
    better_condition: float | None


@dataclass(frozen=True)
class ReciprocalCheck:
    """Measured shapes against the reciprocal vectors of a recording of FRFs at the same sensors,
    no model between: ``recording`` its name, ``orthogonality`` (pairs, pairs) and ``fit`` (pairs,)
    as `correlate.reciprocal` has them."""

    recording: str
    orthogonality: Real
    fit: Real


@dataclass(frozen=True)
class ShapeComparison:
    """Measured against model shapes of one recording at the sensors ``labels`` (``nodes`` as rows
    of `Geometry.xyz`, ``kinds`` 0..5 = x..rz).

    ``measured_number`` and ``model_number`` (P,) count modes from 1, in the order of the pairs of
    ``correlation``; ``model_frequency`` and ``measured_frequency`` in Hz go with the rows and
    columns of its ``mac``. ``expansion`` names the transformation, ``balance_by`` that of the force
    balance; ``element_ids`` go with ``correlation.element_balance`` and ``element_energy``;
    ``group_names`` with ``groups``. ``model_shapes`` (nodes, 3, P) are the translations of the
    paired model shapes at every node, on the scale of ``correlation.shapes_model``; None where the
    model is not drawn. ``reciprocal`` where FRFs were measured at the same sensors.
    """

    recording: str
    use: str
    labels: tuple[str, ...]
    nodes: Index
    kinds: Index
    measured_number: Index
    model_number: Index
    model_frequency: Real
    measured_frequency: Real
    correlation: Correlation
    expansion: str
    element_ids: Index
    balance_by: str = ""
    group_names: tuple[str, ...] = ()
    groups: ElementBalance | None = None
    model_shapes: Real | None = None
    reciprocal: ReciprocalCheck | None = None


@dataclass(frozen=True)
class FrfComparison:
    """Measured against model FRFs of one recording: ``measured`` and ``model`` (lines, responses,
    references) at ``frequency`` (lines,) Hz, SI per newton; ``variance`` of the measured ones or
    None; ``origin_of`` says how they came about."""

    recording: str
    use: str
    quantity: str
    frequency: Real
    measured: Complex
    model: Complex
    variance: Real | None
    responses: tuple[str, ...]
    references: tuple[str, ...]
    correlation: FrfCorrelation
    origin_of: str


@dataclass(frozen=True)
class Compared:
    """Model against recordings, nothing changed.

    ``fit`` holds the contract's metrics, each with the same value under before and after;
    ``geometry`` is None for a model without coordinates; ``nominal`` holds the translations (nodes,
    3) of the model's modes, by their number, that were paired without shapes; ``recordings`` holds
    the error of each by itself, ``warnings`` what is probably a mistake.
    """

    problem: str
    title: str
    source: str
    path: str
    time: float
    modes: tuple[ModePair, ...]
    shapes: tuple[ShapeComparison, ...]
    frfs: tuple[FrfComparison, ...]
    sensors: tuple[SensorReport, ...]
    fit: dict[str, dict[str, dict[str, float]]]
    geometry: Geometry | None = None
    model: dict[str, Any] = field(default_factory=dict)
    nominal: dict[int, Real] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    status: str = "converged"
    recordings: tuple[OwnError, ...] = ()
    warnings: tuple[Doubt, ...] = ()
