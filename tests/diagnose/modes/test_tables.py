"""Tables of modes beside a model on a mesh fine enough, and what noise alone may make of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.modes.tables import Tables, chi_square, prepared
from cvxupdate.diagnose.modes.worth import mesh_of_tables
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.recordings.types import ModeTable, Origin
from tests.cases.cantilever import load, text


def test_the_mesh_of_the_file_leaves_nothing(tmp_path):
    """Four elements for a bar: the fourth frequency is off by half a per cent and more, which is
    the mesh and nothing else."""
    spec, _ = load(tmp_path, text())
    fine = build_model(replace(spec, model=refined(spec.model).model))
    few = [n for n in spec.model.nodes if n.id in (1, 4, 7, 10, 13)]
    rows = tuple(
        spec.model.elements[0].rows[i].model_copy(update={"nodes": pair})
        for i, pair in enumerate([(1, 4), (4, 7), (7, 10), (10, 13)])
    )
    block = spec.model.elements[0].model_copy(update={"rows": rows})
    rough = replace(
        spec, model=spec.model.model_copy(update={"nodes": tuple(few), "elements": (block,)})
    )
    model = build_model(rough)
    f = model_modes(fine, 4).frequencies[:4]
    own = model_modes(model, 4).frequencies[:4]
    t = ModeTable(
        Origin("table", "table", "fit"),
        f,
        1e-3 * f,
        np.full(4, np.nan),
        np.full(4, np.nan),
        (),
        None,
        None,
        np.arange(1, 5),
    )
    mesh = mesh_of_tables(rough, model, [t], False)
    better = model_modes(mesh.on(model), 4).frequencies[:4]
    before, after = np.abs(own / f - 1.0), np.abs(better / f - 1.0)
    assert before[3] > 5e-3 and np.all(after <= 0.1 * FREQUENCY_DISCREPANCY)
    assert mesh.shift == pytest.approx(before.max(), rel=0.05)
    widened = prepared([t]).fit[0]
    assert np.all(widened.frequency_std / widened.frequency >= FREQUENCY_DISCREPANCY)
    np.testing.assert_array_equal(widened.frequency, f)


def test_what_was_held_out_must_not_contradict(tmp_path):
    """The noise of held-out modes: nineteen in twenty of one mode's errors are within 1.96
    deviations."""
    f = np.array([100.0])
    t = ModeTable(
        Origin("table", "table", "hold-out"),
        f,
        0.004 * f,
        f * np.nan,
        f * np.nan,
        (),
        None,
        None,
        np.array([1]),
    )
    assert Tables((), (t,), (t,)).noise == pytest.approx(1.959964 * 0.004, rel=1e-6) and np.isnan(
        Tables((t,), (), (t,)).noise
    )


def test_chi_square_is_that_of_the_tables():
    from scipy.stats import chi2

    assert all(
        chi_square(level, n) == pytest.approx(chi2.ppf(level, n), rel=1e-12)
        for level in (0.95, 0.99)
        for n in (1, 2, 13, 400)
    )
