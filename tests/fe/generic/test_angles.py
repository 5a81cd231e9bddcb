"""The family of chapter 7 by its angles, built here from nothing but eigenvectors and mirrors that
are written down by hand, against the convex set of the package: for every element of 7.3–7.6."""

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import combinations
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from cvxupdate.fe.generic.family import Family, family_of
from cvxupdate.fe.generic.pieces import Piece, pieces_of
from cvxupdate.fe.generic.shape import ElementShape
from tests.cases.elements import SECTIONS, STEEL, build, lines, nodes

TURN = Rotation.from_euler("xyz", (0.5, -0.3, 1.1)).as_matrix()
SPACE = ["x", "y", "z", "rx", "ry", "rz"]
SEEDS = range(3)


@dataclass(frozen=True)
class Element:
    """A piece, the axes (rows) in which its mirrors are those of the coordinates, which of the
    three mirrors it has, and how many parameters (K, M) the text or symmetry gives it."""

    piece: Piece
    axes: np.ndarray
    mirrors: str
    counts: tuple[int, int]
    places: bool = True


def first(text: dict[str, Any]) -> Piece:
    model = build(text)
    return pieces_of(model, frozenset({1}), [])[1]


def line(kind: str, dofs: list[str], turn: np.ndarray | None = None, **more: Any) -> Piece:
    ends = np.array([(0.1, 0.0, 0.0), (0.35, 0.0, 0.0)])
    points = ends if turn is None else ends @ turn.T
    return first(lines(kind, [tuple(x) for x in points.tolist()], [(1, 2)], dofs, **more))


def plate(a: float, b: float, turn: float = 0.0) -> Piece:
    c, s = np.cos(turn), np.sin(turn)
    corners = np.array([(0.0, 0.0), (a, 0.0), (a, b), (0.0, b)]) @ np.array([[c, s], [-s, c]])
    block = {"type": "plate", "material": "m", "section": "s"}
    return first(
        {
            "dofs": ["z", "rx", "ry"],
            "nodes": nodes(np.hstack([corners, np.zeros((4, 1))])),
            "materials": {"m": STEEL},
            "sections": {"s": {"shape": "plate", "thickness": 0.001}},
            "elements": [{**block, "rows": [{"id": 1, "nodes": [1, 2, 3, 4]}]}],
        }
    )


def imported(piece: Piece, places: bool) -> Piece:
    """The same matrices with the nodes in another order, the diagonal first; or without places."""
    assert piece.shape is not None
    order = np.concatenate([np.flatnonzero(piece.shape.node == n) for n in (0, 2, 1, 3)])
    K, M = (A[np.ix_(order, order)] for A in (piece.K, piece.M))
    old = piece.shape
    node = np.repeat(np.arange(4), 3)
    shape = ElementShape(old.xyz[[0, 2, 1, 3]], node, old.kind[order]) if places else None
    return Piece(K, M, piece.dofs[order], piece.kind[order], {}, shape)


def spun(angle: float) -> np.ndarray:
    c, s = np.cos(angle), np.sin(angle)
    return np.array([[c, s, 0.0], [-s, c, 0.0], [0.0, 0.0, 1.0]])


SECTION = SECTIONS["bar"]
SPACE_BEAM = line("beam3d", SPACE, TURN, section=SECTION, orientation=(TURN @ [0, 0, 1]).tolist())
ELEMENTS = {
    "rod": Element(line("rod", ["x"], mass="lumped"), np.eye(3), "x", (1, 2)),
    "beam": Element(line("beam2d", ["z", "ry"], mass="lumped"), np.eye(3), "x", (2, 6)),
    "plate": Element(plate(0.1, 0.05), np.eye(3), "xy", (15, 24)),
    "turned plate": Element(plate(0.1, 0.04, 0.7), spun(0.7), "xy", (15, 24)),
    "square plate": Element(plate(0.05, 0.05, 0.3), spun(0.3), "xy", (15, 24)),
    "beam in space": Element(SPACE_BEAM, TURN.T, "xyz", (6, 16)),
    "imported": Element(imported(plate(0.1, 0.05, 0.7), True), spun(0.7), "xy", (15, 24)),
    "imported square": Element(imported(plate(0.05, 0.05), True), np.eye(3), "xy", (15, 24)),
    "imported, no places": Element(
        imported(plate(0.1, 0.05), False), np.eye(3), "xy", (15, 24), False
    ),
}
PLACED = imported(plate(0.1, 0.05), True)  # of the last: the test knows them, the package does not


