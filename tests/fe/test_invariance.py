"""What must not change the frequencies: where the structure stands, how it is numbered, which
element describes it."""

from dataclasses import replace
from typing import Any

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from cvxupdate.fe.modes import Modes, model_modes
from tests.cases.elements import (
    ALLOY,
    FLAT_Y,
    FLAT_Z,
    POINTS,
    SPACE,
    build,
    chain,
    grid,
    held,
    lines,
    with_values,
)

ANGLES = st.tuples(*[st.floats(-3.2, 3.2)] * 3)
SEEDS = st.integers(0, 2**31)
PAIRS = [*chain(3), (1, 3), (2, 4)]
V = np.array([0.3, -0.9, 0.4])


def flexible(model: Any, count: int = 8) -> np.ndarray:
    return model_modes(model, count).flexible().eigenvalues


def renumbered(text: dict[str, Any], seed: int) -> dict[str, Any]:
    """Other node ids, in another order, and the rows shuffled."""
    rng = np.random.default_rng(seed)
    old = [n["id"] for n in text["nodes"]]
    new = dict(
        zip(old, (int(i) for i in rng.choice(10 * len(old), len(old), replace=False)), strict=True)
    )
    nodes_ = [
        {**text["nodes"][i], "id": new[text["nodes"][i]["id"]]} for i in rng.permutation(len(old))
    ]
    blocks = [
        {
            **b,
            "rows": [
                {**b["rows"][i], "nodes": [new[n] for n in b["rows"][i]["nodes"]]}
                for i in rng.permutation(len(b["rows"]))
            ],
        }
        for b in text["elements"]
    ]
    supports = [{**s, "nodes": [new[n] for n in s["nodes"]]} for s in text.get("supports", [])]
    return {
        **text,
        "nodes": nodes_,
        "elements": blocks,
        **({"supports": supports} if supports else {}),
    }


@settings(max_examples=15, deadline=None)
@given(ANGLES, SEEDS)
def test_beam3d_turned_and_moved(angles: tuple[float, float, float], seed: int) -> None:
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    shift = np.random.default_rng(seed).uniform(-1, 1, 3)
    for section, values in (("upright", {}), ("general", {"shear": 1.0, "N": 2e3})):
        here = with_values(
            build(lines("beam3d", POINTS, PAIRS, SPACE, section, orientation=V)), **values
        )
        there = with_values(
            build(
                lines(
                    "beam3d", POINTS @ turn.T + shift, PAIRS, SPACE, section, orientation=turn @ V
                )
            ),
            **values,
        )
        assert np.allclose(flexible(there), flexible(here), rtol=1e-7)


@settings(max_examples=15, deadline=None)
@given(ANGLES)
def test_rod_turned(angles: tuple[float, float, float]) -> None:
    turn = Rotation.from_euler("xyz", angles).as_matrix()
    pairs = [*PAIRS, (1, 4)]
    assert np.allclose(
        flexible(build(lines("rod", POINTS @ turn.T, pairs, "xyz", "round"))),
        flexible(build(lines("rod", POINTS, pairs, "xyz", "round"))),
    )


def rotated_plate(angle: float) -> np.ndarray:
    xs, ys = [0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26]
    text = grid(xs, ys, "rolled", ALLOY)
    c, s = np.cos(angle), np.sin(angle)
    turned = [
        {**n, "x": c * n["x"] - s * n["y"], "y": s * n["x"] + c * n["y"]} for n in text["nodes"]
    ]
    return flexible(build({**text, "nodes": turned}))


@settings(max_examples=15, deadline=None)
@given(st.floats(-3.2, 3.2))
def test_plate_turned_about_its_normal(angle: float) -> None:
    assert np.allclose(rotated_plate(angle), rotated_plate(0.0), rtol=1e-8)


def test_mirrored_plate() -> None:
    xs, ys = np.array([0.0, 0.11, 0.3, 0.42]), np.array([0.0, 0.17, 0.26])
    mirrored = grid(np.sort(-xs), ys, "rolled", ALLOY)
    assert np.allclose(
        flexible(build(mirrored)), flexible(build(grid(xs, ys, "rolled", ALLOY))), rtol=1e-9
    )


