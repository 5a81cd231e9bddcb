"""Measured modes paired anew with the modes of a model as it is."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.modes import model_modes
from cvxupdate.recordings.types import Channel, ModeTable, Origin
from cvxupdate.residual.another_pairing import nearest_pairing, shape_distances
from cvxupdate.residual.modal import modal_residual
from tests.cases.cantilever import load, text

SENSORS = (3, 6, 9, 12)


@pytest.fixture
def point(tmp_path):
    """Four modes of a cantilever beside themselves, to fit, and the second of them again."""
    return compared(tmp_path, [0, 1, 2, 3], [1])


def compared(tmp_path, fit: list[int], hold: list[int]):
    """Modes of a cantilever beside themselves, to fit and held out."""
    _, model = load(tmp_path, text())
    modes = model_modes(model, 4)
    f, shapes = modes.frequencies[:4], modes.shapes[[model.place[f"n{n}.z"] for n in SENSORS], :4].T
    channels = tuple(Channel(n, "z", "displacement") for n in SENSORS)

    def table(use: str, which: list[int]) -> ModeTable:
        nothing = np.full(len(which), np.nan)
        std = 0.02 * np.abs(shapes[which]).max(axis=1)[:, None] * np.ones(len(SENSORS))
        return ModeTable(
            Origin(use, use, use),
            f[which],
            2e-3 * f[which],
            nothing,
            nothing,
            channels,
            shapes[which],
            std,
            np.zeros(len(which), dtype=np.int64),
        )

    residual = modal_residual(model, [table("fit", fit)], [table("hold-out", hold)], True)
    return residual.evaluate(model.zero())


def test_modes_that_were_exchanged_are_put_right(point) -> None:
    """The one that is only scored goes with the fitted one that it is."""
    right = point.places
    wrong = replace(point, places=(right[0][[0, 2, 1, 3]], right[0][[2]]))
    assert not np.array_equal(wrong.places[0], right[0])
    found = nearest_pairing(wrong)
    assert all(np.array_equal(a, b) for a, b in zip(found.places, right, strict=True))


def test_a_mode_that_is_only_scored_is_found_anew(tmp_path) -> None:
    """An effect that brought a mode among the fitted ones shifts the numbers of all above; and a
    few sensors see alike what are different modes, of which an effect moves one."""
    point = compared(tmp_path, [0, 1, 2], [3])
    right = point.places
    shifted = replace(point, places=(right[0][[0, 2, 1]], right[1] + 1))
    found = nearest_pairing(shifted)
    assert all(np.array_equal(a, b) for a, b in zip(found.places, right, strict=True))
    alone = replace(point, places=(right[0], right[1] + 1))
    assert np.array_equal(nearest_pairing(alone).places[1], right[1])


def test_a_right_pairing_stays(point) -> None:
    found = nearest_pairing(point)
    assert all(np.array_equal(a, b) for a, b in zip(found.places, point.places, strict=True))


def test_a_mode_without_partner_stays_without(point) -> None:
    fewer = replace(
        point, places=(np.where([True, False, True, True], point.places[0], -1), point.places[1])
    )
    assert nearest_pairing(fewer).places[0][1] == -1


def test_what_swings_is_no_motion_as_one_body(tmp_path) -> None:
    """A free bar that measured far lower than modelled: by eigenvalue the motions at 0 Hz are
    nearer, and their shapes are any mixture of one another (the laboratory's 3311)."""
    content = text("{ frequency = 20.0 }, { frequency = 60.0 }")
    _, model = load(
        tmp_path, content.replace('[[model.supports]]\nnodes = [1]\ndofs = ["z", "ry"]\n', "")
    )
    free = model_modes(model, 6)
    assert free.rigid == 2 and free.frequencies[2] > 30.0
    nothing = np.full(2, np.nan)
    measured = np.array([20.0, 60.0])
    table = ModeTable(
        Origin("t", "t", "t"),
        measured,
        2e-3 * measured,
        nothing,
        nothing,
        (),
        None,
        None,
        np.zeros(2, dtype=np.int64),
    )
    point = modal_residual(model, [table], [], False).evaluate(model.zero())
    assert nearest_pairing(point).places[0].min() >= 2


def test_distances_of_shapes_are_those_of_weighted_least_squares() -> None:
    rng = np.random.default_rng(2)
    phi, x, std = rng.normal(size=(2, 5, 3)), rng.normal(size=5), rng.uniform(0.1, 1.0, 5)
    got = shape_distances(phi, x, std)
    for n in range(2):
        for m in range(3):
            column = (phi[n, :, m] / std)[:, None]
            _, left, *_ = np.linalg.lstsq(column, x / std, rcond=None)
            assert got[n, m] == pytest.approx(left[0])
    assert shape_distances(np.zeros((1, 5, 1)), x, std)[0, 0] == pytest.approx(
        np.sum((x / std) ** 2)
    )
