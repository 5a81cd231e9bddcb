"""Recorded frequency responses as the response function method needs them: receptances at chosen
lines, joined to the model, with deviations."""

from __future__ import annotations

from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import InputError, RecordingError
from cvxupdate.fe.block import Index
from cvxupdate.fe.elements.base import Real
from cvxupdate.fe.model import Model
from cvxupdate.recordings.types import FrequencyResponse

Field = NDArray[Any]
ASSUMED = 0.05  # relative deviation of an FRF whose recording says nothing: weights only
# share of the line's r.m.s. below which an entry is not believed to a given percentage:
# anti-resonances (thesis 3.5.5)
FLOOR = 0.1
POWER = {"displacement": 0, "velocity": 1, "acceleration": 2}


@dataclass(frozen=True)
class FrfData:
    """Receptances of one recording.

    ``frequency`` (f,) Hz; ``X`` (f, n, r) in m/N (real where it has no imaginary part); ``std`` the
    deviation √E|δ|² of each, same shape; ``responses`` (n,), ``references`` (r,) places among the
    free DOFs; ``relative_only``: the deviations are only weights; ``used`` (n, r) which functions
    count: one that is zero throughout is a decoupled direction of a simulation and says nothing.
    """

    name: str
    use: str
    frequency: Real
    X: Field
    std: Real
    responses: Index
    references: Index
    coherence: Real | None
    relative_only: bool
    used: NDArray[np.bool_]

    @property
    def real(self) -> bool:
        """Whether nothing in it is complex: an undamped simulation."""
        return not np.iscomplexobj(self.X)

    @property
    def places(self) -> tuple[Index, Index, Index]:
        """Every DOF that it has something at, each once, and where among them the responses and
        the references are."""
        both = np.concatenate([self.responses, self.references])
        every, where = np.unique(both, return_inverse=True)
        return every, where[: len(self.responses)], where[len(self.responses) :]

    def at(self, lines: Index) -> FrfData:
        """The same at some lines only."""
        cut = None if self.coherence is None else self.coherence[lines]
        return replace(
            self,
            frequency=self.frequency[lines],
            X=self.X[lines],
            std=self.std[lines],
            coherence=cut,
        )


def frf_data(recording: FrequencyResponse, model: Model, noise: float | None = None) -> FrfData:
    """A recording as receptances on the DOFs of ``model``; 0 Hz and channels at held DOFs are left
    out.

    ``noise``: relative standard deviation of every entry, instead of what the recording states.
    Where neither says anything 5 % is taken, as weights only. An entry below a tenth of its line's
    r.m.s. (over translations or rotations of that reference) has the deviation of that tenth.

    Raises
    ------
    RecordingError, InputError
        A channel that is not on the model, a reference that is no force, a quantity that is no
        motion, nothing left.
    """
    where = recording.origin.source
    _check(recording, model)
    rows = np.array([model.place.get(c.label, -1) for c in recording.responses], dtype=np.int64)
    columns = np.array([model.place.get(c.label, -1) for c in recording.references], dtype=np.int64)
    _, first = np.unique(rows, return_index=True)
    keep = np.array([i for i in sorted(first.tolist()) if rows[i] >= 0], dtype=np.int64)
    forced = np.flatnonzero(columns >= 0)
    lines = np.flatnonzero(recording.frequency > 0.0)
    if not len(keep) or not len(forced) or not len(lines):
        raise RecordingError(
            f"{where}: none of its channels moves in the model, or it has no line above 0 Hz. "
            "Check nodes, dofs and supports."
        )
    frequency = recording.frequency[lines]
    scale = (2j * np.pi * frequency[:, None, None]) ** -POWER[recording.quantity]
    some = np.ix_(lines, keep, forced)
    X: Field = recording.H[some] * scale
    if not np.any(X.imag):
        X = np.ascontiguousarray(X.real)
    stated = recording.variance if noise is None else None
    std = _deviation(
        X,
        model.dof_kind[rows[keep]] >= 3,
        noise,
        None if stated is None else np.sqrt(stated[some]) * np.abs(scale),
    )
    coherence = None if recording.coherence is None else recording.coherence[np.ix_(lines, keep)]
    return FrfData(
        recording.origin.name,
        recording.origin.use,
        frequency,
        X,
        std,
        rows[keep],
        columns[forced],
        coherence,
        noise is None and stated is None,
        np.any(X != 0.0, axis=0),
    )


def _check(recording: FrequencyResponse, model: Model) -> None:
    """Raise where the recording is no set of FRFs of the model."""
    where = recording.origin.source
    if recording.quantity not in POWER:
        raise InputError(
            f"{where}: method rfm needs FRFs of displacement, velocity or acceleration, not "
            f"{recording.quantity}. Give `response`."
        )
    for channel in recording.references:
        if channel.quantity != "force" or not channel.dof:
            raise InputError(
                f"{where}: reference {channel.label} is no force on the model, so its "
                "responses are not FRFs. Leave the recording out."
            )
    held = set(model.node_ids.tolist())
    for channel in (*recording.responses, *recording.references):
        if channel.node not in held:
            raise RecordingError(
                f"{where}: channel {channel.label} sits at node {channel.node}, which the "
                "model does not have."
            )


def _deviation(
    X: Field, rotations: NDArray[np.bool_], noise: float | None, stated: Real | None
) -> Real:
    """The deviation of every receptance (f, n, r): as ``stated``, or ``noise`` (5 % where nothing
    is known) of its size, at least of `FLOOR` of the line's r.m.s. over DOFs of one kind."""
    size = np.abs(X)
    least = np.zeros(size.shape)
    for kind in (False, True):
        mine = rotations == kind
        if np.any(mine):
            least[:, mine] = FLOOR * np.sqrt(np.mean(size[:, mine] ** 2, axis=1, keepdims=True))
    if stated is not None:
        std = np.maximum(stated, 1e-4 * np.maximum(size, least))
    else:
        std = (ASSUMED if noise is None else noise) * np.maximum(size, least)
    tiny = np.finfo(float).tiny ** 0.25
    return np.asarray(np.maximum(std, max(1e-9 * float(size.max(initial=0.0)), tiny)))
