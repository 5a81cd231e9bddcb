"""Natural modes: rigid-body motion, repeated modes, massless DOFs, soft suspensions, mechanisms;
dense and sparse alike."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from cvxupdate.errors import ModelError
from cvxupdate.fe import modes as fe_modes
from cvxupdate.fe.model import Model
from cvxupdate.fe.modes import Modes, model_modes, natural_modes
from cvxupdate.fe.select import select_parameters
from tests.cases.elements import (
    ALLOY,
    POINTS,
    SPACE,
    build,
    chain,
    grid,
    held,
    joined,
    lines,
    with_values,
)

BOTH = pytest.mark.parametrize("path", ["dense", "sparse"])


@pytest.fixture
def solve(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Modes by either path, with what every answer must satisfy checked."""

    def run(model: Model, count: int, path: str) -> Modes:
        monkeypatch.setattr(fe_modes, "DENSE", 10**9 if path == "dense" else 0)
        found = model_modes(model, count)
        check(model, found)
        return found

    return run


def check(model: Model, modes: Modes) -> None:
    m = model.matrices()
    phi, lam = modes.shapes, modes.eigenvalues
    assert np.all(np.diff(lam) >= -1e-9 * np.abs(lam[-1]))
    assert np.allclose(phi.T @ (m.M @ phi), np.eye(len(lam)), atol=1e-8)
    residual = m.K @ phi - (m.M @ phi) * lam
    assert np.all(
        np.abs(residual).max(axis=0) <= 1e-8 * np.abs(m.K).max() * np.abs(phi).max(axis=0)
    )


def sprung(model: Mapping[str, Any], rows: Sequence[tuple[int, str, float]]) -> dict[str, Any]:
    """The model on springs to ground (node, dof, k)."""
    return joined(
        model,
        {
            "elements": [
                {
                    "type": "spring",
                    "rows": [{"id": 1, "nodes": [n], "dof": d, "k": k} for n, d, k in rows],
                }
            ]
        },
    )


LINE = np.linspace(0.0, 1.2, 13) ** 1.1
FREE: tuple[tuple[str, dict[str, Any], int], ...] = (
    ("rod x", lines("rod", LINE[:, None] * [1, 0, 0], chain(12), ["x"]), 1),
    ("shaft rx", lines("beam3d", LINE[:, None] * [1, 0, 0], chain(12), ["rx"]), 1),
    ("beam z ry", lines("beam2d", LINE[:, None] * [1, 0, 0], chain(12), ["z", "ry"]), 2),
    ("beam y rz", lines("beam3d", LINE[:, None] * [1, 0, 0], chain(12), ["y", "rz"]), 2),
    ("beam x y rz", lines("beam2d", LINE[:, None] * [0.8, 0.6, 0], chain(12), ["x", "y", "rz"]), 3),
    ("beam in space", lines("beam3d", LINE[:, None] * [0.6, 0.64, 0.48], chain(12), SPACE), 6),
    ("frame", lines("beam3d", POINTS, [*chain(3), (1, 3), (2, 4)], SPACE, "tube"), 6),
    ("plate", grid(np.linspace(0, 0.665, 6), np.linspace(0, 0.455, 5)), 3),
    (
        "plate far from the origin",
        grid(40 + np.linspace(0, 0.665, 6), -70 + np.linspace(0, 0.455, 5)),
        3,
    ),
    ("tetrahedron of rods", lines("rod", POINTS, [*chain(3), (1, 3), (2, 4), (1, 4)], "xyz"), 6),
    (
        "hinged beam",
        held(
            lines("beam2d", LINE[:, None] * [1, 0, 0], chain(12), ["x", "y", "rz"]),
            ([1], ["x", "y"]),
        ),
        1,
    ),
    (
        "sliding beam",
        held(
            lines("beam2d", LINE[:, None] * [1, 0, 0], chain(12), ["x", "y", "rz"]),
            ([1, 13], ["y", "rz"]),
        ),
        1,
    ),
    ("lumped plate", grid(np.linspace(0, 0.665, 6), np.linspace(0, 0.455, 5), mass="lumped"), 3),
    (
        "beams without rotary inertia",
        lines("beam3d", POINTS, [*chain(3), (1, 3), (2, 4)], SPACE, "tube", rotary_inertia=False),
        6,
    ),
)


