"""One front door, three ways: each against dense inversion, for every kind of damping, on
structures of unequal spans without symmetry."""

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.synthesis import (
    COUPLED,
    DENSE,
    FEW_POINTS,
    ORDER,
    WAYS,
    ModalSum,
    choose,
    frequency_responses,
    responses,
)
from cvxupdate.fe.synthesis.basis import WHOLE, Subspace, columns
from cvxupdate.study import open_problem

BEAM = """
title = "beam"
[model]
dofs = ["z", "ry"]
nodes = [{nodes}]
[model.materials.m]
E = 70e9
nu = 0.3
rho = 2700.0
[model.sections.s]
shape = "rectangle"
width = 0.03
height = 0.004
[[model.elements]]
type = "beam3d"
material = "m"
section = "s"
rows = [{rows}]
[[model.elements]]
type = "dashpot"
dof = "z"
rows = [{{ id = 900, nodes = [7], c = {c} }}]
{more}
"""
SUPPORT = '[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n'


def beam(folder, more, c=0.0, elements=100):
    x = np.cumsum(np.r_[0.0, 0.006 + 0.003 * np.sin(np.arange(elements))])
    nodes = ", ".join(f"{{ id = {i + 1}, x = {v:.9f} }}" for i, v in enumerate(x))
    rows = ", ".join(f"{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}] }}" for i in range(elements))
    path = folder / "problem.toml"
    path.write_text(BEAM.format(nodes=nodes, rows=rows, c=c, more=more), encoding="utf-8")
    return open_problem(path)[1]


def matrices(model):
    """K, M, C, D, full, modal damping of every flexible mode in C (the last ratio for the rest)."""
    m = model.matrices()
    K, M, C, D = (A.toarray() for A in (m.K, m.M, m.C, m.D))
    if model.modal_damping:
        modes = model_modes(model, model.size).flexible()
        zeta = np.resize(model.modal_damping, len(modes.eigenvalues))
        zeta[len(model.modal_damping) :] = model.modal_damping[-1]
        V = M @ modes.shapes
        C = C + (V * (2 * zeta * np.sqrt(modes.eigenvalues))) @ V.T
    return K, M, C, D


def dense(model, s, outputs, inputs):
    """By dense elimination, no factor kept."""
    K, M, C, D = matrices(model)
    unit = np.eye(len(K))[:, inputs]
    return np.array([np.linalg.solve(K + 1j * D + v * C + v**2 * M, unit)[outputs] for v in s])


STRUCTURAL = '[model.damping]\nkind = "structural"\neta = 0.01'
RAYLEIGH = '[model.damping]\nkind = "rayleigh"\nalpha = 1.0\nbeta = 1e-6'
MODAL = '[model.damping]\nkind = "modal"\nzeta = [0.005, 0.02, 0.01]'
SPRING = """[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 901, nodes = [23], k = 800.0, eta = 0.3 }]
[[model.elements]]
type = "mass"
rows = [{ id = 902, nodes = [31], m = 0.05 }]
"""
KINDS = {
    "undamped": (SUPPORT, 0.0),
    "structural": (SUPPORT + STRUCTURAL, 0.0),
    "rayleigh and a dashpot": (SUPPORT + RAYLEIGH, 3.0),
    "modal": (SUPPORT + MODAL, 0.0),
    "modal and a dashpot": (SUPPORT + MODAL, 2.0),
    "a loss factor of its own": (SPRING + SUPPORT + STRUCTURAL, 1.0),
    "free": ('[model.damping]\nkind = "structural"\neta = 0.02', 0.5),
}
TRUNCATED = WHOLE // 2 + 10


@pytest.fixture(scope="module", params=KINDS, ids=str)
def case(request, tmp_path_factory):
    """A beam that is truncated: (model, points off the resonances of an undamped one, outputs,
    responses by dense inversion; points to the right of them, responses there)."""
    more, c = KINDS[request.param]
    model = beam(tmp_path_factory.mktemp("beam"), more, c, TRUNCATED)
    modes = model_modes(model, 6).flexible()
    f = np.linspace(0.3 * modes.frequencies[0], 1.1 * modes.frequencies[3], 83)
    last = f"n{TRUNCATED + 1}.z"
    at = np.array([model.place[q] for q in ("n7.z", "n60.z", last, "n40.ry")])
    s = 2j * np.pi * f
    right = (s + 0.05 * np.abs(s))[::2]
    return model, s, at, dense(model, s, at, at[:3]), right, dense(model, right, at, at[:3])


@pytest.mark.parametrize("way", [*WAYS, None])
def test_every_way_agrees_with_dense_inversion(case, way):
    model, s, at, exact, *_ = case
    assert model.size > WHOLE  # or nothing would be truncated
    H = responses(model, s, at, at[:3], way=way)
    # the structure's stiffest motion over its softest limits every solution to 1e-6 at a resonance
    assert np.linalg.norm(H - exact) < 1e-5 * np.linalg.norm(exact)
    low = np.abs(exact) < 0.02 * np.abs(exact).max(axis=0)  # static corrections hold them in place
    assert np.median(np.abs(H - exact)[low] / np.abs(exact)[low]) < 1e-5
    assert np.allclose(
        H[:, :3], H[:, :3].transpose(0, 2, 1), rtol=1e-8, atol=1e-9 * np.abs(H).max()
    )  # reciprocity


