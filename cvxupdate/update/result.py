"""What `run` gives back: one frozen object that the report and the JSON are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

Metrics = dict[str, dict[str, float]]


@dataclass(frozen=True)
class ParameterResult:
    """One parameter before and after, in SI units (p-values: relative, 0 before); ``p`` and ``p_std`` are always relative.

    ``standard_deviation`` is None where the recordings do not determine it; ``bound`` is "lower" or "upper" where it ended on one.
    """

    name: str
    of: str
    element: int | None
    elements: tuple[int, ...]
    group: str | None
    unit: str
    before: float
    after: float
    standard_deviation: float | None
    lower: float | None
    upper: float | None
    at_bound: bool
    bound: str | None
    p: float
    p_std: float | None


@dataclass(frozen=True)
class ModeResult:
    """One measured mode beside the model's, before and after; errors are |f − fₓ| / fₓ in per cent, mode numbers
    count from the first flexible mode of the initial model."""

    recording: str
    use: str
    measured: float
    standard_deviation: float
    before: float
    after: float
    error_before: float
    error_after: float
    model_mode_before: int
    model_mode_after: int
    mac_before: float | None
    mac_after: float | None


@dataclass(frozen=True)
class Updated:
    """The outcome of updating one problem.

    ``status`` is converged, optimal, infeasible or stopped, with the ``reason`` in words; ``fit`` holds the contract's metrics,
    {"fit": {metric: {"before", "after"}}, "hold_out": {…}}; ``certificate`` that of the last convex step; ``conflict`` and ``relaxation``
    say why a step is infeasible; ``noise`` is by how much the residual exceeds the stated deviations.
    """

    problem: str
    title: str
    source: str
    path: str
    status: str
    reason: str
    method: str
    solver: str
    iterations: int
    parameters: tuple[ParameterResult, ...]
    fit: dict[str, Metrics]
    certificate: dict[str, Any]
    time: float
    conflict: tuple[str, ...] = ()
    relaxation: tuple[str, ...] = ()
    modes: tuple[ModeResult, ...] = ()
    history: tuple[dict[str, Any], ...] = ()
    undetermined: tuple[dict[str, Any], ...] = ()
    noise: float | None = None
    active: tuple[str, ...] = ()
    regularisation: tuple[dict[str, Any], ...] = ()
    model: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
