"""Families of element matrices against chapter 7: its numbers, its angles, and the laws that every
member obeys."""

from typing import Any

import numpy as np
import pytest
from scipy.stats import ortho_group

from cvxupdate.errors import ModelError
from cvxupdate.fe.generic.family import Family, family_of
from cvxupdate.fe.generic.pieces import Piece, pieces_of
from cvxupdate.fe.generic.shape import ElementShape, own_classes
from cvxupdate.registry import ELEMENTS
from tests.cases.elements import CASES, STEEL, Case, build, lines, nodes

DRAWN = [
    c
    for c in CASES
    if len(c.model["elements"]) == 1 and ELEMENTS.named(c.model["elements"][0]["type"]).text.outline
]
UNEQUAL = [(0.0, 0.0, 0.0), (0.13, 0.0, 0.0)]


def first_piece(model: Any) -> Piece:
    pieces = pieces_of(model, frozenset(int(i) for b in model.blocks for i in b.ids), [])
    return pieces[min(pieces)]


def plate(a: float, b: float, turn: float = 0.0) -> Piece:
    c, s = np.cos(turn), np.sin(turn)
    corners = np.array([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)]) @ np.array([[c, s], [-s, c]])
    text = {
        "dofs": ["z", "rx", "ry"],
        "nodes": nodes(np.hstack([corners, np.zeros((4, 1))])),
        "materials": {"m": STEEL},
        "sections": {"s": {"shape": "plate", "thickness": 0.001}},
        "elements": [
            {
                "type": "plate",
                "material": "m",
                "section": "s",
                "rows": [{"id": 1, "nodes": [1, 2, 3, 4]}],
            }
        ],
    }
    return first_piece(build(text))


def beam(mass: str = "lumped", section: Any = "bar", **block: Any) -> Piece:
    text = lines("beam2d", UNEQUAL, [(1, 2)], ["z", "ry"], section, mass=mass, **block)
    return first_piece(build(text))


def rod(mass: str = "lumped") -> Piece:
    return first_piece(build(lines("rod", UNEQUAL, [(1, 2)], ["x"], mass=mass)))


def of(piece: Piece, matrix: str, classes: Any = "symmetry", **more: Any) -> Family:
    return family_of(matrix, piece.K, piece.M, piece.shape, classes, **more)


def scaled(piece: Piece, A: np.ndarray) -> np.ndarray:
    """In {w, L w′}."""
    assert piece.shape is not None
    return A / np.outer(piece.shape.scale, piece.shape.scale)


