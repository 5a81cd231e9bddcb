"""Exact members in a diagnosis: divided until no natural frequency of the band is off.

The diagnosis works in modes and static corrections, so it needs K and M. Exact members are given
them by division, in as many parts as the band asks for; how far that is enough is known, because
the natural frequencies of the exact members are (`fe.exact.modes`).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

import numpy as np

from cvxupdate.diagnose.nominal.scatter import MEMBER
from cvxupdate.diagnose.settings import EXACT_MESH
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import Refined, refined
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import LineBlock, text_of

TRIED = (2, 4, 8, 16, 32)


@dataclass(frozen=True)
class Divided:
    """The problem with beams in place of exact members, each in ``parts`` of a ``mesh``; ``off`` is
    the largest relative error of a natural frequency up to the end of the band."""

    spec: Spec
    model: Model
    mesh: Refined
    parts: int
    off: float

    @property
    def says(self) -> str:
        """One line of evidence."""
        return (
            f"Every exact member was divided into {self.parts} beams for the diagnosis: no natural "
            f"frequency of the band is off by more than {100 * self.off:.2g} % against the exact "
            "members."
        )


def divided(spec: Spec, model: Model, recordings: Sequence[Recording]) -> Divided | None:
    """The problem without exact members; None where it has none.

    Raises
    ------
    InputError
        Where 32 parts are not enough.
    """
    if not model.exact:
        return None
    top = max((_top(r) for r in recordings), default=0.0)
    count = 8
    while True:
        exact = model_modes(model, count).flexible().frequencies
        if exact[-1] > top:
            break
        count *= 2
    exact = exact[exact <= top] if np.any(exact <= top) else exact[:1]
    blocks = tuple(_beams(block) for block in spec.model.elements)
    plain = spec.model.model_copy(update={"elements": blocks})
    kinds = {id(block) for block in blocks if _was_exact(spec, block)}
    for parts in TRIED:
        mesh = refined(plain, partial(_parts, kinds, parts), renumber=True)
        now = replace(spec, model=mesh.model, update=None)
        beams = build_model(now)
        found = model_modes(beams, len(exact)).flexible().frequencies
        off = float(np.abs(found / exact - 1.0).max())
        if off <= EXACT_MESH:
            return Divided(now, beams, mesh, parts, off)
    raise InputError(
        f"{spec.path}: the band to {top:.5g} Hz asks for more than {TRIED[-1]} parts of each exact "
        "member. Give the recordings a `band` that ends lower, or put nodes inside the members."
    )


def _parts(kinds: set[int], parts: int, block: Any, row: Any) -> int:
    return parts if id(block) in kinds else 1


def _top(recording: Recording) -> float:
    """The highest frequency that a recording tells of, Hz."""
    if isinstance(recording, FrequencyResponse | ModeTable):
        return float(np.max(recording.frequency))
    return float(recording.rate) / 2.0 if isinstance(recording, TimeHistory) else 0.0


def _was_exact(spec: Spec, block: Any) -> bool:
    ids = {row.id for row in block.rows}
    return any(
        text_of(b).exact is not None and ids == {row.id for row in b.rows}
        for b in spec.model.elements
    )


def _beams(block: Any) -> Any:
    """A block of exact members as beams; each that has no group is one by itself where effects are
    placed, but its numbers scatter with those of the others (`MEMBER`)."""
    if text_of(block).exact is None:
        return block
    rows = tuple(
        row if row.group is not None else row.model_copy(update={"group": f"{MEMBER}{row.id}"})
        for row in block.rows
    )
    return LineBlock(
        type="beam3d",
        rows=rows,
        rotary_inertia=block.rotary_inertia,
        polar_inertia=block.polar_inertia,
        material=block.material,
        section=block.section,
        orientation=block.orientation,
        group=block.group,
    )
