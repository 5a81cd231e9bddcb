"""What the mesh costs: the relative error of each natural frequency, from the same model on a finer
mesh.

A diagnosis must not mistake the discretisation of the analyst's model for missing physics. Beside
effects modes are others, and in another order (a free structure on cords has what were its
rigid-body modes first, a hinge brings kinks), so the correction goes with the shape of each mode.
Of rods and beams it is the inertia of their inside (`cvxupdate.diagnose.nominal.inner`). Of sheets
it is found mode by mode, by Richardson extrapolation, and a later mode has the mean of the nominal
modes that it is made of. Shapes and parameters stay those of the analyst's mesh.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from cvxupdate.correlate import pair_modes
from cvxupdate.diagnose.nominal.inner import Inner, inner_of
from cvxupdate.diagnose.settings import ANOTHER_MODE, SLENDER
from cvxupdate.diagnose.types import Real
from cvxupdate.errors import CvxupdateError
from cvxupdate.fe.block import Index
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.fe.sections import section_constants
from cvxupdate.fe.select import has_property
from cvxupdate.physics.members import sheet_names
from cvxupdate.spec import Spec

# Of the top of the band, between which the correction fades.
ABOVE = (1.25, 2.0)
PARTS = 8  # of rods and beams: an order of two leaves a 64th
# of convergence of the frequencies with the mesh (tests/fe/test_closed_forms.py)
ORDER = {"plate": 2, "rod": 2, "beam2d": 4, "beam3d": 4}


@dataclass(frozen=True)
class MeshError:
    """``frequencies`` (modes,) Hz of the analyst's mesh and ``shift`` (modes,): converged frequency
    over this one, less 1; ``carried`` (DOFs, modes) M φ of these modes at the DOFs ``labels``, or
    ``inner`` what is inside members there, which counts up to ``top`` (Hz); ``finer`` times so fine
    is the mesh that told it."""

    frequencies: Real
    shift: Real
    order: int = 2
    labels: tuple[str, ...] = ()
    carried: Real | None = None
    inner: Inner | None = None
    finer: int = 2
    top: float = np.inf

    @classmethod
    def of(cls, model: Model, modes: Modes, shift: Real, order: int = 2) -> MeshError:
        """Of flexible modes of a model as it stands."""
        carried = np.asarray(model.matrices(model.zero()).M @ modes.shapes)
        return cls(modes.frequencies, shift, order, model.labels, carried)

    def at(self, frequencies: Real) -> Real:
        """The shift of modes by their frequencies: that of the nearest mode; zero beyond those that
        were compared."""
        if not len(self.frequencies):
            return np.zeros(len(frequencies))
        nearest = np.argmin(np.abs(np.asarray(frequencies)[:, None] - self.frequencies), axis=1)
        return np.where(
            np.asarray(frequencies) <= 1.1 * self.frequencies[-1], self.shift[nearest], 0.0
        )

    def rows(self, model: Model) -> Index:
        """Where a model grown from the nominal one has the DOFs of that; −1 where it has not."""
        return np.array([model.place.get(label, -1) for label in self.labels], dtype=np.int64)

    def taken_out(self, model: Model, modes: Modes, rows: Index) -> Modes:
        """Modes of a model that has the nominal one's DOFs at ``rows``, without the mesh's error:
        by what is inside its members, or ω (1 + Σ δᵣ (φᵣᵀ M φ)²): in shares of mass, not of
        energy, for a kink, which a soft joint makes, has no end of energy in modes without. Modes
        far above the band keep theirs, for what they give there is static, and that is exact."""
        if not self.labels:
            return modes
        if self.inner is not None:
            beyond = (modes.frequencies / self.top - ABOVE[0]) / (ABOVE[1] - ABOVE[0])
            low = np.flatnonzero(beyond < 1.0)
            values, part = modes.eigenvalues.copy(), 1.0 - np.maximum(beyond[low], 0.0)
            values[low] *= self.inner.ratio(model, values[low], modes.shapes[:, low]) ** part
            return replace(modes, eigenvalues=values)
        if self.carried is None or not self.carried.size:
            return modes
        shapes = np.where(rows[:, None] >= 0, modes.shapes[rows], 0.0)
        by = 1.0 + self.shift @ (self.carried.T @ shapes) ** 2
        return replace(modes, eigenvalues=modes.eigenvalues * by**2)

    def worst(self, top: float) -> float:
        """Largest shift of a mode up to ``top`` Hz; 0 where none was compared."""
        return float(np.abs(self.shift[self.frequencies <= top]).max(initial=0.0))

    def missed(self, top: float) -> float:
        """Of the worst shift up to ``top`` Hz, what may still be missed."""
        return float(self.rest(np.array([self.worst(top)]))[0])

    def rest(self, shift: Real) -> Real:
        """What may be missed of shifts: the finer mesh (or extrapolation to none: terms of the next
        order in h) leaves its fineness to the order of convergence; what is inside members is told
        by the shape on this mesh, to the square."""
        square = 0.0 if self.inner is None else shift**2
        return np.asarray(np.abs(shift) * float(self.finer) ** -self.order + square)


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
        inside = _by_members(spec, model, top, sheared, order)
        if inside is not None:
            return inside
        fine = build_model(replace(spec, model=refined(spec.model).model, update=None))
        if sheared:
            model, fine = shearing(model), shearing(fine)
        order = min(order, 2) if stocky(model) else order
        coarse = _up_to(model, top)
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
    at = np.asarray(found.measured)
    f, g = coarse.frequencies[at], sharp.frequencies[found.model]
    shift = (g + (g - f) / (2.0**order - 1.0)) / f - 1.0
    # shapes of other DOFs than the shared ones look alike now and then
    same = np.abs(shift) <= ANOTHER_MODE
    own = Modes(coarse.eigenvalues[at[same]], coarse.shapes[:, at[same]], 0)
    return MeshError.of(model, own, shift[same], order)


def _by_members(
    spec: Spec, model: Model, top: float, sheared: bool, order: int
) -> MeshError | None:
    """The mesh error of rods and beams by what is inside them; None with sheets."""
    if not sheet_names().isdisjoint(b.kind.name for b in model.blocks):
        return None
    text = refined(spec.model, lambda block, row: PARTS).model
    fine = build_model(replace(spec, model=text, update=None))
    model, fine = (shearing(m) if sheared else m for m in (model, fine))
    inner = inner_of(model, fine)
    if inner is None:
        return None
    modes = _up_to(model, top)
    shift = np.sqrt(inner.ratio(model, modes.eigenvalues, modes.shapes)) - 1.0
    order = min(order, 2) if stocky(model) else order
    return MeshError(modes.frequencies, shift, order, model.labels, None, inner, PARTS, top)


def _up_to(model: Model, top: float) -> Modes:
    """Flexible modes, at least those up to ``top`` Hz."""
    count = 16
    while True:
        modes = model_modes(model, count).flexible()
        if modes.frequencies[-1] > top or count >= model.size - 6:
            return modes
        count *= 2


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