def random_member(family: Family, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """(X, matrix): block diagonal, definite, with 7.6's angles and values at random."""
    X = np.diag(family.values)
    for c in family.classes:
        R = ortho_group.rvs(len(c), random_state=rng) if len(c) > 1 else np.eye(1)
        X[np.ix_(c, c)] = R @ np.diag(rng.uniform(0.1, 3.0, len(c)) * family.values[list(c)]) @ R.T
    return X, family.member(X)


def test_rod_has_three_parameters() -> None:
    """7.7–7.15: k; m₁ = m₂ and m₁₂ in the symmetric form, m₁, m₂ and m₁₂ in the general one."""
    for piece in (rod("lumped"), rod("consistent")):
        K, M = of(piece, "K"), of(piece, "M")
        assert (len(K.entries), len(M.entries), K.rigid) == (1, 2, 1)
        assert len(of(piece, "M", "none").entries) == 3
        np.testing.assert_allclose(K.values, 2.0 * piece.K[0, 0])  # θ = 2 k₀ (7.9)
    X, A = random_member(of(rod(), "M", "none"), np.random.default_rng(3))
    assert A[0, 0] != pytest.approx(A[1, 1])
    theta = np.sort(np.linalg.eigvalsh(X))  # (7.15): σ are the eigenvalues of [m₁ m₁₂; m₁₂ m₂]
    np.testing.assert_allclose(np.linalg.eigvalsh(A), theta, rtol=1e-12)


def test_beam_has_the_strain_vectors_and_values_of_the_text() -> None:
    """7.18–7.20: (0, 1, 0, −1)/√2 with 2 k₀ and (2, 1, −2, 1)/√10 with 30 k₀, k₀ = E I / L³."""
    piece = beam()
    L = UNEQUAL[1][0]
    k0 = scaled(piece, piece.K)[0, 0] / 12.0
    assert k0 == pytest.approx(piece.K[1, 1] / 4.0 / L**2)
    K = of(piece, "K")
    assert piece.shape is not None
    u = K.vectors / piece.shape.scale[:, None]
    np.testing.assert_allclose(K.values, [2.0 * k0, 30.0 * k0], rtol=1e-12)
    sign = np.array([1.0, -1.0, 1.0, -1.0])  # w′ = −θy in the x–z plane
    np.testing.assert_allclose(np.abs(u[:, 0] @ (sign * [0, 1, 0, -1])), np.sqrt(2.0))
    np.testing.assert_allclose(np.abs(u[:, 1] @ (sign * [2, 1, -2, 1])), np.sqrt(10.0))
    M = of(piece, "M")
    m0 = 2.0 * scaled(piece, piece.M)[0, 0]
    np.testing.assert_allclose(M.values, np.array([1 / 24, 1 / 24, 1 / 2, 1 / 2]) * m0)


def test_beam_has_eight_parameters_and_nine_without_the_mirror() -> None:
    """(7.20) has x₁₂, which the mirror at mid-length makes zero: 8, as 7.7.4 says, not 9."""
    piece = beam()
    assert of(piece, "K").classes == ((0,), (1,))
    assert len(of(piece, "M").entries) == 6  # s₁ … s₄, s₁₃, s₂₄ (7.23)
    assert len(of(piece, "K", "none").entries) == 3
    assert len(of(piece, "M", "none").entries) == 10


@pytest.mark.parametrize("section", ["bar", {"shape": "rectangle", "width": 0.1, "height": 0.05}])
def test_other_beams_are_members_of_the_family_of_the_lumped_one(section: Any) -> None:
    """Consistent and Timoshenko beams (Gladwell and Ahmadian 1995)."""
    deep = {**section, "kappa": 0.85} if isinstance(section, dict) else section
    for other in (beam("consistent", section), beam("consistent", deep)):
        for matrix in "KM":
            family = of(beam("lumped", section), matrix)
            A = getattr(other, matrix)
            found = family.relative(family.parameters(A))
            X = family.sizes[:, None] * found * family.sizes
            np.testing.assert_allclose(family.member(X), A, rtol=1e-9, atol=1e-9 * np.abs(A).max())


@pytest.mark.parametrize(
    "sides", [(0.1, 0.05), (0.05, 0.05), (0.05, 0.06)], ids=["2 to 1", "square", "oblong"]
)
@pytest.mark.parametrize("turn", [0.0, 0.7], ids=["straight", "turned"])
def test_plate_has_four_classes(sides: tuple[float, float], turn: float) -> None:
    """Each symmetry class of 12 DOFs at four corners holds three (the corners are a regular orbit);
    the three rigid motions are of three different ones. So K has classes of 3, 2, 2 and 2, 15
    parameters, where 7.5 names classes of 4, 2, 1 and 2, and M four of 3, 24 parameters."""
    piece = plate(*sides, turn)
    K, M = of(piece, "K"), of(piece, "M")
    assert sorted(len(c) for c in K.classes) == [2, 2, 2, 3]
    assert [len(c) for c in M.classes] == [3, 3, 3, 3]
    assert (len(K.entries), len(M.entries), K.rigid) == (15, 24, 3)
    diagonal = of(piece, "K", "diagonal"), of(piece, "M", "diagonal")
    assert [len(f.entries) for f in diagonal] == [9, 12]  # R = T = I of 7.7.3


def test_the_classes_of_a_square_do_not_mix_repeated_modes() -> None:
    """In a square, modes that are a quarter-turn apart repeat: any turn among them is an
    eigenvector, and only the mirrors say which belong together. The classes are those of a
    rectangle that is nearly square."""
    square, nearly = (of(plate(0.05, b), "K") for b in (0.05, 0.05 * (1 + 1e-5)))
    assert np.sum(np.diff(square.values) < 1e-9 * square.values.max()) == 2
    for c in square.classes:
        span = square.vectors[:, c]
        other = max(
            (nearly.vectors[:, d] for d in nearly.classes if len(d) == len(c)),
            key=lambda B: np.linalg.norm(np.linalg.qr(B)[0].T @ np.linalg.qr(span)[0]),
        )
        cosines = np.linalg.svd(np.linalg.qr(other)[0].T @ np.linalg.qr(span)[0])[1]
        np.testing.assert_allclose(cosines, 1.0, atol=1e-4)


def test_classes_may_be_named_and_reduced() -> None:
    piece = plate(0.1, 0.05)
    named = of(piece, "K", ((1, 5, 8, 9), (2, 7), (3,), (4, 6)))
    assert len(named.entries) == 17  # the count of (7.24)
    assert named.classes[0] == (0, 4, 7, 8)
    reduced = of(piece, "K", ((1, 5, 8, 9), (2, 7), (3,), (4, 6)), free=6)
    assert len(reduced.entries) == 8  # (7.26), (7.27): u₇, u₈ and u₉ stay; ζ, η, λ₁ … λ₆
    low, high = of(piece, "K", free=6), of(piece, "M", free=5)
    assert len(low.entries) == 8  # with classes of three, two, two and two as well
    assert {i for c in low.classes for i in c} == set(range(6))
    assert {i for c in high.classes for i in c} == set(range(7, 12))
    _, A = random_member(low, np.random.default_rng(1))
    values, vectors = low.values[6:], low.vectors[:, 6:] / piece.shape.scale[:, None]  # type: ignore[union-attr]
    np.testing.assert_allclose(scaled(piece, A) @ vectors, vectors * values, rtol=1e-9, atol=1e-3)
    with pytest.raises(ModelError, match="no classes of its 9 modes"):
        of(piece, "K", ((1, 10),))


@pytest.mark.parametrize("case", DRAWN, ids=[c.name for c in DRAWN])
def test_every_member_keeps_the_motions_without_energy(case: Case) -> None:
    """Of every type of element: the rank, and K Φ_R = 0 to 1e-12 for X ⪰ 0 at random; the symmetry
    of the element stays."""
    piece = first_piece(case.build())
    assert piece.shape is not None
    for classes in ("symmetry", "none"):
        K = of(piece, "K", classes)
        assert K.rigid == case.null
        R = piece.shape.rigid * piece.shape.scale[:, None]
        free = R[:, np.abs(scaled(piece, piece.K) @ R).max(axis=0) <= 1e-9 * np.abs(piece.K).max()]
        _, A = random_member(K, np.random.default_rng(7))
        assert free.shape[1] > 0
        assert np.abs(scaled(piece, A) @ free).max() <= 1e-12 * np.abs(scaled(piece, A)).max()
        assert np.linalg.eigvalsh(scaled(piece, A))[0] >= -1e-12 * np.abs(scaled(piece, A)).max()
        energies = np.linalg.eigvalsh(scaled(piece, A))
        assert np.sum(energies > 1e-11 * energies.max()) == len(piece.K) - case.null
    for P in piece.shape.symmetries((piece.K, piece.M)):
        _, A = random_member(of(piece, "K"), np.random.default_rng(8))
        np.testing.assert_allclose(P @ A @ P.T, A, atol=1e-9 * np.abs(A).max())


@pytest.mark.parametrize("matrix", ["K", "M"])
@pytest.mark.parametrize("name", ["rod", "beam", "plate", "square"])
def test_members_by_angles_and_ours_are_the_same_set(name: str, matrix: str) -> None:
    """(7.6) with R, T block diagonal: in our coordinates X = R Θ Rᵀ; and the eigenvectors of any X
    of ours are such an R."""
    piece = {"rod": rod(), "beam": beam(), "plate": plate(0.1, 0.04), "square": plate(0.1, 0.1)}[
        name
    ]
    family, rng = of(piece, matrix), np.random.default_rng(11)
    X, A = random_member(family, rng)
    p = family.parameters(A)
    assert len(p) == len(family.entries)
    np.testing.assert_allclose(
        family.sizes[:, None] * family.relative(p) * family.sizes, X, atol=1e-9 * X.max()
    )
    nominal = getattr(piece, matrix)
    by_units = nominal + sum(
        v * family.unit(i, j) for v, (i, j) in zip(p, family.entries, strict=True)
    )
    np.testing.assert_allclose(by_units, A, atol=1e-9 * np.abs(A).max())
    again = np.diag(family.values)
    for c in family.classes:
        theta, R = np.linalg.eigh(X[np.ix_(c, c)])
        again[np.ix_(c, c)] = R @ np.diag(theta) @ R.T
    np.testing.assert_allclose(family.member(again), A, atol=1e-9 * np.abs(A).max())


def test_beam_in_space_keeps_tension_torsion_and_bending_apart() -> None:
    """Whatever its orientation: six strain modes in six classes."""
    for section, orientation in (("bar", (0.2, 0.3, 1.0)), ("round", None), ("tube", None)):
        text = lines(
            "beam3d",
            [(0.0, 0.0, 0.0), (0.3, 0.1, 0.2)],
            [(1, 2)],
            ["x", "y", "z", "rx", "ry", "rz"],
            section,
            orientation=orientation,
        )
        piece = first_piece(build(text))
        assert of(piece, "K").classes == tuple((i,) for i in range(6))
        assert of(piece, "K").rigid == 6
        M = of(piece, "M")
        assert (
            len(M.entries) == 16
        )  # tension and torsion 1 + 1 each, bending two of 3 in each plane


def test_matrices_alone_show_the_classes_of_a_plate() -> None:
    """Without places, by what neither mixes; matrices that mix everything have one class."""
    piece = plate(0.1, 0.05)
    family = family_of("K", scaled(piece, piece.K), scaled(piece, piece.M), None)
    assert sorted(len(c) for c in family.classes) == [2, 2, 2, 3]
    assert family.rigid == 3
    rng = np.random.default_rng(5)
    A, B = (x @ x.T for x in rng.normal(size=(2, 5, 5)))
    assert [b.shape for b in own_classes(A, B)] == [(5, 5)]


def test_a_lump_without_rotary_inertia_can_gain_some() -> None:
    text = lines("beam2d", UNEQUAL, [(1, 2)], ["z", "ry"], mass="lumped")
    piece = first_piece(build(text))
    bare = Piece(piece.K, np.diag([1.0, 0.0, 1.0, 0.0]), piece.dofs, piece.kind, {}, piece.shape)
    M = of(bare, "M")
    assert np.trace(M.nominal) == 2.0
    assert M.unit(0, 0)[1, 1] > 0.0


def test_what_is_no_structure_has_no_family() -> None:
    shape = ElementShape(np.array(UNEQUAL), np.array([0, 1]), np.array([0, 0]))
    with pytest.raises(ModelError, match="mass matrix is zero"):
        family_of("M", np.eye(2), np.zeros((2, 2)), shape)
    with pytest.raises(ModelError, match="not positive semidefinite"):
        family_of("K", np.diag([1.0, -1.0]), np.eye(2), shape)
