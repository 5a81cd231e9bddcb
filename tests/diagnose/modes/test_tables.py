"""Tables of modes with the mesh taken out of them, and what noise alone may make of them."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eig

from cvxupdate.diagnose.modes.kinds import chi_square
from cvxupdate.diagnose.modes.tables import Tables, _widened, prepared
from cvxupdate.diagnose.nominal.mesh import mesh_error
from cvxupdate.diagnose.settings import FREQUENCY_DISCREPANCY
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import ModeTable, Origin
from tests.cases.cantilever import load, text


def test_the_mesh_is_taken_out_of_the_tables(tmp_path):
    """Four elements for a bar: the fourth frequency is off by half a per cent and more, which is
    the mesh and nothing else."""
    spec, _ = load(tmp_path, text())
    fine = build_model(spec)
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
    moved = prepared(model, [t], mesh_error(rough, model, float(f.max()))).fit[0]
    before, after = np.abs(f / own - 1.0), np.abs(moved.frequency / own - 1.0)
    assert before[3] > 5e-3 and np.all(after <= before * 2.0**-2 + 1e-5), (
        "what is left is what extrapolation may miss"
    )
    assert np.all(moved.frequency_std / moved.frequency >= FREQUENCY_DISCREPANCY)


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


def damped(lab, c):
    """(|s| / 2π, ratios) of the lab's chain with a dashpot of ``c`` at its end."""
    C = np.diag([0.0, 0.0, 0.0, c])
    zero, one = np.zeros((4, 4)), np.eye(4)
    a = np.block([[zero, one], [-lab.K, -C]])
    s = eig(a, np.block([[one, zero], [zero, lab.M]]), right=False)
    s = s[s.imag > 0][np.argsort(s.imag[s.imag > 0])]
    return np.abs(s) / (2.0 * np.pi), -s.real / np.abs(s)


def test_a_dashpot_moves_undamped_frequencies_to_second_order_and_they_count_so_much_less(lab):
    chain = lab()
    bare, _ = damped(chain, 0.0)
    (one, _), (two, heavy) = damped(chain, 30.0), damped(chain, 60.0)
    ratio = (two / bare - 1.0) / (one / bare - 1.0)
    assert ratio == pytest.approx(4.0, rel=0.1)
    assert np.abs(two / bare - 1.0).max() < 3.0 * heavy.max() ** 2
    nothing = np.full(4, np.nan)
    table = ModeTable(
        Origin("t", "t", "fit"),
        two,
        1e-3 * two,
        heavy,
        0.1 * heavy,
        (),
        None,
        None,
        np.arange(1, 5),
    )
    wide = _widened(table, (np.zeros(4), 0.0), np.zeros(4)).frequency_std / two
    np.testing.assert_allclose(wide**2, 1e-6 + heavy**4)
    plain = _widened(replace(table, damping=nothing), (np.zeros(4), 0.0), np.zeros(4))
    np.testing.assert_allclose(plain.frequency_std, 1e-3 * two)
