"""Whole symmetric matrices on a sparsity pattern through `run`: exact where the modes determine
them, symmetric, connected, definite, with rigid modes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import scipy.linalg as la
import scipy.sparse as sp

from cvxupdate import study
from cvxupdate.convex import StiffnessPositive
from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.build import build_model
from cvxupdate.fe.rigid import free_motions, rigid_body_modes, rigid_motions
from cvxupdate.fe.whole import with_entries
from cvxupdate.registry import CONSTRAINTS
from cvxupdate.spec import load_problem
from cvxupdate.update.context import ModelContext
from tests.cases.ceam_frame import BAY, built, measure, model_text, recording

STIFF = np.array([1.0, 1.15, 0.9, 1.0, 1.1, 1.0, 0.85])
MASS = np.array([1.0, 1.0, 1.1, 0.95, 1.0, 1.0, 1.05])
PROBLEMS = Path(__file__).resolve().parents[2] / "problems"
PRIOR = '\n[regularisation]\nkind = "tikhonov"\nweight = 1.0\n'
SMALL = '\n[regularisation]\nkind = "tikhonov"\nweight = 1e-6\n'


def problem(
    folder, whole, constraints="", modes=30, stiff=STIFF, mass=None, noise=0.0, std=None, more="",
    beams=range(7),
):  # fmt: skip
    target = built(model_text(stiff, mass, beams=beams), folder, "target.toml")
    text = (
        model_text(beams=beams)
        + recording(measure(target, modes), noise=noise, std=std)
        + f'[update]\nmethod = "ceam"\nwhole = {{ {whole} }}\n'
    )
    (folder / "problem.toml").write_text(text + f"[constraints]\n{constraints}\n{more}")
    return folder / "problem.toml", target


def matrices(path, updated):
    return build_model(load_problem(path)).matrices(np.array([q.p for q in updated.parameters]))


def test_an_entry_moves_its_pair_alone_and_the_pattern_stays(tmp_path):
    model = built(model_text(), tmp_path)
    free = with_entries(model, ["K", "M"], "model", True, -1.0, 1.0)
    rng = np.random.default_rng(0)
    p = rng.normal(size=len(free.parameters))
    before, after = model.matrices(), free.matrices(p)
    for name in "KM":
        A, B = (getattr(m, name).toarray() for m in (before, after))
        size = np.sqrt(np.diag(A))
        assert np.allclose(B, B.T, rtol=1e-12, atol=1e-12 * np.abs(B).max())
        outside = np.abs(A) < 1e-12 * np.outer(size, size)
        assert np.array_equal(B[outside], A[outside])
        for q, value in zip(free.parameters, p, strict=True):
            if q.of == name:
                i, j = (model.place[label] for label in q.name[2:-1].split(", "))
                assert B[i, j] == pytest.approx(A[i, j] + value * size[i] * size[j], rel=1e-12)
                assert q.physical(value) == pytest.approx(B[i, j], rel=1e-12)
    assert {q.unit for q in free.parameters} == {"N/m", "N/rad", "N*m/rad", "kg", "kg*m", "kg*m^2"}


def test_patterns_hold_one_another(tmp_path):
    model = built(model_text(), tmp_path)
    names = [
        {q.name for q in with_entries(model, ["K"], pattern, True, -1, 1).parameters}
        for pattern in ("model", "nodes", "all")
    ]
    assert names[0] < names[1] < names[2]
    assert len(names[2]) == model.size * (model.size + 1) // 2
    assert len(with_entries(model, ["K"], "all", False, -1, 1).parameters) == model.size**2
    with pytest.raises(ModelError, match="C is zero"):
        with_entries(model, ["C"], "model", True, -1, 1)


@pytest.mark.slow
def test_the_stiffness_is_found_when_every_mode_is_known(tmp_path):
    path, target = problem(tmp_path, 'matrices = ["K"]', "stiffness_positive = { }", more=SMALL)
    updated = study.run(path)
    assert updated.status == "converged"
    K, true = matrices(path, updated).K.toarray(), target.matrices().K.toarray()
    size = np.sqrt(np.diag(true))
    assert np.abs((K - true) / np.outer(size, size)).max() < 1e-4
    R = rigid_motions(target)
    assert np.abs(K @ R).max() < 1e-7 * np.abs(K).max()
    assert updated.model["stiffness_eigenvalue_min"] > -1e-10
    assert updated.fit["fit"]["frequency_error_percent_max"]["after"] < 1e-3


@pytest.mark.slow
def test_symmetry_as_a_clause_keeps_the_matrix_symmetric(tmp_path):
    path, _ = problem(
        tmp_path, 'matrices = ["K"], symmetric = false', "symmetry = { }", modes=4, more=PRIOR
    )
    updated = study.run(path)
    assert updated.status == "converged"
    K = matrices(path, updated).K.toarray()
    size = np.sqrt(np.diag(K))
    assert np.abs((K - K.T) / np.outer(size, size)).max() < 1e-8
    assert (
        len(
            {q.name for q in updated.parameters if q.name.startswith("K[n1.x, ")}
            & {"K[n1.x, n2.x]"}
        )
        == 1
    )
    assert any(q.name == "K[n2.x, n1.x]" for q in updated.parameters)
    assert "symmetry of K" in updated.model["clauses"]


@pytest.mark.slow
def test_no_element_appears_that_was_not_there(tmp_path):
    path, _ = problem(
        tmp_path, 'matrices = ["K"], pattern = "nodes"', "connectivity = { }", modes=4, more=PRIOR
    )
    updated = study.run(path)
    zero = [q for q in updated.parameters if abs(q.before) < 1e-3]
    assert zero and all(abs(q.p) < 1e-9 for q in zero)
    asked = zero[0].name
    path, _ = problem(
        tmp_path,
        'matrices = ["K"], pattern = "nodes"',
        f'connectivity = {{ }}\nlinear = [{{ coefficients = {{ "{asked}" = 1.0 }}, at_least = '
        f"0.1 }}]",
        modes=4,
        more=PRIOR,
    )
    clash = study.run(path)
    assert clash.status == "infeasible"
    assert set(clash.conflict) == {f"connectivity: no element at {asked}", f"{asked} at least 0.1"}


@pytest.mark.slow
def test_the_clause_keeps_a_stiffness_that_noise_would_make_indefinite(tmp_path):
    noisy = {"modes": 3, "noise": 0.02, "std": 0.02, "more": PRIOR.replace("1.0", "10.0")}
    noisy["beams"] = BAY
    path, _ = problem(tmp_path, 'matrices = ["K"]', **noisy)
    free = study.run(path)
    assert la.eigvalsh(matrices(path, free).K.toarray())[0] < 0
    assert free.model["stiffness_eigenvalue_min"] < -1e-2
    path, _ = problem(tmp_path, 'matrices = ["K"]', "stiffness_positive = { }", **noisy)
    kept = study.run(path)
    assert kept.status == "converged"
    assert kept.model["stiffness_eigenvalue_min"] > -1e-10
    assert "the assembled stiffness matrix stays positive semidefinite" in kept.active


def test_mass_in_every_direction_and_inertia_are_kept(tmp_path):
    path, _ = problem(
        tmp_path,
        'matrices = ["M"]',
        "inertia = { }\nmass_positive = { matrix = true }",
        mass=MASS,
        stiff=np.ones(7),
        modes=5,
        more=PRIOR,
    )
    updated = study.run(path)
    assert updated.status == "converged"
    model = build_model(load_problem(path))
    r = model.xyz[model.dof_node]
    R = np.zeros((model.size, 6))
    for k in range(3):
        R[model.dof_kind == k, k] = R[model.dof_kind == 3 + k, 3 + k] = 1.0
        turn = np.cross(np.eye(3)[k], r)
        for a in range(3):
            R[model.dof_kind == a, 3 + k] = turn[model.dof_kind == a, a]
    before, after = (R.T @ (m.M @ R) for m in (model.matrices(), matrices(path, updated)))
    assert np.abs(after - before).max() < 1e-7 * np.abs(before).max()
    assert np.abs([q.p for q in updated.parameters]).max() > 1e-3
    assert updated.model["mass_eigenvalue_min"] > 0


def test_what_a_whole_matrix_cannot_have_is_said(tmp_path):
    for whole, constraints, words in (
        ('matrices = ["K"], symmetric = false', "", "nothing keeps the matrices symmetric"),
        ('matrices = ["K"], lower = 0.5, upper = -0.5', "", "crossed"),
        ('matrices = ["M"]', "total_mass = { conserve = true }", "mass in every direction"),
        ('matrices = ["D"]', "", "D is zero"),
    ):
        with pytest.raises(InputError, match=words):
            study.run(problem(tmp_path, whole, constraints, modes=2)[0])
    path, _ = problem(tmp_path, 'matrices = ["K"]', modes=2)
    path.write_text(path.read_text().replace('whole = { matrices = ["K"] }', ""))
    with pytest.raises(InputError, match=r"update\.parameters"):
        study.run(path)


def test_rigid_modes_stay_to_rounding_however_soft_the_frame_is_out_of_its_plane():
    """Whatever entries move, within the clause all six motions stay free by the package's own
    measure; the bay is 160 times softer out of its plane."""
    spec, model, recordings = study.open_problem(PROBLEMS / "ceam/whole" / "problem.toml")
    context = ModelContext(spec, model, recordings)
    table = CONSTRAINTS.named("StiffnessPositive").keys["stiffness_positive"].table(matrix=False)
    (clause,) = StiffnessPositive.from_spec(table, context).clauses(context.columns)
    rows = np.zeros((len(clause.lower), len(model.parameters)))
    rows[:, list(clause.on)] = clause.C
    free = la.null_space(rows)
    assert free.shape[1] > 100
    rng = np.random.default_rng(0)
    for _ in range(5):
        p = free @ rng.normal(size=free.shape[1])
        p *= 0.3 / np.abs(p).max()
        for _ in range(2):
            p -= rows.T @ la.solve(rows @ rows.T, rows @ p)
        assert free_motions(model, model.matrices(p).K).shape[1] == 6


@pytest.mark.slow
def test_the_bay_on_its_own_pattern():
    """Ten modes of X1 and 362 entries of FE1's stiffness, the problem file as it is, matrix
    inequality included."""
    path = PROBLEMS / "ceam/whole" / "problem.toml"
    updated = study.run(path)
    assert updated.status == "converged"
    _, model, _ = study.open_problem(path)
    assert len(model.parameters) == 362
    K = model.matrices(np.array([q.p for q in updated.parameters])).K.toarray()
    before = model.matrices().K.toarray()
    size = np.sqrt(np.diag(before))
    assert np.all(
        np.abs(K / np.outer(size, size))[np.abs(before) < 1e-12 * np.outer(size, size)] < 1e-12
    )
    assert np.abs(K - K.T).max() < 1e-12 * np.abs(K).max()
    assert updated.model["stiffness_eigenvalue_min"] > -1e-12
    assert rigid_body_modes(model, sp.csc_array(K), model.matrices().M).shape[1] == 6
    assert updated.fit["fit"]["frequency_error_percent_max"]["after"] < 0.01
    error = updated.fit["hold_out"]["frf_error"]
    assert error["after"] < 0.5 * error["before"]


def test_rigid_body_modes_are_free_to_rounding(tmp_path):
    """What a solver leaves of K R = 0 would be a soft support: the equalities are met exactly after
    the step."""
    path, target = problem(
        tmp_path, 'matrices = ["K"]', "stiffness_positive = { matrix = false }", modes=4, more=PRIOR
    )
    updated = study.run(path)
    K = matrices(path, updated).K.toarray()
    assert np.abs(K @ rigid_motions(target)).max() < 1e-13 * np.abs(K).max()
    assert updated.fit["fit"]["mac_min"]["after"] > 1 - 1e-6
