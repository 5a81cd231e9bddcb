"""What the mesh costs: the relative error of each natural frequency, from the same model on a mesh
twice as fine.

A diagnosis must not mistake the discretisation of the analyst's model for missing physics. The
correction is found once, mode by mode, by Richardson extrapolation, and every later set of natural
frequencies is moved by it; shapes and parameters stay those of the analyst's mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.correlate import pair_modes
from cvxupdate.diagnose.settings import ANOTHER_MODE, SLENDER
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.fe.sections import section_constants
from cvxupdate.fe.select import has_property
from cvxupdate.spec import Spec

# of convergence of the frequencies with the mesh (tests/fe/test_closed_forms.py)
ORDER = {"plate": 2, "rod": 2, "beam2d": 4, "beam3d": 4}


@dataclass(frozen=True)
class MeshError:
    """``frequencies`` (modes,) Hz of the analyst's mesh and ``shift`` (modes,): converged frequency
    over this one, less 1.

    ``numbers`` (modes,) of the modes, the lowest flexible one 0, where modes are to be known by
    them: a beam without shear has other frequencies.
    """

    frequencies: Real
    shift: Real
    order: int = 2
    numbers: Real | None = None

    def at(self, frequencies: Real) -> Real:
        """The shift of the lowest flexible modes, by their frequencies nearby or by their order:
        that of the nearest mode; zero beyond those that were compared."""
        if not len(self.frequencies):
            return np.zeros(len(frequencies))
        if self.numbers is not None:
            place = np.arange(len(frequencies))
            return np.where(
                place <= self.numbers.max(),
                self.shift[np.argmin(np.abs(place[:, None] - self.numbers), axis=1)],
                0.0,
            )
        nearest = np.argmin(np.abs(np.asarray(frequencies)[:, None] - self.frequencies), axis=1)
        return np.where(
            np.asarray(frequencies) <= 1.1 * self.frequencies[-1], self.shift[nearest], 0.0
        )

    def worst(self, top: float) -> float:
        """Largest shift of a mode up to ``top`` Hz; 0 where none was compared."""
        return float(np.abs(self.shift[self.frequencies <= top]).max(initial=0.0))

    def missed(self, top: float) -> float:
        """Of the worst shift up to ``top`` Hz, what Richardson extrapolation on two meshes may
        miss: terms of the next order in h, 2^−order of it."""
        return self.worst(top) * 2.0**-self.order


NONE = MeshError(np.zeros(0), np.zeros(0))


def mesh_error(spec: Spec, model: Model, top: float, sheared: bool = False) -> MeshError:
    """The mesh error of the flexible modes up to ``top`` Hz; none where the model has no elements
    that can be divided.

    ``sheared``: of the same model with every beam deforming in shear, whose mesh error is another:
    of second order where elements are short.
    """
    kinds = {b.kind.name for b in model.blocks} & set(ORDER)
    if (
        not kinds
        or model.size > 5000
        or (sheared and not any(has_property(b, "shear") for b in model.blocks))
    ):
        return NONE
    order = min(ORDER[k] for k in kinds)
    try:
        fine = build_model(replace(spec, model=refined(spec.model).model, update=None))
        if sheared:
            model, fine = shearing(model), shearing(fine)
        order = min(order, 2) if stocky(model) else order
        count = 16
        while True:
            coarse = model_modes(model, count).flexible()
            if coarse.frequencies[-1] > top or count >= model.size - 6:
                break
            count *= 2
        sharp = model_modes(
            fine, min(int(1.3 * len(coarse.eigenvalues)) + 4, fine.size - 6)
        ).flexible()
    except CvxupdateError:
        return NONE
    shared = [(i, fine.place[label]) for i, label in enumerate(model.labels) if label in fine.place]
    mine, theirs = (np.array(x) for x in zip(*shared, strict=True))
    found = pair_modes(
        sharp.shapes[theirs],
        coarse.shapes[mine],
        sharp.frequencies,
        coarse.frequencies,
        threshold=0.6,
    )
    f, g = coarse.frequencies[found.measured], sharp.frequencies[found.model]
    shift = (g + (g - f) / (2.0**order - 1.0)) / f - 1.0
    # shapes of other DOFs than the shared ones look alike now and then
    same = np.abs(shift) <= ANOTHER_MODE
    numbers = np.asarray(found.measured, dtype=float)[same] if sheared else None
    return MeshError(f[same], shift[same], order, numbers)


def shearing(model: Model) -> Model:
    """The model with every beam a Timoshenko beam."""
    return replace(
        model,
        blocks=tuple(
            replace(b, properties={**b.properties, "shear": np.ones_like(b.properties["shear"])})
            if has_property(b, "shear")
            else b
            for b in model.blocks
        ),
    )


def stocky(model: Model) -> bool:
    """Whether any beam that deforms in shear has elements shorter than `SLENDER` depths: such
    converge with the square of their length only (tests/fe/test_timoshenko_mass.py)."""
    for b in model.blocks:
        section = getattr(b.kind, "section", None)
        if section is None or not has_property(b, "shear"):
            continue
        c = section_constants(section, b.properties)
        deepest = np.sqrt(
            12.0 * np.max([np.real(c[k]) / np.real(c["A"]) for k in ("Iy", "Iz") if k in c], axis=0)
        )
        if np.any(
            (np.real(b.properties["shear"]) > 0.0) & (b.properties["length"] < SLENDER * deepest)
        ):
            return True
    return False


def mesh_line(worst: float) -> list[str]:
    """One line where the mesh shifts frequencies by more than a thousandth."""
    if worst <= 1e-3:
        return []
    return [
        f"The mesh alone shifts natural frequencies by up to {100 * worst:.2g} %; this was taken "
        "out."
    ]
