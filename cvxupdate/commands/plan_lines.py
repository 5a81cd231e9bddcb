"""At which frequencies to measure, and how accurately (chapter 5, 3.5.5), from the model alone."""

from __future__ import annotations

import numpy as np

from cvxupdate.commands.plan_places import candidates
from cvxupdate.commands.planned import Lines, Options, Real
from cvxupdate.errors import ModelError
from cvxupdate.fe.model import Model
from cvxupdate.fe.synthesis import frequency_responses
from cvxupdate.recordings.types import DOF_KINDS, Channel, FrequencyResponse, Origin
from cvxupdate.residual.frf_accuracy import accuracy
from cvxupdate.residual.frf_data import FrfData, frf_data
from cvxupdate.residual.frf_points import choose_points, sensitivities

GRID = 240
"""Lines among which is chosen."""
COARSE = 40
"""Lines by which sensors are compared: each costs a row of every candidate and parameter."""
CHOSEN = 30
MOST_PLACES = 400
RULES = {
    "best": "one after another those that leave the least total variance of the parameters",
    "between": "evenly between resonances (3.5.5)",
    "log-function": "where the data may be least accurate (5.32)",
}


def simulated(
    model: Model, frequency: Real, sensors: tuple[str, ...], exciters: tuple[str, ...], noise: float
) -> FrfData:
    """What the model itself would answer, with relative ``noise``."""
    rows, columns = (np.array([model.place[v] for v in x]) for x in (sensors, exciters))
    H = frequency_responses(model, frequency, rows, columns).astype(np.complex128)
    return frf_data(
        FrequencyResponse(
            Origin("planned", "planned"),
            frequency,
            H,
            "displacement",
            tuple(_channel(v, "displacement") for v in sensors),
            tuple(_channel(v, "force") for v in exciters),
        ),
        model,
        noise,
    )


def _channel(label: str, quantity: str) -> Channel:
    node, _, dof = label[1:].partition(".")
    return Channel(int(node), dof if dof in DOF_KINDS else "", quantity)


def grid(frequencies: Real, band: tuple[float, float] | None, lines: int) -> Real:
    """Lines over the band, none on a resonance of the model, where undamped it has no answer."""
    low, high = band if band is not None else (0.5 * frequencies[0], 1.1 * frequencies[-1])
    f = np.linspace(max(low, 1e-3 * high), high, lines)
    near = np.min(np.abs(f[:, None] - frequencies[None, :]) / frequencies, axis=1)
    return np.asarray(f[near > 1e-4])


def information(
    model: Model, frequencies: Real, exciters: tuple[str, ...], options: Options
) -> Real | None:
    """What a sensor at each candidate tells of the parameters, (candidates, n, n); None without
    parameters or where there are too many places for it."""
    places = candidates(model)
    if not model.parameters or len(places) > MOST_PLACES:
        return None
    labels = tuple(model.labels[i] for i in places)
    f = grid(frequencies, options.band, COARSE)
    out = np.empty((len(places), len(model.parameters), len(model.parameters)))
    for k, label in enumerate(labels):
        J = sensitivities(model, simulated(model, f, (label,), exciters, options.usual))
        flat = J.reshape(-1, J.shape[2])
        out[k] = flat.T @ flat
    return out


def line_sets(
    model: Model,
    frequencies: Real,
    sensors: tuple[str, ...],
    exciters: tuple[str, ...],
    options: Options,
) -> tuple[tuple[Lines, ...], tuple[tuple[float, ...], tuple[float, ...]], list[str]]:
    """Lines by every rule, the characteristic log function (5.32) as (Hz, bearable noise), and what
    is to be said; none without parameters."""
    if not model.parameters:
        return (), ((), ()), []
    data = simulated(model, grid(frequencies, options.band, GRID), sensors, exciters, options.usual)
    count = min(CHOSEN, len(data.frequency))
    J, notes, out = sensitivities(model, data), [], []
    for rule, says in RULES.items():
        try:
            lines = choose_points(model, data, rule, count).lines
        except ModelError as error:
            notes.append(f"no lines by the rule {rule}: {error}")
            continue
        part = J[lines].reshape(-1, J.shape[2])
        deviations = _deviations(part)
        worst = float(np.max(np.where(np.isfinite(deviations), deviations, np.inf)))
        out.append(
            Lines(
                rule,
                says,
                tuple(data.frequency[lines].tolist()),
                tuple(deviations.tolist()),
                options.usual * options.accuracy / worst if worst > 0.0 else float("nan"),
            )
        )
    try:
        log = accuracy(
            model, data.frequency, data.responses, options.usual, options.accuracy, rounds=0
        )
        curve = (tuple(log.frequency.tolist()), tuple(log.bearable.tolist()))
    except ModelError as error:
        notes.append(f"no log function (5.32): {error}")
        curve = ((), ())
    return tuple(out), curve, notes


def _deviations(J: Real) -> Real:
    """Of every parameter by these rows (in standard deviations); NaN for one that they leave
    open."""
    _, s, Vt = np.linalg.svd(J, full_matrices=True)
    s = np.concatenate([s, np.zeros(J.shape[1] - len(s))])
    known = s > 1e-10 * s.max(initial=0.0)
    variance = np.sum((Vt[known] / s[known, None]) ** 2, axis=0)
    open_ = np.sum(Vt[~known] ** 2, axis=0) > 1e-12
    return np.where(open_, np.nan, np.sqrt(variance))
