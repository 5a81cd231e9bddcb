"""Fits of a large model in few coordinates end where those in all of its DOFs do."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, at_nominal, seed_from, together
from cvxupdate.diagnose.modes.evidence import ModesEvidence
from cvxupdate.diagnose.modes.fits import fitted_from, in_few
from cvxupdate.diagnose.modes.members import whole_members
from cvxupdate.diagnose.types import Score
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from tests.cases.cantilever import load
from tests.cases.long_bar import text

SENSORS = (41, 81, 121, 161)
LUMP = '[[model.elements]]\ntype = "mass"\nrows = [{ id = 900, nodes = [121], m = 0.8 }]'
SPRING = (
    '[[model.elements]]\ntype = "spring"\ndof = "z"\nrows = [{ id = 900, nodes = [121], k = 9e4 }]'
)


def evidence_of(folder: Path, extra: str, elements: int = 160) -> ModesEvidence:
    """Five modes with shapes of a bar of 320 DOFs with something more, beside the bare bar."""
    _, real = load(folder, text(elements, "rows = [{ frequency = 10.0 }]", extra))
    modes = model_modes(real, 5)
    rows = [real.place[f"n{n}.z"] for n in SENSORS]
    shapes = modes.shapes[rows, :5] / np.abs(modes.shapes[rows, :5]).max(axis=0)
    listed = ", ".join(
        f"{{ frequency = {f:.9g}, frequency_std = {2e-4 * f:.3g}, shape = {x.tolist()} }}"
        for f, x in zip(modes.frequencies, shapes.T, strict=False)
    )
    channels = ", ".join(
        f'{{ column = {k}, node = {n}, dof = "z", quantity = "displacement" }}'
        for k, n in enumerate(SENSORS)
    )
    spec, model = load(folder, text(elements, f"rows = [{listed}]\nchannels = [{channels}]"))
    found = gathered(spec, model, load_recordings(spec), lambda said: None)
    assert isinstance(found, ModesEvidence)
    return found


@pytest.mark.parametrize(
    ("extra", "word", "size"), [(LUMP, "added_mass", 0.5), (SPRING, "grounding_spring", 0.2)]
)
def test_they_end_where_fits_in_all_dofs_do(
    tmp_path: Path, extra: str, word: str, size: float
) -> None:
    evidence = evidence_of(tmp_path, extra)
    base = evidence.bases[0]
    assert base.misfit == pytest.approx(
        fitted_from(base.setting, evidence.model.zero()).misfit, rel=1e-3
    )
    (effect,) = (
        e
        for e in evidence.candidates(evidence.model, (word,))
        if e.place.nodes == (121,) and e.place.dof in (None, "z")
    )
    start = at_nominal(evidence, Hypothesis((), base))
    seed = seed_from(evidence, start, Score(effect, 1.0, np.array([size]), exact=True), 0, True)
    assert seed is not None
    few = in_few(seed.setting, evidence._space)
    assert few is not None and few[0].model.size < evidence.model.size / 3
    own, other = evidence.fitted(seed, ""), fitted_from(seed.setting, seed.start, seed.continued)
    assert own.misfit < 0.1 and own.p[-1] == pytest.approx(other.p[-1], rel=2e-3)
    assert own.point.modes.shapes.shape[0] == evidence.model.size
    figures = Hypothesis(seed.effects, own).figures[0]
    assert next(iter(figures.values.values())) == pytest.approx(
        0.8 if word == "added_mass" else 9e4, rel=0.02
    )


def test_whole_members_are_tried_there(tmp_path: Path) -> None:
    evidence = evidence_of(tmp_path, LUMP)
    effects = evidence.candidates(evidence.model, ("stiffness_change",))
    own, other = (whole_members(evidence.bases[0], effects, s) for s in (evidence._space, None))
    assert own and [s.effects[0].place.groups for s in own] == [
        s.effects[0].place.groups for s in other
    ]
    for a, b in zip(own, other, strict=True):
        np.testing.assert_allclose(a.start, b.start)


def test_a_small_model_has_no_space(tmp_path: Path) -> None:
    spec, model = load(tmp_path, text(100, "rows = [{ frequency = 10.0 }]"))
    found = gathered(spec, model, load_recordings(spec), lambda said: None)
    assert isinstance(found, ModesEvidence) and found._space is None


def test_what_leaves_noise_alone_is_spent(tmp_path: Path) -> None:
    """However much of a model's discrepancy is forgiven: a lump that is 8 % too heavy leaves what
    noise does not."""
    evidence = evidence_of(tmp_path, LUMP)
    base = evidence.bases[0]
    (lump,) = (
        e for e in evidence.candidates(evidence.model, ["added_mass"]) if e.place.nodes == (121,)
    )
    begun = together(evidence, Hypothesis((), base), [lump], 1.0)
    found = Hypothesis(begun.effects, fitted_from(begun.fit.setting, begun.fit.p))
    assert found.fit.spent and not base.spent
    heavier = found.fit.p.copy()
    heavier[-1] *= 1.08
    assert not evidence.evaluated(found.fit.setting, heavier).spent
