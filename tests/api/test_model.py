"""Models from arrays and matrices: the same matrices as a problem file gives, laws of mechanics,
and a word for everything that is wrong."""

from __future__ import annotations

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.linalg import eigh

import cvxupdate
from cvxupdate import InputError, Model

STEEL = {"steel": {"E": 207e9, "rho": 7850.0}}
BAR = {"bar": {"shape": "rectangle", "width": 0.03, "height": 0.01}}
X = np.array([0.0, 0.11, 0.26, 0.34, 0.5])  # unequal spans
RNG = np.random.default_rng(5)


def beam(**further) -> Model:
    conn = np.c_[np.arange(1, 5), np.arange(2, 6)]
    block = {
        "type": "beam2d",
        "nodes": conn,
        "material": "steel",
        "section": "bar",
        "group": ["root", "root", "tip", "tip"],
    }
    lump = {"type": "mass", "nodes": [[3]], "m": np.array([0.21])}
    return Model(
        np.c_[X, 0 * X],
        [block, lump],
        materials=STEEL,
        sections=BAR,
        **{"supports": {1: "all"}, **further},
    )


def spd(n: int) -> np.ndarray:
    A = RNG.standard_normal((n, n))
    return A @ A.T + n * np.eye(n)


def test_arrays_and_a_problem_file_give_one_model() -> None:
    model = beam(damping={"kind": "structural", "eta": 0.01})
    rows = "".join(
        f'{{ id = {i}, nodes = [{i}, {i + 1}], group = "{"root" if i < 3 else "tip"}" }}, '
        for i in range(1, 5)
    )
    nodes = "".join(f"{{ id = {i}, x = {float(x)!r} }}, " for i, x in enumerate(X, 1))
    text = f"""
[model]
dofs = ["x", "y", "rz"]
nodes = [{nodes}]
materials.steel = {{ E = 207e9, rho = 7850.0 }}
sections.bar = {{ shape = "rectangle", width = 0.03, height = 0.01 }}
elements = [ {{ type = "beam2d", material = "steel", section = "bar", rows = [{rows}] }},
             {{ type = "mass", rows = [{{ id = 5, nodes = [3], m = 0.21 }}] }} ]
supports = [{{ nodes = [1], dofs = ["x", "y", "z", "rx", "ry", "rz"] }}]
damping = {{ kind = "structural", eta = 0.01 }}
"""
    other = Model.from_problem(text)
    assert model.labels == other.labels and model.groups == {"root": [1, 2], "tip": [3, 4]}
    for name in "KMCD":
        assert abs(getattr(model, name) - getattr(other, name)).max() == 0.0
    again = Model.from_problem(model.to_toml())
    assert abs(again.K - model.K).max() == 0.0
    assert repr(model).startswith("Model(5 nodes, 12 free DOFs, 5 elements, 2 groups")
    assert len(repr(model)) < 120 and "<strong>" in model._repr_html_()
    assert model.mass == pytest.approx(0.21 + 7850 * 0.03 * 0.01 * 0.5)


def test_matrices_come_back_as_they_went_in() -> None:
    K, M, C = spd(4), spd(4), spd(4)
    labels = ["n4.z", "4:+RY", (7, "z"), (7, 5)]
    model = Model.from_matrices(K, sp.csr_matrix(M), C, labels=labels)
    order = [model.labels.index(n) for n in ("n4.z", "n4.ry", "n7.z", "n7.ry")]
    for name, A in (("K", K), ("M", M), ("C", C)):
        assert np.allclose(getattr(model, name).toarray()[np.ix_(order, order)], A, rtol=1e-14)
    lam = eigh(K, M, eigvals_only=True)
    assert np.allclose(model.modes(4).frequencies, np.sqrt(lam) / (2 * np.pi), rtol=1e-10)


def test_groups_and_what_they_leave_are_the_whole() -> None:
    K1, K2, M, at = spd(3), spd(2), np.diag([1.0, 2.0, 3.0]), ["n1.x", "n2.x", "n3.x"]
    whole = K1.copy()
    whole[1:, 1:] += K2
    part = {"K": K2, "labels": at[1:]}
    model = Model.from_matrices(whole, M, labels=at, groups={"brace": part})
    assert np.allclose(model.K.toarray(), whole) and model.groups == {"brace": [1]}
    f = model.modes(1)
    up = cvxupdate.update(model, cvxupdate.Modes([1.1 * f.frequencies[0]]), ["brace: stiffness"])
    assert up.status == "converged" and up.parameters[0].p > 0.0
    stiff = up.model.K.toarray()
    assert np.allclose(stiff - whole, np.pad(up.parameters[0].p * K2, ((1, 0), (1, 0))), atol=1e-6)
    assert up.model.modes(1).frequencies[0] == pytest.approx(1.1 * f.frequencies[0], rel=1e-4)


def test_a_complex_stiffness_is_a_loss() -> None:
    K, M = spd(2), np.eye(2)
    model = Model.from_matrices(K * (1 + 0.02j), M)
    assert np.allclose(model.D.toarray(), 0.02 * K) and np.allclose(model.K.toarray(), K)
    assert np.allclose(model.modes(2).damping, 0.01)