@BOTH
@pytest.mark.parametrize(("name", "text", "rigid"), FREE, ids=[f[0] for f in FREE])
def test_rigid_body_modes(
    name: str, text: dict[str, Any], rigid: int, path: str, solve: Any
) -> None:
    model = build(text)
    modes = solve(model, 2, path)
    assert modes.rigid == rigid
    assert np.all(modes.frequencies[:rigid] == 0.0)
    assert modes.flexible().frequencies.min() > 1.0
    assert len(modes.eigenvalues) == rigid + 2


@pytest.mark.parametrize(("name", "text", "rigid"), FREE, ids=[f[0] for f in FREE])
def test_dense_and_sparse_agree(name: str, text: dict[str, Any], rigid: int, solve: Any) -> None:
    model = build(text)
    count = max(1, (model.size - rigid) // 4 - 3)
    a, b = solve(model, count, "dense"), solve(model, count, "sparse")
    assert np.allclose(a.flexible().eigenvalues, b.flexible().eigenvalues, rtol=1e-8)


def square_plate() -> dict[str, Any]:
    s = np.linspace(0.0, 0.4, 21)
    return grid(s, s, {"shape": "plate", "thickness": 0.003})


def round_bar() -> dict[str, Any]:
    return lines(
        "beam3d", np.linspace(0, 1, 61)[:, None] * [0.6, 0.64, 0.48], chain(60), SPACE, "round"
    )


@pytest.mark.parametrize("make", [square_plate, round_bar])
def test_repeated_modes_are_complete(make: Any, solve: Any) -> None:
    """Pairs come as pairs however many modes are asked for, and the last pair may be cut in two."""
    model = build(make())
    whole = solve(model, 24, "dense").flexible()
    values = whole.eigenvalues
    assert np.sum(np.abs(np.diff(values)) < 1e-7 * values[1:]) >= 3
    for count in (1, 5, 10, 11, 12, 24):
        found = solve(model, count, "sparse").flexible()
        assert np.allclose(found.eigenvalues, values[:count], rtol=1e-8)
    m = model.matrices()
    last = (
        1 + int(np.argmax(np.diff(values[20:]) / values[20:-1])) + 20
    )  # where a gap follows, the spaces agree
    share = whole.shapes[:, :last].T @ (m.M @ found.shapes[:, :last])
    assert np.allclose(np.linalg.svd(share, compute_uv=False), 1.0, atol=1e-6)


def test_four_equal_structures(solve: Any) -> None:
    """Eightfold eigenvalues: four like cantilevers of a round bar that do not touch."""
    one = np.linspace(0, 1, 21)[:, None] * [1.0, 0, 0]
    points = np.vstack([one + np.array([0, 0.1 * i, 0]) for i in range(4)])
    pairs = [(21 * i + a, 21 * i + b) for i in range(4) for a, b in chain(20)]
    model = build(held(lines("beam3d", points, pairs, SPACE, "round"), ([1, 22, 43, 64], SPACE)))
    a, b = solve(model, 17, "dense"), solve(model, 17, "sparse")
    assert np.ptp(a.eigenvalues[:8]) < 1e-7 * a.eigenvalues[0]
    assert np.allclose(a.eigenvalues, b.eigenvalues, rtol=1e-8)


@BOTH
@pytest.mark.parametrize("hz", [1.0, 0.05])
def test_soft_suspension_is_not_rigid(hz: float, path: str, solve: Any) -> None:
    """A plate on springs at 1 Hz, and at 0.05 Hz: three suspension modes, no rigid ones, the
    flexible ones hardly moved."""
    sheet = grid(np.linspace(0, 0.665, 16), np.linspace(0, 0.455, 12))
    free = build(sheet)
    mass = free.total_mass()
    k = (2 * np.pi * hz) ** 2 * mass / 4
    model = build(sprung(sheet, [(n, "z", k) for n in (1, 16, 177, 192)]))
    found = solve(model, 6, path)
    assert found.rigid == 0
    exact = hz * np.array(
        [1.0, np.sqrt(3), np.sqrt(3)]
    )  # four corners: bounce, and tilt at √3 times that
    assert np.allclose(found.frequencies[:3], exact, rtol=5e-3 * hz**2 + 1e-6)
    assert np.allclose(
        found.frequencies[3:], solve(free, 3, path).flexible().frequencies, rtol=0.01
    )


@BOTH
def test_light_rotations_do_not_hide_a_suspension(path: str, solve: Any) -> None:
    """A tiny lumped inertia makes a huge k/m somewhere: the zero level must not rise with it."""
    text = lines(
        "beam2d",
        np.linspace(0, 1, 31)[:, None] * [1.0, 0, 0],
        chain(30),
        ["y", "rz"],
        rotary_inertia=False,
    )
    light = with_values(build(sprung(text, [(1, "y", 40.0), (31, "y", 40.0)])))
    text["elements"] = [dict(b) for b in text["elements"]]
    model = build(
        joined(
            sprung(text, [(1, "y", 40.0), (31, "y", 40.0)]),
            {
                "elements": [
                    {"type": "mass", "rows": [{"id": 1, "nodes": [5], "m": 0.0, "Izz": 1e-9}]}
                ]
            },
        )
    )
    found = solve(model, 4, path)
    assert found.rigid == 0
    assert found.frequencies[0] == pytest.approx(
        np.sqrt(80 / light.total_mass()) / 2 / np.pi, rel=1e-3
    )


@BOTH
def test_massless_dofs_follow_statically(path: str, solve: Any) -> None:
    """A weightless beam with three lumps: as many modes as moving masses, equal to those of its
    flexibility matrix."""
    x = np.array([0.0, 0.2, 0.3, 0.45, 0.5, 0.7, 0.75, 0.8, 0.9, 1.0])
    light = {"E": 70e9, "nu": 0.3, "rho": 0.0}
    text = held(
        lines("beam2d", x[:, None] * [1.0, 0, 0], chain(9), ["y", "rz"], "bar", light),
        ([1, 10], ["y"]),
    )
    lumps = {3: 2.0, 5: 1.5, 8: 0.7}
    model = build(
        joined(
            text,
            {
                "elements": [
                    {
                        "type": "mass",
                        "rows": [
                            {"id": i, "nodes": [n], "m": m}
                            for i, (n, m) in enumerate(lumps.items())
                        ],
                    }
                ]
            },
        )
    )
    found = solve(model, 10, path)
    EI = 70e9 * 0.012 * 0.1**3 / 12
    a = np.array([x[n - 1] for n in lumps])

    def sag(at: float, load: float) -> float:  # simply supported, unit span (Roark)
        at, load = min(at, load), max(at, load)
        b = 1 - load
        return b * at * (1 - b**2 - at**2) / 6 / EI

    F = np.array([[sag(p, q) for q in a] for p in a])
    exact = 1 / np.sort(np.linalg.eigvals(F @ np.diag(list(lumps.values()))).real)[::-1]
    assert np.allclose(found.eigenvalues, exact, rtol=1e-9)


def test_few_masses_in_a_large_light_model(solve: Any) -> None:
    """Forty lumps on a weightless frame: neither path may drown in the massless DOFs."""
    light = {"E": 70e9, "nu": 0.3, "rho": 0.0}
    text = held(
        lines(
            "beam2d",
            np.linspace(0, 3, 41)[:, None] * [0.8, 0.6, 0],
            chain(40),
            ["x", "y", "rz"],
            "bar",
            light,
        ),
        ([1], ["x", "y", "rz"]),
    )
    model = build(
        joined(
            text,
            {
                "elements": [
                    {
                        "type": "mass",
                        "rows": [{"id": i, "nodes": [2 * i], "m": 0.3} for i in range(1, 21)],
                    }
                ]
            },
        )
    )
    a, b = solve(model, 12, "dense"), solve(model, 12, "sparse")
    assert np.allclose(a.eigenvalues, b.eigenvalues, rtol=1e-8)
    assert (
        len(solve(model, 400, "sparse").eigenvalues)
        == len(solve(model, 400, "dense").eigenvalues)
        == 40
    )


def test_count_beyond_what_there_is(solve: Any) -> None:
    model = build(FREE[0][1])
    assert (
        len(solve(model, 100, "dense").eigenvalues)
        == len(solve(model, 100, "sparse").eigenvalues)
        == 13
    )
    assert len(solve(model, 0, "dense").eigenvalues) == 1


# ---- what is no structure


def mechanisms() -> list[tuple[str, dict[str, Any], str]]:
    truss = lines(
        "rod",
        [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]],
        [(1, 2), (2, 3), (3, 4), (4, 1)],
        ["x", "y"],
    )
    swing = lines(
        "rod", [[0, 0, 0], [1, 0, 0], [2, 0, 0], [3, 0, 0], [4, 0, 0]], chain(4), ["x", "y"]
    )
    hanging = joined(
        lines("beam2d", LINE[:, None] * [1, 0, 0], chain(12), ["x", "y", "rz"]),
        {
            "elements": [
                {"type": "mass", "rows": [{"id": 1, "nodes": [14], "m": 2.0}]},
                {"type": "spring", "dof": "x", "rows": [{"id": 2, "nodes": [13, 14], "k": 1e5}]},
            ]
        },
    )
    hanging = {**hanging, "nodes": [*hanging["nodes"], {"id": 14, "x": 2.0}]}
    apart = lines("beam3d", POINTS, [(1, 2), (3, 4)], SPACE)
    return [
        ("square of rods", truss, r"n\d\.[xy] most"),
        ("rods in a row", held(swing, ([1, 5], ["x", "y"])), r"n\d\.y most"),
        ("mass on a slider", hanging, "n14.y most"),
        ("two pieces", apart, r"n\d\.\w+ most"),
    ]


