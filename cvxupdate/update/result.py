"""What `run` gives back: one frozen object that the report and the JSON are made of."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Any

from cvxupdate.correlate.overlay import FrfOverlay
from cvxupdate.correlate.own_errors import OwnError
from cvxupdate.correlate.plausible.doubt import Doubt
from cvxupdate.spec.write import Written

if TYPE_CHECKING:
    from cvxupdate.convex import StepProblem
    from cvxupdate.correlate.result import Geometry

Metrics = dict[str, dict[str, float]]


@dataclass(frozen=True)
class ParameterResult:
    """One parameter before and after, in SI units (p-values: relative, 0 before); ``p`` and
    ``p_std`` are always relative.

    ``standard_deviation`` is None where the recordings do not determine it; ``bound`` is "lower" or
    "upper" where it ended on one.
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
    """One measured mode beside the model's, before and after; errors are |f − fₓ| / fₓ in per cent,
    mode numbers count from the first flexible mode of the initial model."""

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
class AccuracyResult:
    """How accurate one recording of frequency responses must be (thesis chapter 5), from the model
    before the update, line by line.

    ``noise`` the relative r.m.s. deviation of its entries, ``stated`` whether the recording says
    so; ``change`` the deviation of every parameter that is sought. Per line: ``error`` and
    ``system`` component of the characteristic log function (5.32), log10; ``bearable`` the relative
    noise at which the two are equal (5.12); ``radius`` of (5.6), None where it was not computed;
    ``relative_model`` the modelling error of (5.15). ``fitted`` and ``best`` lines in Hz.
    ``spread`` is the median deviation of p that the fitted lines leave at this noise, ``borne`` the
    noise at which it would equal ``change``.
    """

    recording: str
    noise: float
    stated: bool
    change: float
    frequency: tuple[float, ...]
    error: tuple[float, ...]
    system: tuple[float, ...]
    bearable: tuple[float, ...]
    radius: tuple[float | None, ...]
    relative_model: tuple[float, ...]
    fitted: tuple[float, ...]
    best: tuple[float, ...]
    spread: float | None
    borne: float | None


@dataclass(frozen=True)
class DirectResult:
    """One direct method on the problem's modes: what it ``changes``, relative changes of the
    matrices (Frobenius), mean errors of fitted and held-out frequencies in per cent, and the faults
    that `cvxupdate.direct.faults` measures; ``where`` the nodes that change most; ``by_node``
    (node, part of the change) of the method asked for and of the convex update beside it, which is
    the row named "convex"; ``why`` says why it could not be done (then the rest is None)."""

    name: str
    title: str
    equations: str
    changes: str
    stiffness_change: float | None = None
    mass_change: float | None = None
    fit_error: float | None = None
    hold_out_error: float | None = None
    reproduction: float | None = None
    mass_min: float | None = None
    stiffness_min: float | None = None
    new_entries: int | None = None
    spurious: int | None = None
    where: tuple[str, ...] = ()
    by_node: tuple[tuple[int, float], ...] = ()
    says: tuple[str, ...] = ()
    why: str = ""


@dataclass(frozen=True)
class Correlation:
    """Correlations of the ``parameters`` that the recordings determine: the ``matrix`` (empty where
    there are more than 200), and the ``strongest`` pairs with theirs."""

    parameters: tuple[str, ...]
    matrix: tuple[tuple[float, ...], ...]
    strongest: tuple[tuple[str, str, float], ...]


@dataclass(frozen=True)
class Judgement:
    """What to hold against a good fit: how many parameters ended ``on_bounds`` of all, modes whose
    ``shapes_lost`` MAC, and ``doubts`` in words."""

    on_bounds: int
    parameters: int
    shapes_lost: tuple[dict[str, object], ...]
    doubts: tuple[str, ...]


@dataclass(frozen=True)
class Grouping:
    """The macro elements of one row: its property ``of``, how they were chosen (``kind``), how many
    ``single`` parameters there were, ``names`` and ``elements`` of each group, the standard
    ``deviation`` of p of each as foreseen before the update, ``says`` in words."""

    of: str
    kind: str
    single: int
    names: tuple[str, ...]
    elements: tuple[tuple[int, ...], ...]
    deviation: tuple[float, ...]
    says: str


@dataclass(frozen=True)
class ClassicalResult:
    """A classical ``solution`` of chapter 4 on the last linearised equations: its ``level`` (terms,
    rank or iterations) or ``alpha``, and how they were ``chosen``.

    ``singular`` values σ and ``coefficients`` |uᵀ b| of the weighted equations with the deviation
    ``noise`` of an entry of b and the ``picard_level``; the L-curve: weights, ‖A p − b‖ and ‖p‖
    of Tikhonov's solutions, and the place of its ``corner``.
    """

    solution: str
    level: int | None
    alpha: float | None
    chosen: str
    singular: tuple[float, ...]
    coefficients: tuple[float, ...]
    noise: float
    picard_level: int
    curve_alpha: tuple[float, ...]
    curve_residual: tuple[float, ...]
    curve_size: tuple[float, ...]
    corner: int


def clause_names(problem: StepProblem) -> tuple[str, ...]:
    """The clauses that a step had to keep, bounds on parameters left out: those stand beside the
    parameters."""
    return tuple(c.name for c in problem.clauses if not c.name.startswith("bounds on "))


@dataclass(frozen=True)
class Updated:
    """The outcome of updating one problem.

    ``status`` is converged, optimal, infeasible or stopped, with the ``reason`` in words; ``fit``
    holds the contract's metrics, {"fit": {metric: {"before", "after"}}, "hold_out": {…}};
    ``certificate`` that of the last convex step; ``conflict`` and ``relaxation`` say why a step is
    infeasible; ``told`` counts equations, free combinations of parameters and those that the
    recordings determine; ``noise`` is by how much the residual exceeds the stated deviations;
    ``accuracy`` is of method rfm alone; ``recordings`` holds the error of each by itself,
    ``warnings`` what is probably a mistake in the problem; ``starts`` what many starts found, where
    they were asked for;
    ``written`` is the updated model as a problem file, where it can be one, and ``matrix_files``
    the texts of the matrices that it names; ``caveats`` say what keeps a converged update from
    being an improvement; ``direct`` is of method direct alone;
    ``families`` are the element matrices that were found, X and S, and what they mean;
    ``groupings`` the macro elements that the recordings chose, and ``geometry`` what to draw them
    on; ``overlays`` are frequency responses before and after, for the page alone;
    ``classical`` is of a classical solution of chapter 4 alone; ``correlations`` of the parameters,
    and the ``judgement``, stand beside the fit.
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
    told: dict[str, int] = field(default_factory=dict)
    noise: float | None = None
    active: tuple[str, ...] = ()
    regularisation: tuple[dict[str, Any], ...] = ()
    model: dict[str, Any] = field(default_factory=dict)
    notes: tuple[str, ...] = ()
    accuracy: tuple[AccuracyResult, ...] = ()
    recordings: tuple[OwnError, ...] = ()
    warnings: tuple[Doubt, ...] = ()
    starts: dict[str, Any] = field(default_factory=dict)
    written: Written | None = None
    caveats: tuple[str, ...] = ()
    direct: tuple[DirectResult, ...] = ()
    families: tuple[dict[str, Any], ...] = ()
    groupings: tuple[Grouping, ...] = ()
    geometry: Geometry | None = None
    classical: ClassicalResult | None = None
    correlations: Correlation | None = None
    judgement: Judgement | None = None
    overlays: tuple[FrfOverlay, ...] = ()
    matrix_files: dict[str, str] = field(default_factory=dict)