def mirrored(shape: ElementShape, axis: np.ndarray) -> np.ndarray:
    """What the mirror across ``axis`` through the centre does to the DOFs: displacements turn
    over along it, rotations across it, and every node goes to its image."""
    T = np.eye(3) - 2.0 * np.outer(axis, axis)
    r = shape.xyz - shape.xyz.mean(axis=0)
    image = [int(np.argmin(np.linalg.norm(r - T @ x, axis=1))) for x in r]
    whole = np.zeros((len(r), 2, 3, len(r), 2, 3))
    for n, m in enumerate(image):
        whole[m, 0, :, n, 0, :], whole[m, 1, :, n, 1, :] = T, -T
    some = shape.node * 6 + shape.kind
    return whole.reshape(6 * len(r), -1)[np.ix_(some, some)]


def by_hand(e: Element, matrix: str) -> Iterator[tuple[np.ndarray, np.ndarray]]:
    """(modes (d, n), their values (n,)) of each class, of {w, L w′} where places are known: common
    eigenvectors of the matrix and the mirrors, told apart by what the mirrors make of them."""
    shape = e.piece.shape or PLACED.shape
    assert shape is not None
    scale = shape.scale if e.places else np.ones(len(e.piece.K))
    A = getattr(e.piece, matrix) / np.outer(scale, scale)
    mirrors = [mirrored(shape, e.axes["xyz".index(a)]) for a in e.mirrors]
    rigid = np.linalg.eigvalsh(A) <= 1e-10 * np.linalg.norm(A, 2)
    both = A / np.linalg.norm(A, 2) + sum(
        (3.0 + k) ** 2 * P
        for k, P in enumerate(mirrors)  # no sum of two of them is another
    )
    modes = np.linalg.eigh(both)[1]
    values = np.einsum("ij,ij->j", modes, A @ modes)
    kinds = [tuple(np.sign(u @ P @ u) for P in mirrors) for u in modes.T]
    assert np.abs(A @ modes - modes * values).max() <= 1e-9 * np.abs(A).max()
    keep = values > 1e-10 * values.max()
    assert np.sum(~keep) == np.sum(rigid)
    for kind in dict.fromkeys(kinds):
        some = [i for i, k in enumerate(kinds) if k == kind and keep[i]]
        if some:
            yield scale[:, None] * modes[:, some], values[some]


def rotation(n: int, rng: np.random.Generator) -> np.ndarray:
    """R of (7.5) from its n (n − 1) / 2 angles."""
    R = np.eye(n)
    for i, j in combinations(range(n), 2):
        c, s = (f(rng.uniform(0.0, 2.0 * np.pi)) for f in (np.cos, np.sin))
        G = np.eye(n)
        G[[i, j, i, j], [i, j, j, i]] = c, c, s, -s
        R = R @ G
    return R


def family(e: Element, matrix: str) -> Family:
    return family_of(matrix, e.piece.K, e.piece.M, e.piece.shape)


def both(name: str, matrix: str) -> tuple[Family, list[tuple[np.ndarray, np.ndarray]]]:
    e = ELEMENTS[name]
    return family(e, matrix), list(by_hand(e, matrix))


