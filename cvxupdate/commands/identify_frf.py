"""Modes of one set of frequency responses, with all that the page shows of them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np

from cvxupdate.commands.identified import Fitted, Mode, ModeSetResult
from cvxupdate.commands.identify_normal import normal_of
from cvxupdate.commands.identify_options import LONG_LIVED, Options
from cvxupdate.errors import RecordingError

if TYPE_CHECKING:
    from cvxupdate.fe.model import Model
    from cvxupdate.recordings.identify import DecayRates, IdentifiedModes
    from cvxupdate.recordings.types import Channel, Complex, FrequencyResponse, ModeTable, Real


def of_frf(
    frf: FrequencyResponse, kind: str, o: Options, notes: Sequence[str], model: Model | None = None
) -> ModeSetResult:
    """Modes of one set of FRFs; ``model`` fills up what was not measured, where asked for.

    Raises
    ------
    RecordingError
        Where nothing can be identified from them.
    """
    if o.method == "ssi":
        raise RecordingError(
            "ssi takes time histories of the responses; these are frequency responses. Take plscf"
        )
    frf = _usable(frf)
    if o.method == "appropriation":
        return _appropriated(frf, kind, o, notes)
    from cvxupdate.recordings.identify import Criteria, identify_modes, synthesise

    found = identify_modes(
        frf,
        o.band,
        max_order=o.order,
        damping=o.damping,
        criteria=Criteria() if o.method == "plscf" else Criteria(fraction=LONG_LIVED),
        iterations=20 if o.method == "plscf" else 0,
        added_decay=o.decay,
        poles=o.method,
    )
    if not found.frequency.size:
        raise RecordingError(
            f"no mode was found between {found.band[0]:.4g} and {found.band[1]:.4g} Hz; widen "
            "--band, or raise --order"
        )
    keep = (frf.frequency >= found.band[0]) & (frf.frequency <= found.band[1])
    lines = frf.frequency[keep]
    fit = Fitted(
        lines,
        frf.H[keep],
        synthesise(found, lines).H,
        frf.quantity,
        tuple(c.label for c in frf.responses),
        tuple(c.label for c in frf.references),
        found.rest,
    )
    return replace(
        _mode_set(frf, kind, o, _modes_of(found), found.shapes, found.shape_std, found.band),
        diagram=found.stabilisation,
        fit=fit,
        normal=normal_of(found.poles, found.shapes, frf.responses, o.normal, found, model),
        laws=laws_of(found.to_table()),
        notes=(*notes, *_said(found, o)),
    )


def _usable(frf: FrequencyResponse) -> FrequencyResponse:
    """Without lines at which an FRF is no number, and without channels that are no motion."""
    finite = np.all(np.isfinite(frf.H), axis=(1, 2)) & (frf.frequency > 0.0)
    if not np.any(finite):
        raise RecordingError("no line holds a number in every frequency response")
    if not frf.references or any(c.quantity == "unknown" and not c.dof for c in frf.references):
        raise RecordingError(
            "a spectrum for which no force was recorded: its poles are not those of the structure "
            "alone. Give the time history, or the references"
        )
    return replace(
        frf,
        frequency=frf.frequency[finite],
        H=frf.H[finite],
        variance=None if frf.variance is None else frf.variance[finite],
        coherence=None if frf.coherence is None else frf.coherence[finite],
    )


def _modes_of(found: IdentifiedModes) -> tuple[Mode, ...]:
    mpc, mpd = complexity(found.shapes)
    rows = zip(
        found.frequency,
        found.frequency_std,
        found.damping,
        found.damping_std,
        mpc,
        mpd,
        strict=True,
    )
    return tuple(Mode(*(float(v) for v in row)) for row in rows)


def complexity(shapes: Complex) -> tuple[Real, Real]:
    """MPC and MPD (degrees) of every shape, NaN with fewer than two channels."""
    from cvxupdate.recordings.realise import mean_phase_deviation, phase_collinearity

    if shapes.shape[1] < 2:
        return np.full(len(shapes), np.nan), np.full(len(shapes), np.nan)
    return phase_collinearity(shapes), mean_phase_deviation(shapes)


def _mode_set(
    frf: FrequencyResponse,
    kind: str,
    o: Options,
    modes: tuple[Mode, ...],
    shapes: Complex,
    shape_std: Real,
    band: tuple[float, float],
) -> ModeSetResult:
    from cvxupdate.correlate.mac import mac

    inside = (frf.frequency >= band[0]) & (frf.frequency <= band[1])
    indicator = np.linalg.svd(frf.H[inside], compute_uv=False)
    return ModeSetResult(
        recording=frf.origin.name,
        kind=kind,
        method=o.method,
        band=band,
        modes=modes,
        shapes=shapes,
        shape_std=shape_std,
        labels=labels_of(frf.responses),
        nodes=tuple(c.node for c in frf.responses),
        dofs=tuple(c.dof for c in frf.responses),
        quantity=frf.quantity,
        auto_mac=mac(shapes.T, shapes.T),
        diagram=None,
        spectrum_lines=frf.frequency[inside],
        spectrum=np.asarray(indicator[:, :3].T, dtype=np.float64),
        spectrum_says="singular values of the frequency responses (CMIF)",
        fit=None,
        normal=(),
        laws=None,
        notes=(),
    )


def labels_of(channels: Sequence[Channel]) -> tuple[str, ...]:
    """Labels of channels; the second one of a label is told by its number."""
    seen: dict[str, int] = {}
    out = []
    for c in channels:
        seen[c.label] = seen.get(c.label, 0) + 1
        out.append(c.label if seen[c.label] == 1 else f"{c.label} ({seen[c.label]})")
    return tuple(out)


def laws_of(table: ModeTable) -> DecayRates | None:
    """The law of the damping; None with too few modes."""
    from cvxupdate.recordings.identify import decay_rates

    try:
        return decay_rates(table)
    except RecordingError:
        return None


def _said(found: IdentifiedModes, o: Options) -> list[str]:
    said = []
    if np.isfinite(found.chi_square) and found.chi_square > 2.0:
        said.append(
            f"the misfit is {np.sqrt(found.chi_square):.2g} times what the stated variances allow; "
            "the deviations are made as much larger"
        )
    if not np.isfinite(found.chi_square):
        said.append("no variance was known: the deviations are those of the misfit")
    if found.line_correlation > 1.5:
        said.append(f"noise is alike over {found.line_correlation:.1f} lines, which count as one")
    if o.decay > 0.0:
        said.append(f"an exponential window of {o.decay:g} 1/s was taken out of the damping")
    if o.method in ("realisation", "ibrahim"):
        said.append(
            "poles of the time domain as they are, without maximum likelihood: the deviations "
            "leave out what the method itself loses"
        )
    return said


def _appropriated(
    frf: FrequencyResponse, kind: str, o: Options, notes: Sequence[str]
) -> ModeSetResult:
    """Normal modes excited by appropriated forces, computed from the FRFs; no damping."""
    from cvxupdate.recordings.appropriate import appropriate
    from cvxupdate.recordings.convert import convert

    low, high = o.band if o.band is not None else (0.0, np.inf)
    flexible = convert(frf, "displacement")
    inside = (flexible.frequency >= low) & (flexible.frequency <= high)
    if np.count_nonzero(inside) < 8:
        raise RecordingError("too few lines for force appropriation; widen --band")
    f, H = flexible.frequency[inside], flexible.H[inside]
    found = appropriate(f, H, o.indicator)
    if not found.frequency.size:
        raise RecordingError(
            f"no force excites a pure mode by {o.indicator}: too few exciters for modes so close, "
            "or damping that is not proportional. Take the method plscf"
        )
    nothing = float("nan")
    modes = tuple(
        Mode(float(g), nothing, nothing, nothing, 1.0, 0.0, float(p))
        for g, p in zip(found.frequency, found.purity, strict=True)
    )
    band = (float(f[0]), float(f[-1]))
    shapes = found.shapes.astype(np.complex128)
    made = _mode_set(frf, kind, o, modes, shapes, np.full(shapes.shape, nothing), band)
    says = (
        f"force appropriation by {o.indicator}: undamped natural frequencies and real shapes of "
        "the responses in quadrature; damping and deviations are not given by it",
        f"{len(frf.references)} exciter{'s' if len(frf.references) > 1 else ''}: with fewer than "
        "modes that are active at once, a mode is not pure",
    )
    return replace(made, notes=(*notes, *says))
