"""Terms of a shell element in space: bending, membrane and mass from its local axes to those of the
model, through the rigid links that warping and an offset are."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from cvxupdate.fe.shells.bending import bending_terms
from cvxupdate.fe.shells.frames import Frame, frames
from cvxupdate.fe.shells.inertia import deflection_mass, membrane_mass, rotary_mass
from cvxupdate.fe.shells.membrane import membrane_terms
from cvxupdate.fe.terms import Real, Term, rotate

BENDING, MEMBRANE = (2, 3, 4), (0, 1, 5)
"""Places of (w, θx, θy) and of (u, v, θz) among the local DOFs of a node."""


def shell_terms(
    xyz: Real,
    orientation: Real,
    lumped: bool,
    rotary_inertia: bool,
    eccentric: bool,
    kinds: tuple[int, ...],
) -> Iterator[Term]:
    """All terms, (e, n d, n d), in global axes, on the d ``kinds`` of DOF (0 to 5: x to rz) of each
    node.

    The sheet is flat, in the mean plane of its nodes; a node that lies h below it moves it by a
    rigid link, u + h θy, v − h θx, so that a rigid-body motion of a warped element strains nothing.
    An offset e adds to h; membrane matrices are quadratic in it: terms ``….1`` and ``….2`` go with
    e and e², and are there where ``eccentric``.

    Raises
    ------
    ModelError
        For an element that is no sheet (`frames`).
    """
    frame = frames(xyz, orientation)
    n = xyz.shape[1]

    def spread(values: Real, places: tuple[int, ...]) -> Real:
        out = np.zeros((len(xyz), n, 6, n, 6))
        split = values.reshape(-1, n, 3, n, 3)
        for a, to in enumerate(places):
            for b, other in enumerate(places):
                out[:, :, to, :, other] = split[:, :, a, :, b]
        return out.reshape(-1, 6 * n, 6 * n)

    kept = [6 * node + kind for node in range(n) for kind in kinds]

    def turned(local: Real) -> Real:
        whole = rotate(local, frame.triads, 2 * n)
        return whole if len(kinds) == 6 else whole[:, kept][:, :, kept]

    for name, values in bending_terms(frame.plane).items():
        yield Term("K", name, turned(spread(values, BENDING)))
    if rotary_inertia:
        yield Term("M", "rhoI", turned(spread(rotary_mass(frame.plane, lumped), BENDING)))
    across = spread(deflection_mass(frame.plane, lumped), BENDING)
    along = {("K", name): v for name, v in membrane_terms(frame.plane).items()}
    along["M", "rhoh"] = membrane_mass(frame.plane, lumped)
    for (matrix, name), values in along.items():
        for power, part in enumerate(_linked(spread(values, MEMBRANE), frame, eccentric)):
            whole = part + across if matrix == "M" and power == 0 else part
            yield Term(matrix, f"{name}.{power}" if power else name, turned(whole))


def _linked(values: Real, frame: Frame, eccentric: bool) -> Iterator[Real]:
    """Membrane matrices seen from nodes ``height`` above the sheet: the powers of an offset."""
    warped = np.any(frame.height != 0.0)
    at_nodes = values
    if warped:
        left = values + _lever(values, -frame.height)
        at_nodes = left + _lever(left.transpose(0, 2, 1), -frame.height).transpose(0, 2, 1)
    yield at_nodes
    if eccentric:
        one = np.ones_like(frame.height)
        once = _lever(values, one).transpose(0, 2, 1)
        cross = once + _lever(once, -frame.height) if warped else once
        yield cross + cross.transpose(0, 2, 1)
        yield _lever(once, one)


def _lever(values: Real, height: Real) -> Real:
    """What the rows of (u, v) do to those of (θy, −θx) of nodes that far from the sheet: Sᵀ k."""
    e, d, _ = values.shape
    rows = values.reshape(e, d // 6, 6, d)
    out = np.zeros_like(rows)
    out[:, :, 4] = height[:, :, None] * rows[:, :, 0]
    out[:, :, 3] = -height[:, :, None] * rows[:, :, 1]
    return out.reshape(e, d, d)