@BOTH
@pytest.mark.parametrize(("name", "text", "words"), mechanisms(), ids=[m[0] for m in mechanisms()])
def test_mechanism_is_named(
    name: str, text: dict[str, Any], words: str, path: str, solve: Any
) -> None:
    with pytest.raises(ModelError, match=f"mechanism.*{words}"):
        solve(build(text), 6, path)


@pytest.mark.parametrize("elements", [30, 400])
def test_large_mechanism_is_named(elements: int) -> None:
    """A hinge that nobody drew, in a fine mesh: two beams joined by translations only."""
    n = elements
    points = np.vstack([np.linspace(0, 1, n + 1), np.linspace(1, 2, n + 1)]).reshape(-1)[
        :, None
    ] * [1.0, 0, 0]
    text = lines(
        "beam2d", points, [*chain(n), *[(n + 1 + a, n + 1 + b) for a, b in chain(n)]], ["y", "rz"]
    )
    with pytest.raises(ModelError, match=r"mechanism"):
        model_modes(build(held(text, ([1, n + 1, n + 2], ["y"]))), 6)


def test_dof_with_neither_stiffness_nor_mass_is_named() -> None:
    text = {
        "dofs": ["x", "y"],
        "nodes": [{"id": 1, "x": 0.0}, {"id": 2, "x": 1.0}],
        "elements": [
            {"type": "dashpot", "dof": "y", "rows": [{"id": 1, "nodes": [1, 2], "c": 1.0}]},
            {"type": "spring", "dof": "x", "rows": [{"id": 2, "nodes": [1, 2], "k": 1.0}]},
            {"type": "mass", "rows": [{"id": 3, "nodes": [2], "m": 1.0}]},
        ],
        "supports": [{"nodes": [1], "dofs": ["x", "y"]}],
    }
    text["elements"][2] = {
        "type": "spring",
        "dof": "x",
        "rows": [{"id": 3, "nodes": [2], "k": 1.0}],
    }
    with pytest.raises(ModelError, match=r"n2\.y has neither stiffness nor mass"):
        model_modes(build(text), 1)


