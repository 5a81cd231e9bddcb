"""What is done before and instead of an update, as functions: `identify` modes from recordings,
`plan` a measurement from a model."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from cvxupdate.api.measured import IdentifyResult, PlanResult
from cvxupdate.api.model import Model
from cvxupdate.api.modes import Modes
from cvxupdate.api.problem import Problem, Recorded, given_problem, parameter_rows, recording_table
from cvxupdate.commands.identify import identify as identified
from cvxupdate.commands.identify_options import Options as IdentifyOptions
from cvxupdate.commands.plan import plan as planned
from cvxupdate.commands.planned import Diagnosed
from cvxupdate.commands.planned import Options as PlanOptions
from cvxupdate.diagnose.output.diagnosis import Diagnosis
from cvxupdate.errors import InputError


def identify(
    recordings: Any,
    *,
    method: str = "plscf",
    normal: str | None = None,
    band: tuple[float, float] | None = None,
    order: int = 60,
    recording: str | int | None = None,
    rate: float | None = None,
    damping: str = "viscous",
    estimator: str | None = None,
    decay: float = 0.0,
    indicator: str = "mmif",
) -> IdentifyResult:
    """Modes with their deviations, from recordings.

    Parameters
    ----------
    recordings : `Frf`, `TimeHistory` or a list of them; the path of a file of recordings; or a
        problem in any form, with or without a [model].
    method : plscf, realisation, ibrahim, appropriation or ssi.
    normal : a route to normal modes, or "all"; None: complex modes alone.
    band : (lowest, highest) Hz.
    order : the largest order of the stabilisation diagram.
    recording : one of several, by number (1 is the first) or name.
    rate : Hz of a file of time histories that does not state it.
    damping : viscous, or hysteretic (a loss factor for each mode).
    estimator : lpm, h1, h2 or hv of frequency responses from time histories.
    decay : 1/s of an exponential window to take out.
    indicator : mmif … of force appropriation.

    Raises
    ------
    InputError
        For a fault of the input, or where modes can be identified from no recording.
    """
    options = IdentifyOptions(
        method,
        normal,
        _ends(band),
        order,
        None if recording is None else str(recording),
        rate,
        damping,
        estimator,
        decay,
        indicator,
    )
    return IdentifyResult(identified(_given(recordings), options), recordings)


def _given(recordings: Any) -> Any:
    """What the command opens: a path, a problem, or tables of recordings without a model."""
    if isinstance(recordings, Problem):
        return recordings.spec
    if isinstance(recordings, Modes):
        raise InputError("these are modes; there is nothing to identify. Give Frf or TimeHistory.")
    if isinstance(recordings, Recorded):
        return {"recordings": [recording_table(recordings)]}
    if isinstance(recordings, str | os.PathLike | Mapping):
        return recordings
    if isinstance(recordings, list | tuple) and recordings:
        return {"recordings": [recording_table(r, k) for k, r in enumerate(recordings)]}
    raise InputError(
        f"recordings: a {type(recordings).__name__} is none. Give Frf, TimeHistory, a list of "
        "them, the path of a file, or a problem."
    )


def plan(
    problem: Any,
    parameters: Any = None,
    *,
    sensors: int | None = None,
    exciters: int | None = None,
    modes: int = 6,
    band: tuple[float, float] | None = None,
    noise: float | None = None,
    accuracy: float = 0.05,
    diagnosis: Any = None,
    further: int | None = None,
) -> PlanResult:
    """What to measure, from the model alone: sensors, exciters, frequency lines, and what accuracy
    they leave the parameters; with a diagnosis also what would tell its explanations apart.

    Parameters
    ----------
    problem : a `Model`, or a problem in any form; its recordings, if it has any, are not read.
    parameters : those that are to be updated, as `update` takes them; None: the problem's own.
    sensors, exciters : how many; None: as many as the modes need.
    modes : the lowest so many are to be measured.
    band : (lowest, highest) Hz of the lines.
    noise : of the responses (None: 0.01; beside a diagnosis that of its recordings), accuracy :
        wanted of the parameters, both fractions.
    diagnosis : what `diagnose` gave back for this problem, or the path of its diagnosis.json; the
        problem's recordings are then read.
    further : how many responses are to tell its explanations apart together; None: as
        many as are worth it.

    Raises
    ------
    InputError
        For a fault of the input, or a request that the model cannot meet.
    """
    options = PlanOptions(sensors, exciters, modes, _ends(band), noise, accuracy, further)
    wanted = (
        None if parameters is None else {"method": "rfm", "parameters": parameter_rows(parameters)}
    )
    if isinstance(problem, Model):
        if diagnosis is not None:
            raise InputError(
                "diagnosis: a model has no recordings to fit its explanations to. Give the problem "
                "that was diagnosed."
            )
        made = Problem(problem, (), update=wanted)
        return PlanResult(planned(made.spec, options), made)
    spec, keep = given_problem(problem, None, update=wanted)
    return PlanResult(planned(spec, options, _diagnosed(diagnosis)), keep)


def _diagnosed(diagnosis: Any) -> Diagnosed | None:
    if diagnosis is None:
        return None
    if isinstance(diagnosis, str | os.PathLike):
        return Diagnosed.of(Path(diagnosis))
    given = getattr(diagnosis, "data", diagnosis)
    content = given.to_json() if isinstance(given, Diagnosis) else given
    if not isinstance(content, Mapping):
        raise InputError(
            f"diagnosis: a {type(diagnosis).__name__} is none. Give what diagnose gave back, or "
            "the path of a diagnosis.json."
        )
    return Diagnosed(content, "diagnosis")


def _ends(band: Any) -> tuple[float, float] | None:
    if band is None:
        return None
    try:
        low, high = (float(v) for v in band)
    except (TypeError, ValueError):
        raise InputError(f"band: {band!r} is no band. Give (lowest, highest) in Hz.") from None
    return low, high
