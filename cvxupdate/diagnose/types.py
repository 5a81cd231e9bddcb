"""What the stages hand to one another, and the protocol behind which each kind of recording
stands: a stage knows only these."""

from __future__ import annotations

from collections.abc import Callable, Hashable, Sequence
from dataclasses import dataclass
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from cvxupdate.diagnose.fit import Fit
from cvxupdate.diagnose.results import Further, Updated
from cvxupdate.diagnose.settings import LEVEL_NOISE
from cvxupdate.diagnose.shown import Shown
from cvxupdate.fe.model import Model
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.fault import Fault

Real = NDArray[np.float64]
Progress = Callable[[str], None]
Key = tuple[Hashable, ...]


@dataclass(frozen=True)
class Errors:
    """Relative errors on what was fitted and on what was held out (NaN: nothing was)."""

    fit: float
    hold_out: float

    @property
    def worst(self) -> float:
        """The larger one."""
        return float(np.nanmax([self.fit, self.hold_out]))


@dataclass(frozen=True)
class Score:
    """The fraction of the projected residual (0 to 1) that an effect explains and its size ``p``
    (count,), with the side respected that it may take.

    To first order, or ``exact``: at the best of several finite sizes. ``trusted``: False where a
    derivative says nothing of an effect of finite size.
    """

    effect: Effect
    fraction: float
    p: Real
    exact: bool = False
    trusted: bool = True


@dataclass(frozen=True)
class Seed:
    """Effects placed on a model, and where their fit begins. ``continued``: at a finite size, to
    which the modes have to be followed."""

    effects: tuple[Effect, ...]
    setting: Any
    start: Real
    continued: bool = False

    @property
    def keys(self) -> frozenset[Key]:
        """The set of what is supposed."""
        return frozenset(e.key for e in self.effects)

    @property
    def name(self) -> str:
        """For progress."""
        return " and ".join(e.name for e in self.effects) or "nuisance parameters"


@dataclass(frozen=True)
class FiniteSize:
    """Effects at their best finite sizes: ``scores``, and ``seeds`` on whole members."""

    scores: Sequence[Score]
    seeds: Sequence[Seed]


@dataclass(frozen=True)
class LevelChange:
    """Relative change between drive levels, what noise makes of it, and of ``what``, in words."""

    change: float
    noise: float
    what: str = "transfer functions"

    def exceeds(self, least: float, times: float = LEVEL_NOISE) -> bool:
        """Whether it is larger than ``least``, and than so many ``times`` its noise."""
        return self.change > least and self.change > times * self.noise


