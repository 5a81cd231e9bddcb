"""Which kinds of inner DOFs an analysis model needs for the band of the recordings, and how far
frequencies of two meshes are apart."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import replace

import numpy as np
import scipy.sparse as sp

from cvxupdate.correlate import pair_modes
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.settings import ANOTHER_MODE
from cvxupdate.diagnose.types import Real
from cvxupdate.fe.analysis import Analysis
from cvxupdate.fe.build import build_model
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes
from cvxupdate.fe.select import has_property
from cvxupdate.spec import Spec

# Times the precision: what families may hold of an eigenvalue before modes are asked.
ROUGHLY = 20.0
SURELY = 0.6  # MAC of two modes that are one and the same

Change = Callable[[Model], Model]


def with_loose(spec: Spec, file: Model, analysis: Analysis) -> tuple[Model, ...]:
    """The model of the file, and it without supports where these hold edges: what edges may do
    matters when they give way."""
    rims = (x for x in analysis.inner if x.ends)
    if all(any(label in file.place for label in x.ends) for x in rims):
        return (file,)
    everywhere = tuple(s for s in spec.model.supports if s.nodes == "all")
    text = spec.model.model_copy(update={"supports": everywhere})
    return file, undamped(build_model(replace(spec, model=text, update=None)))


def needed(
    analysis: Analysis, files: Sequence[Model], top: float, precision: float, sheared: bool
) -> Analysis:
    """Without families of inner DOFs that change no frequency by more than the precision, all
    together, of models as they stand nor of the first with shear where that may be asked."""
    variants: list[tuple[Model, Change]] = [(file, _itself) for file in files]
    if sheared and can_shear(files[0]):
        variants.append((files[0], shearing))
    families = list(analysis.families)
    if variants[-1][1] is _itself and not shears(files[0]):
        families = [f for f in families if not f.startswith("shear")]
    whole = analysis.only(frozenset(families))
    models = [change(whole.on(file)) for file, change in variants]
    modes = [_up_to(model, top) for model in models]
    held = np.hstack(
        [_held(model, whole, families, m) for model, m in zip(models, modes, strict=True)]
    )
    order = np.argsort(held.max(axis=1, initial=0.0))
    for k in range(len(order), 0, -1):
        if held[order[:k]].sum(axis=0).max(initial=0.0) > ROUGHLY * precision:
            continue
        less = whole.only(frozenset(families[i] for i in order[k:]))
        shifts = [
            shift_between(change(less.on(file)), model, top, m)
            for (file, change), model, m in zip(variants, models, modes, strict=True)
        ]
        if max(shifts) <= precision:
            return less
    return whole


def _itself(model: Model) -> Model:
    return model


def _held(model: Model, analysis: Analysis, families: Sequence[str], modes: Modes) -> Real:
    """The part of each mode's strain energy (families, modes) that inner DOFs hold, family by
    family."""
    K = sp.csr_array(model.matrices(model.zero()).K)
    rows: dict[str, list[int]] = {f: [] for f in families}
    for x in analysis.inner:
        if x.label in model.place:
            rows[x.family].append(model.place[x.label])
    out = []
    for own in (np.array(rows[family], dtype=np.int64) for family in families):
        phi = modes.shapes[own]
        out.append(np.einsum("im,im->m", phi, K[own][:, own] @ phi))
    energy = np.abs(np.array(out)).reshape(len(families), len(modes.eigenvalues))
    return np.asarray(energy / np.maximum(modes.eigenvalues, 1e-300))


def _up_to(model: Model, top: float) -> Modes:
    """The flexible modes up to a frequency (Hz), and one more."""
    count = 16
    while True:
        modes = model_modes(model, min(count, model.size)).flexible()
        if len(modes.frequencies) < count or modes.frequencies[-1] > top:
            return modes
        count *= 2


def shift_between(coarse: Model, fine: Model, top: float, known: Modes | None = None) -> float:
    """Largest relative difference of a frequency of two meshes up to ``top`` (Hz), modes told by
    their shapes at the DOFs that both have; ``known``: the fine one's modes."""
    sharp = _up_to(fine, top) if known is None else known
    dull = model_modes(coarse, min(len(sharp.eigenvalues) + 8, coarse.size)).flexible()
    shared = [(i, fine.place[x]) for i, x in enumerate(coarse.labels) if x in fine.place]
    mine, theirs = (np.array(x) for x in zip(*shared, strict=True))
    found = pair_modes(
        dull.shapes[mine], sharp.shapes[theirs], dull.frequencies, sharp.frequencies, SURELY
    )
    f, g = dull.frequencies[found.model], sharp.frequencies[found.measured]
    change = np.abs(f / g - 1.0)[g <= top]
    return float(change[change <= ANOTHER_MODE].max(initial=0.0))


def can_shear(model: Model) -> bool:
    """Whether any element could deform in shear."""
    return any(has_property(b, "shear") for b in model.blocks)


def shears(model: Model) -> bool:
    """Whether any element does."""
    return any(np.any(b.properties.get("shear", np.zeros(1)) > 0.0) for b in model.blocks)
