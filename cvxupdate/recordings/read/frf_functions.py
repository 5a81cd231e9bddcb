"""FRFs from the functions of a universal file; node and direction from the headers."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents, Function
from cvxupdate.recordings.read.frf_declared import declared
from cvxupdate.recordings.read.frf_parts import FrfParts, distinct
from cvxupdate.recordings.read.wanted import Wanted
from cvxupdate.recordings.types import Channel, Complex, Real

_FRF, _COHERENCE = 4, 6
_Point = tuple[int, str]


def _axis(f: Function) -> Real:
    if f.abscissa is not None:
        return np.asarray(f.abscissa, dtype=float)
    return np.asarray(f.start + f.step * np.arange(f.values.shape[0]), dtype=np.float64)


def _ends(f: Function) -> tuple[_Point, _Point]:
    return (f.response.node, f.response.dof), (f.reference.node, f.reference.dof)


def _quantity_of(functions: list[Function], quantity: str | None, where: str) -> str:
    """The quantity of the responses, as given or as the file states it."""
    stated = {f.quantity for f in functions} - {"unknown"}
    if len(stated) > 1:
        raise RecordingError(
            f"{where}: its FRFs are of several quantities ({', '.join(sorted(stated))}). Give "
            "them in separate files."
        )
    kind = quantity or (next(iter(stated)) if stated else None)
    if kind is None:
        raise RecordingError(
            f"{where}: the file does not state the quantity of its FRFs. Give response = "
            '"acceleration" (or velocity, displacement).'
        )
    if stated and kind not in stated:
        raise RecordingError(
            f"{where}: response = {kind!r}, but the file states {stated.pop()}. Correct the one "
            "that is wrong."
        )
    return kind


def _checked(contents: Contents, placed: bool, driven: bool) -> list[Function]:
    """The FRFs of the file, each with a direction at both ends, unless the problem file says where
    its responses are (``placed``) and its references (``driven``)."""
    where = contents.file
    functions = [f for f in contents.functions if f.kind == _FRF]
    if not functions:
        kinds = sorted({f.kind for f in contents.functions})
        raise RecordingError(
            f"{where}: no FRF (function type 4) in this file, only types {kinds}. A time history "
            '(type 1) needs kind = "time".'
        )
    for f in (*functions, *(f for f in contents.functions if f.kind == _COHERENCE)):
        if not (f.response.dof or placed) or not (f.reference.dof or driven):
            raise RecordingError(
                f"{where}: the FRF of node {f.response.node} has no direction. Export it with "
                "directions, or declare channels and references."
            )
    return functions


def frf_of_functions(
    contents: Contents,
    quantity: str | None,
    wanted: Sequence[Wanted] = (),
    references: Sequence[Channel] = (),
) -> FrfParts:
    """Function types 4 (FRF) and 6 (coherence).

    ``wanted`` and ``references``, where given, say which responses of the file (``column``: in the
    order in which they appear, the first is 0) are used and where they are, and where the file's
    references are, in their order. Raises `RecordingError` where the functions do not form one
    complete matrix on one frequency axis, or where what is declared does not go with them.
    """
    where, functions = contents.file, _checked(contents, bool(wanted), bool(references))
    kind = _quantity_of(functions, quantity, where)
    axis = _axis(functions[0])
    responses = distinct([_ends(f)[0] for f in functions])
    inputs = distinct([_ends(f)[1] for f in functions])
    H: Complex = np.full((axis.size, len(responses), len(inputs)), np.nan, dtype=complex)
    coherence = np.full(H.shape, np.nan)
    scales: dict[_Point, tuple[float, str]] = {}
    seen: set[tuple[int, int]] = set()
    for f in contents.functions:
        response, reference = _ends(f)
        if f.kind not in (_FRF, _COHERENCE) or response not in responses or reference not in inputs:
            continue
        r, s = responses.index(response), inputs.index(reference)
        _same_axis(f, axis, where)
        if f.kind == _COHERENCE:
            coherence[:, r, s] = np.real(f.values)
            continue
        if (r, s) in seen:
            raise RecordingError(f"{where}: the FRF {_label(f)} appears twice. Keep one.")
        seen.add((r, s))
        scales.setdefault(response, (f.scale * f.response.sign, f.unit))
        with np.errstate(invalid="ignore"):  # a damaged file may hold ∞, which is said later
            H[:, r, s] = np.asarray(f.values) * (f.scale * f.response.sign * f.reference.sign)
    _all_there(seen, responses, inputs, where)
    parts = FrfParts(
        axis,
        H,
        None if np.all(np.isnan(coherence)) else coherence,
        tuple(Channel(*at, kind, scales[at][1], scales[at][0]) for at in responses),
        tuple(Channel(*at, "force") for at in inputs),
        kind,
    )
    return declared(parts, contents, wanted, references)


def _label(f: Function) -> str:
    return f"n{f.response.node}.{f.response.dof} / n{f.reference.node}.{f.reference.dof}"


def _same_axis(f: Function, axis: Real, where: str) -> None:
    if f.values.shape[0] != axis.size or not np.allclose(_axis(f), axis, rtol=1e-6, atol=0.0):
        raise RecordingError(
            f"{where}: the functions do not share one frequency axis "
            f"(n{f.response.node}.{f.response.dof} has {f.values.shape[0]} lines, the first "
            f"{axis.size}). Export them together."
        )


def _all_there(
    seen: set[tuple[int, int]], responses: list[_Point], references: list[_Point], where: str
) -> None:
    missing = [
        (r, s) for r in range(len(responses)) for s in range(len(references)) if (r, s) not in seen
    ]
    if missing:
        (node, dof), (rnode, rdof) = responses[missing[0][0]], references[missing[0][1]]
        raise RecordingError(
            f"{where}: the FRF n{node}.{dof} / n{rnode}.{rdof} is missing ({len(missing)} in "
            "all): every response is needed for every reference. Put the references into "
            "separate recordings."
        )
