"""Every effect is the model with one more parameter: its tangent is the derivative of what
the refit uses, its limits are the known ones."""

from __future__ import annotations

import time

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.nominal.supports import held_dofs, release_from
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import natural_modes
from cvxupdate.physics import EFFECTS, candidates_of
from cvxupdate.physics.attached_resonator import attach
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.growth import Rates
from cvxupdate.spec import load_problem


def context_of(problem):
    spec, model = problem
    start = with_nuisance(undamped(model))
    m = start.matrices(start.zero())
    held = held_dofs(spec, model)
    return SearchContext(
        start, m.K, m.M, 800.0, 5.0, tuple(start.labels[:3]), tuple(held), release_from(spec), 0.005
    )


def grown(candidate, p):
    """K, M, C, D of the refitted model; DOFs that the base model does not have are condensed
    (statically, K alone has them coupled)."""
    model = candidate.change.model
    full = np.zeros(len(model.parameters))
    full[len(full) - candidate.columns :] = p
    return model, {k: getattr(model.matrices(full), k).toarray() for k in "KMCD"}


def onto(base, model, K):
    """K of ``model`` on the DOFs of ``base``, the others condensed."""
    keep = [model.place[label] for label in base.labels]
    rest = [i for i in range(K.shape[0]) if i not in set(keep)]
    if not rest:
        return K[np.ix_(keep, keep)]
    return K[np.ix_(keep, keep)] - K[np.ix_(keep, rest)] @ np.linalg.solve(
        K[np.ix_(rest, rest)], K[np.ix_(rest, keep)]
    )


def assembled(base, blocks, what):
    out = np.zeros((base.size + 1, base.size + 1))
    for b in blocks:
        part = getattr(b, what)
        if part is not None:
            for dofs, small in zip(b.dofs, part, strict=True):
                out[np.ix_(dofs, dofs)] += small
    return out[:-1, :-1]


CHAIN_WORDS = (
    "stiffness_change",
    "added_mass",
    "grounding_spring",
    "viscous_damper",
    "structural_damping",
    "mass_proportional_damping",
)
BAR_WORDS = (
    "stiffness_change",
    "mass_change",
    "thickness_change",
    "added_mass",
    "grounding_spring",
    "joint_flexibility",
    "shear_deformation",
    "axial_preload",
    "viscous_damper",
    "structural_damping",
    "mass_proportional_damping",
)


@pytest.mark.parametrize(
    ("which", "name"), [("chain", w) for w in CHAIN_WORDS] + [("bar", w) for w in BAR_WORDS]
)
def test_tangents_are_derivatives_of_the_refitted_model(request, which, name):
    context = context_of(request.getfixturevalue(which))
    found = candidates_of(context, (name,))
    assert found, name
    h = 1e-6
    for candidate in found[:25]:
        for k in range(candidate.count):
            step = np.zeros(candidate.columns)
            step[k] = h
            model, after = grown(candidate, step)
            _, before = grown(candidate, np.zeros(candidate.columns))
            compliance = model.size > context.model.size
            for what in "K" if compliance else "KMCD":
                wanted = (
                    onto(context.model, model, after[what])
                    - onto(context.model, model, before[what])
                ) / h
                got = assembled(context.model, candidate.change.tangent[k], what)
                # a compliance begins at a ten thousandth of the structure's own, not at zero: that
                # is all the difference there may be
                tolerance = (1e-3 if compliance else 1e-5) * max(
                    np.abs(wanted).max(), 1e-12
                ) + 1e-9 * np.abs(before[what]).max() / h * 1e-4
                assert np.abs(got - wanted).max() <= tolerance, (candidate.name, what)


def test_the_rates_of_a_given_matrix_take_time_in_proportion_to_its_entries(tmp_path):
    """Each stored entry is a block of the one element: 16 times as many take not 256 times as long.
    And the tangent of the element is the matrix."""
    took = {}
    for n in (500, 8000):
        K = sp.diags([np.full(n - 1, -1.0), np.full(n, 2.5), np.full(n - 1, -1.0)], (-1, 0, 1))
        sp.save_npz(tmp_path / f"K{n}.npz", K.tocsr())
        problem = tmp_path / "problem.toml"
        problem.write_text(
            '[model]\ndofs = ["x"]\n[[model.elements]]\ntype = "matrix"\n'
            f'rows = [{{ id = 7, stiffness = "K{n}.npz", group = "all" }}]\n'
        )
        model = build_model(load_problem(problem))
        took[n] = np.inf
        for _ in range(3):
            began = time.thread_time()
            rates = Rates.of(model, "stiffness")
            took[n] = min(took[n], time.thread_time() - began)
        if n == 500:
            np.testing.assert_array_equal(assembled(model, rates.tangent((7,)), "K"), K.toarray())
    assert took[8000] < 64 * took[500]


