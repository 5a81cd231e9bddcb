"""FRFs synthesised from identified modes (section 9.5), and what they leave unexplained."""

from __future__ import annotations

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.convert import derivatives
from cvxupdate.recordings.identify.model import Roots, linear_basis, value_from_pole
from cvxupdate.recordings.identify.result import IdentifiedModes
from cvxupdate.recordings.types import Complex, FrequencyResponse, Real


def modal_frf(
    frequency: Real,
    poles: Complex,
    shapes: Complex,
    participation: Complex,
    *,
    lower: Real | None = None,
    upper: Real | None = None,
    band: tuple[float, float] | None = None,
    quantity: str = "displacement",
    damping: str = "viscous",
) -> Complex:
    """FRFs (lines, responses, references) of modes with residues ``outer(shapes[r],
    participation[r])`` of the receptance.

    ``poles`` (modes,) rad/s; ``shapes`` (modes, responses); ``participation`` (modes, references);
    residuals ``lower`` and ``upper`` (terms, responses, references) as in `model`, for ``band``
    (Hz, default the ends of ``frequency``). ``damping`` viscous or hysteretic (loss factor ``2
    zeta``).
    """
    roots = Roots(value_from_pole(poles, damping), participation, damping)
    none = np.zeros((0, shapes.shape[1], participation.shape[1]))
    low, high = none if lower is None else lower, none if upper is None else upper
    ends = band if band is not None else (float(frequency.min()), float(frequency.max()))
    basis = linear_basis(
        frequency, roots, derivatives(quantity), (low.shape[0], high.shape[0]), ends
    )
    residuals = np.concatenate([high, low]).transpose(1, 0, 2).reshape(shapes.shape[1], -1)
    x = np.concatenate([shapes.real.T, shapes.imag.T, residuals], axis=1)
    return np.asarray(np.einsum("fic,oc->foi", basis, x))


def synthesise(
    modes: IdentifiedModes,
    frequency: Real,
    *,
    quantity: str | None = None,
    residuals: bool = True,
    auxiliary: bool = True,
) -> FrequencyResponse:
    """FRFs of the identified modes at any frequencies (Hz, above 0), in any motion.

    ``residuals`` and ``auxiliary`` add the static terms and the modes beyond the band's edges:
    wanted for a comparison inside the band, meaningless far outside it. Damping added by an
    exponential window is not put back. Variance is None.

    Raises
    ------
    RecordingError
        When a frequency is not above 0.
    """
    if np.any(frequency <= 0.0):
        raise RecordingError(
            "FRFs are synthesised at frequencies above 0 Hz only; leave the first line out"
        )
    kind = modes.quantity if quantity is None else quantity
    poles, shapes, participation = modes.poles, modes.shapes, modes.participation
    if auxiliary:
        poles, shapes, participation = (
            np.concatenate(both)
            for both in zip((poles, shapes, participation), modes.auxiliary, strict=True)
        )
    H = modal_frf(
        frequency,
        poles,
        shapes,
        participation,
        quantity=kind,
        damping=modes.damping_model,
        lower=modes.lower if residuals else None,
        upper=modes.upper if residuals else None,
        band=modes.band,
    )
    return FrequencyResponse(modes.origin, frequency, H, kind, modes.responses, modes.references)


def rest_of(frf: FrequencyResponse, modes: IdentifiedModes) -> Real:
    """What the synthesis leaves of each FRF, ``‖H - synthesised‖ / ‖H‖`` over the lines of ``frf``,
    (responses, references)."""
    keep = frf.frequency > 0.0
    H = frf.H[keep]
    fitted = synthesise(modes, frf.frequency[keep], quantity=frf.quantity).H
    size = np.linalg.norm(H, axis=0)
    return np.asarray(np.linalg.norm(H - fitted, axis=0) / np.where(size > 0.0, size, np.inf))
