"""The equations of eigenstructure assignment: exact at the truth, derivatives by complex step, the
null-space basis, every expansion."""

from __future__ import annotations

from typing import get_args

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.load import load_recordings
from cvxupdate.residual.ceam import CeamResidual, forces
from cvxupdate.residual.ceam_expand import (
    FORCE_WEIGHT,
    condensed_shape,
    expand,
    null_space_basis,
    null_space_shape,
    null_space_shape_sparse,
)
from cvxupdate.residual.ceam_modes import (
    AssignedMode,
    assigned_modes,
    damping_kind,
    impedance,
    rate,
    self_assigned,
)
from cvxupdate.residual.ceam_whiten import whitener
from cvxupdate.spec import load_problem
from cvxupdate.spec.update import Update
from cvxupdate.spec.whole import EXPANSIONS
from tests.cases.ceam_frame import built, measure, model_text, recording, update_text

STIFF = np.array([1.0, 1.15, 0.9, 1.0, 1.1, 1.0, 0.85])
MASS = np.array([1.0, 1.0, 1.1, 0.95, 1.0, 1.0, 1.05])
ETA = np.array([0.02, 0.0, 0.03, 0.01, 0.0, 0.02, 0.04])


def problem(folder, damping="", dofs=("x", "y", "z", "rx", "ry", "rz"), modes=4, noise=0.0):
    """(model with parameters, assigned modes, true p) with stiffness, mass and damping all
    wrong."""
    eta, c = (
        (ETA, 0.0) if damping == "hysteretic" else (None, 40.0 if damping == "viscous" else 0.0)
    )
    target = built(model_text(STIFF, MASS, eta, c=c), folder, "target.toml")
    found = measure(target, modes, damping == "viscous")
    of = ("stiffness", "mass", "damping") if damping == "hysteretic" else ("stiffness", "mass")
    extra = (
        ', { elements = [30, 31], of = "c", each = "element", lower = -0.9, upper = 2.0 }'
        if damping == "viscous"
        else ""
    )
    text = model_text(
        eta=0.02 if damping == "hysteretic" else None, c=55.0 if damping == "viscous" else 0.0
    )
    (folder / "problem.toml").write_text(
        text + recording(found, dofs, noise) + update_text(of, extra=extra)
    )
    spec = load_problem(folder / "problem.toml")
    model = build_model(spec)
    truth = [STIFF - 1, MASS - 1]
    if damping == "hysteretic":
        truth.append(ETA * STIFF / 0.02 - 1)
    if damping == "viscous":
        truth.append(np.full(2, 40.0 / 55.0 - 1))
    return model, assigned_modes(model, load_recordings(spec)), np.concatenate(truth)


@pytest.mark.parametrize("damping", ["", "hysteretic", "viscous"])
def test_the_truth_satisfies_the_equations_and_they_are_linear_in_p(tmp_path, damping):
    model, assigned, truth = problem(tmp_path, damping)
    assert damping_kind(model) == (damping or "none")
    assert all(mode.real == (damping == "") for mode in assigned)
    residual = CeamResidual(model, assigned, "dynamic", model.zero())
    assert residual.exact
    first = residual.evaluate(model.zero())
    system = first.system()
    assert np.abs(system.residual(truth)).max() < 1e-7 * np.abs(first.differences[0]).max()
    rng = np.random.default_rng(1)
    p = rng.uniform(-0.3, 0.3, len(truth))
    assert np.allclose(
        system.residual(p), residual.evaluate(p).differences[0], atol=1e-9 * np.abs(system.A).max()
    )
    assert len(system.rows) == len(assigned) * model.size * (1 if damping == "" else 2)


@pytest.mark.parametrize("expansion", ["null-space", "dynamic"])
@pytest.mark.parametrize("damping", ["", "hysteretic", "viscous"])
def test_expanded_by_the_true_model_the_truth_satisfies_the_equations(tmp_path, damping, expansion):
    model, assigned, truth = problem(tmp_path, damping, ("x", "y", "z"))
    first = CeamResidual(model, assigned, expansion, model.zero())
    assert not first.exact
    there = CeamResidual(model, assigned, expansion, truth)
    start = np.abs(there.evaluate(model.zero()).differences[0]).max()
    assert np.abs(there.evaluate(truth).differences[0]).max() < 1e-5 * start


