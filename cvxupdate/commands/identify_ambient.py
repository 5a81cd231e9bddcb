"""Modes of responses alone, with all that the page shows of them."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.commands.identified import Mode, ModeSetResult
from cvxupdate.commands.identify_frf import complexity, labels_of, laws_of
from cvxupdate.commands.identify_normal import normal_of
from cvxupdate.commands.identify_options import Options
from cvxupdate.errors import RecordingError

if TYPE_CHECKING:
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.identify.ambient import AmbientModes
    from cvxupdate.recordings.types import Real, TimeHistory

BLOCKS = 8
"""Blocks of the spectrum behind the diagram, half overlapped: looked at, not computed with."""


def of_responses(history: TimeHistory, o: Options, model: Model | None = None) -> ModeSetResult:
    """Modes of a record whose excitation was not measured, or is left aside.

    Raises
    ------
    RecordingError
        Where nothing can be identified from it.
    """
    from cvxupdate.correlate.mac import mac
    from cvxupdate.recordings.identify.ambient import identify_ambient
    from cvxupdate.recordings.types import ModeTable

    if o.method not in ("plscf", "ssi"):
        raise RecordingError(
            f"no force was recorded, and {o.method} needs frequency responses; take --method ssi"
        )
    found = identify_ambient(history, o.band, max_order=o.order)
    if not found.frequency.size:
        raise RecordingError(
            f"no mode was found between {found.band[0]:.4g} and {found.band[1]:.4g} Hz: "
            + (_dropped(found) or "no pole is stable")
            + ". Choose --band around the peaks, or record longer"
        )
    mpc, mpd = complexity(found.shapes)
    figures = (found.frequency, found.frequency_std, found.damping, found.damping_std, mpc, mpd)
    table = ModeTable(
        history.origin,
        *figures[:4],
        found.channels,
        found.shapes,
        None,
        np.zeros(found.frequency.size, dtype=np.int64),
    )
    lines, curves = _spectrum(history, found)
    return ModeSetResult(
        recording=history.origin.name,
        kind="ambient",
        method="ssi",
        band=found.band,
        modes=tuple(Mode(*(float(v) for v in row)) for row in zip(*figures, strict=True)),
        shapes=found.shapes,
        shape_std=found.shape_std,
        labels=labels_of(found.channels),
        nodes=tuple(c.node for c in found.channels),
        dofs=tuple(c.dof for c in found.channels),
        quantity=found.channels[0].quantity,
        auto_mac=mac(found.shapes.T, found.shapes.T),
        diagram=found.stabilisation,
        spectrum_lines=lines,
        spectrum=curves,
        spectrum_says="singular values of the responses' cross spectra",
        fit=None,
        normal=normal_of(found.poles, found.shapes, found.channels, o.normal, None, model),
        laws=laws_of(table),
        notes=_said(found, history),
    )


def _spectrum(history: TimeHistory, found: AmbientModes) -> tuple[Real, Real]:
    from cvxupdate.recordings.output_spectra import output_spectra

    n = len(history.data)
    spectra = output_spectra(
        history, block=max(64, n // BLOCKS), quantity=found.channels[0].quantity
    )
    inside = (spectra.frequency >= found.band[0]) & (spectra.frequency <= found.band[1])
    values = np.linalg.svd(spectra.density[inside], compute_uv=False)
    return spectra.frequency[inside], np.asarray(values[:, :3].T, dtype=np.float64)


def _dropped(found: AmbientModes) -> str:
    if not found.dropped:
        return ""
    shown = ", ".join(f"{f:.4g}" for f in found.dropped[:8])
    more = " and more" if len(found.dropped) > 8 else ""
    return f"stable poles at {shown}{more} Hz are none of a structure (complex, or of no width)"


def _said(found: AmbientModes, history: TimeHistory) -> tuple[str, ...]:
    said = [
        "responses alone: the excitation is taken to be white over the band; a steady harmonic of "
        "it shows as a mode with hardly any damping",
        f"{found.rate:.5g} samples a second after decimation, correlations over {found.lags} lags; "
        f"deviations from the scatter of {found.pieces} pieces of the record",
        "shapes have no scale",
    ]
    if found.channels[0].quantity not in ("displacement", "velocity", "acceleration"):
        said.append(
            f"its channels read {found.channels[0].quantity}, no calibrated motion: frequencies "
            "and damping hold, shapes only as far as the channels are alike"
        )
    if any(c.quantity == "force" for c in history.channels):
        said.append("the recorded force was left aside")
    if _dropped(found):
        said.append(_dropped(found))
    return tuple(said)