class Evidence(Protocol):
    """What one kind of recording says of a model and of what it may lack."""

    @property
    def told_by(self) -> str:
        """The kind, as effects name it: "responses" or "modes"."""

    @property
    def model(self) -> Model:
        """The nominal model with its nuisance parameters, undamped."""

    @property
    def file(self) -> Model | None:
        """The model as it came, where a reference state was there to bring it to."""

    @property
    def names(self) -> tuple[str, ...]:
        """Effects that are tried."""

    @property
    def stocky(self) -> bool:
        """Whether theory wants shear of its beams, which have none."""

    @property
    def levels(self) -> int:
        """How many levels of smoothing there are, from far-reaching to sharp."""

    @property
    def bases(self) -> Sequence[Fit]:
        """Nuisance parameters alone fitted, level by level as far as it is worth while."""

    @property
    def noise(self) -> Errors:
        """Errors that noise alone makes."""

    @property
    def nominal(self) -> Errors:
        """Errors of the model as it came, the mesh's taken out."""

    @property
    def delay_unit(self) -> float:
        """Seconds of one unit of a sensor's delay."""

    @property
    def band(self) -> tuple[float, float]:
        """Lowest and highest frequency, Hz."""

    @property
    def resonances(self) -> int:
        """How many modes are seen in responses; 0 where that is not asked."""

    def level_change(self) -> LevelChange | None:
        """How the recordings depend on the drive level; None where no two levels compare."""

    @property
    def foretold(self) -> bool:
        """Whether the file's own laws foretell what changes between levels."""

    @property
    def drift(self) -> str | None:
        """How the structure changed while it was measured, in words; None where it did not, or the
        recordings do not say."""

    def by_modes(self, fewest: int = 0) -> Evidence | None:
        """The modes in responses, ``fewest`` or more (0: that tell what is missing), or None."""

    def context(self, model: Model) -> SearchContext:
        """For placing effects on a model."""

    def candidates(self, model: Model, names: Sequence[str] | None = None) -> list[Effect]:
        """Every effect at every place of a model."""

    def setting(self, model: Model, faults: Sequence[Fault], like: Any = None) -> Any:
        """A model against the recordings, as another setting is (None: at the first level)."""

    def at_level(self, setting: Any, level: int) -> Any:
        """The same against those of another level."""

    def evaluated(self, setting: Any, p: Real) -> Fit:
        """Without fitting. Raises ModelError where the model is no structure."""

    def fitted(self, seed: Seed, effort: str) -> Fit:
        """Fitted from a seed; ``effort`` is "first pass", "coarse" or "sharp". Raises
        CvxupdateError where that leads to no structure."""

    def first_order(self, fit: Fit, effects: Sequence[Effect]) -> list[Score]:
        """Scores in the order of ``effects``."""

    def finite_size(
        self, nominal: Fit, parent: Fit, placed: tuple[Effect, ...], effects: Sequence[Effect]
    ) -> FiniteSize:
        """Effects at their best sizes beside those already ``placed``: conditional on nominal
        nuisance parameters, or on those of the fitted ``parent``."""

    def halves(self, fit: Fit) -> Sequence[NDArray[np.bool_]]:
        """Random halves of the rows with their complements; none where rows are too few."""

    def linearised(self, fit: Fit) -> Any:
        """The nuisance parameters (`cvxupdate.diagnose.screen.projection.Linearised`)."""

    def columns(self, fit: Fit, effects: Sequence[Effect]) -> list[Real | None]:
        """Weighted derivative columns (rows, count) of effects; None where one has none."""

    @property
    def approach(self) -> Any:
        """The first steps beside a model that is far off (`cvxupdate.diagnose.search.guided`);
        None where there are none."""

    def errors(self, fit: Fit) -> Errors:
        """On what was fitted and on what was held out."""

    def held_out(self, fit: Fit) -> float:
        """Logarithm of the likelihood of what was held out, at a fit; 0 where that says nothing
        that was not fitted: of a linear structure another record is one more of the same."""

    def between_levels(self, fit: Fit) -> Errors:
        """What a fit leaves of the change between drive levels, as a fraction of the responses,
        among what was fitted and from there to what was held out; NaN where none compare."""

    def alike(self, fit: Fit, effect: Effect, strictly: bool = False) -> Sequence[Effect]:
        """The same effect at places that these recordings hardly tell from its own, nearest first
        (``strictly``: that no recording in the band tells from it); none where the search compares
        all places anyway."""

    def apart(self, one: Fit, other: Fit, titles: tuple[str, str]) -> str:
        """Which measurement would tell two explanations apart that do alike, in words; empty where
        none is known."""

    def relative(self, errors: Errors) -> float:
        """The worse one as a fraction of the responses or of the eigenvalues."""

    def allowance(self, model: Model) -> float:
        """Error that the mesh may leave although its shift was taken out."""

    def explained(self, fit: Fit, errors: Errors) -> bool:
        """Whether what a fit leaves is within noise and the allowances."""

    def departs(self, fit: Fit) -> str:
        """Which kind of figures is left by more than chance, in words; empty where none is."""

    def clear(self, fit: Fit) -> bool:
        """Whether a fit leaves nothing from which a further effect could be told."""

    @property
    def hurried(self) -> bool:
        """Whether the time for one diagnosis is over: nothing new is begun."""

    @property
    def jobs(self) -> int:
        """How many processes refit at a time."""

    @property
    def unfinished(self) -> bool:
        """Whether that ended the search before all was refitted."""

    def leave(self, what: str, count: int = 0) -> None:
        """Time leaves so many of something undone, in words; none: all of it."""

    def wide(self) -> Fit:
        """The nuisance parameters let go far beyond their scatter."""

    def further(self, last: Fit) -> Further:
        """What else the recordings say once the search is over."""

    def left(self, errors: Errors) -> str:
        """Errors in words, with what they are a fraction of."""

    def remains(self, found: Fit) -> str:
        """Where a fit leaves what it leaves, in words; empty where noise is all."""

    def lines(self) -> list[str]:
        """Evidence on the recordings and the nominal model, one line each."""

    def updated(self, last: Fit, further: Further) -> Updated:
        """The model that a fit ended at, for the problem file."""

    def stated(self, last: Fit) -> tuple[Errors, Errors]:
        """The contract's errors: of the file as it came, and of the diagnosed model."""

    def shown(self, last: Fit, scores: Sequence[Score]) -> Shown:
        """What the page draws."""

    def metrics(self, last: Fit) -> dict[str, Any]:
        """The contract's metrics before and after, of fitted and of held-out recordings."""
