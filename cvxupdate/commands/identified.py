"""What `identify` finds: modes of every recording, with all that its page shows."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from cvxupdate.correlate.result import Geometry
    from cvxupdate.recordings.identify.decay import DecayRates
    from cvxupdate.recordings.identify.stabilisation import Stabilisation
    from cvxupdate.recordings.realise import NormalModes
    from cvxupdate.recordings.types import Complex, Real


@dataclass(frozen=True)
class Fitted:
    """Synthesised over measured FRFs: ``frequency`` (lines,) Hz; ``measured``, ``fitted`` (lines,
    responses, references) in the recorded ``quantity``; ``rest`` ‖H − fit‖ / ‖H‖."""

    frequency: Real
    measured: Complex
    fitted: Complex
    quantity: str
    responses: tuple[str, ...]
    references: tuple[str, ...]
    rest: float


@dataclass(frozen=True)
class Mode:
    """One mode: ``frequency`` (Hz) and ``damping`` (fraction of critical) with their deviations,
    NaN where unknown; ``mpc`` 1 and ``mpd`` 0° for a real shape, NaN with fewer than two channels;
    ``purity`` of an appropriated one, else NaN; ``pair`` the number of the model's flexible mode
    that a table pairs it with, 0 for none."""

    frequency: float
    frequency_std: float
    damping: float
    damping_std: float
    mpc: float
    mpd: float
    purity: float = float("nan")
    pair: int = field(default=0, kw_only=True)


@dataclass(frozen=True)
class InitialDamping:
    """Damping to begin with, from measured ratios ``zeta`` (modes,): C = ``alpha`` M + ``beta`` K
    (1/s and s; 3.43), D = ``eta`` K (3.47)."""

    alpha: float
    beta: float
    eta: float
    zeta: Real


@dataclass(frozen=True, eq=False)
class MeasuredDamping:
    """(3.44) mode by mode: C_r = v vᵀ with ``vectors`` v = √(2 ω ζ) M φ_X (modes, N) over the DOFs
    ``labels``, of measured shapes at unit modal mass, and ``frequency`` (Hz) and ``zeta`` (modes,).

    ``coupling`` is the largest |φ_rᵀ M φ_s| of two of them: by as much, to first order, the damping
    of one mode is not its own alone. ``first`` is the lowest element number that is free.
    """

    labels: tuple[str, ...]
    frequency: Real
    zeta: Real
    vectors: Real
    coupling: float
    first: int


@dataclass(frozen=True)
class ModeSetResult:
    """The modes of one recording.

    ``kind`` is "frf", "time" (FRFs estimated from it), "ambient" or "modes" (a table as it is);
    ``shapes`` (modes, channels) complex, largest entry 1, with ``shape_std``; ``labels``
    (channels,) as n6.y, ``nodes`` and ``dofs`` likewise; ``auto_mac`` (modes, modes). ``spectrum``
    is (curves, lines) over ``spectrum_lines`` Hz, what stands behind the diagram; ``file`` the name
    of its table; ``measured`` the modes' own damping matrices, where there is a model.
    """

    recording: str
    kind: str
    method: str
    band: tuple[float, float]
    modes: tuple[Mode, ...]
    shapes: Complex
    shape_std: Real
    labels: tuple[str, ...]
    nodes: tuple[int, ...]
    dofs: tuple[str, ...]
    quantity: str
    auto_mac: Real
    diagram: Stabilisation | None
    spectrum_lines: Real
    spectrum: Real
    spectrum_says: str
    fit: Fitted | None
    normal: tuple[NormalModes, ...]
    laws: DecayRates | None
    notes: tuple[str, ...]
    file: str = "modes.csv"
    measured: MeasuredDamping | None = None

    @property
    def frequency(self) -> Real:
        """Hz, (modes,)."""
        return np.array([m.frequency for m in self.modes])

    @property
    def initial(self) -> InitialDamping | None:
        """The damping that a model may begin with; None where no ratio is known."""
        from cvxupdate.fe.damping import loss_factor_from_modal, rayleigh_from_modal

        known = [(m.frequency, m.damping) for m in self.modes if m.damping > 0.0 < m.frequency]
        if not known:
            return None
        f, zeta = (np.array(v) for v in zip(*known, strict=True))
        return InitialDamping(*rayleigh_from_modal(f, zeta), loss_factor_from_modal(zeta), zeta)


@dataclass(frozen=True)
class Identified:
    """All of it: ``sets`` one for each recording; ``geometry`` where there is a model; ``path`` and
    ``options`` make the command again."""

    problem: str
    title: str
    path: str
    time: float
    sets: tuple[ModeSetResult, ...]
    geometry: Geometry | None = None
    options: str = ""
    notes: tuple[str, ...] = ()
    skipped: tuple[str, ...] = field(default=())


Index = NDArray[np.int64]
