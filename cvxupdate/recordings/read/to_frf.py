"""From a file's contents to frequency response functions."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Function
from cvxupdate.recordings.read.variance import variance_of_frf
from cvxupdate.recordings.read.wanted import (
    FORMS,
    Names,
    Wanted,
    channel_of,
    real_values,
    stated_unit,
    values_of,
)
from cvxupdate.recordings.types import DOF_KINDS, Channel, Complex, FrequencyResponse, Origin, Real
from cvxupdate.recordings.units import parse_unit

MOTIONS = ("displacement", "velocity", "acceleration")
_Parts = tuple[Real, Complex, Real | None, tuple[Channel, ...], tuple[Channel, ...], str]


def _grid(points: Sequence[tuple[int, str]]) -> list[tuple[int, str]]:
    return list(dict.fromkeys(points))


def _axis(f: Function) -> Real:
    if f.abscissa is not None:
        return np.asarray(f.abscissa, dtype=float)
    return np.asarray(f.start + f.step * np.arange(f.values.shape[0]), dtype=np.float64)


def _from_functions(contents: Contents, quantity: str | None) -> _Parts:
    """Function types 4 (FRF) and 6 (coherence) of a universal file; node and direction from the
    headers."""
    where = contents.file
    functions = [f for f in contents.functions if f.kind == 4]
    if not functions:
        kinds = sorted({f.kind for f in contents.functions})
        raise RecordingError(
            f"{where}: it holds no FRF (function type 4), only types {kinds}. A time history "
            '(type 1) needs kind = "time".'
        )
    for f in (*functions, *(f for f in contents.functions if f.kind == 6)):
        if not f.response.dof or not f.reference.dof:
            raise RecordingError(
                f"{where}: the FRF of node {f.response.node} does not say its direction. "
                "Export it with directions."
            )
    stated = {f.quantity for f in functions} - {"unknown"}
    if len(stated) > 1:
        raise RecordingError(
            f"{where}: its FRFs are of several quantities ({', '.join(sorted(stated))}). Give "
            "them in separate files."
        )
    kind = quantity or (stated.pop() if stated else None)
    if kind is None:
        raise RecordingError(
            f"{where}: the file does not say what its FRFs are. Give response = "
            '"acceleration" (or velocity, displacement).'
        )
    if stated and kind not in stated:
        raise RecordingError(
            f"{where}: response = {kind!r}, but the file says {stated.pop()}. Correct the one "
            "that is wrong."
        )
    axis = _axis(functions[0])
    responses = _grid([(f.response.node, f.response.dof) for f in functions])
    references = _grid([(f.reference.node, f.reference.dof) for f in functions])
    H = np.full((axis.size, len(responses), len(references)), np.nan, dtype=complex)
    coherence = np.full(H.shape, np.nan)
    seen: set[tuple[int, int]] = set()
    scales: dict[tuple[int, str], tuple[float, str]] = {}
    for f in contents.functions:
        ends = (f.response.node, f.response.dof), (f.reference.node, f.reference.dof)
        if f.kind not in (4, 6) or ends[0] not in responses or ends[1] not in references:
            continue
        r, s = responses.index(ends[0]), references.index(ends[1])
        if f.values.shape[0] != axis.size or not np.allclose(_axis(f), axis, rtol=1e-6, atol=0.0):
            raise RecordingError(
                f"{where}: the functions do not have one frequency axis "
                f"(n{ends[0][0]}.{ends[0][1]} has {f.values.shape[0]} lines, the first "
                f"{axis.size}). Export them together."
            )
        if f.kind == 6:
            coherence[:, r, s] = np.real(f.values)
            continue
        if (r, s) in seen:
            raise RecordingError(
                f"{where}: the FRF n{ends[0][0]}.{ends[0][1]} / n{ends[1][0]}.{ends[1][1]} is "
                "there twice. Keep one."
            )
        seen.add((r, s))
        scales.setdefault(ends[0], (f.scale * f.response.sign, f.unit))
        H[:, r, s] = np.asarray(f.values) * (f.scale * f.response.sign * f.reference.sign)
    missing = [
        (r, s) for r in range(len(responses)) for s in range(len(references)) if (r, s) not in seen
    ]
    if missing:
        (node, dof), (rnode, rdof) = responses[missing[0][0]], references[missing[0][1]]
        raise RecordingError(
            f"{where}: the FRF n{node}.{dof} / n{rnode}.{rdof} is missing ({len(missing)} in "
            "all): every response must be there for every reference. Put the references into "
            "separate recordings."
        )
    channels = tuple(
        Channel(node, dof, kind, scales[(node, dof)][1], scales[(node, dof)][0])
        for node, dof in responses
    )
    forces = tuple(Channel(node, dof, "force") for node, dof in references)
    return axis, H, None if np.all(np.isnan(coherence)) else coherence, channels, forces, kind


def _dofs(contents: Contents, names: Names, who: str) -> list[tuple[int, str]]:
    """Nodes and DOFs from ``<who>_node`` and ``<who>_dof`` (1 to 6 = x to rz, negative allowed by
    no one)."""
    where = contents.file
    nodes, dofs = (contents.arrays.get(names[f"{who}_{part}"]) for part in ("node", "dof"))
    if nodes is None or dofs is None:
        raise RecordingError(
            f"{where}: the arrays {who}_node and {who}_dof are needed, or channels and "
            "references in the problem file."
        )
    nodes, dofs = np.atleast_1d(np.squeeze(nodes)), np.atleast_1d(np.squeeze(dofs))
    if nodes.ndim != 1 or nodes.shape != dofs.shape:
        raise RecordingError(
            f"{where}: {who}_node {nodes.shape} and {who}_dof {dofs.shape} do not agree. Give "
            "one DOF per node."
        )
    whole_nodes, whole_dofs = (
        real_values(nodes, f"{where}: {who}_node"),
        real_values(dofs, f"{where}: {who}_dof"),
    )
    if (
        np.any(whole_nodes != np.rint(whole_nodes))
        or not np.all(np.isin(whole_dofs, range(1, 7)))
        or np.any(whole_nodes < 0)
    ):
        raise RecordingError(
            f"{where}: {who}_node must be node numbers and {who}_dof 1 to 6 (x, y, z, rx, ry, rz)."
        )
    return [(int(n), DOF_KINDS[int(d) - 1]) for n, d in zip(whole_nodes, whole_dofs, strict=True)]


def _from_arrays(
    contents: Contents,
    wanted: Sequence[Wanted],
    references: Sequence[Channel],
    kind: str,
    names: Names,
) -> _Parts:
    """Arrays ``frequency``, ``H`` (frequency, response, reference), ``coherence`` and the DOFs of
    both ends."""
    where = contents.file
    H = contents.arrays[names["H"]]
    if H.dtype.kind not in "biufc":
        raise RecordingError(f"{where}: H does not hold numbers.")
    axis = real_values(values_of(contents, names, "frequency"), f"{where}: frequency")
    if H.ndim == 1:
        H = H[:, None]
    if H.ndim == 2:
        H = H[:, :, None]
    forces = tuple(references) or tuple(
        Channel(node, dof, "force") for node, dof in _dofs(contents, names, "reference")
    )
    if wanted:
        chosen = []
        for want in wanted:
            if isinstance(want.column, str) or H.ndim != 3 or not 0 <= want.column < H.shape[1]:
                raise RecordingError(
                    f"{where}: {want.label}: there is no such response in H of shape {H.shape}."
                )
            chosen.append(want.column)
        channels = tuple(channel_of(contents, want, "force") for want in wanted)
        H = H[:, chosen, :]
    else:
        channels = tuple(
            Channel(node, dof, kind) for node, dof in _dofs(contents, names, "response")
        )
        chosen = list(range(len(channels)))
    if H.shape != (axis.size, len(channels), len(forces)):
        raise RecordingError(
            f"{where}: H has shape {H.shape}, but there are {axis.size} frequencies, "
            f"{len(channels)} responses and {len(forces)} references. The axes of H are "
            "frequency, response, reference."
        )
    scale = np.array([channel.scale for channel in channels])[:, None]
    coherence = contents.arrays.get(names["coherence"])
    if coherence is not None:
        coherence = real_values(coherence, f"{where}: coherence")
        if coherence.ndim == 2:
            coherence = np.repeat(coherence[:, :, None], len(forces), axis=2)
        full = np.full(H.shape, np.nan)
        if (
            coherence.ndim != 3
            or coherence.shape[0] != axis.size
            or coherence.shape[2] != len(forces)
            or not (coherence.shape[1] > max(chosen) or coherence.shape[1] <= len(channels))
        ):
            raise RecordingError(
                f"{where}: coherence has shape {coherence.shape}, H {H.shape}. Its axes are "
                "the same; it may stop after the first responses."
            )
        for place, column in enumerate(chosen):
            if column < coherence.shape[1]:
                full[:, place, :] = coherence[:, column, :]
        coherence = full
    return axis, np.asarray(H, dtype=complex) * scale, coherence, channels, forces, kind


def _stated_variance(
    contents: Contents,
    wanted: Sequence[Wanted],
    H: Complex,
    channels: Sequence[Channel],
    names: Names,
) -> Real | None:
    """The array ``variance`` of a container that has ``H``, in SI, with the shape of ``H``; None
    where the file has none."""
    where = contents.file
    given = (
        contents.arrays.get(names["variance"])
        if names["H"] in contents.arrays and not contents.functions
        else None
    )
    if given is None:
        if "variance" in names.given:
            raise RecordingError(
                f"{where}: there is no array {names['variance']!r}. Correct "
                "variables.variance, or leave it out."
            )
        return None
    variance = real_values(given, f"{where}: variance")
    variance = (
        variance.reshape((*variance.shape, *(1,) * (3 - variance.ndim)))
        if variance.ndim < 3
        else variance
    )
    if (
        wanted
        and variance.ndim == 3
        and variance.shape[1] > max(int(want.column) for want in wanted)
    ):
        variance = variance[:, [int(want.column) for want in wanted], :]
    if variance.shape != H.shape:
        raise RecordingError(
            f"{where}: variance has shape {given.shape}, which is not that of H. Its axes are "
            "those of H: frequency, response, reference."
        )
    if not np.all(np.isfinite(variance)) or np.any(variance < 0.0):
        raise RecordingError(
            f"{where}: its variance has entries that are negative or not numbers. It is E|H - "
            "EH|² of each entry, in the unit of H squared."
        )
    return np.asarray(variance * np.array([channel.scale for channel in channels])[:, None] ** 2)


def _column_frf(contents: Contents, want: Wanted, names: Names) -> NDArray[np.complex128]:
    """One FRF from its columns: complex text, real and imaginary part, magnitude and phase, or
    decibel and phase."""
    where = f"{contents.file}: {want.label}"
    first = values_of(contents, names, want.column, want.index, want.label)
    if want.form not in FORMS:
        raise RecordingError(f"{where}: form {want.form!r} is not one of {', '.join(FORMS)}.")
    if want.form == "complex":
        if first.dtype.kind not in "biufc":
            raise RecordingError(f"{where}: it does not hold numbers.")
        return np.asarray(first, dtype=complex)
    real = real_values(first, where)
    if want.form == "magnitude-phase" and want.pair is None:
        return np.asarray(real, dtype=complex)
    if want.form == "db-phase" and want.pair is None:
        return np.asarray(10.0 ** (real / 20.0), dtype=complex)
    if want.pair is None:
        raise RecordingError(
            f"{where}: form {want.form!r} needs pair, the column of the imaginary part."
        )
    second = real_values(values_of(contents, names, want.pair, want.index, want.label), where)
    if second.shape != real.shape:
        raise RecordingError(f"{where}: its two columns have {real.size} and {second.size} lines.")
    if want.form == "real-imaginary":
        return np.asarray(real + 1j * second)
    unit = want.phase_unit or stated_unit(contents, want.pair) or "deg"
    magnitude = 10.0 ** (real / 20.0) if want.form == "db-phase" else real
    return np.asarray(magnitude * np.exp(1j * parse_unit(unit).factor * second))


def _from_columns(
    contents: Contents,
    wanted: Sequence[Wanted],
    references: Sequence[Channel],
    kind: str | None,
    frequency_column: int | str | None,
    names: Names,
) -> _Parts:
    where = contents.file
    if not wanted or not references:
        raise RecordingError(
            f"{where}: FRFs in columns need channels and references in the [[recordings]] block."
        )
    column = (
        frequency_column
        if frequency_column is not None
        else ("frequency" if names["frequency"] in contents.arrays else 0)
    )
    axis_values = values_of(contents, names, column)
    if axis_values.dtype.kind == "c" and np.all(axis_values.imag == 0):
        axis_values = axis_values.real
    axis = real_values(axis_values, f"{where}: frequency")
    places = _grid([(want.node, want.dof) for want in wanted])
    H = np.full((axis.size, len(places), len(references)), np.nan, dtype=complex)
    coherence = np.full(H.shape, np.nan)
    first: dict[tuple[int, str], Channel] = {}
    for want in wanted:
        if not 0 <= want.reference < len(references):
            raise RecordingError(
                f"{where}: {want.label}: there is no reference {want.reference}; "
                f"{len(references)} are declared."
            )
        channel = channel_of(contents, want, references[want.reference].quantity)
        first.setdefault((want.node, want.dof), channel)
        values = _column_frf(contents, want, names)
        if values.size != axis.size:
            raise RecordingError(
                f"{where}: {want.label}: {values.size} lines, but {axis.size} frequencies."
            )
        r = places.index((want.node, want.dof))
        if not np.isnan(H[0, r, want.reference]):
            raise RecordingError(f"{where}: {want.label} is declared twice for one reference.")
        H[:, r, want.reference] = values * channel.scale
        if want.coherence is not None:
            coherence[:, r, want.reference] = real_values(
                values_of(contents, names, want.coherence, want.index), f"{where}: coherence"
            )
    if kind is None:
        kinds = {want.quantity for want in wanted}
        if len(kinds) != 1:
            raise RecordingError(
                f"{where}: its responses are of several quantities "
                f"({', '.join(sorted(kinds))}). Give them apart."
            )
        kind = kinds.pop()
    for want in wanted:
        if want.quantity not in (kind, "unknown", "voltage"):
            raise RecordingError(
                f"{where}: {want.label}: response = {kind!r} says otherwise. Correct the one "
                "that is wrong."
            )
    channels = tuple(first[place] for place in places)
    return (
        axis,
        H,
        None if np.all(np.isnan(coherence)) else coherence,
        channels,
        tuple(references),
        kind,
    )


def frequency_response(
    contents: Contents,
    origin: Origin,
    *,
    quantity: str | None = None,
    wanted: Sequence[Wanted] = (),
    references: Sequence[Channel] = (),
    frequency_column: int | str | None = None,
    names: Names | None = None,
    averages: float | None = None,
) -> FrequencyResponse:
    """FRFs of a file in SI, with their variance (see `read.variance`).

    Three forms are read: functions of a universal file; arrays ``frequency``, ``H``, ``coherence``,
    ``variance``, ``response_node``, ``response_dof`` (1 to 6), ``reference_node``,
    ``reference_dof`` of a container (``variance`` E|H - EH|² in the file's unit squared, where the
    program that made them knows it: it is taken as it is); columns of a table, declared by
    ``wanted`` and ``references``. ``quantity`` of the responses; ``averages`` where it is known.
    The coherence kept with the recording is the least over the references (each is excited alone).
    Raises `RecordingError` naming file and channel.
    """
    where = contents.file
    names = names or Names()
    if contents.functions:
        axis, H, coherence, channels, forces, kind = _from_functions(contents, quantity)
    elif names["H"] in contents.arrays:
        axis, H, coherence, channels, forces, kind = _from_arrays(
            contents, wanted, references, quantity or "acceleration", names
        )
        if quantity is None:
            raise RecordingError(
                f'{where}: it does not say what its FRFs are. Give response = "acceleration" '
                "(or velocity, displacement)."
            )
    else:
        axis, H, coherence, channels, forces, kind = _from_columns(
            contents, wanted, references, quantity, frequency_column, names
        )
    if (
        axis.size < 2
        or not np.all(np.isfinite(axis))
        or np.any(np.diff(axis) <= 0.0)
        or axis[0] < 0.0
    ):
        raise RecordingError(
            f"{where}: its frequencies must be finite, not negative, and increase. Give the "
            "right frequency_column."
        )
    if coherence is not None and np.any((coherence < -1e-3) | (coherence > 1.001)):
        raise RecordingError(
            f"{where}: its coherence is not between 0 and 1. Name the right column or array."
        )
    variance = _stated_variance(contents, wanted, H, channels, names)
    if variance is None:
        variance, _ = variance_of_frf(
            H, None if coherence is None else np.clip(coherence, 0.0, 1.0), averages
        )
    least = None
    if coherence is not None:
        filled = np.where(np.isnan(coherence), np.inf, np.clip(coherence, 0.0, 1.0)).min(axis=2)
        least = np.where(np.isinf(filled), np.nan, filled)
    return FrequencyResponse(origin, axis, H, kind, channels, forces, variance, least)
