"""Constrained eigenstructure assignment through `run`: exact cases, definiteness, conflicts with
known answer, what is proved impossible."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg as la

from cvxupdate import study
from cvxupdate.convex import Mirror
from cvxupdate.errors import InputError
from cvxupdate.fe.build import build_model
from cvxupdate.recordings.load import load_recordings
from cvxupdate.residual.ceam import CeamResidual
from cvxupdate.residual.ceam_modes import assigned_modes
from cvxupdate.spec import load_problem
from cvxupdate.update import ceam
from cvxupdate.update.admissible import admissible
from cvxupdate.update.definite import definiteness
from cvxupdate.update.parts import step_problem
from tests.cases.ceam_frame import built, measure, model_text, recording, update_text

STIFF = np.array([1.0, 1.15, 0.9, 1.0, 1.1, 1.0, 0.85])
MASS = np.array([1.0, 1.0, 1.1, 0.95, 1.0, 1.0, 1.05])
ALL = ("x", "y", "z", "rx", "ry", "rz")


def problem(
    folder,
    constraints="",
    stiff=STIFF,
    mass=None,
    eta=None,
    modes=4,
    dofs=ALL,
    of=("stiffness",),
    ground=False,
    low=-0.9,
    high=1.0,
    noise=0.0,
    std=None,
    update="",
    extra="",
    seed=0,
):
    """A problem file whose recordings come from another frame."""
    target = built(model_text(stiff, mass, eta), folder, "target.toml")
    text = model_text(eta=None if eta is None else 0.02, ground=ground) + recording(
        measure(target, modes), dofs, noise, std, seed=seed
    )
    (folder / "problem.toml").write_text(
        text
        + update_text(of, low, high, more=update, extra=extra)
        + f"[constraints]\n{constraints}\n"
    )
    return folder / "problem.toml"


def values(updated, of):
    return np.array([q.p for q in updated.parameters if q.of == of])


def test_stiffness_and_mass_are_found_exactly_when_the_total_mass_is_known(tmp_path):
    mass = MASS.copy()
    lengths = np.array([np.linalg.norm(np.subtract(*(p for p in pair))) for pair in _ends()])
    mass /= (mass @ lengths) / lengths.sum()
    updated = study.run(
        problem(tmp_path, "total_mass = { conserve = true }", mass=mass, of=("stiffness", "mass"))
    )
    assert updated.status == "converged"
    assert values(updated, "stiffness") == pytest.approx(STIFF - 1, abs=1e-6)
    assert values(updated, "mass") == pytest.approx(mass - 1, abs=1e-6)
    assert updated.fit["fit"]["frequency_error_percent_max"]["after"] < 1e-5
    assert updated.certificate["optimal"]
    assert updated.model["mass_eigenvalue_min"] > 0
    assert updated.model["stiffness_eigenvalue_min"] > -1e-10


def _ends():
    from tests.cases.ceam_frame import BEAMS, NODES

    xyz = [np.array([x, y, 0.1 * (i == 3)]) for i, (x, y) in enumerate(NODES)]
    return [(xyz[a], xyz[b]) for a, b in BEAMS]


def test_without_the_total_mass_only_the_ratio_is_determined_and_that_is_said(tmp_path):
    updated = study.run(problem(tmp_path, mass=MASS, of=("stiffness", "mass")))
    assert len(updated.undetermined) == 1  # K and M scaled together leave every mode as it is
    scale = (1 + values(updated, "stiffness")) / STIFF
    assert scale == pytest.approx(np.full(7, scale[0]), rel=1e-5)
    assert (1 + values(updated, "mass")) / MASS == pytest.approx(np.full(7, scale[0]), rel=1e-5)


def test_non_proportional_damping_is_found_exactly(tmp_path):
    eta = np.array([0.02, 0.0, 0.03, 0.01, 0.0, 0.02, 0.04])
    updated = study.run(problem(tmp_path, eta=eta, of=("stiffness", "damping")))
    assert values(updated, "stiffness") == pytest.approx(STIFF - 1, abs=1e-6)
    assert values(updated, "damping") == pytest.approx(eta * STIFF / 0.02 - 1, abs=1e-6)


def test_translations_alone_are_enough(tmp_path):
    updated = study.run(problem(tmp_path, dofs=("x", "y", "z")))
    assert updated.status == "converged"
    assert values(updated, "stiffness") == pytest.approx(STIFF - 1, abs=1e-6)
    assert any("only locally" in note for note in updated.notes)


@pytest.mark.parametrize(
    "expansion",
    ["null-space", "kidder", "petersmann", "guyan", "irs", "gysin", "serep", "tam", "hybrid"],
)
def test_expansions_improve_the_model(tmp_path, expansion):
    updated = study.run(
        problem(tmp_path, dofs=("x", "y", "z"), update=f'expansion = "{expansion}"\n')
    )
    error = updated.fit["fit"]["frequency_error_percent_mean"]
    assert updated.status == "converged"
    assert error["after"] < 0.5 * error["before"]


def test_self_assigned_modes_hold_the_model_where_nothing_was_measured(tmp_path):
    plain = study.run(problem(tmp_path, modes=2, noise=0.02, std=0.02))
    held = study.run(problem(tmp_path, modes=2, noise=0.02, std=0.02, update="self_assign = 6\n"))
    assert (
        np.linalg.norm(values(held, "stiffness"))
        < np.linalg.norm(values(plain, "stiffness")) + 1e-9
    )


def test_too_many_own_modes_are_refused(tmp_path):
    with pytest.raises(InputError, match="the model has only"):
        study.run(problem(tmp_path, update="self_assign = 60\n"))


def test_two_stages_converge_to_the_same_exact_answer(tmp_path):
    updated = study.run(problem(tmp_path, update="stages = 2\n"))
    assert values(updated, "stiffness") == pytest.approx(STIFF - 1, abs=1e-6)
    assert any("Two stages" in note for note in updated.notes)


def test_the_mass_inequality_is_what_keeps_the_mass_definite(tmp_path):
    """Lumps that may be taken off: without the clause the fit takes off more than there is."""
    lump = (
        ', { elements = [40, 41], of = "m", each = "element", lower = -60.0, upper = 60.0, scale '
        "= 0.1 }"
    )
    block = (
        '[[model.elements]]\ntype = "mass"\nrows = [{ id = 40, nodes = [2], m = 0.0 }, { id = '
        "41, nodes = [4], m = 0.0 }]\n"
    )

    def case(constraints):
        target = built(
            model_text(STIFF, np.array([1, 0.1, 0.1, 1, 1, 1, 1.0])), tmp_path, "target.toml"
        )
        text = model_text() + block + recording(measure(target, 4), noise=0.15, std=0.15, seed=3)
        (tmp_path / "problem.toml").write_text(
            text
            + update_text(("stiffness",), -0.9, 3.0, extra=lump)
            + f"[constraints]\n{constraints}\n"
        )
        return tmp_path / "problem.toml"

    path = case("")
    free = study.run(path)
    p = [q.p for q in free.parameters]
    M = build_model(load_problem(path)).matrices(np.array(p)).M.toarray()
    assert la.eigvalsh(M)[0] < 0
    assert free.model["mass_eigenvalue_min"] < 0
    kept = study.run(case("mass_positive = { matrix = true, elements = false, floor = 1e-3 }"))
    assert kept.status == "converged"
    M = (
        build_model(load_problem(path))
        .matrices(np.array([q.p for q in kept.parameters]))
        .M.toarray()
    )
    assert la.eigvalsh(M)[0] > 0
    assert kept.model["mass_eigenvalue_min"] > 0
    assert any("mass matrix stays positive definite" in c for c in kept.active)


GROUND = ', { elements = [20], of = "k", lower = 0.0, upper = 5.0, scale = 1e4 }'


def linear(*pairs):
    """The linear clauses on single parameters: name, side, name, side, …"""
    rows = ", ".join(
        f'{{ coefficients = {{ "{name}" = 1.0 }}, {side} }}'
        for name, side in zip(pairs[::2], pairs[1::2], strict=True)
    )
    return f"linear = [{rows}]"


CONFLICTS = {
    "mode out of bounds": (
        {"high": 0.1, "low": -0.3, "constraints": "modes = [{ mode = 1 }]"},
        {"mode 1", "bounds on e2.stiffness"},
    ),
    "mode within deviations": (
        {
            "high": 0.05,
            "low": -0.3,
            "std": 1e-4,
            "constraints": "modes = [{ mode = 2, within = 2.0 }]",
            "stiff": np.array([1, 1.3, 1, 1, 1, 1, 1.0]),
        },
        {"mode 2", "bounds on e2.stiffness"},
    ),
    "mass out of reach": (
        {
            "of": ("stiffness", "mass"),
            "high": 0.1,
            "low": -0.1,
            "constraints": "total_mass = { value = 9.0e1 }",
        },
        {"total mass", *(f"bounds on e{i}.mass" for i in range(1, 8))},
    ),
    "element mass taken away": (
        {
            "of": ("mass",),
            "low": -0.99,
            "extra": ', { elements = [1], of = "rho", lower = -0.5 }',
            "constraints": "mass_positive = { floor = 0.2 }\n"
            'linear = [{ coefficients = { "e3.mass" = 1.0 }, at_most = -0.9 }]',
        },
        {"element mass of e3.mass", "e3.mass at most -0.9"},
    ),
    "stiffness taken away": (
        {
            "low": -0.99,
            "constraints": "stiffness_positive = { floor = 1e-3 }\n"
            + linear("e1.stiffness", "at_most = -0.98", "e6.stiffness", "at_most = -0.98"),
        },
        None,
    ),
    "grounded though free": (
        {
            "ground": True,
            "extra": GROUND,
            "constraints": "stiffness_positive = { matrix = false }\n"
            'linear = [{ coefficients = { "e20.k" = 1.0 }, at_least = 0.5 }]',
        },
        {"rigid-body modes", "e20.k at least 0.5"},
    ),
    "budget too small": (
        {
            "constraints": "budget = { at_most = 0.1 }\n"
            'linear = [{ coefficients = { "e4.stiffness" = 1.0 }, at_least = 0.2 }]'
        },
        {"budget", "e4.stiffness at least 0.2"},
    ),
    "total budget too small": (
        {
            "constraints": 'budget = { at_most = 0.3, norm = "l1" }\n'
            + linear("e4.stiffness", "at_least = 0.2", "e5.stiffness", "at_most = -0.2")
        },
        {"budget", "e4.stiffness at least 0.2", "e5.stiffness at most -0.2"},
    ),
    "neighbours too unlike": (
        {
            "constraints": "smoothness = { at_most = 0.05 }\n"
            'linear = [{ coefficients = { "e1.stiffness" = 1.0, "e2.stiffness" = -1.0 }, '
            "equals = 0.2 }]"
        },
        {"neighbours e1.stiffness and e2.stiffness", "e1.stiffness - e2.stiffness = 0.2"},
    ),
    "tied but different": (
        {
            "constraints": 'tied_groups = [{ groups = ["deck"], of = "stiffness" }]\n'
            + linear("e1.stiffness", "equals = 0.2", "e2.stiffness", "equals = 0.1")
        },
        {"tied: e1.stiffness = e2.stiffness", "e1.stiffness = 0.2", "e2.stiffness = 0.1"},
    ),
    "centre of gravity out of reach": (
        {
            "of": ("mass",),
            "high": 0.02,
            "low": -0.02,
            "constraints": "inertia = { conserve = false, centre = [0.9, 0.29, 0.02] }",
        },
        None,
    ),
    "inertia against mass": (
        {
            "of": ("mass",),
            "constraints": "inertia = { }\nlinear = [{ coefficients = { "
            + ", ".join(f'"e{i}.mass" = 1.0' for i in range(1, 8))
            + " }, at_least = 3.0 }]",
        },
        None,
    ),
}


@pytest.mark.parametrize("name", CONFLICTS)
def test_a_known_conflict_is_named(tmp_path, name):
    case, expected = CONFLICTS[name]
    updated = study.run(problem(tmp_path, **case))
    assert updated.status == "infeasible"
    if expected is not None:
        found = set(updated.conflict)
        assert len(found) == len(expected), found
        assert all(any(clause.startswith(start) for clause in found) for start in expected), found
    _irreducible(tmp_path, updated)


def _irreducible(folder, updated):
    """Independent of the tool: its conflict cannot hold, and without any one clause it can (by
    cvxpy and Clarabel)."""
    import cvxpy as cp

    spec = load_problem(folder / "problem.toml")
    model = build_model(spec)
    step = step_problem(spec, model, load_recordings(spec))
    clauses = [c for c in step.clauses if c.name in updated.conflict]
    assert len(clauses) == len(updated.conflict)

    def gap(chosen):
        p, t = cp.Variable(len(step.columns)), cp.Variable(nonneg=True)
        made = []
        for c in chosen:
            if hasattr(c, "C"):
                value = c.C @ p[list(c.on)]
                size = max(np.abs(c.C).max(), 1e-300)
                up, low = np.isfinite(c.upper), np.isfinite(c.lower)
                made += [value[up] / size <= c.upper[up] / size + t] if np.any(up) else []
                made += [value[low] / size >= c.lower[low] / size - t] if np.any(low) else []
            else:
                made += list(c.constraints(p, t))
        problem = cp.Problem(cp.Minimize(t), made)
        problem.solve(solver=cp.CLARABEL)
        return float(t.value)

    whole = gap(clauses)
    assert whole > 1e-6
    for left_out in clauses:
        assert gap([c for c in clauses if c is not left_out]) < 1e-3 * whole, left_out.name


def test_the_way_out_of_a_conflict_is_the_true_change(tmp_path):
    updated = study.run(
        problem(
            tmp_path,
            "modes = [{ mode = 3 }]",
            stiff=np.array([1, 1.17, 1, 1, 1, 1, 1.0]),
            low=-0.1,
            high=0.1,
        )
    )
    assert any(
        '"bounds on e2.stiffness: -0.1 to 0.1" has its upper limit at 0.17 instead of 0.1' in line
        for line in updated.relaxation
    ), updated.relaxation


def prove(path, confidence=0.99):
    spec = load_problem(path)
    model = build_model(spec)
    recordings = load_recordings(spec)
    return admissible(model, recordings, step_problem(spec, model, recordings), confidence)


def test_impossible_is_proved_only_when_it_is(tmp_path):
    truth = {"stiff": np.array([1, 1.0, 1, 1.6, 1, 1, 1.0]), "noise": 1e-6, "std": 1e-6}
    inside = prove(problem(tmp_path, **truth, low=-0.5, high=0.7))
    assert inside.possible
    outside = prove(problem(tmp_path, **truth, low=-0.3, high=0.3))
    assert not outside.possible
    assert any("bounds on e4.stiffness" in c for c in outside.conflict)
    assert any("equation of motion" in c for c in outside.conflict)
    assert outside.proof is not None
    assert "no admissible parameters" in outside.says


def test_the_proof_survives_noise_within_its_band(tmp_path):
    """The truth is admissible, so no draw of the noise may be called impossible."""
    for seed in range(5):
        assert prove(
            problem(tmp_path, noise=3e-4, std=3e-4, low=-0.5, high=0.5, seed=seed)
        ).possible


def test_a_wrong_mass_is_not_to_be_explained_by_stiffness(tmp_path):
    """Physics that the parameters lack (a lump) cannot be made up for by any admissible
    stiffness."""
    heavy = MASS.copy()
    heavy[1] = 1.8
    found = prove(problem(tmp_path, mass=heavy, noise=1e-7, std=1e-7, low=-0.4, high=0.4))
    assert not found.possible


def test_nothing_is_proved_from_incomplete_shapes(tmp_path):
    with pytest.raises(InputError, match="only locally"):
        prove(problem(tmp_path, dofs=("x", "y", "z"), std=0.01))


def test_definiteness_is_computed_from_the_matrices(tmp_path):
    model = build_model(load_problem(problem(tmp_path, of=("stiffness", "mass"))))
    p = np.zeros(14)
    good = definiteness(model, p)
    assert good["mass_eigenvalue_min"] > 0
    p[7:] = -1.5
    bad = definiteness(model, p)
    scale = 1 / np.sqrt(np.abs(np.diag(model.matrices(p).M.toarray())))
    M = scale[:, None] * model.matrices(p).M.toarray() * scale
    assert bad["mass_eigenvalue_min"] == pytest.approx(la.eigvalsh(M)[0], rel=1e-10)
    assert definiteness(model, [np.nan] * 14)["mass_eigenvalue_min"] is None


def test_solvers_compare_the_ceam_step(tmp_path):
    _, rows, spread = study.solvers(
        problem(
            tmp_path,
            "mass_positive = { matrix = true }\nbudget = { at_most = 2.0 }",
            of=("stiffness", "mass"),
        )
    )
    named = {r.solver: r for r in rows}
    assert named["CLARABEL"].status == "optimal"
    assert named["OSQP"].status == "refused"
    assert "cannot take" in named["OSQP"].note
    assert spread < 1e-4


@pytest.mark.parametrize("method", ["frequencies", "sensitivity"])
def test_physical_clauses_serve_other_methods(tmp_path, method):
    path = problem(
        tmp_path,
        "smoothness = { at_most = 0.3 }\nstiffness_positive = { floor = 1e-6 }\nbudget = { "
        "at_most = 1.0 }",
        modes=6,
    )
    path.write_text(path.read_text().replace('method = "ceam"', f'method = "{method}"'))
    updated = study.run(path)
    assert updated.status == "converged"
    error = updated.fit["fit"]["frequency_error_percent_mean"]
    assert error["after"] < 0.2 * error["before"]
    p = values(updated, "stiffness")
    assert np.linalg.norm(p) <= 1.0 + 1e-6


def test_a_mirrored_structure_ties_its_halves(tmp_path):
    text = (
        '[model]\ndofs = ["x", "y"]\nnodes = [{ id = 1, x = -1.0, y = 0.0, z = 0.0 }, '
        "{ id = 2, x = 0.0, y = 0.4, z = 0.0 }, { id = 3, x = 1.0, y = 0.0, z = 0.0 }]\n"
        "[model.materials.s]\nE = 2e11\nnu = 0.3\nrho = 7800.0\n"
        '[model.sections.b]\nshape = "circle"\ndiameter = 0.02\n'
        '[[model.elements]]\ntype = "rod"\nmaterial = "s"\nsection = "b"\n'
        "rows = [{ id = 1, nodes = [1, 2] }, { id = 2, nodes = [3, 2] }, "
        "{ id = 3, nodes = [1, 3] }]\n"
        '[[recordings]]\nkind = "modes"\nrows = [{ frequency = 100.0 }]\n'
        '[update]\nmethod = "frequencies"\n'
        'parameters = [{ elements = "all", of = "stiffness", each = "element" }]\n'
        '[constraints]\nmirror = [{ plane = "x" }]\n'
    )
    (tmp_path / "problem.toml").write_text(text)
    spec = load_problem(tmp_path / "problem.toml")
    (mirror,) = [
        c for c in step_problem(spec, build_model(spec), ()).constraints if type(c) is Mirror
    ]
    assert mirror.pairs == (("e1.stiffness", "e2.stiffness"),)
    bad = replace(
        spec,
        constraints=spec.constraints.model_copy(
            update={"mirror": (spec.constraints.mirror[0].model_copy(update={"at": 0.3}),)}
        ),
    )
    with pytest.raises(InputError, match="no two parameters are mirror images"):
        step_problem(bad, build_model(spec), ())


def test_an_incomplete_mode_is_reproduced_within_its_deviations_but_never_exactly(tmp_path):
    tight = {"dofs": ("x", "y", "z"), "std": 0.01, "low": -0.09, "high": 0.09}
    path = problem(tmp_path, **tight)
    spec = load_problem(path)
    model = build_model(spec)
    first = assigned_modes(model, load_recordings(spec))[:1]
    system = CeamResidual(model, first, "null-space", model.zero()).evaluate(model.zero()).system()

    def misfit(updated):
        return np.sqrt(np.mean(system.residual(values(updated, "stiffness")) ** 2))

    free = study.run(path)
    kept = study.run(problem(tmp_path, "modes = [{ mode = 1, within = 0.3 }]", **tight))
    assert kept.status == "converged"
    assert any("mode 1" in c and "within 0.3" in c for c in kept.model["clauses"])
    assert misfit(free) > 0.35
    assert misfit(kept) <= 0.3 + 1e-6
    with pytest.raises(InputError, match="an exact clause would keep it wrong"):
        study.run(problem(tmp_path, "modes = [{ mode = 1 }]", **tight))


def rigid_inertia(model, p, centre):
    """Total mass and moments of inertia about axes through ``centre``, from nodal sums over the
    free DOFs: Rᵀ M R."""
    r = model.xyz[model.dof_node] - centre
    R = np.zeros((model.size, 6))
    for k in range(3):
        R[model.dof_kind == k, k] = R[model.dof_kind == 3 + k, 3 + k] = 1.0
        turn = np.cross(np.eye(3)[k], r)
        for a in range(3):
            R[model.dof_kind == a, 3 + k] = turn[model.dof_kind == a, a]
    return R.T @ (model.matrices(p).M @ R)


def centre_of(J):
    """(x, y, z) from the coupling of translations and rotations about the origin."""
    return np.array([J[1, 5], J[2, 3], J[0, 4]]) / J[0, 0]


def test_the_centre_of_gravity_and_the_moments_are_exactly_what_was_asked(tmp_path):
    plain = build_model(load_problem(problem(tmp_path, of=("mass",), low=-0.5, high=0.5)))
    true = np.array(
        [0.1, -0.05, 0.02, 0.15, -0.1, 0.05, 0.2]
    )  # masses that exist, so that what is asked can be had
    J = rigid_inertia(plain, true, np.zeros(3))
    centre = centre_of(J)
    moments = np.diag(rigid_inertia(plain, true, centre))[3:]
    words = (
        f"inertia = {{ mass = {float(J[0, 0])!r}, centre = {centre.tolist()!r}, moments = "
        f"{moments.tolist()!r} }}"
    )
    updated = study.run(problem(tmp_path, words, of=("mass",), low=-0.5, high=0.5))
    assert updated.status == "converged"
    p = values(updated, "mass")
    found = rigid_inertia(plain, p, np.zeros(3))
    assert found[0, 0] == pytest.approx(J[0, 0], rel=1e-8)
    assert centre_of(found) == pytest.approx(centre, abs=1e-8)
    assert np.diag(rigid_inertia(plain, p, centre))[3:] == pytest.approx(moments, rel=1e-7)


def test_conserved_inertia_is_that_of_the_model(tmp_path):
    updated = study.run(
        problem(
            tmp_path, "inertia = { }", mass=MASS, of=("stiffness", "mass"), noise=0.01, std=0.01
        )
    )
    model = build_model(load_problem(tmp_path / "problem.toml"))
    p = np.array([q.p for q in updated.parameters])
    before, after = (rigid_inertia(model, x, np.zeros(3)) for x in (0 * p, p))
    assert after == pytest.approx(before, abs=1e-7 * np.abs(before).max())
    assert np.abs(p).max() > 0.01


def test_the_first_stage_keeps_the_self_assigned_modes(tmp_path, monkeypatch):
    """Its equations are of the measured eigenvalues and of every own mode, as the second one's."""
    seen = []

    def noted(residual, *rest, **keywords):
        seen.append([m.label for m in residual.assigned])
        return assign(residual, *rest, **keywords)

    assign = ceam.assign
    monkeypatch.setattr(ceam, "assign", noted)
    study.run(problem(tmp_path, modes=3, update="stages = 2\nself_assign = 2\n"))
    first, second = seen[0], seen[-1]
    assert sum("own mode" in label for label in first) == 2 and len(first) == len(second) == 5
    assert sum("the model's shape" in label for label in first) == 3
