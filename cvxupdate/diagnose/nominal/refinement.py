"""What the mesh of the file is worth, and the model that is diagnosed in its place: refined until
what its mesh leaves in the band is below the noise of the recordings.

A diagnosis must not mistake the discretisation of the analyst's model for missing physics. So it
works on the file's elements with the matrices of their parts (`cvxupdate.fe.analysis`): places,
parameters and sensors stay, the mesh's error goes, in frequencies and in shapes.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import numpy as np

from cvxupdate.diagnose.nominal.families import needed, with_loose
from cvxupdate.diagnose.nominal.families import shift_between as shift_between
from cvxupdate.diagnose.nominal.points import Held, giving, on_points, points_of
from cvxupdate.diagnose.nominal.theory import POINT, SHEAR, SIZES, stocky, theory_of
from cvxupdate.diagnose.settings import (
    FRAME_TYPES,
    MESH_PARTS,
    MESH_TOLD,
    SHEET_TYPES,
    SOUND_THEORY,
)
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.analysis import Analysis, analysis_of, as_stated
from cvxupdate.fe.analysis.corners import corner_nodes
from cvxupdate.fe.analysis.piece import Piece
from cvxupdate.fe.model import Model
from cvxupdate.physics.units import number
from cvxupdate.spec import Spec

LARGEST = 5000  # DOFs of a file's model that is refined: a larger one is fine enough
MISSED = 0.25  # of what extrapolation takes out: errors of the next order, halved once more
ORDERS = (1.0, 6.0)  # of convergence that a mesh may show


@dataclass(frozen=True)
class Mesh:
    """``analysis`` what stands for the elements of the file (None: nothing can be divided);
    ``shift`` the largest relative error of a natural frequency in the band by the file's mesh,
    ``error`` what that mesh alone leaves of the responses; ``left`` what the finer one does;
    ``advised`` the parts of each edge with which the file's own elements would do; ``theory`` what
    the theory of its beams may leave out (`cvxupdate.diagnose.nominal.theory`); ``stocky``: beams
    are too short for theory to leave shear out; ``points`` hold sheets, which give way there."""

    analysis: Analysis | None = None
    shift: float = 0.0
    error: float = 0.0
    left: float = 0.0
    advised: int = 1
    theory: tuple[str, ...] = ()
    stocky: bool = False
    points: tuple[Held, ...] = ()

    def on(self, file: Model) -> Model:
        """The model that is diagnosed."""
        return file if self.analysis is None else self.analysis.on(on_points(file, self.points))

    @property
    def finer(self) -> bool:
        """Than the file's own."""
        return self.analysis is not None

    @property
    def told(self) -> int | None:
        """Its parts of an edge, where the mesh of the file is worth a word."""
        return self.analysis.parts if self.analysis and self.shift > MESH_TOLD else None


PLAIN = Mesh()
"""The file's own."""

Difference = Callable[[Model, Model], float]


@dataclass(frozen=True)
class Wanted:
    """What a mesh must do: frequencies up to ``top`` (Hz) to a relative ``precision``, and of what
    ``differ`` says of a model beside a better one no more than ``enough``; ``sheared``: beams may
    turn out to deform in shear."""

    top: float
    precision: float
    enough: float
    differ: Difference
    sheared: bool = False


def fine_enough(spec: Spec, file: Model, wanted: Wanted) -> Mesh:
    """The mesh for the model of a ``file``, undamped: with the first of `MESH_PARTS`, judged by
    what extrapolation took out there; where that is too much, with more, judged by the difference
    that they make."""
    if file.size > LARGEST:
        return PLAIN
    pieces: dict[int, list[Piece]] = {}
    try:
        found = analysis_of(spec, file, MESH_PARTS[0], True, pieces)
        if found is None:
            return PLAIN
        plain, model = _before(spec, file, found), found.on(file)
        rest = shift_between(plain, model, wanted.top)
        left = MISSED * wanted.differ(plain, model)
        for parts in MESH_PARTS[1:]:
            if left <= wanted.enough:
                break
            finer = analysis_of(spec, file, parts, True, pieces)
            if finer is None:
                break
            left = wanted.differ(model, finer.on(file))
            found, model = finer, finer.on(file)
        shift_of = partial(shift_between, top=wanted.top)
        theory = theory_of(model, wanted.differ, shift_of, wanted.enough, SOUND_THEORY)
        short = stocky(model, shift_of, SOUND_THEORY)
        chosen = needed(
            found,
            with_loose(spec, file, found),
            wanted.top,
            wanted.precision,
            wanted.sheared or SHEAR in theory,
        )
        model = chosen.on(file)
        points = _points(file, chosen, wanted)
        theory = (*theory, POINT) if points else theory
        own = as_stated(spec, file)
        shift, error = shift_between(own, model, wanted.top), wanted.differ(own, model)
    except CvxupdateError:
        return PLAIN
    advice = _advised(shift, rest, MESH_PARTS[0])
    return Mesh(chosen, shift, error, left, advice, theory, short, points)