def test_node_order_of_a_plate() -> None:
    """Starting at the opposite corner changes nothing, at the next one it swaps Dx and Dy."""
    xs, ys = [0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26]
    first = flexible(build(grid(xs, ys, "rolled", ALLOY)))
    assert np.allclose(flexible(build(grid(xs, ys, "rolled", ALLOY, turn=2))), first, rtol=1e-9)
    swapped = {"shape": "plate", "thickness": 0.003, "Dx": 0.9, "Dy": 1.1, "D1": 1.05, "Dxy": 0.85}
    assert np.allclose(flexible(build(grid(xs, ys, swapped, ALLOY, turn=1))), first, rtol=1e-9)


@settings(max_examples=15, deadline=None)
@given(SEEDS)
def test_renumbering(seed: int) -> None:
    for text in (
        lines("beam3d", POINTS, PAIRS, SPACE, "upright", orientation=V),
        lines("rod", POINTS, [*PAIRS, (1, 4)], "xyz"),
        held(grid([0.0, 0.11, 0.3, 0.42], [0.0, 0.17, 0.26], "rolled"), ([1, 4], ["z"])),
    ):
        assert np.allclose(
            flexible(build(renumbered(text, seed))), flexible(build(text)), rtol=1e-8
        )


def test_reversed_beams() -> None:
    """A beam may run either way."""
    there = build(
        lines("beam3d", POINTS, [(b, a) for a, b in PAIRS], SPACE, "upright", orientation=V)
    )
    assert np.allclose(
        flexible(there),
        flexible(build(lines("beam3d", POINTS, PAIRS, SPACE, "upright", orientation=V))),
        rtol=1e-9,
    )


def test_beam2d_is_beam3d_kept_in_its_plane() -> None:
    for mass in ("consistent", "lumped"):
        for points, dofs, others in (
            (FLAT_Y, ["x", "y", "rz"], ["z", "rx", "ry"]),
            (FLAT_Z, ["x", "z", "ry"], ["y", "rx", "rz"]),
        ):
            for values in ({}, {"shear": 1.0, "N": 1e4}):
                flat = with_values(
                    build(lines("beam2d", points, PAIRS[:4], dofs, "upright", mass=mass)), **values
                )
                space = with_values(
                    build(
                        held(
                            lines("beam3d", points, PAIRS[:4], SPACE, "upright", mass=mass),
                            ("all", others),
                        )
                    ),
                    **values,
                )
                active = with_values(
                    build(lines("beam3d", points, PAIRS[:4], dofs, "upright", mass=mass)), **values
                )
                assert flat.labels == space.labels == active.labels
                for other in (space, active):
                    for name in ("K", "M"):
                        a, b = (
                            getattr(flat.matrices(), name).toarray(),
                            getattr(other.matrices(), name).toarray(),
                        )
                        assert np.allclose(a, b, rtol=1e-12, atol=1e-13 * np.abs(a).max())


def test_shapes_turn_with_the_structure() -> None:
    """Not only frequencies: the shapes of a turned frame are the turned shapes."""
    turn = Rotation.from_euler("xyz", [0.4, -1.1, 2.0]).as_matrix()
    here = model_modes(
        build(lines("beam3d", POINTS, PAIRS, SPACE, "upright", orientation=V)), 4
    ).flexible()
    there = model_modes(
        build(lines("beam3d", POINTS @ turn.T, PAIRS, SPACE, "upright", orientation=turn @ V)), 4
    ).flexible()
    moved: Modes = replace(
        here, shapes=np.einsum("ij,njm->nim", turn, here.shapes.reshape(-1, 3, 4)).reshape(-1, 4)
    )
    for r in range(4):
        a, b = moved.shapes[:, r], there.shapes[:, r]
        assert min(np.abs(a - b).max(), np.abs(a + b).max()) <= 1e-6 * np.abs(a).max()