@pytest.mark.parametrize("which", ["chain", "bar"])
def test_every_effect_leaves_the_model_as_it_is_at_zero(request, which):
    """Zero parameters: the structure of the file, or one that is rigid to one part in some
    thousands where the effect is a compliance."""
    context = context_of(request.getfixturevalue(which))
    base = natural_modes(context.K, context.M, 4, np.zeros((context.model.size, 0))).frequencies
    for t in EFFECTS:
        for c in t.candidates(context)[:12]:
            if c.change is None:
                continue
            _, m = grown(c, np.zeros(c.count))
            import scipy.linalg

            f = np.sqrt(
                scipy.linalg.eigh(
                    m["K"],
                    m["M"] + 1e-14 * np.trace(m["M"]) * np.eye(len(m["M"])),
                    eigvals_only=True,
                )[:4]
            ) / (2 * np.pi)
            np.testing.assert_allclose(f, base, rtol=1e-3, err_msg=c.name)


def test_soft_supports_and_joints_end_at_free_and_hinged(bar):
    """Compliance without end: the support is gone."""
    context = context_of(bar)
    soft = next(
        c
        for c in candidates_of(context, ("grounding_spring",))
        if c.place.nodes == (6,) and c.change.model.size > context.model.size
    )
    model, m = grown(soft, np.array([1e4]))
    row = model.place["n6.z"]
    released = context.release(6, "z")
    there = released.place["n6.z"]
    free = released.matrices(released.zero()).K[there, there]
    assert 0 < m["K"][row, row] - free < 2e-4 * free


def test_axial_force_changes_frequencies_as_euler_says(bar):
    """f(N) / f(0) = sqrt(1 + N / N_cr) for the first mode of a pinned bar; at −N_cr it buckles."""
    context = context_of(bar)
    preload = candidates_of(context, ("axial_preload",))[0]
    f0 = natural_modes(context.K, context.M, 1, np.zeros((context.model.size, 0))).frequencies[0]
    for ratio in (-0.5, 0.4, 3.0):
        model = preload.change.model
        full = np.zeros(len(model.parameters))
        full[-1] = ratio
        m = model.matrices(full)
        f = natural_modes(m.K, m.M, 1, np.zeros((model.size, 0))).frequencies[0]
        assert f / f0 == pytest.approx(np.sqrt(1 + ratio), rel=2e-3)
    euler = np.pi**2 * 207e9 * 0.04 * 0.008**3 / 12 / 0.6**2
    assert model.parameters[-1].physical(1.0) == pytest.approx(euler, rel=1e-9)


def test_a_resonator_adds_its_dynamic_stiffness(chain):
    """Seen from its host: −ω² m (k + iωc) / (k + iωc − ω² m)."""
    context = context_of(chain)
    row, mass, tuning, zeta = 2, 0.08, 17.0, 0.03
    model = attach(context.model, row, tuning, mass, zeta)
    m = model.matrices(model.zero())
    k, c = mass * (2 * np.pi * tuning) ** 2, 2 * zeta * mass * 2 * np.pi * tuning
    K, M = context.K.toarray(), context.M.toarray()
    for f in (3.0, 16.5, 17.0, 40.0):
        w = 2 * np.pi * f
        grown_z = m.K.toarray() - w**2 * m.M.toarray() + 1j * w * m.C.toarray()
        z = K - w**2 * M + 0j
        z[row, row] += -(w**2) * mass * (k + 1j * w * c) / (k + 1j * w * c - w**2 * mass)
        np.testing.assert_allclose(np.linalg.inv(grown_z)[:4, :4], np.linalg.inv(z), rtol=1e-9)
    assert [q.physical(0.0) for q in model.parameters[-3:]] == pytest.approx([mass, k, c])


def test_tie_of_sensor_faults_to_channels(chain):
    context = context_of(chain)
    found = candidates_of(context, ("sensor_fault",))
    assert {(c.fault.channel, c.fault.how, c.fault.other) for c in found} == {
        *((label, how, "") for label in context.sensors for how in ("gain", "delay")),
        ("n1.x", "swap", "n2.x"),
        ("n1.x", "swap", "n3.x"),
        ("n2.x", "swap", "n3.x"),
    }
    assert next(c for c in found if c.fault.how == "swap").place.nodes == (1, 2)
    assert len({c.name for c in found}) == len(found)