def test_null_space_basis_is_orthonormal_and_annihilated(tmp_path):
    model, assigned, _ = problem(tmp_path, "hysteretic")
    m = model.matrices(model.zero())
    Z = impedance(m, assigned[0]).toarray()
    Z = Z / np.abs(Z).max()
    V, force = null_space_basis(Z)
    both = np.vstack([V, force])
    assert np.allclose(both.conj().T @ both, np.eye(len(Z)), atol=1e-12)
    assert np.abs(Z @ V + force).max() < 1e-13
    # complete shapes (6.7, 6.9): V_bar e is the force that the correction has to carry, -Z phi
    e = la.solve(V, assigned[0].shape)
    assert np.allclose(force @ e, -Z @ assigned[0].shape, atol=1e-12)


def test_null_space_shape_has_the_least_norm_and_does_not_depend_on_units(tmp_path):
    model, assigned, _ = problem(tmp_path, "", ("x", "y", "z"))
    m, mode = model.matrices(model.zero()), assigned[1]
    Z = impedance(m, mode).toarray()
    scale = 1 / np.sqrt(m.K.diagonal())
    full, force = null_space_shape(Z, mode.at, mode.shape, scale)
    assert np.array_equal(full[mode.at], mode.shape)
    rest = np.setdiff1d(np.arange(model.size), mode.at)
    # normal equations of min |x|² + |w Z x|² in scaled coordinates over the unmeasured DOFs
    x = full / scale
    Zs = FORCE_WEIGHT * scale[:, None] * Z * scale[None, :]
    gradient = (x + Zs.T @ (Zs @ x))[rest]
    assert np.abs(gradient).max() < 1e-9 * np.abs(Zs.T @ (np.abs(Zs) @ np.abs(x))).max()
    assert np.allclose(force, -Z @ full, atol=1e-9 * (np.abs(Z) @ np.abs(full)).max())
    unit = np.where(model.dof_kind >= 3, 57.3, 1.0)  # degrees instead of radians
    other, _ = null_space_shape(
        Z / unit[:, None] / unit[None, :], mode.at, mode.shape * unit[mode.at], scale * unit
    )
    assert np.allclose(other / unit, full, atol=1e-9)


def test_problem_files_know_every_expansion() -> None:
    assert get_args(Update.model_fields["expansion"].annotation) == EXPANSIONS


@pytest.mark.parametrize("expansion", EXPANSIONS)
def test_every_expansion_of_the_true_structure_gives_its_own_shape_where_it_can(
    tmp_path, expansion
):
    target = built(model_text(STIFF, MASS), tmp_path, "target.toml")
    found = measure(target, 4)
    (tmp_path / "problem.toml").write_text(
        model_text(STIFF, MASS) + recording(found, ("x", "y", "z")) + update_text()
    )
    spec = load_problem(tmp_path / "problem.toml")
    model = build_model(spec)
    assigned = assigned_modes(model, load_recordings(spec))
    modes = model_modes(model, 14)
    m = model.matrices(model.zero())
    exact = {
        "dynamic": 1e-8,
        "kidder": 2e-3,  # three terms of its series
        "petersmann": 1e-8,  # fewer slaves than modes of the sum
        "gysin": None,
        "serep": 1e-7,
        "serepa": 1e-7,
        "tam": 1e-7,
        "hybrid": None,
        "guyan": None,
        "irs": None,
        "null-space": 1e-3,
    }
    for mode, shape in zip(assigned, found.shapes.T, strict=True):
        full = expand(mode, m, expansion, modes)
        true = shape * (mode.shape[0] / shape[mode.at[0]])
        error = np.linalg.norm(full - true) / np.linalg.norm(true)
        limit = exact[expansion]
        assert error < (0.15 if limit is None else limit), (expansion, mode.label)