@pytest.mark.parametrize("way", [*WAYS, None])
def test_every_way_goes_through_the_right_half_plane(case, way):
    """s = δ + iω: what an exponential window makes of a record; smooth, so agreement is close."""
    model, _, at, _, s, exact = case
    H = responses(model, s, at, at[:3], way=way)
    assert np.linalg.norm(H - exact) < 1e-6 * np.linalg.norm(exact)


@pytest.mark.parametrize("way", WAYS)
def test_a_small_model_is_not_truncated(tmp_path, way):
    """However far beyond the last static correction the points lie."""
    model = beam(tmp_path, SPRING + SUPPORT + RAYLEIGH, 2.0, 40)
    modes = model_modes(model, model.size).flexible()
    s = 2j * np.pi * np.linspace(0.5, 0.9, 7) * modes.frequencies[30]
    at = np.array([model.place[q] for q in ("n7.z", "n30.z", "n40.ry")])
    H, exact = responses(model, s, at, at, way=way), dense(model, s, at, at)
    assert np.linalg.norm(H - exact) < 1e-7 * np.linalg.norm(exact)


@pytest.mark.parametrize("way", WAYS)
def test_massless_motions_follow_statically(tmp_path, way):
    """A chain of springs in which three joints have no mass."""
    springs = ", ".join(
        f"{{ id = {i + 1}, nodes = [{i + 1}, {i + 2}], k = {1000.0 + 170.0 * i**1.5:.6f} }}"
        for i in range(8)
    )
    masses = ", ".join(
        f"{{ id = {i + 20}, nodes = [{i}], m = {0.1 * i} }}" for i in (2, 4, 5, 7, 8)
    )
    nodes = ", ".join(f"{{ id = {i + 1}, x = {float(i)} }}" for i in range(9))
    path = tmp_path / "problem.toml"
    path.write_text(
        f"""
title = "chain"
[model]
dofs = ["x"]
nodes = [{nodes}]
[[model.elements]]
type = "spring"
dof = "x"
rows = [{springs}]
[[model.elements]]
type = "mass"
rows = [{masses}]
[[model.elements]]
type = "dashpot"
dof = "x"
rows = [{{ id = 50, nodes = [3, 6], c = 2.0 }}]
[[model.supports]]
nodes = [1]
dofs = ["x"]
{STRUCTURAL}
""",
        encoding="utf-8",
    )
    model = open_problem(path)[1]
    assert len(model_modes(model, model.size).eigenvalues) < model.size
    s = 2j * np.pi * np.linspace(0.5, 30.0, 60)
    at = np.array([model.place[q] for q in ("n3.x", "n8.x", "n9.x")])
    H, exact = responses(model, s, at, at, way=way), dense(model, s, at, at)
    assert np.linalg.norm(H - exact) < 1e-7 * np.linalg.norm(exact)


def test_quantities_held_dofs_and_bad_words(tmp_path):
    model = beam(tmp_path, SUPPORT, c=1.0, elements=20)
    f = np.array([3.0, 11.0, 40.0])
    at = np.array([model.place["n5.z"], -1])
    x, v, a = (frequency_responses(model, f, at, at, q) for q in ORDER)
    s = 2j * np.pi * f
    assert np.allclose(v, s[:, None, None] * x) and np.allclose(a, s[:, None, None] * v)
    assert np.all(x[:, 1] == 0.0) and np.all(x[:, :, 1] == 0.0) and np.all(x[:, 0, 0] != 0.0)
    assert np.allclose(x[:, :1, :1], dense(model, s, at[:1], at[:1]))
    with pytest.raises(InputError, match="no motion"):
        frequency_responses(model, f, at, at, "strain")
    with pytest.raises(InputError, match="no way"):
        frequency_responses(model, f, at, at, way="fast")


@pytest.mark.parametrize("way", ["direct", "modal", "reduced"])
def test_an_undamped_model_has_no_response_at_rest_when_it_is_free(tmp_path, way):
    model = beam(tmp_path, "", elements=20)
    at = np.array([model.place["n5.z"]])
    with pytest.raises(ModelError, match="natural frequency"):
        frequency_responses(model, [0.0, 10.0], at, at, way=way)


