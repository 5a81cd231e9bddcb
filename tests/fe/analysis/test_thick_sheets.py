"""Sheets that are not thin against Mindlin's theory by a Legendre series, which shares no code."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.points import giving, on_points, points_of
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.modes import model_modes
from cvxupdate.study import open_problem
from validation.rigs.cases import draw
from validation.rigs.files import write
from validation.rigs.response import modal

MODES = 8


@pytest.fixture(scope="module")
def both(tmp_path_factory):
    """(analysis model, first natural frequencies of the series) of a plate with nothing wrong."""
    return cache(lambda seed, parts: of_case(seed, tmp_path_factory.mktemp("sheet"), parts))


def of_case(seed, folder, parts):
    case = draw(seed)
    sound = replace(case, scatter=dict.fromkeys(case.scatter, (1.0, 1.0)), concealed=(), rig=())
    f = modal(sound.bench(), sound.scatter, sound.zeta).omega / (2.0 * np.pi)
    write(sound, folder)
    spec, model, _ = open_problem(folder / "problem.toml")
    bare = undamped(model.with_parameters(()))
    own = analysis_of(spec, bare, parts, solid=True).on(on_points(bare, points_of(bare)))
    return case, own, np.sort(f)[np.sort(f) > 1.0][:MODES]


@pytest.mark.parametrize(("seed", "within"), [(4228, 1e-3), (3185, 3e-3)])
def test_a_free_sheet_is_as_slow_as_theory_says(both, seed, within):
    """25 and 16 thicknesses wide; Kirchhoff's theory is up to 2 and 4 % too fast."""
    case, own, f = both(seed, 8)
    assert case.shear and not case.drawing.held
    np.testing.assert_allclose(model_modes(own, 14).flexible().frequencies[:MODES], f, rtol=within)


def test_one_on_points_is_as_slow_where_these_give_way(both):
    """18 thicknesses wide: held rigidly it is too fast, as far as theory lets its points give
    (ln(R / r₀) of 3: a series has its own r₀) it is right on the average."""
    _, own, f = both(3135, 8)
    rigid, soft = (
        model_modes(giving(own, s), 14).flexible().frequencies[:MODES] / f - 1.0 for s in (0.0, 3.0)
    )
    assert np.mean(rigid) > 8e-3 and abs(np.mean(soft)) < 2e-3
    assert np.std(soft) < 0.5 * np.std(rigid)


@pytest.mark.parametrize("parts", [4, 8])
def test_no_motion_is_without_mass(both, parts):
    """Shear that lags behind bending is a mass that is positive beside others only."""
    _, own, _ = both(3185, parts)
    assert np.linalg.eigvalsh(own.matrices(own.zero()).M.toarray())[0] > 0.0
