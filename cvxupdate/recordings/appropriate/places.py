"""Where to put the exciters, from a model's modes."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.types import Real


@dataclass(frozen=True)
class ExciterPlaces:
    """Chosen places and what they can do.

    ``columns`` (count,) of the shapes, ascending; ``strength`` the smallest singular value of the
    chosen modal forces over the largest that any single place gives; ``forces`` (modes, count) of
    unit length that drive each mode and, where there are as many exciters as modes, no other of
    them; ``purity`` (modes,) fraction of the modal force in the wanted mode.
    """

    columns: tuple[int, ...]
    strength: float
    forces: Real
    purity: Real


def _strength(shapes: Real, columns: list[int]) -> float:
    return float(np.linalg.svd(shapes[:, columns], compute_uv=False)[-1])


def exciter_places(
    shapes: Real, count: int, *, candidates: tuple[int, ...] | None = None
) -> ExciterPlaces:
    """Choose ``count`` places whose forces separate the modes best.

    ``shapes`` (modes, channels) of the model, mass-normalised; ``candidates`` the columns that an
    exciter can reach (default all). The smallest singular value of the modal forces ``shapes[:,
    places]`` is made as large as possible: the worst combination of modes is still driven (or the
    worst combination of forces still drives). Greedy choice, then exchanges until none helps, in
    the spirit of Holmes & Cooper (1996). Assumes that the model's shapes are near the structure's.

    Raises
    ------
    RecordingError
        When there are fewer candidates than exciters.
    """
    free = list(range(shapes.shape[1])) if candidates is None else list(candidates)
    if not 1 <= count <= len(free):
        raise RecordingError(
            f"{count} exciters cannot be placed on {len(free)} candidate degrees of freedom"
        )
    chosen: list[int] = []
    for _ in range(count):
        chosen.append(
            max((c for c in free if c not in chosen), key=lambda c: _strength(shapes, [*chosen, c]))
        )
    best, improved = _strength(shapes, chosen), True
    while improved:
        improved = False
        for place in range(count):
            for c in free:
                trial = [*chosen[:place], c, *chosen[place + 1 :]]
                if c not in chosen and _strength(shapes, trial) > best * (1.0 + 1e-9):
                    chosen, best, improved = trial, _strength(shapes, trial), True
    chosen = sorted(chosen)
    B = shapes[:, chosen]
    forces = np.linalg.pinv(B).T
    forces = forces / np.linalg.norm(forces, axis=1, keepdims=True)
    modal = forces @ B.T
    purity = np.diag(modal) ** 2 / np.sum(modal**2, axis=1)
    single = max(float(np.linalg.norm(shapes[:, c])) for c in free)
    return ExciterPlaces(tuple(chosen), best / single, forces, np.asarray(purity))