def spinning(folder, omega):
    """A cantilevered round shaft of unequal spans with a disc off the middle that spins."""
    nodes = ", ".join(
        f"{{ id = {i + 1}, x = {x} }}" for i, x in enumerate((0.0, 0.13, 0.29, 0.4, 0.62))
    )
    rows = ", ".join(f"{{ id = {i}, nodes = [{i}, {i + 1}] }}" for i in range(1, 5))
    path = folder / "problem.toml"
    path.write_text(
        f"""
title = "shaft"
[model]
dofs = ["y", "z", "ry", "rz"]
nodes = [{nodes}]
[model.materials.m]
E = 207e9
nu = 0.3
rho = 7850.0
[model.sections.s]
shape = "circle"
diameter = 0.02
[[model.elements]]
type = "beam3d"
material = "m"
section = "s"
rows = [{rows}]
[[model.elements]]
type = "mass"
rows = [{{ id = 20, nodes = [4], m = 2.1, Ixx = 0.02, Iyy = 0.011, Izz = 0.011 }}]
[[model.elements]]
type = "gyroscopic"
omega = {omega}
rows = [{{ id = 60, nodes = [4], Ip = 0.02, axis = [1.0, 0.0, 0.0] }}]
[[model.elements]]
type = "dashpot"
dof = "y"
rows = [{{ id = 40, nodes = [3], c = 12.0 }}]
[[model.supports]]
nodes = [1]
dofs = ["y", "z", "ry", "rz"]
{STRUCTURAL}
""",
        encoding="utf-8",
    )
    return open_problem(path)[1]


def test_something_that_spins_is_not_made_symmetric(tmp_path):
    """A gyroscopic C is skew: H(s) at the transposed places is that of the opposite spin."""
    folders = [tmp_path / name for name in ("forward", "back")]
    for folder in folders:
        folder.mkdir()
    model, back = (spinning(f, w) for f, w in zip(folders, (300.0, -300.0), strict=True))
    at = np.array([model.place[q] for q in ("n2.y", "n2.z", "n4.y", "n4.rz")])
    f = np.linspace(3.0, 200.0, 40)
    for way in (*WAYS, None):
        H, T = (frequency_responses(m, f, at, at, way=way) for m in (model, back))
        exact = dense(model, 2j * np.pi * f, at, at)
        assert np.linalg.norm(H - exact) < 1e-6 * np.linalg.norm(exact)
        assert not np.allclose(H, H.transpose(0, 2, 1), rtol=1e-3)
        assert np.linalg.norm(H - T.transpose(0, 2, 1)) < 1e-6 * np.linalg.norm(H)


def test_the_choice_goes_by_size_and_need():
    many, size, basis = 10 * FEW_POINTS, 2000, 60
    assert basis**2 < DENSE * size
    assert choose(FEW_POINTS, size, basis, 0) == "direct"  # no basis pays
    assert choose(FEW_POINTS, size, basis, 0, direct=False) == "modal"
    assert (
        choose(many, size, basis, 0) == choose(many, size, basis, int(COUPLED * basis)) == "modal"
    )
    assert choose(many, size, basis, basis) == "reduced"
    assert choose(many, basis, basis, basis) == "direct"  # dense costs more than sparse
    assert choose(many, basis, basis, basis, direct=False) == "reduced"


def test_a_sum_of_modes_takes_what_a_diagnosis_gives(tmp_path):
    """Damping ratios mode by mode; dashpots and loss factors that couple the low modes alone."""
    model = beam(tmp_path, SPRING + SUPPORT, 2.0, 30)
    m = model.matrices()
    modes = model_modes(model, model.size)
    phi, lam = modes.shapes, modes.eigenvalues
    zeta = 0.01 + 0.002 * np.cos(np.arange(len(lam)))
    low = 12
    C, D = (phi[:, :low].T @ (A @ phi[:, :low]) for A in (m.C, m.D))
    given = ModalSum(lam, np.ones(len(lam)), 2 * zeta * np.sqrt(lam), np.zeros(len(lam)), C, D)
    s = (0.02 + 1j) * np.linspace(20.0, 2000.0, 50)
    B, F = phi[[5, 20, 33]], phi[[10]]
    whole_c, whole_d = (np.zeros((len(lam), len(lam))) for _ in range(2))
    whole_c[:low, :low], whole_d[:low, :low] = C, D
    whole_c += np.diag(2 * zeta * np.sqrt(lam))
    exact = [B @ np.linalg.solve(np.diag(lam + v**2) + v * whole_c + 1j * whole_d, F.T) for v in s]
    assert given.at(s, B, F) == pytest.approx(np.array(exact), rel=1e-9)
    assert len(columns(C)[0]) == 1  # one dashpot, one column


def test_each_order_of_static_corrections_comes_nearer(tmp_path):
    """At points up to 1.9 times those that the modes are for, where corrections have to carry."""
    model = beam(tmp_path, SUPPORT, 3.0, TRUNCATED)
    at = np.array([model.place[q] for q in ("n7.z", "n60.z", "n40.ry")])
    top = model_modes(model, 8).frequencies[3]
    sub = Subspace.of(model, model.matrices(), None, top, at)
    assert not sub.complete
    last = sub.modes.frequencies[-1]
    s = (0.1 + 1j) * 2 * np.pi * 0.95 * last * np.ones(1)
    exact = dense(model, s, at, at)
    errors = []
    for blocks in (1, 2, 3):
        b = sub.basis(blocks)
        H = ModalSum.of(b, np.zeros(b.size)).at(s, b.V[at], b.V[at])
        errors.append(np.linalg.norm(H - exact) / np.linalg.norm(exact))
    assert errors[0] > 5.0 * errors[1] > 25.0 * errors[2]