def test_responses_solve_the_equations_of_motion() -> None:
    K, M, C = spd(3), np.diag([1.0, 2.0, 1.5]), 0.01 * spd(3)
    model, f = Model.from_matrices(K, M, C), np.array([0.1, 0.4, 2.0])
    H = model.frf(f, quantity="mobility").H
    for k, w in enumerate(2 * np.pi * f):
        exact = 1j * w * np.linalg.inv(K - w**2 * M + 1j * w * C)
        assert np.allclose(H[k], exact, rtol=1e-9)
    turned = model.frf(f, ["1:-X"], ["n2.x"])
    assert np.allclose(turned.H[:, 0, 0], model.frf(f, ["n1.x"], ["n2.x"]).H[:, 0, 0])
    assert turned.responses[0].label == "n1.x"


def test_a_held_place_does_not_move() -> None:
    assert np.all(beam().frf([5.0, 9.0], ["n1.y"], ["n3.y"]).H == 0.0)


def test_pandas_rows_are_nodes_and_elements() -> None:
    pandas = pytest.importorskip("pandas")
    nodes = pandas.DataFrame({"id": [1, 2], "x": [0.0, 1.0]})
    rows = pandas.DataFrame(
        {"id": [1, 2], "nodes": [[1], [1, 2]], "k": [2e4, 3e4], "group": ["a", None]}
    )
    masses = {"type": "mass", "nodes": [[1], [2]], "m": 1.0}
    model = Model(nodes, [{"type": "spring", "dof": "x", "rows": rows}, masses])
    assert np.allclose(model.K.toarray(), [[5e4, -3e4], [-3e4, 3e4]])
    table = model.to_dataframe()
    assert list(table["type"]) == ["spring", "spring", "mass", "mass"]
    assert model.groups == {"a": [1]}


@pytest.mark.parametrize(
    ("make", "says"),
    [
        (lambda: Model.from_matrices(spd(3), spd(2)), "different sizes"),
        (lambda: Model.from_matrices(np.ones((2, 3))), "square"),
        (lambda: Model.from_matrices([[1.0, np.nan], [0, 1]], np.eye(2)), "not finite"),
        (lambda: Model.from_matrices([[1.0, 2.0], [0.0, 1.0]], np.eye(2)), "not symmetric"),
        (lambda: Model.from_matrices([["a"]], [[1.0]]), "no matrix of numbers"),
        (lambda: Model.from_matrices(np.eye(2), np.eye(2), labels=["n1.x"]), "1 for matrices of 2"),
        (lambda: Model.from_matrices(np.eye(2), np.eye(2), labels=["n1.x", "n1.x"]), "two rows"),
        (lambda: Model.from_matrices(np.eye(1), np.eye(1), labels=["1:-X"]), "against its axis"),
        (lambda: Model.from_matrices(np.eye(1), np.eye(1), labels=["top"]), "no degree of freedom"),
        (lambda: Model.from_matrices(), "give K and M"),
        (lambda: Model.from_matrices(np.eye(2), np.eye(2), groups={"a": {"Q": 1}}), "has Q"),
        (lambda: Model.from_matrices(np.eye(2), np.eye(2), groups=[np.eye(2)]), "groups: give"),
        (lambda: Model.from_matrices(1j * np.eye(2), np.eye(2), D=np.eye(2)), "loss once"),
        (lambda: Model.from_matrices(np.eye(2), 1j * np.eye(2)), "only K may be"),
        (lambda: Model(np.zeros((2, 4)), []), "has 4 coordinates"),
        (lambda: Model([[0.0], [1.0]], "beam"), "list of blocks"),
        (lambda: Model([[0.0], [1.0]], [3]), "is no dictionary"),
        (
            lambda: Model(
                [[0.0], [1.0]], [{"type": "spring", "nodes": [[1, 2]], "dof": "x", "k": [1, 2]}]
            ),
            "2 values for 1",
        ),
        (
            lambda: Model(
                [[0.0], [1.0]], [{"type": "spring", "nodes": [[1, 9]], "dof": "x", "k": 1.0}]
            ),
            "node 9",
        ),
        (lambda: Model([[0.0], [1.0]], [{"type": "sprung", "nodes": [[1, 2]]}]), "sprung"),
        (lambda: beam(supports={99: "all"}), "99"),
        (lambda: beam(damping={"kind": "magic"}), "magic"),
        (lambda: beam(colour="red"), "unknown key 'colour'"),
        (lambda: beam().frf([1.0, 2.0], ["n99.y"]), "no such degree of freedom"),
        (lambda: beam().modes(0), "at least 1"),
        (lambda: beam().modes("many"), "not a number"),
        (lambda: beam().frf([1.0, 2.0], quantity="speed"), "no motion"),
    ],
)
def test_bad_input_is_said_in_words(make, says: str) -> None:
    with pytest.raises(InputError, match=says):
        make()


def test_figures_of_a_model() -> None:
    figure = beam().plot()
    assert figure.axes[0].get_xlabel() == "x (m)"
    with pytest.raises(InputError, match="no coordinates"):
        Model.from_matrices(np.eye(2), np.eye(2)).plot()