def test_condensation_without_slaves_changes_nothing():
    assert np.array_equal(
        condensed_shape(sp.csc_array(np.diag([2.0, 3.0])), np.array([1, 0]), np.array([5.0, 7.0])),
        [7.0, 5.0],
    )


@pytest.mark.parametrize("damping", ["", "hysteretic"])
def test_the_sparse_null_space_shape_is_the_dense_one(tmp_path, damping):
    model, assigned, _ = problem(tmp_path, damping, ("x", "y", "z"))
    m = model.matrices()
    scale = 1 / np.sqrt(m.K.diagonal())
    for mode in assigned:
        Z = sp.csc_array(impedance(m, mode))
        dense = null_space_shape(Z.toarray(), mode.at, mode.shape, scale)[0]
        assert np.allclose(
            null_space_shape_sparse(Z, mode.at, mode.shape, scale),
            dense,
            atol=1e-9 * np.abs(dense).max(),
        )


@pytest.mark.parametrize("kind", ["hysteretic", "viscous"])
def test_rates_are_roots_of_the_oscillator(kind):
    s = rate(12.5, 0.04, kind)
    omega = 2 * np.pi * 12.5
    left = (
        s**2 + 2 * 0.04 * omega * s + omega**2
        if kind == "viscous"
        else s**2 + omega**2 * (1 + 2j * 0.04)
    )
    assert abs(left) < 1e-10 * omega**2


def test_forces_agree_with_the_derivative_of_the_impedance(tmp_path):
    model, assigned, _ = problem(tmp_path, "hysteretic")
    derivatives = [model.derivative(j) for j in range(len(model.parameters))]
    mode = assigned[2]
    A = forces(derivatives, mode, mode.shape)
    p = np.zeros(len(model.parameters))
    p[[3, 9, 16]] = 1.0
    for j in (3, 9, 16):
        step = np.zeros_like(p)
        step[j] = 1.0
        moved = impedance(model.matrices(step), mode) - impedance(model.matrices(0 * step), mode)
        assert np.allclose(A[:, j], moved @ mode.shape, rtol=1e-9, atol=1e-9 * np.abs(A).max())


def test_own_modes_have_no_residual(tmp_path):
    model, _, _ = problem(tmp_path)
    modes = model_modes(model, 6)
    residual = CeamResidual(model, self_assigned(model, modes, range(5)), "dynamic", model.zero())
    assert np.abs(residual.evaluate(model.zero()).differences[0]).max() < 1e-3


def test_whitened_rows_have_unit_variance(tmp_path):
    """Monte Carlo over shape noise: the rows of the true model are standard normal."""
    target = built(model_text(STIFF, MASS), tmp_path, "target.toml")
    found = measure(target, 2)
    rows = []
    for seed in range(60):
        text = (
            model_text(STIFF, MASS)
            + recording(found, ("x", "y", "z", "rx", "ry", "rz"), noise=0.01, std=0.01, seed=seed)
            + update_text()
        )
        (tmp_path / "problem.toml").write_text(text)
        spec = load_problem(tmp_path / "problem.toml")
        model = build_model(spec)
        residual = CeamResidual(
            model, assigned_modes(model, load_recordings(spec)), "dynamic", model.zero()
        )
        rows.append(residual.evaluate(model.zero()).differences[0])
    values = np.array(rows)
    assert np.mean(values**2) == pytest.approx(1.0, abs=0.06)
    assert np.all(np.abs(np.mean(values**2, axis=0) - 1.0) < 6 * np.sqrt(2 / 60))


