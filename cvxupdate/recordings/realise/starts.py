"""What the routes to normal modes start from, and the routes that take frequency responses or a
model."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import convert
from cvxupdate.recordings.identify.result import IdentifiedModes
from cvxupdate.recordings.identify.synthesis import synthesise
from cvxupdate.recordings.realise.frf import (
    chen_hsu_tsuei,
    normal_frf,
    normal_poles,
    resonance_shapes,
)
from cvxupdate.recordings.realise.shape import ahmadian_gladwell
from cvxupdate.recordings.realise.state import ibrahim_fill, rivals
from cvxupdate.recordings.types import Complex, Real

Found = tuple[Real, Real]
BESIDE = 0.01
"""Distance from resonance, in fractions of critical damping, at which (2.32) is evaluated: near
enough for the mode to rule, and Re H can be inverted."""


@dataclass(frozen=True)
class ModelModes:
    """Undamped modes of the model beside the recordings: ``frequency`` (modes,) Hz and ``shapes``
    (modes, channels), NaN at a channel that is not one of the model's DOFs; of several channels at
    one DOF the first has it; ``says`` why there are none, where that is so."""

    frequency: Real
    shapes: Real
    says: str = ""


@dataclass(frozen=True)
class ModeSet:
    """What a route starts from: ``poles`` (modes,) rad/s, ``shapes`` (modes, channels) complex;
    ``fitted`` the identification of FRFs that they come from, None for responses alone; ``model``
    None where no model goes with them."""

    poles: Complex
    shapes: Complex
    fitted: IdentifiedModes | None = None
    model: ModelModes | None = None

    @property
    def frequency(self) -> Real:
        """Natural frequencies |p| / 2π, Hz."""
        return np.asarray(np.abs(self.poles) / (2.0 * np.pi))


def _fitted(m: ModeSet, name: str) -> IdentifiedModes:
    if m.fitted is None:
        raise RecordingError(
            f"the route {name} needs frequency responses, and these modes come from responses "
            "alone; take a route through the modes, e.g. ibrahim-fullekrug"
        )
    return m.fitted


def _square(modes: IdentifiedModes, name: str) -> tuple[list[int], list[int]]:
    """Rows and columns of the FRFs at the places that are both responses and references."""
    at = {c.label: k for k, c in enumerate(modes.responses)}
    columns = [k for k, c in enumerate(modes.references) if c.label in at]
    if len(columns) < 2:
        raise RecordingError(
            f"the route {name} needs a square matrix of FRFs: at least two places that are both "
            f"driven and measured, there {'is 1' if columns else 'are 0'}"
        )
    return [at[modes.references[k].label] for k in columns], columns


def resonance(m: ModeSet) -> Found:
    """(2.32) on the receptances synthesised beside the natural frequencies; the force is the one
    that moves the mode most. At the frequency itself Re H of the mode vanishes, and G with it."""
    modes = _fitted(m, "resonance")
    f = m.frequency * (1.0 + BESIDE * np.maximum(-m.poles.real / np.abs(m.poles), 1e-6))
    H = convert(synthesise(modes, f, quantity="displacement"), "displacement").H
    own = np.argmin(np.abs(modes.poles - m.poles[:, None]), axis=1)
    force = ahmadian_gladwell(modes.participation[own])
    force = force / np.linalg.norm(force, axis=1, keepdims=True)
    return m.frequency, resonance_shapes(H, np.einsum("foi,fi->fo", H, force))


def _dense(modes: IdentifiedModes, frequency: Real) -> Real:
    """Lines (Hz) over the band, closer about every natural frequency."""
    about = [g * (1.0 + 0.02 * np.linspace(-1, 1, 201)) for g in frequency]
    f = np.unique(np.concatenate([np.linspace(*modes.band, 2000), *about]))
    return np.asarray(f[(f > 0.0) & (f >= modes.band[0]) & (f <= modes.band[1])])


def crossings(m: ModeSet) -> Found:
    """`chen_hsu_tsuei` on the square part, densely synthesised over the band."""
    modes = _fitted(m, "crossings")
    rows, columns = _square(modes, "crossings")
    f = _dense(modes, m.frequency)
    H = synthesise(modes, f, quantity="displacement").H[:, rows][:, :, columns]
    frequency, part = chen_hsu_tsuei(f, H)
    shapes = np.full((frequency.size, m.shapes.shape[1]), np.nan)
    shapes[:, rows] = part
    return frequency, shapes


def normal_responses(m: ModeSet) -> Found:
    """The poles of the normal FRFs (2.29) of all that was measured, densely synthesised."""
    modes = _fitted(m, "normal-frf")
    f = _dense(modes, m.frequency)
    return normal_poles(f, normal_frf(synthesise(modes, f, quantity="displacement").H))


def filled(m: ModeSet) -> Found:
    """`ibrahim_fill` with the lowest of the model's modes that are not among the measured ones, as
    many as are missing; their damping is the mean of the measured ratios."""
    if m.model is None:
        raise RecordingError(
            "the route ibrahim-fill fills up with modes of the model: give a problem file that "
            "has one. Without it, take ibrahim"
        )
    if m.model.says:
        raise RecordingError(f"the model has no modes to fill up with: {m.model.says}")
    known = np.all(np.isfinite(m.model.shapes), axis=0)
    count, channels = m.poles.size, int(np.count_nonzero(known))
    shapes, own = m.shapes[:, known], m.model.shapes[:, known]
    if count > channels:
        raise RecordingError(
            f"{count} modes but {channels} channels at DOFs of the model: the route ibrahim-fill "
            "needs at least as many channels; narrow --band"
        )
    left = rivals(shapes, own)
    if left.size < channels - count:
        raise RecordingError(
            f"{count} measured modes and {left.size} others of the model do not make {channels}, "
            "the number of channels: the model is too coarse to fill them up. Take ibrahim"
        )
    filler = left[: channels - count]
    ratio = float(np.mean(-m.poles.real / np.abs(m.poles)))
    frequency, found = ibrahim_fill(
        m.poles,
        shapes,
        m.model.frequency[filler],
        own[filler],
        analytical_damping=min(max(ratio, 0.0), 0.99),
    )
    out = np.full((count, m.shapes.shape[1]), np.nan)
    out[:, known] = found
    return frequency, out
