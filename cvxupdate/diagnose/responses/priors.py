"""What is known of the unknowns of responses beforehand."""

from __future__ import annotations

from collections.abc import Collection, Sequence
from typing import Protocol

import numpy as np

from cvxupdate.diagnose.nominal.scatter import prior_scales
from cvxupdate.diagnose.responses.signals import Real, Signal, independent
from cvxupdate.diagnose.settings import (
    COMMON_DAMPING_STD,
    FREE,
    KIND_STD,
    MODE_DAMPING_STD,
    TUNED_STD,
    WIDE,
)
from cvxupdate.fe.model import Model
from cvxupdate.physics.fault import Fault


class Unknowns(Protocol):
    """What has unknowns: a model, damping ratios, faults, beside signals."""

    @property
    def model(self) -> Model:
        """With its parameters."""

    @property
    def signals(self) -> tuple[Signal, ...]:
        """What it is compared with."""

    @property
    def faults(self) -> tuple[Fault, ...]:
        """Of the sensors."""

    @property
    def damped(self) -> int:
        """How many modes have a damping ratio of their own."""

    @property
    def tuned(self) -> bool:
        """Whether these have frequencies of their own, too."""

    @property
    def mixed(self) -> bool:
        """Whether the share of the loss that is hysteretic is an unknown."""


def priors(setting: Unknowns, counted: Collection[str], groups: bool) -> Real:
    """Prior standard deviations of all unknowns of a setting. Those of the model's ``counted``
    kinds of parameters, and of its ``groups`` that are not let go, are as much smaller as rows say
    the same (`alike`): beside thousands of them a deviation of a group would cost nothing, and take
    the part of what is missing."""
    own = [COMMON_DAMPING_STD, *([KIND_STD] if setting.mixed else [])]
    own += [MODE_DAMPING_STD] * setting.damped
    own += [TUNED_STD] * (setting.damped if setting.tuned else 0)
    models = np.array(prior_scales(setting.model))
    known = [
        q.group in counted or (groups and q.group is not None and q.upper < WIDE)
        for q in setting.model.parameters
    ]
    models[known] /= np.sqrt(alike(setting.signals, setting.damped))
    return np.array([*models, *own, *[FREE] * len(setting.faults)])


def alike(signals: Sequence[Signal], modes: int) -> float:
    """Over how many rows what is known of a model has to be counted once: in their noise they are
    independent, in what a sound model leaves as many say the same as there are rows for each
    independent figure (`independent`)."""
    figures, rows = independent(signals, modes)
    if not rows:
        return 1.0
    noise = np.concatenate([(s.std**2 / s.scale() ** 2).reshape(-1) for s in signals])
    part = float(np.mean(np.minimum(noise, 1.0)))
    return part + (1.0 - part) * rows / max(1.0, figures)