def _points(file: Model, mesh: Analysis, wanted: Wanted) -> tuple[Held, ...]:
    """Points that hold sheets, where it is heard that these give way there."""
    points = points_of(file)
    if not points:
        return ()
    softer = giving(mesh.on(on_points(file, points)), SIZES[POINT][1])
    return points if wanted.differ(mesh.on(file), softer) > wanted.enough else ()


def with_theory_of(file: Model, wanted: Wanted) -> Mesh:
    """The file's own mesh, with what the theory of its beams may leave out."""
    if file.size > LARGEST:
        return PLAIN
    try:
        shift_of = partial(shift_between, top=wanted.top)
        theory = theory_of(file, wanted.differ, shift_of, wanted.enough, SOUND_THEORY)
        return Mesh(theory=theory, stocky=stocky(file, shift_of, SOUND_THEORY))
    except CvxupdateError:
        return PLAIN


def _before(spec: Spec, file: Model, found: Analysis) -> Model:
    """What tells how far a mesh is from the limit: its elements before they were extrapolated, or
    those of half as many parts, where lines are all and nothing is extrapolated."""
    coarse = None if has_sheets(file) else analysis_of(spec, file, found.parts // 2, solid=True)
    return found.plain.on(file) if coarse is None else coarse.on(file)


def wants_finer(model: Model, simulated: bool) -> bool:
    """Whether it has sheets, or is a plane frame whose beams meet at an angle, where they overlap;
    ``simulated``: in a simulation over time, where DOFs cost, only sheets count."""
    plane = any(b.kind.name in FRAME_TYPES for b in model.blocks)
    return has_sheets(model) or (not simulated and plane and bool(corner_nodes(model)))


def has_sheets(model: Model) -> bool:
    """Whether it has any, whose theory leaves something."""
    return any(b.kind.name in SHEET_TYPES for b in model.blocks)


def _advised(shift: float, rest: float, parts: int) -> int:
    """Parts of an edge that bring a ``shift`` below `MESH_TOLD`, where so many ``parts`` leave
    ``rest``."""
    if shift <= MESH_TOLD:
        return 1
    order = float(np.clip(np.log(shift / max(rest, 1e-12)) / np.log(parts), *ORDERS))
    return int(np.ceil((shift / MESH_TOLD) ** (1.0 / order)))


def mesh_notes(mesh: Mesh) -> tuple[str, ...]:
    """For the file of the diagnosed model."""
    if mesh.told is None:
        return ()
    return (
        f"[model] refine = {mesh.told}: the model is taken on finer parts of its elements, as it "
        f"was diagnosed. Their own mesh would shift frequencies by up to {100 * mesh.shift:.2g} %.",
    )


def mesh_lines(mesh: Mesh, responses: bool = True) -> list[str]:
    """What the mesh of the file is worth, and which would do, where that is worth a line;
    ``responses``: what it leaves is told of them, else of natural frequencies alone."""
    if mesh.told is None:
        return []
    leaves = (
        f" and alone makes an error of {number(100 * mesh.error, 2)} % of the response"
        if responses
        else ""
    )
    rest = f"{mesh.left:.1g}" if responses else f"{100 * mesh.left:.1g} % of them"
    return [
        f"The mesh of the file shifts natural frequencies by up to {100 * mesh.shift:.2g} %"
        f"{leaves}; the diagnosis worked on the same "
        f"elements with the matrices of finer parts, whose mesh leaves {rest}. With every "
        f"edge in {mesh.advised} the file's own elements would be within "
        f"{100 * MESH_TOLD:.1g} % of the frequencies."
    ]
