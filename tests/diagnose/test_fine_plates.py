"""Coarse plates against a laboratory on a mesh thirty times as fine and of another aspect: what the
right effect leaves is the recordings' noise and little else, and its size is right."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.gather import gathered
from cvxupdate.diagnose.hypothesis import Hypothesis, seeds_from
from cvxupdate.diagnose.types import Score, Seed
from cvxupdate.study import open_problem
from tests.cases.fine_plate import Plate, drawn, frf, real

# so thin that Kirchhoff's theory, which the laboratory rests on, is that of a solid
PLATE, TIMES = Plate(h=4e-4, nx=4, ny=3), (6, 8)
PATCH = frozenset({(1, 0), (1, 1), (2, 0), (2, 1)})
CASES = {
    "lump": ({"lump": (3, 1, 0.008)}, "added_mass", "n9 (z)", 0.006, "m", 0.008),
    "patch": (
        {"patch": (PATCH, 1.3)}, "thickness_change", "e2, e3, e6, e7", 0.2, "factor", 1.3,
    ),
}  # fmt: skip


def evidence_of(folder, plate, recordings, model):
    return gathered(*open_problem(drawn(folder, plate, recordings)), lambda said: None)


@pytest.mark.parametrize("case", CASES)
def test_what_the_right_effect_leaves_is_not_the_mesh(tmp_path, case):
    concealed, physics, place, guess, name, size = CASES[case]
    model = real(tmp_path, PLATE, TIMES, **concealed)
    evidence = evidence_of(tmp_path, PLATE, frf(tmp_path, PLATE, model, TIMES), model)
    assert evidence.fine.error > 10.0 * evidence.fine.left
    (effect,) = (
        c for c in evidence.candidates(evidence.model, (physics,)) if c.place.short == place
    )
    start = Hypothesis((), evidence.bases[0])
    score = Score(effect, 1.0, np.array([guess]), exact=True)
    (seed,) = seeds_from(evidence, start, [score], 0, nominal=True)
    found = evidence.fitted(seed, "coarse")
    for level in range(1, evidence.levels):
        effort = "sharp" if level == evidence.levels - 1 else "coarse"
        setting = evidence.at_level(found.setting, level)
        found = evidence.fitted(Seed((effect,), setting, found.p), effort)
    errors = evidence.errors(found)
    assert errors.worst < 0.06 < 0.2 * evidence.errors(evidence.bases[-1]).fit
    value = Hypothesis((effect,), found).figures[0].values[name]
    assert value == pytest.approx(size, rel=0.05)


def test_where_nothing_is_concealed_nuisance_parameters_explain(tmp_path):
    plate = Plate(h=4e-4, nx=4, ny=3, held=False)
    model = real(tmp_path, plate, TIMES)
    evidence = evidence_of(tmp_path, plate, frf(tmp_path, plate, model, TIMES), model)
    base = evidence.bases[-1]
    assert evidence.explained(base, evidence.errors(base))
    assert evidence.fine.shift > 3e-3  # which the mesh of the file alone would have had to explain
