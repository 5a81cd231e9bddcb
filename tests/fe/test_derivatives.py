"""Block derivatives of every parameter word of every element, against complex step and central
differences of the whole matrices."""

from dataclasses import dataclass

import numpy as np
import pytest

from cvxupdate.errors import ModelError
from cvxupdate.fe.model import DerivativeBlock, Model
from cvxupdate.fe.parameters import UNITS
from cvxupdate.fe.select import has_property, select_parameters
from tests.cases.elements import CASES, Case, build, chain, grid, lines

LIVE = {
    "eta": 0.02,
    "alpha": 3.0,
    "beta": 1e-5,
    "shear": 0.7,
    "N": 2e3,
}  # so that every word moves something
ZERO = {"eta": 0.01, "alpha": 1.0, "beta": 1e-6, "shear": 1.0, "N": 1e3}
WORDS = ("stiffness", "mass", "damping", *UNITS)


@dataclass(frozen=True)
class Wanted:
    name: str
    of: str
    elements: tuple[int, ...] = ()
    group: str | None = None
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None


def assembled(model: Model, blocks: tuple[DerivativeBlock, ...], matrix: str) -> np.ndarray:
    """Element blocks summed over the free DOFs."""
    out = np.zeros((model.size + 1, model.size + 1))
    for b in blocks:
        values = getattr(b, matrix)
        if values is not None:
            assert values.shape == (*b.dofs.shape, b.dofs.shape[1])
            np.add.at(out, (b.dofs[:, :, None], b.dofs[:, None, :]), values)
    return out[:-1, :-1]


def check_derivatives(model: Model, p: np.ndarray) -> None:
    for j, parameter in enumerate(model.parameters):
        blocks = model.derivative(j, p)
        step = np.zeros(len(p), dtype=complex)
        step[j] = 1e-30j
        imaginary = model.matrices(p + step)
        d = np.zeros(len(p))
        d[j] = 1e-4
        above, below = model.matrices(p + d), model.matrices(p - d)
        above2, below2 = model.matrices(p + 2 * d), model.matrices(p - 2 * d)
        moved = False
        for matrix in "KMCD":
            mine = assembled(model, blocks, matrix)
            exact = getattr(imaginary, matrix).toarray().imag / 1e-30
            size = np.abs(exact).max()
            assert np.abs(mine - exact).max() <= 1e-12 * size, (parameter.name, matrix)
            a, b = (
                (getattr(u, matrix) - getattr(v, matrix)).toarray()
                for u, v in ((above, below), (above2, below2))
            )
            central = (8 * a - b) / 12e-4  # fourth order
            base = abs(getattr(above, matrix)).max()
            assert np.abs(mine - central).max() <= 1e-9 * size + 1e-11 * base, (
                parameter.name,
                matrix,
            )
            moved |= bool(size > 0)
        assert moved, parameter.name


def words_of(model: Model) -> list[str]:
    return [w for w in WORDS if any(has_property(b, w) for b in model.blocks)]


@pytest.mark.parametrize("case", CASES, ids=lambda c: c.name)
def test_every_word(case: Case) -> None:
    """All words at once, away from p = 0, so each derivative is taken where the others have
    moved."""
    model = case.build(**LIVE)
    wanted = [Wanted(w, w, scale=1.0) for w in words_of(model)]
    model = model.with_parameters(select_parameters(wanted, model))
    p = np.random.default_rng(7).uniform(-0.15, 0.15, len(wanted))
    check_derivatives(model, p)
    check_derivatives(model, model.zero())


def test_all_words_were_met() -> None:
    met = {w for c in CASES for w in words_of(c.build(**LIVE))}
    assert met == set(WORDS)


@pytest.mark.parametrize(
    "case",
    [
        c
        for c in CASES
        if c.name in ("spring", "rod consistent", "beam2d xy", "beam3d oriented", "plate")
    ],
    ids=lambda c: c.name,
)
def test_words_that_are_zero_today(case: Case) -> None:
    """eta, alpha, beta, shear, N: physics that the model does not have yet."""
    model = case.build()
    wanted = [
        Wanted(w, w, scale=s)
        for w, s in ZERO.items()
        if any(has_property(b, w) for b in model.blocks)
    ]
    model = model.with_parameters(select_parameters(wanted, model))
    check_derivatives(model, model.zero())
    check_derivatives(model, np.full(len(wanted), 0.3))
    for parameter in model.parameters:
        assert (parameter.nominal, parameter.unit_size) == (0.0, ZERO[parameter.of])


@pytest.mark.parametrize(
    ("name", "of"),
    [
        ("beam2d xy", "Iy"),
        ("beam2d xz", "Iz"),
        ("beam2d xy", "J"),
        ("beam3d round", "G"),
        ("beam3d own G", "nu"),
        ("rod consistent", "Iz"),
        ("spring", "Ixx"),
        ("beam3d round", "wall"),
        ("dashpot", "k"),
        ("plate", "A"),
        ("beam2d xy", "damping"),
    ],
)
def test_a_word_that_moves_nothing_is_refused(name: str, of: str) -> None:
    model = next(c for c in CASES if c.name == name).build()
    with pytest.raises(ModelError, match=f"no element there has the property '{of}'"):
        select_parameters([Wanted("p", of, scale=1.0)], model)


