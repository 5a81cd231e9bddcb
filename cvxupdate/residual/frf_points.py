"""Which lines to fit: between resonances, away from anti-resonances, from the gap between the two
models' resonances and from the frequencies of the structure held at its sensors, where coherence is
good (thesis 3.5.1, 3.5.5); those where the data may be least accurate (5.32); or those that tell
most."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.responses import held_frequencies
from cvxupdate.residual.frf import FrfResidual
from cvxupdate.residual.frf_accuracy import accuracy
from cvxupdate.residual.frf_data import FrfData

NEAR = 0.015  # relative distance from a resonance, the model's or the measured, that is avoided
# relative distance up to which a resonance of the model and a measured one count as the same mode
GAP = 0.12
COHERENT = 0.8
MODES = 60


@dataclass(frozen=True)
class Points:
    """Chosen ``lines`` of one recording, the frequencies that were avoided, and the check (3.48):
    ``rank`` of the FRFs at the lines against the ``modes`` in the whole range of the recording
    (measured ones; the model's where it shows no resonance), ``ratio`` σ₁/σ_modes (inf
    where the rank is too low); ``warnings`` in words."""

    lines: Index
    measured: Real
    model: Real
    held: Real
    modes: int
    rank: int
    ratio: float
    warnings: tuple[str, ...]


def resonances(data: FrfData) -> Real:
    """Frequencies (Hz) of the peaks of the summed receptance, at least 3 dB above the lowest line
    on either side."""
    size = np.sqrt(np.sum(np.abs(data.X) ** 2, axis=(1, 2)))
    level = np.log10(np.maximum(size, np.finfo(float).tiny))
    found = []
    tops = [
        i for i in range(1, len(level) - 1) if level[i] >= level[i - 1] and level[i] > level[i + 1]
    ]
    for place, i in enumerate(tops):
        before, after = (
            (tops[place - 1] if place else 0),
            (tops[place + 1] if place + 1 < len(tops) else len(level) - 1),
        )
        if level[i] - max(level[before:i].min(), level[i + 1 : after + 1].min()) > 0.15:
            found.append(data.frequency[i])
    return np.array(found)


def choose_points(
    model: Model, data: FrfData, rule: str | Sequence[float], count: int | None
) -> Points:
    """Lines by ``rule``: "all"; "between" resonances, evenly; "log-function", its lowest values
    (5.32); "best", one after another those that leave the least total variance of the parameters;
    or a list of frequencies in Hz (the nearest lines).

    Raises
    ------
    InputError
        A frequency outside the recording.
    """
    measured = resonances(data)
    held, own = _frequencies(model, data)
    warnings: list[str] = []
    if not isinstance(rule, str):
        lines = _nearest(data, rule)
    elif rule == "all":
        lines = np.arange(len(data.frequency))
    else:
        number = min(count or _enough(model, data, own), len(data.frequency))
        allowed = _allowed(data, measured, own, held)
        if rule == "best":
            lines = most_informative(sensitivities(model, data), allowed, number)
        elif rule == "log-function":
            noise = float(
                np.median(
                    data.std[:, data.used]
                    / np.maximum(np.abs(data.X[:, data.used]), np.finfo(float).tiny)
                )
            )
            lines = _lowest(
                accuracy(model, data.frequency, data.responses, noise, rounds=0).log_function,
                allowed,
                number,
            )
        else:
            lines = _spread(data.frequency, allowed, np.concatenate([measured, own]), number)
    band = (data.frequency.min(), data.frequency.max())
    modes = len(measured) or int(np.sum((own >= band[0]) & (own <= band[1])))
    rank, ratio = selection_rank(data, lines, modes)
    if rank < modes:
        warnings.append(
            f"{data.name}: the FRFs at the {len(lines)} chosen lines have rank {rank}, but "
            f"{modes} modes are to be seen between {band[0]:.5g} and {band[1]:.5g} Hz: the "
            "lines do not carry all that the recording knows (3.48). Choose more points."
        )
    close = [f for f in held if np.any(np.abs(data.frequency[lines] - f) < 0.01 * f)]
    if close:
        shown = ", ".join(f"{f:.5g}" for f in close[:6])
        warnings.append(
            f"{data.name}: lines lie within 1 % of frequencies of the structure held at its "
            f"sensors ({shown} Hz), where the reduced dynamic stiffness is far from linear in "
            "the parameters (3.5.1)."
        )
    return Points(lines, measured, own, held, modes, rank, ratio, tuple(warnings))


def selection_rank(data: FrfData, lines: Index, modes: int) -> tuple[int, float]:
    """Rank of [H(ω₁) H(ω₂) …] above the noise of its entries, and σ₁/σ_modes (3.48); all references
    stand below one another."""
    X = data.X[lines][:, data.used].T
    norm = np.linalg.norm(X, axis=0)
    norm = np.where(norm > 0, norm, 1.0)
    s = np.linalg.svd(X / norm, compute_uv=False)
    relative = float(np.median(np.linalg.norm(data.std[lines][:, data.used].T, axis=0) / norm))
    noise = 0.0 if data.relative_only else relative * (1.0 + np.sqrt(X.shape[1] / X.shape[0]))
    rank = int(np.sum(s > max(1e-10 * s[0], noise)))
    return rank, float(s[0] / s[modes - 1]) if 0 < modes <= len(s) and s[modes - 1] > 0 else np.inf


def _frequencies(model: Model, data: FrfData) -> tuple[Real, Real]:
    """Natural frequencies up to the last line: held at the sensors, and free."""
    top = 1.1 * data.frequency.max()
    held = np.zeros(0)
    try:
        rest = model.size - len(data.responses)
        held = held_frequencies(model, data.responses, min(MODES, rest)) if rest else held
    except ModelError:
        pass  # nothing but massless DOFs is left: no frequency to avoid
    own = model_modes(model, min(MODES, model.size), model.zero()).flexible().frequencies
    return held[(held > 0) & (held < top)], own[own < top]


def _enough(model: Model, data: FrfData, own: Real) -> int:
    """More than twice the modes of the band, and four equations for each parameter."""
    rows = len(data.responses) * len(data.references) * (1 if data.real else 2)
    return max(
        10,
        2 * int(np.sum(own <= data.frequency.max())) + 1,
        int(np.ceil(4 * len(model.parameters) / rows)),
    )


def _nearest(data: FrfData, wanted: Sequence[float]) -> Index:
    step = np.diff(data.frequency, prepend=np.nan, append=np.nan)
    lines = []
    for f in wanted:
        i = int(np.argmin(np.abs(data.frequency - f)))
        if abs(data.frequency[i] - f) > 0.51 * np.nanmax(step[i : i + 2]):
            raise InputError(
                f"{data.name}: there is no line near {f:g} Hz; the recording goes from "
                f"{data.frequency[0]:g} to {data.frequency[-1]:g} Hz. Correct "
                "update.frequency_points."
            )
        lines.append(i)
    return np.unique(np.array(lines, dtype=np.int64))


def _allowed(
    data: FrfData, measured: Real, own: Real, held: Real
) -> np.ndarray[tuple[int], np.dtype[np.bool_]]:
    f = data.frequency
    ok = np.ones(len(f), dtype=bool)
    for bad in np.concatenate([measured, own, held]):
        ok &= np.abs(f - bad) > NEAR * bad
    for fx in measured:
        near = own[np.abs(own - fx) < GAP * fx]
        if len(near):
            partner = near[np.argmin(np.abs(near - fx))]
            ok &= (f < min(fx, partner)) | (f > max(fx, partner))
    size = np.abs(data.X)
    rms = np.sqrt(np.mean(size**2, axis=(1, 2)))
    smooth = np.array([np.median(rms[max(0, i - 5) : i + 6]) for i in range(len(f))])
    ok &= rms > 0.1 * smooth
    if data.coherence is not None and not np.all(np.isnan(data.coherence)):
        ok &= np.nan_to_num(np.nanmedian(data.coherence, axis=1), nan=1.0) >= COHERENT
    return ok if ok.sum() >= 2 else np.ones(len(f), dtype=bool)


def _spread(
    f: Real, allowed: np.ndarray[tuple[int], np.dtype[np.bool_]], edges: Real, number: int
) -> Index:
    """Evenly over the allowed lines, and at least one between every two neighbouring resonances
    that have one."""
    lines = np.flatnonzero(allowed)
    if len(lines) <= number:
        return lines
    cuts = np.searchsorted(np.sort(edges), f[lines])
    keep = {int(lines[cuts == c][np.sum(cuts == c) // 2]) for c in np.unique(cuts)}
    even = lines[np.unique(np.round(np.linspace(0, len(lines) - 1, number)).astype(int))].tolist()
    for line in sorted(even, key=lambda i: -min((abs(i - k) for k in keep), default=0)):
        if len(keep) >= number:
            break
        keep.add(int(line))
    return np.array(sorted(keep), dtype=np.int64)


def sensitivities(model: Model, data: FrfData) -> Real:
    """∂(receptance)/∂p of the model as it stands in standard deviations, line by line, (f, rows,
    parameters)."""
    point = FrfResidual(model, (data,), "receptance").evaluate(model.zero())
    J = point.residual.weights[:, None] * point.jacobian
    halves = J.reshape(
        -1, len(data.frequency), int(np.sum(data.used)), J.shape[1]
    )  # real rows first, then imaginary ones
    return np.concatenate(list(halves), axis=1)


def most_informative(
    J: Real, allowed: np.ndarray[tuple[int], np.dtype[np.bool_]], number: int, prior: float = 0.05
) -> Index:
    """Greedy A-optimal lines (Fedorov 1972): each next one lowers trace (I/prior² + Σ JᵀJ)⁻¹ most;
    ``prior`` the deviation every p may have."""
    P = prior**2 * np.eye(J.shape[2])
    free = [int(i) for i in np.flatnonzero(allowed)]
    chosen: list[int] = []
    while free and len(chosen) < number:
        some = J[free]
        JP = some @ P
        inner = np.eye(J.shape[1]) + JP @ some.transpose(0, 2, 1)
        gain = np.einsum("fij,fij->f", JP, np.linalg.solve(inner, JP))
        best = int(np.argmax(gain))
        P = P - JP[best].T @ np.linalg.solve(inner[best], JP[best])
        P = (P + P.T) / 2.0
        chosen.append(free.pop(best))
    return np.array(sorted(chosen), dtype=np.int64)


def best_lines(data: FrfData, points: Points, log_function: Real, number: int) -> Index:
    """The lines of ``data`` with the lowest log function (5.32) among those that `choose_points`
    would allow; ``points`` of the same recording."""
    return _lowest(log_function, _allowed(data, points.measured, points.model, points.held), number)


def _lowest(
    log_function: Real, allowed: np.ndarray[tuple[int], np.dtype[np.bool_]], number: int
) -> Index:
    """Lines with the lowest log function, kept apart by a third of an even spacing."""
    apart = max(1, len(log_function) // (3 * number))
    chosen: list[int] = []
    for line in np.argsort(np.where(allowed, log_function, np.inf)).tolist():
        if len(chosen) == number or not allowed[line]:
            break
        if all(abs(line - other) >= apart for other in chosen):
            chosen.append(line)
    return np.array(sorted(chosen), dtype=np.int64)
