"""Elements and groups of a model: their matrices sum to the model's, and the balance names the
group that changed."""

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.correlate import element_batches, group_balance, group_matrices
from cvxupdate.correlate.elements import element_energies
from cvxupdate.fe.modes import model_modes
from cvxupdate.study import open_problem

TEXT = """
[model]
dofs = ["x", "z", "ry"]
nodes = [{ id = 1, x = 0.0 }, { id = 2, x = 0.3 }, { id = 3, x = 0.7 }, { id = 4, x = 1.0 },
         { id = 5, x = 1.6 }, { id = 6, x = 1.9 }]
[model.materials.steel]
E = 200e9
nu = 0.3
rho = 7800.0
[model.sections.bar]
shape = "rectangle"
width = 0.02
height = 0.01
[[model.elements]]
type = "beam3d"
material = "steel"
section = "bar"
rows = [
  { id = 1, nodes = [1, 2], group = "left" }, { id = 2, nodes = [2, 3], group = "left" },
  { id = 3, nodes = [3, 4], group = "middle" },
  { id = 4, nodes = [4, 5], group = "right" }, { id = 5, nodes = [5, 6], group = "right" },
]
[[model.elements]]
type = "mass"
rows = [{ id = 10, nodes = [4], m = 0.8, group = "lump" }]
[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 20, nodes = [5], k = 4e4, group = "prop" }]
[[model.supports]]
nodes = [1]
dofs = ["x", "z", "ry"]
"""


@pytest.fixture(scope="module")
def model(tmp_path_factory):
    path = tmp_path_factory.mktemp("beam") / "problem.toml"
    path.write_text(TEXT, encoding="utf-8")
    return open_problem(path)[1]


def changed(model, group, what, factor):
    return replace(
        model,
        blocks=tuple(
            replace(
                b,
                properties={
                    **b.properties,
                    what: np.where([g == group for g in b.groups], factor, b.properties[what]),
                },
            )
            for b in model.blocks
        ),
    )


def test_groups_and_elements_sum_to_the_model(model):
    m = model.matrices()
    groups = group_matrices(model)
    assert [g.name for g in groups] == ["left", "middle", "right", "lump", "prop"]
    for name, whole in (("K", m.K), ("M", m.M)):
        total = sum(getattr(g, name) for g in groups)
        assert np.allclose(
            total.toarray(), whole.toarray(), rtol=1e-12, atol=1e-12 * abs(whole).max()
        )
    batches, ids = element_batches(model)
    assert ids.tolist() == [1, 2, 3, 4, 5, 20], (
        "a lump has no stiffness and is no place for a change of it"
    )
    phi = model_modes(model, 4).shapes
    assert np.allclose(
        element_energies(batches, phi).sum(axis=0), 0.5 * np.sum(phi * (m.K @ phi), axis=0)
    )


@pytest.mark.parametrize(
    ("group", "what", "factor"),
    [
        ("left", "stiffness", 0.6),
        ("right", "stiffness", 1.4),
        ("prop", "stiffness", 0.5),
        ("lump", "mass", 1.7),
        ("middle", "mass", 0.7),
    ],
)
def test_a_changed_group_is_found_exactly_with_complete_shapes(model, group, what, factor):
    m, groups = model.matrices(), group_matrices(model)
    truth = model_modes(changed(model, group, what, factor), 5)
    found = group_balance(
        groups, m.K, m.M, truth.shapes * [1.0, -2.0, 0.3, 7.0, 1.0], truth.frequencies
    )
    k = [g.name for g in groups].index(group)
    share, change = (
        (found.stiffness, found.stiffness_change)
        if what == "stiffness"
        else (found.mass, found.mass_change)
    )
    both = np.concatenate([found.stiffness, found.mass])
    assert share[k] == pytest.approx(1.0, abs=1e-6) and change[k] == pytest.approx(
        factor - 1.0, rel=1e-5
    )
    assert np.sum(both > 1.0 - 1e-6) == 1


def test_no_group_loses_more_than_all_it_has(model):
    """Noisy shapes ask for losses beyond everything; the bound holds, and the share is what is left
    to explain with it."""
    m, groups = model.matrices(), group_matrices(model)
    own = model_modes(model, 5)
    found = [
        group_balance(
            groups,
            m.K,
            m.M,
            own.shapes * (1 + 0.5 * np.random.default_rng(seed).standard_normal(own.shapes.shape)),
            own.frequencies,
        )
        for seed in range(20)
    ]
    for b in found:
        assert np.all(b.stiffness_change >= -1.0) and np.all(b.mass_change >= -1.0)
        assert np.all((b.stiffness >= 0.0) & (b.stiffness <= 1.0)) and np.all(
            (b.mass >= 0.0) & (b.mass <= 1.0)
        )
    assert any(np.any(b.stiffness_change == -1.0) for b in found), "the bound was never asked for"