@dataclass(frozen=True)
class Wanted:
    name: str
    of: str
    elements: tuple[int, ...] = ()
    group: str | None = None
    lower: float | None = None
    upper: float | None = None
    scale: float | None = None


@pytest.mark.parametrize("n", [6, 24])
def test_negative_mass_is_refused(n: int) -> None:
    """A mass p-value below −1, of one element among many: on the diagonal or only inside M."""
    model = build(grid(np.linspace(0, 0.665, n + 1), np.linspace(0, 0.455, n + 1)))
    model = model.with_parameters(select_parameters([Wanted("e8.mass", "mass", (8,))], model))
    for p in (-3.0, -1.5, -60.0):
        with pytest.raises(ModelError, match="mass matrix has a negative"):
            model_modes(model, 4, np.array([p]))
        with pytest.raises(ModelError, match="mass matrix has a negative"):
            model_modes(model, 4, matrices=model.matrices(np.array([p])))
    assert model_modes(model, 4, np.array([-0.5])).rigid == 3


def test_mass_taken_off_is_allowed() -> None:
    """A negative lump is fine as long as the whole stays positive (a hole, a part left out)."""
    text = held(lines("rod", [[0, 0, 0], [1, 0, 0], [2, 0, 0]], chain(2), ["x"]), ([1], ["x"]))
    model = build(
        joined(text, {"elements": [{"type": "mass", "rows": [{"id": 1, "nodes": [3], "m": 1.0}]}]})
    )
    model = model.with_parameters(select_parameters([Wanted("lump", "m", (3,))], model))
    assert np.all(model_modes(model, 2, np.array([-1.8])).eigenvalues > 0)


