"""A mesh of rods and beams too coarse for the recordings: what it explains of the mismatch, which
mesh would do, and the problem on that mesh, which is diagnosed instead.

Where the frequencies of the file are a few per cent off by the mesh alone they are extrapolated
(`cvxupdate.diagnose.nominal.mesh`); beyond that extrapolation misses more than a sound model may,
and shapes, which nothing extrapolates, are off as well. No effect can mend that, nor a factor on
any element (thesis 7.7.2B): the form of the elements is wrong.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from cvxupdate.correlate.response_error import stated_errors
from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.settings import (
    COARSE_MESH,
    EXACT_MESH,
    HALVED,
    MESH_TOLD,
    SHEET_TYPES,
)
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.internal import is_nonlinear
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import Refined, refined
from cvxupdate.recordings.measured import band_of
from cvxupdate.recordings.types import FrequencyResponse, ModeTable, Recording, TimeHistory
from cvxupdate.residual.modal import modal_residual
from cvxupdate.spec import Spec
from cvxupdate.spec.elements import LineBlock

DIVIDED = ("rod", "beam2d", "beam3d")
PARTS = (2, 4, 8, 16, 32)  # parts of every rod and beam
CONSISTENT: dict[str, dict[str, Any]] = {
    "rod": {"mass": "consistent"},
    "beam2d": {"mass": "consistent", "rotary_inertia": False},
}
MOST_DOFS = 1500  # DOFs of a divided model: one that is larger was not drawn in a few elements


@dataclass(frozen=True)
class Discretisation:
    """A mesh that is too coarse beside one that does, which has every element in ``parts`` (and
    consistent masses, where the file has ``lumped`` ones): ``shift`` the largest relative error of
    a natural frequency in the band by the file's mesh, ``left`` by the other, where it is known;
    ``errors`` of the responses (or of the frequencies of tables, as ``of`` says) to fit, of the
    file and of the other, before anything is fitted; ``alone`` what the file's mesh leaves of the
    responses by itself, and the noise, where known."""

    parts: int
    lumped: bool
    shift: float
    left: float | None
    errors: tuple[float, float]
    alone: tuple[float, float] | None = None
    of: str = "responses"

    @property
    def mesh(self) -> str:
        """The better mesh in words."""
        each = f"every element in {self.parts}"
        return f"{each} along each edge and consistent masses" if self.lumped else each

    def to_json(self) -> dict[str, Any]:
        """The entry ``discretisation`` of ``diagnosis.json``."""
        return {
            "parts": self.parts,
            "consistent_mass": self.lumped,
            "frequency_error": self.shift,
            "frequency_error_left": self.left,
            "fit": {"before": self.errors[0], "after": self.errors[1]},
        }

    @property
    def explains(self) -> bool:
        """Whether the mesh alone makes most of what the file leaves, above noise."""
        most = HALVED * self.errors[0]
        if self.alone is not None:
            return self.shift > MESH_TOLD and self.alone[0] >= max(most, self.alone[1])
        return self.shift > MESH_TOLD and self.errors[1] <= most

    @property
    def verdict(self) -> str:
        """Where nothing else is missing."""
        return (
            "No physics is missing: the mesh is too coarse. The model explains the recordings "
            f"within noise and the usual scatter of its parameters with {self.mesh} "
            f"({self.errors[0]:.2g} of the {self.of} are off with the mesh of the file, "
            f"{self.errors[1]:.2g} with that, before anything is fitted). Divide the elements; or, "
            'where the DOFs have to stay, update their matrices with of = "generic".'
        )


@dataclass(frozen=True)
class Coarse:
    """The problem of a ``file`` with every rod and beam divided, its ``mesh``, and what that is
    worth."""

    spec: Spec
    model: Model
    mesh: Refined
    file: Model
    told: Discretisation

    @property
    def says(self) -> str:
        """One line of evidence."""
        t = self.told
        return (
            f"The mesh of the file is too coarse for these recordings: it alone puts natural "
            f"frequencies of the band up to {100 * t.shift:.2g} % off. The diagnosis worked on the "
            f"same model with {t.mesh} (up to {100 * (t.left or 0.0):.1g} % off), which leaves "
            f"{t.errors[1]:.2g} of the {t.of} before anything is fitted, where the file leaves "
            f"{t.errors[0]:.2g}. The first part of an element keeps its number; numbers above "
            "those of the file are of its other parts and of the nodes between them."
        )


def too_coarse(spec: Spec, file: Model, recordings: Sequence[Recording]) -> Coarse | None:
    """The problem on a mesh that does, where that of its rods and beams is too coarse for the band
    of its responses, or of its tables where there are no responses to fit; None where it is not, or
    another way deals with it."""
    kinds = {b.kind.name for b in file.blocks}
    fitted = [r for r in recordings if r.origin.use == "fit"]
    responses = [r for r in fitted if isinstance(r, FrequencyResponse | TimeHistory)]
    fitted = [*responses] or fitted
    if (
        not kinds & set(DIVIDED)
        or kinds & set(SHEET_TYPES)
        or spec.model.families
        or not fitted
        or is_nonlinear(file)
    ):
        return None
    try:
        return _divided(spec, file, fitted, max(_top(r) for r in fitted))
    except CvxupdateError:
        return None


def _top(recording: Recording) -> float:
    """The highest frequency that is fitted, Hz."""
    if isinstance(recording, FrequencyResponse):
        return float(recording.frequency.max())
    if isinstance(recording, TimeHistory):
        return band_of(recording)[1]
    return float(recording.frequency.max()) if isinstance(recording, ModeTable) else 0.0


def _divided(spec: Spec, file: Model, fitted: Sequence[Recording], top: float) -> Coarse | None:
    bare = file.with_parameters(())
    own = _frequencies(bare, top)
    finer = _finer(spec, PARTS[0])
    shift = _off(own, _frequencies(finer[1], top))
    if shift <= COARSE_MESH:
        return None
    for parts in PARTS[:-1]:
        now, best = finer, _finer(spec, 2 * parts)
        if best[1].size > MOST_DOFS:
            return None
        sharp = _frequencies(best[1], top)
        left = _off(_frequencies(now[1], top), sharp)
        if left <= EXACT_MESH:
            shift = _off(own, sharp)
            errors = _error(file, fitted), _error(now[1], fitted)
            of = "frequencies" if isinstance(fitted[0], ModeTable) else "responses"
            told = Discretisation(parts, _lumped(spec), shift, left, errors, of=of)
            return Coarse(*now, file, told)
        finer = best
    return None


def _finer(spec: Spec, parts: int) -> tuple[Spec, Model, Refined]:
    """Masses consistent where that converges to the same, two orders faster: lumps of a beam have
    no rotary inertia of its section, those of one in space have that about its axis."""
    blocks = tuple(
        b.model_copy(update=CONSISTENT[b.type]) if _is_lumped(b) else b for b in spec.model.elements
    )
    plain = spec.model.model_copy(update={"elements": blocks})

    def count(block: Any, row: Any) -> int:
        return parts if block.type in DIVIDED else 1

    mesh = refined(plain, count, renumber=True)
    now = replace(spec, model=mesh.model, update=None)
    return now, build_model(now), mesh


def _is_lumped(block: Any) -> bool:
    return isinstance(block, LineBlock) and block.mass == "lumped" and block.type in CONSISTENT


def _lumped(spec: Spec) -> bool:
    return any(_is_lumped(b) for b in spec.model.elements)


def _frequencies(model: Model, top: float) -> Real:
    """Of the flexible modes up to ``top`` (Hz), and of the next one."""
    count = 8
    while True:
        found = model_modes(model, min(count, model.size)).flexible().frequencies
        if len(found) == 0 or found[-1] > top or count >= model.size:
            return found[: int(np.sum(found <= top)) + 1]
        count *= 2


def _off(coarse: Real, fine: Real) -> float:
    """Largest relative difference, in the order of the modes: shapes of a mesh so coarse may be
    those of no mode of the other."""
    n = min(len(coarse), len(fine) - 1 if len(fine) > 1 else 1)
    return float(np.abs(coarse[:n] / fine[:n] - 1.0).max(initial=0.0))


def _error(model: Model, fitted: Sequence[Recording]) -> float:
    """The contract's error, of several recordings together: of responses, or the r.m.s. relative
    error of the frequencies of tables."""
    tables = [r for r in fitted if isinstance(r, ModeTable)]
    if tables:
        bare = model.with_parameters(())
        point = modal_residual(bare, tables, (), False).evaluate(bare.zero())
        off = [point.frequencies(k) / t.frequency - 1.0 for k, t in enumerate(tables)]
        return float(np.sqrt(np.nanmean(np.concatenate(off) ** 2)))
    values = [s.value for s in stated_errors(model, fitted)]
    return float(np.sqrt(np.mean(np.square(values))))


def of_sheets(mesh: Mesh, before: float, nominal: float, noise: float) -> Discretisation | None:
    """What the file's mesh of plates is worth beside the analysis model that was diagnosed: errors
    of the responses ``before``, of the file, of the ``nominal`` model there, and of ``noise``. None
    where the file's own mesh was."""
    if mesh.analysis is None:
        return None
    errors, alone = (before, nominal), (mesh.error, noise)
    return Discretisation(mesh.advised, False, mesh.shift, None, errors, alone)