@pytest.mark.parametrize("matrix", ["K", "M"])
@pytest.mark.parametrize("name", ELEMENTS)
def test_the_dimension_is_that_of_angles_and_values(name: str, matrix: str) -> None:
    """n values and n (n − 1) / 2 angles for each class, as many as entries of X, which are
    independent matrices."""
    ours, classes = both(name, matrix)
    by_angles = sum(len(v) + len(v) * (len(v) - 1) // 2 for _, v in classes)
    units = np.array([ours.unit(i, j).ravel() for i, j in ours.entries])
    units /= np.linalg.norm(units, axis=1, keepdims=True)
    rank = np.linalg.matrix_rank(units, tol=1e-9)
    expected = ELEMENTS[name].counts["KM".index(matrix)]
    assert rank == len(ours.entries) == by_angles == expected


@pytest.mark.parametrize("matrix", ["K", "M"])
@pytest.mark.parametrize("name", ELEMENTS)
def test_every_member_by_angles_is_one_of_ours(name: str, matrix: str) -> None:
    """(7.6), values from nothing to three times the nominal ones: X ⪰ 0, and nothing is left."""
    ours, classes = both(name, matrix)
    for seed in SEEDS:
        rng = np.random.default_rng(seed)
        A = np.zeros_like(ELEMENTS[name].piece.K)
        for modes, values in classes:
            R = rotation(len(values), rng)
            A += modes @ R @ np.diag(rng.uniform(0.0, 3.0, len(values)) * values) @ R.T @ modes.T
        relative = ours.relative(ours.parameters(A))
        X = ours.sizes[:, None] * relative * ours.sizes
        size = np.sqrt(np.abs(np.diag(A)))
        assert np.abs((ours.member(X) - A) / np.outer(size, size)).max() <= 1e-9
        assert np.linalg.eigvalsh(relative)[0] >= -1e-9


@pytest.mark.parametrize("matrix", ["K", "M"])
@pytest.mark.parametrize("name", ELEMENTS)
def test_every_one_of_ours_is_a_member_by_angles(name: str, matrix: str) -> None:
    """Any X ⪰ 0: its matrix does not mix the classes made by hand, and in each its eigenvectors are
    an R."""
    ours, classes = both(name, matrix)
    e = ELEMENTS[name]
    shape = e.piece.shape
    scale = np.ones(len(e.piece.K)) if shape is None else shape.scale
    for seed in SEEDS:
        rng = np.random.default_rng(10 + seed)
        X = np.zeros((len(ours.values),) * 2)
        for c in ours.classes:
            half = rng.normal(size=(len(c), max(1, len(c) - seed % 2)))  # of lesser rank, too
            X[np.ix_(c, c)] = half @ half.T
        A = ours.member(ours.sizes[:, None] * X * ours.sizes) / np.outer(scale, scale)
        again = np.zeros_like(A)
        for modes, _ in classes:
            U = modes / scale[:, None]
            theta, R = np.linalg.eigh(U.T @ A @ U)
            assert theta[0] >= -1e-12 * np.abs(A).max()
            again += U @ R @ np.diag(theta) @ R.T @ U.T
        assert np.abs(again - A).max() <= 1e-9 * np.abs(A).max()


@pytest.mark.parametrize("name", ELEMENTS)
def test_rigid_motions_cost_no_energy_whatever_x(name: str) -> None:
    """K Φ_R = 0 to 1e-12 for X ⪰ 0 at random, and no other motion is lost."""
    e = ELEMENTS[name]
    shape, ours = e.piece.shape or PLACED.shape, family(e, "K")
    assert shape is not None
    scale = shape.scale if e.places else np.ones(len(e.piece.K))
    known = shape.rigid * shape.scale[:, None] if e.places else shape.rigid
    motion = known[:, np.linalg.norm(known, axis=0) > 1e-9]
    R = np.linalg.qr(motion)[0][:, : np.linalg.matrix_rank(motion)]
    K0 = e.piece.K / np.outer(scale, scale)
    R = R[:, np.abs(K0 @ R).max(axis=0) <= 1e-9 * np.abs(K0).max()]
    assert R.shape[1] == ours.rigid > 0
    for seed in SEEDS:
        rng = np.random.default_rng(20 + seed)
        X = np.zeros((len(ours.values),) * 2)
        for c in ours.classes:
            half = rng.normal(size=(len(c), 2 * len(c)))
            X[np.ix_(c, c)] = half @ half.T
        K = ours.member(ours.sizes[:, None] * X * ours.sizes) / np.outer(scale, scale)
        assert np.abs(K @ R).max() <= 1e-12 * np.abs(K).max()
        energies = np.linalg.eigvalsh(K)
        assert np.sum(energies > 1e-9 * energies.max()) == len(K) - ours.rigid


@pytest.mark.parametrize("name", ["plate", "square plate", "beam in space", "imported"])
def test_angles_do_not_keep_the_mass(name: str) -> None:
    """T of (7.6) at random and σ as they are: the rigid-body mass of the element changes (the
    clauses `mass` and `inertia` keep it: tests/convex/test_generic.py)."""
    e = ELEMENTS[name]
    shape = e.piece.shape
    assert shape is not None
    motion = shape.rigid[:, np.flatnonzero(np.linalg.norm(shape.rigid[:, :3], axis=0))[0]]
    whole = motion @ e.piece.M @ motion
    lost = []
    for seed in SEEDS:
        rng, M = np.random.default_rng(seed), np.zeros_like(e.piece.M)
        for modes, values in by_hand(e, "M"):
            T = rotation(len(values), rng)
            M += modes @ T @ np.diag(values) @ T.T @ modes.T
        lost.append(abs(motion @ M @ motion / whole - 1.0))
    assert max(lost) > 0.1