def test_zero_today_without_scale_is_refused() -> None:
    model = build(lines("beam2d", [[0, 0, 0], [1, 0, 0], [1.5, 0, 0]], chain(2), ["x", "y", "rz"]))
    with pytest.raises(ModelError, match="`scale`"):
        select_parameters([Wanted("eta", "eta")], model)


def test_overlapping_and_tied_parameters() -> None:
    """One element under an element parameter, a group's and one for all; ties across groups and
    sections of unlike size."""
    model = build(grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26], "rolled"))
    odd = tuple(
        int(i) for b in model.blocks for i, g in zip(b.ids, b.groups, strict=True) if g == "odd"
    )
    model = model.with_parameters(
        select_parameters(
            [
                Wanted("e1.stiffness", "stiffness", (1,)),
                Wanted("e1+e4.E", "E", (1, 4)),
                Wanted("odd.E", "E", odd, "odd"),
                Wanted("all.E", "E"),
                Wanted("all.thickness", "thickness"),
                Wanted("e2.thickness", "thickness", (2,)),
                Wanted("all.nu", "nu"),
                Wanted("all.rho", "rho"),
                Wanted("e3.mass", "mass", (3,)),
            ],
            model,
        )
    )
    check_derivatives(model, np.array([0.2, -0.1, 0.15, 0.05, -0.1, 0.3, 0.2, -0.2, 0.4]))
    assert [p.members() for p in model.parameters] == [1, 2, 3, 6, 6, 1, 6, 6, 1]


def test_physical_parameters_move_together() -> None:
    """Parameters on the same property add: E (1 + p₁ + p₂), not a product, so each is linear on its
    own."""
    model = build(lines("rod", [[0, 0, 0], [1, 0, 0], [1.7, 0, 0]], chain(2), ["x"]))
    model = model.with_parameters(
        select_parameters([Wanted("a", "E"), Wanted("b", "E", (1,))], model)
    )
    K = model.matrices(np.array([0.1, 0.2])).K.toarray()
    k1, k2 = 207e9 * 0.0012 / 1.0, 207e9 * 0.0012 / 0.7
    assert np.allclose(
        K,
        [
            [1.3 * k1, -1.3 * k1, 0],
            [-1.3 * k1, 1.3 * k1 + 1.1 * k2, -1.1 * k2],
            [0, -1.1 * k2, 1.1 * k2],
        ],
    )


def test_stiffness_p_value_leaves_damping_alone() -> None:
    """(3.22): the p-values of K, M and D are independent, while E carries the loss factor with
    it."""
    case = next(c for c in CASES if c.name == "beam2d xy").build(eta=0.02)
    model = case.with_parameters(
        select_parameters(
            [Wanted("s", "stiffness"), Wanted("e", "E"), Wanted("d", "damping")], case
        )
    )
    assert all(b.D is None for b in model.derivative(0))
    assert any(b.D is not None for b in model.derivative(1))
    assert all(b.K is None and b.D is not None for b in model.derivative(2))


def test_mass_gradient() -> None:
    for case in CASES:
        model = case.build()
        wanted = [Wanted(w, w, scale=1.0) for w in words_of(model)]
        model = model.with_parameters(select_parameters(wanted, model))
        p = np.random.default_rng(3).uniform(-0.1, 0.1, len(wanted))
        gradient = model.mass_gradient(p)
        for j in range(len(p)):
            d = np.zeros(len(p))
            d[j] = 1e-4
            slope = (model.total_mass(p + d) - model.total_mass(p - d)) / 2e-4
            assert gradient[j] == pytest.approx(
                slope, rel=1e-6, abs=1e-9 * model.total_mass() + 1e-12
            ), (case.name, wanted[j].name)


def test_units_and_readings() -> None:
    model = build(
        lines(
            "beam3d",
            [[0, 0, 0], [1, 0, 0], [1.5, 0, 0]],
            chain(2),
            ["x", "y", "z", "rx", "ry", "rz"],
            "bar",
        )
    )
    E, A, I, s = select_parameters(
        [Wanted("E", "E"), Wanted("A", "A"), Wanted("Iy", "Iy"), Wanted("s", "stiffness")], model
    )
    assert (E.nominal, E.unit) == (207e9, "Pa")
    assert E.physical(0.1) == pytest.approx(1.1 * 207e9)
    assert (A.physical(0.0), A.unit) == (pytest.approx(0.0012), "m^2")
    assert I.physical(-0.5) == pytest.approx(0.5 * 0.1 * 0.012**3 / 12)
    assert (s.nominal, s.unit_size) == (0.0, 1.0)
