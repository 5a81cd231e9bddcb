"""FRFs from the arrays of a container (MAT, HDF5, NPZ)."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.read.contents import Contents
from cvxupdate.recordings.read.frf_parts import FrfParts
from cvxupdate.recordings.read.wanted import Names, Wanted, channel_of, real_values, values_of
from cvxupdate.recordings.types import DOF_KINDS, Channel, Complex, Real


def _dofs(contents: Contents, names: Names, who: str) -> list[tuple[int, str]]:
    """Nodes and DOFs from ``<who>_node`` and ``<who>_dof`` (1 to 6 = x to rz)."""
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


def frf_of_arrays(
    contents: Contents,
    wanted: Sequence[Wanted],
    references: Sequence[Channel],
    kind: str,
    names: Names,
) -> FrfParts:
    """Arrays ``frequency``, ``H`` (frequency, response, reference), ``coherence`` and the DOFs of
    both ends. Raises `RecordingError` where their shapes do not agree."""
    where = contents.file
    H = contents.arrays[names["H"]]
    if H.dtype.kind not in "biufc":
        raise RecordingError(f"{where}: H does not hold numbers.")
    axis = real_values(values_of(contents, names, "frequency"), f"{where}: frequency")
    H = H.reshape((*H.shape, *(1,) * (3 - H.ndim))) if 0 < H.ndim < 3 else H
    forces = tuple(references) or tuple(
        Channel(node, dof, "force") for node, dof in _dofs(contents, names, "reference")
    )
    if wanted:
        chosen = _chosen(wanted, H.shape, where)
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
    coherence = _coherence(contents, names, H.shape, chosen)
    return FrfParts(axis, np.asarray(H, dtype=complex) * scale, coherence, channels, forces, kind)


def _chosen(wanted: Sequence[Wanted], shape: tuple[int, ...], where: str) -> list[int]:
    """The responses that the declared channels pick out of H."""
    chosen = []
    for want in wanted:
        if isinstance(want.column, str) or len(shape) != 3 or not 0 <= want.column < shape[1]:
            raise RecordingError(f"{where}: {want.label}: no such response in H of shape {shape}.")
        chosen.append(want.column)
    return chosen


def _coherence(
    contents: Contents, names: Names, shape: tuple[int, ...], chosen: Sequence[int]
) -> Real | None:
    """The array ``coherence`` with the shape of H, NaN where it has no entry for a response."""
    given = contents.arrays.get(names["coherence"])
    if given is None:
        return None
    coherence = real_values(given, f"{contents.file}: coherence")
    if coherence.ndim == 2:
        coherence = np.repeat(coherence[:, :, None], shape[2], axis=2)
    if (
        coherence.ndim != 3
        or coherence.shape[0] != shape[0]
        or coherence.shape[2] != shape[2]
        or not (coherence.shape[1] > max(chosen) or coherence.shape[1] <= shape[1])
    ):
        raise RecordingError(
            f"{contents.file}: coherence has shape {coherence.shape}, H {shape}. Its axes are "
            "the same; it may stop after the first responses."
        )
    full = np.full(shape, np.nan)
    for place, column in enumerate(chosen):
        if column < coherence.shape[1]:
            full[:, place, :] = coherence[:, column, :]
    return full


def stated_variance(
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