@BOTH
def test_negative_stiffness_is_named(path: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(fe_modes, "DENSE", 10**9 if path == "dense" else 0)
    model = build(held(lines("rod", LINE[:, None] * [1, 0, 0], chain(12), ["x"]), ([1], ["x"])))
    model = model.with_parameters(select_parameters([Wanted("e12.E", "E", (12,))], model))
    with pytest.raises(ModelError, match=r"negative stiffness.*n13\.x most"):
        model_modes(model, 2, np.array([-1.2]))


def test_natural_modes_of_plain_matrices(monkeypatch: pytest.MonkeyPatch) -> None:
    """Given no geometry, free motions are found and come first; negative eigenvalues are returned,
    dense and sparse alike."""
    n = 60
    K = sp.diags_array(
        [np.full(n, 2.0), -np.ones(n - 1), -np.ones(n - 1)], offsets=[0, 1, -1], format="lil"
    )
    K[0, 0] = K[-1, -1] = 1.0
    M = sp.csc_array(sp.eye_array(n))
    exact = 4 * np.sin(np.arange(6) * np.pi / 2 / n) ** 2
    for dense in (0, 10**6):
        monkeypatch.setattr(fe_modes, "DENSE", dense)
        modes = natural_modes(sp.csc_array(K), M, 5)
        assert modes.rigid == 1
        assert np.allclose(modes.eigenvalues, exact, atol=1e-13)
        soft = sp.csc_array(K - 0.01 * M)
        values = natural_modes(soft, M, 5).eigenvalues
        assert np.allclose(values, exact[:5] - 0.01, atol=1e-12)


# ---- size


@pytest.mark.slow
def test_hundred_thousand_dofs_in_one_call() -> None:
    """12 modes of a free plate of 101,472 DOFs, between Leissa's upper bounds (Ritz, free
    rectangle, a/b = 1.5, ν = 0.3) and 1 % below them."""
    nx, ny = 223, 150
    a, b, h = 0.75, 0.5, 0.003
    steel = {"E": 206e9, "nu": 0.3, "rho": 7860.0}
    model = big_plate(nx, ny, a, b, h, steel)
    assert model.size == 3 * (nx + 1) * (ny + 1) > 1e5
    modes = model_modes(model, 12)
    assert modes.rigid == 3
    D = steel["E"] * h**3 / 12 / (1 - 0.3**2)
    parameter = 2 * np.pi * modes.flexible().frequencies[:5] * a**2 * np.sqrt(steel["rho"] * h / D)
    bounds = np.array([20.128, 21.603, 46.654, 50.293, 58.201])  # Leissa 1973, ω a² √(ρ h / D)
    assert np.all((parameter < bounds) & (parameter > 0.99 * bounds))
    check(model, modes)
    coarse = model_modes(big_plate(60, 40, a, b, h, steel), 12).flexible().frequencies
    assert np.allclose(modes.flexible().frequencies, coarse, rtol=5e-3)


def big_plate(nx: int, ny: int, a: float, b: float, h: float, material: dict[str, float]) -> Model:
    """By the same way as a problem file, the text left out (a million numbers of TOML say nothing
    new)."""
    small = build(
        grid([0.0, a / nx, 2 * a / nx], [0.0, b / ny], {"shape": "plate", "thickness": h}, material)
    )
    block = small.blocks[0]
    ids = np.arange((nx + 1) * (ny + 1)).reshape(ny + 1, nx + 1)
    quads = np.stack([ids[:-1, :-1], ids[:-1, 1:], ids[1:, 1:], ids[1:, :-1]], axis=-1).reshape(
        -1, 4
    )
    e = len(quads)
    y, x = np.divmod(np.arange(ids.size), nx + 1)
    from dataclasses import replace

    block = replace(
        block,
        ids=np.arange(1, e + 1),
        groups=("",) * e,
        dofs=(3 * quads[:, :, None] + np.arange(3)).reshape(e, 12),
        terms=tuple(replace(t, values=t.values[:1]) for t in block.terms),
        geometry=np.zeros(e, dtype=np.int64),
        properties={k: np.full(e, v[0]) for k, v in block.properties.items()},
    )
    labels = tuple(f"n{i + 1}.{d}" for i in range(ids.size) for d in ("z", "rx", "ry"))
    return Model(
        labels,
        np.arange(1, ids.size + 1),
        np.stack([x * a / nx, y * b / ny, 0.0 * x], axis=1),
        np.repeat(np.arange(ids.size), 3),
        np.tile([2, 3, 4], ids.size),
        (block,),
    )


def test_alloy_is_used_nowhere_by_chance() -> None:
    """Frequencies scale with √(E/ρ) and with the thickness, and fall with the square of the
    size."""
    xs, ys = np.linspace(0, 0.6, 6), np.linspace(0, 0.4, 5)
    first = (
        model_modes(build(grid(xs, ys, {"shape": "plate", "thickness": 0.002}, ALLOY)), 5)
        .flexible()
        .frequencies
    )
    other = {**ALLOY, "E": 4 * ALLOY["E"]}
    assert np.allclose(
        model_modes(build(grid(xs, ys, {"shape": "plate", "thickness": 0.002}, other)), 5)
        .flexible()
        .frequencies,
        2 * first,
    )
    assert np.allclose(
        model_modes(build(grid(2 * xs, 2 * ys, {"shape": "plate", "thickness": 0.004}, ALLOY)), 5)
        .flexible()
        .frequencies,
        first / 2,
    )