@pytest.mark.parametrize("dofs", [("x", "y", "z", "rx", "ry", "rz"), ("x", "y", "z")])
@pytest.mark.parametrize("damping", ["", "hysteretic"])
@pytest.mark.parametrize("there", [False, True])
def test_whitening_by_sparse_factors_is_the_least_norm_of_the_errors(
    tmp_path, damping, dofs, there
):
    """Against a dense minimum-norm solution of [Z S, c, F] y = r, also where Z is singular because
    the model has the mode already."""
    model, assigned, truth = problem(tmp_path, damping, dofs)
    m = model.matrices(truth if there else model.zero())
    mode = assigned[1]
    full = expand(mode, m, "dynamic", None)
    W = whitener(m, mode, full)
    Z = impedance(m, mode).toarray()
    moved = (2 * mode.s * (m.M @ full) + m.C @ full) * mode.s
    c = (moved.real if mode.real else moved) * mode.rate_std
    F = np.zeros((model.size, len(W.held)))
    F[W.held, np.arange(len(W.held))] = W.floor
    rng = np.random.default_rng(2)
    r = forces(model.derivatives(), mode, full) @ rng.normal(size=(len(truth), 3))
    least = la.lstsq(np.column_stack([Z * W.std, c, F]), r, lapack_driver="gelsd", cond=1e-15)[0]
    assert np.linalg.norm(W(r), axis=0) == pytest.approx(np.linalg.norm(least, axis=0), rel=1e-5)
    assert W(r).shape == r.shape
    assert np.allclose(W(r[:, 0]), W(r)[:, 0])


def test_repeated_modes_are_weighed_too(tmp_path):
    """Two equal, unconnected halves: every mode is double, so that Z is singular twice."""
    nodes = ", ".join(f"{{ id = {i}, x = {i}.0, y = 0.0, z = 0.0 }}" for i in range(1, 13))
    springs = ", ".join(
        f"{{ id = {i}, nodes = [{i}, {i + 1}] }}" for i in (1, 2, 3, 4, 5, 7, 8, 9, 10, 11)
    )
    masses = ", ".join(f"{{ id = {20 + i}, nodes = [{i}], m = 1.0 }}" for i in range(1, 13))
    text = (
        f'title = "two"\n[model]\ndofs = ["x"]\nnodes = [{nodes}]\n[[model.elements]]\ntype = '
        f'"spring"\ndof = "x"\nk = 1.0e4\nrows = [{springs}, {{ id = 6, nodes = [1] }}, {{ id '
        f'= 12, nodes = [7] }}]\n[[model.elements]]\ntype = "mass"\nrows = [{masses}]\n'
    )
    model = built(text, tmp_path)
    m = model.matrices()
    values, shapes = la.eigh(m.K.toarray(), m.M.toarray())
    shape = shapes[:, 0] + 0.3 * shapes[:, 1]
    mode = AssignedMode(
        "double",
        complex(1j * np.sqrt(values[0])),
        np.arange(12),
        shape,
        np.full(12, 0.01),
        1e-3,
        True,
    )
    W = whitener(m, mode, shape)
    r = np.random.default_rng(0).normal(size=(12, 4))
    F = np.zeros((12, len(W.held)))
    F[W.held, np.arange(len(W.held))] = W.floor
    G = np.column_stack(
        [
            impedance(m, mode).toarray() * W.std,
            2 * mode.s.imag**2 * -1.0 * (m.M @ shape) * mode.rate_std,
            F,
        ]
    )
    least = la.lstsq(G, r, lapack_driver="gelsd", cond=1e-15)[0]
    assert np.linalg.norm(W(r), axis=0) == pytest.approx(np.linalg.norm(least, axis=0), rel=1e-4)


def test_combined_rows_have_the_same_norm_for_every_p(tmp_path, monkeypatch):
    model, assigned, _ = problem(tmp_path, "hysteretic")
    plain = CeamResidual(model, assigned, "dynamic", model.zero()).evaluate(model.zero()).system()
    monkeypatch.setattr("cvxupdate.residual.ceam.LARGE", 0)
    combined = (
        CeamResidual(model, assigned, "dynamic", model.zero(), None, True)
        .evaluate(model.zero())
        .system()
    )
    assert len(combined.rows) == len(assigned) * (len(model.parameters) + 1)
    assert combined.count == plain.count == len(plain.rows)
    for seed in range(3):
        p = np.random.default_rng(seed).uniform(-0.5, 0.5, len(model.parameters))
        assert np.linalg.norm(combined.residual(p)) == pytest.approx(
            np.linalg.norm(plain.residual(p)), rel=1e-10
        )
