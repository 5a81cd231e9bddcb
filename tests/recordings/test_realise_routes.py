"""The routes to normal modes by name: each gives the normal modes where its assumption holds."""

import re

import numpy as np
import pytest
import scipy.linalg

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify import identify_modes
from cvxupdate.recordings.realise import (
    ROUTES,
    ModelModes,
    ModeSet,
    mean_phase_deviation,
    realised,
    resonance_shapes,
    wei_zhang,
    zhang_lallement,
)
from cvxupdate.recordings.realise.routes import route_named
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin

M = np.diag([2.0, 1.5, 1.0, 1.7])
K = 1e5 * np.array(
    [
        [15.0, -6.0, 0.0, 0.0],
        [-6.0, 14.0, -8.0, 0.0],
        [0.0, -8.0, 13.0, -5.0],
        [0.0, 0.0, -5.0, 5.0],
    ]
)
DASHPOT = np.diag([0.0, 600.0, 0.0, 0.0])  # one heavy dashpot: modes are complex
EXACT = ("ibrahim", "zhang-lallement", "wei-zhang", "ibrahim-fullekrug", "normal-frf", "crossings")


def normal_modes():
    values, vectors = scipy.linalg.eigh(K, M)
    return np.sqrt(values) / (2.0 * np.pi), vectors.T


def damped(C):
    """Poles, complex shapes and receptances of all degrees of freedom."""
    n = len(M)
    A = np.block([[np.zeros((n, n)), np.eye(n)], [-np.linalg.solve(M, K), -np.linalg.solve(M, C)]])
    values, vectors = np.linalg.eig(A)
    keep = values.imag > 0.0
    rank = np.argsort(np.abs(values[keep]))
    lines = np.linspace(30.0, 260.0, 1200)
    s = 2j * np.pi * lines
    H = np.array([np.linalg.inv(K + x * C + x * x * M) for x in s])
    return values[keep][rank], vectors[:n, keep].T[rank], lines, H


@pytest.fixture(scope="module")
def identified():
    def go(C):
        _, _, lines, H = damped(C)
        places = [Channel(k + 1, "x", "displacement") for k in range(4)]
        forces = [Channel(k + 1, "x", "force") for k in range(4)]
        frf = FrequencyResponse(
            Origin("a", "a"), lines, H, "displacement", tuple(places), tuple(forces)
        )
        return identify_modes(frf, max_order=24)

    return {"proportional": go(2.0 * M + 1e-5 * K), "dashpot": go(DASHPOT)}


def mac(a, b):
    return float((a @ b) ** 2 / (a @ a) / (b @ b))


@pytest.mark.parametrize("route", ROUTES, ids=lambda r: r.name)
def test_every_route_keeps_modes_that_are_normal_already(route, identified):
    modes = identified["proportional"]
    frequency, shapes = normal_modes()
    model = ModelModes(frequency, shapes)
    found = realised(ModeSet(modes.poles, modes.shapes, modes, model), route)
    assert found.says == ""
    assert np.allclose(found.frequency, frequency, rtol=2e-5)
    assert min(mac(a, b) for a, b in zip(found.shapes, shapes, strict=True)) > 1.0 - 1e-6


@pytest.mark.parametrize("name", EXACT)
def test_routes_that_undo_damping_do_so_where_all_is_measured(name, identified):
    modes = identified["dashpot"]
    found = realised(ModeSet(modes.poles, modes.shapes, modes), route_named(name))
    frequency, shapes = normal_modes()
    assert np.allclose(found.frequency, frequency, rtol=1e-6)
    assert min(mac(a, b) for a, b in zip(found.shapes, shapes, strict=True)) > 1.0 - 1e-6
    assert np.abs(modes.frequency / frequency - 1.0).max() > 1e-3  # damping had moved them


def test_resonance_is_the_normal_response_where_all_is_measured():
    """(2.30): x_R = H_R f with the normal receptance H_R, for any real force."""
    _, _, lines, H = damped(DASHPOT)
    f = np.array([1.0, -0.3, 0.2, 0.5])
    at = H[[100, 500, 900]]
    wanted = np.array(
        [np.linalg.inv(K - (2.0 * np.pi * lines[k]) ** 2 * M) @ f for k in (100, 500, 900)]
    )
    assert np.allclose(resonance_shapes(at, at @ f), wanted, rtol=1e-8)


def test_two_of_four_modes_are_realised_nearly():
    """Incomplete, moderately damped: to first order the normal modes."""
    poles, shapes, _, _ = damped(0.25 * DASHPOT)
    poles, shapes = poles[:2], shapes[:2]
    frequency, truth = normal_modes()
    for way in (zhang_lallement, wei_zhang):
        found, vectors = way(poles, shapes)
        assert np.allclose(np.sort(found), frequency[:2], rtol=2e-3)
        order = np.argsort(found)
        assert min(mac(vectors[order[k]], truth[k]) for k in range(2)) > 0.999


def test_the_model_fills_up_what_was_not_measured():
    """Two of four modes, and a model whose springs are all 10 % too stiff: its own frequencies are
    5 % off, those of the route as near as with the right model, and a channel that is not on the
    model is left open."""
    poles, shapes, _, _ = damped(0.25 * DASHPOT)
    frequency, truth = normal_modes()
    wide = np.column_stack([shapes[:2], shapes[:2, :1]])
    own = np.column_stack([truth, np.full(4, np.nan)])
    for factor in (1.0, 1.1):
        model = ModelModes(np.sqrt(factor) * frequency, own)
        found = realised(ModeSet(poles[:2], wide, None, model), route_named("ibrahim-fill"))
        assert np.allclose(found.frequency, frequency[:2], rtol=2e-3)
        assert np.all(np.isnan(found.shapes[:, 4])) and np.all(np.isfinite(found.mac))
        assert min(mac(a[:4], b) for a, b in zip(found.shapes, truth[:2], strict=True)) > 0.9995


@pytest.mark.parametrize(
    ("model", "says"),
    [
        (None, "give a problem file"),
        (ModelModes(np.zeros(0), np.zeros((0, 4)), "n3.x has neither"), "no modes.*n3.x"),
        (ModelModes(np.ones(4), np.full((4, 4), np.nan)), "2 modes but 0 channels"),
        (ModelModes(np.ones(3), np.eye(4)[:3]), "1 others of the model do not make 4"),
    ],
)
def test_what_cannot_be_filled_up_says_why(model, says):
    poles, shapes, _, _ = damped(DASHPOT)
    found = realised(ModeSet(poles[:2], shapes[:2], None, model), route_named("ibrahim-fill"))
    assert re.search(says, found.says) and np.all(np.isnan(found.frequency))


def test_what_cannot_be_done_says_why():
    poles, shapes, _, _ = damped(DASHPOT)
    few = realised(ModeSet(poles, shapes[:, :2]), route_named("ibrahim-fullekrug"))
    assert "4 modes but 2 channels" in few.says and np.all(np.isnan(few.frequency))
    none = realised(ModeSet(poles, shapes), route_named("resonance"))
    assert "needs frequency responses" in none.says
    with pytest.raises(RecordingError, match="no route.*niedbal"):
        route_named("nidbal")


def test_mean_phase_deviation():
    line = np.array([[1.0, -2.0, 0.5]]) * np.exp(0.7j)
    assert mean_phase_deviation(line)[0] == pytest.approx(0.0, abs=1e-9)
    wave = np.exp(2j * np.pi * np.arange(16) / 16)[None]
    assert mean_phase_deviation(wave)[0] == pytest.approx(45.0, abs=1.0)
