"""Identified modes, with all that was found beside them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.recordings.identify.stabilisation import Stabilisation
from cvxupdate.recordings.types import Channel, Complex, ModeTable, Origin, Real


@dataclass(frozen=True)
class IdentifiedModes:
    """Modes identified from FRFs, by increasing frequency.

    Attributes
    ----------
    frequency, frequency_std : (modes,) Hz.
    damping, damping_std : (modes,) fraction of critical (half the loss factor when hysteretic).
    poles : (modes,) rad/s, viscous poles of the same frequency and damping.
    shapes : (modes, responses) complex, largest entry 1.
    shape_std : (modes, responses), of the complex entry; shape_std_real, shape_std_imag : of its
    parts. 0 at the entry by which the others are told: the largest, or where that is not known the
    best known.
    participation : (modes, references), so that the receptance's residue is ``outer(shapes[r],
    participation[r])``.
    lower, upper : (terms, responses, references) residuals of the receptance over ``band`` (Hz), as
    in `model`; the first
        terms are the classic ``upper - lower / omega²``.
    damping_model : viscous or hysteretic.
    quantity : of the FRFs that the modes were identified from.
    auxiliary : (poles, shapes, participation) of modes beyond the band's edges, or overdamped, that
    were fitted along; not reported.
    stabilisation : the diagram.
    chi_square : weighted misfit per degree of freedom, NaN when no variance was known.
    line_correlation : lines per independent piece of noise.
    rest : ‖H - fit‖ / ‖H‖ in the band, in the quantity of the FRFs (noise of the data included).
    added_decay : 1/s, the exponential window's decay that was taken out of the poles.
    """

    origin: Origin
    frequency: Real
    frequency_std: Real
    damping: Real
    damping_std: Real
    poles: Complex
    shapes: Complex
    shape_std: Real
    shape_std_real: Real
    shape_std_imag: Real
    participation: Complex
    lower: Real
    upper: Real
    band: tuple[float, float]
    damping_model: str
    quantity: str
    responses: tuple[Channel, ...]
    references: tuple[Channel, ...]
    auxiliary: tuple[Complex, Complex, Complex]
    stabilisation: Stabilisation
    chi_square: float
    line_correlation: float
    rest: float
    added_decay: float = 0.0

    @property
    def constants(self) -> Complex:
        """Modal constants of the receptance, (modes, responses, references), 1/kg of translations
        (Ewins 2000, 2.8): φ_r φ_d of shapes of unit modal mass, real where modes are."""
        rate = 2j * np.imag(self.poles)[:, None, None]
        return np.asarray(rate * self.shapes[:, :, None] * self.participation[:, None, :])

    def to_table(self, *, real: bool = False) -> ModeTable:
        """The modes as a `ModeTable`; with ``real`` each shape is turned to its best phase and its
        real part kept.

        The rotation maximises the real part (Ahmadian & Gladwell 1995); for the other realisations
        see `realise`.
        """
        shapes: Complex | Real = self.shapes
        std = self.shape_std
        if real:
            turn = np.exp(-0.5j * np.angle(np.sum(self.shapes**2, axis=1)))[:, None]
            turn = turn * np.where(np.real(turn) < 0.0, -1.0, 1.0)
            shapes = np.asarray(np.real(self.shapes * turn))
            std = np.sqrt(
                (turn.real * self.shape_std_real) ** 2 + (turn.imag * self.shape_std_imag) ** 2
            )
        return ModeTable(
            origin=self.origin,
            frequency=self.frequency,
            frequency_std=self.frequency_std,
            damping=self.damping,
            damping_std=self.damping_std,
            channels=self.responses,
            shapes=shapes,
            shape_std=std,
            pairs=np.zeros(self.frequency.size, dtype=np.int64),
        )
