"""A finite-element model reduced for simulation: static answer, frequency responses, and the
nonlinear answer of the whole model."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate import forces as nl
from cvxupdate.errors import ModelError
from cvxupdate.fe.synthesis import responses
from cvxupdate.simulate import reduced_system, simulate
from tests.cases import elements

SPANS = np.cumsum([0.0, 0.11, 0.13, 0.09, 0.12, 0.1, 0.14, 0.08, 0.11, 0.12])


def cantilever(**damping):
    points = np.column_stack([SPANS, 0.0 * SPANS, 0.0 * SPANS])
    model = elements.lines("beam2d", points, elements.chain(9), ["x", "y", "rz"], "bar")
    model["supports"] = [{"nodes": [1], "dofs": ["x", "y", "rz"]}]
    return elements.build(model | ({"damping": damping} if damping else {}))


def place(model, label):
    return model.place[label]


def column(model, label):
    out = np.zeros((model.size, 1))
    out[place(model, label)] = 1.0
    return out


@pytest.mark.parametrize(
    ("damping", "close"),
    [
        ({"kind": "modal", "zeta": [0.01, 0.02, 0.015]}, 3e-3),
        ({"kind": "rayleigh", "alpha": 3.0, "beta": 1e-5}, 3e-3),
        ({"kind": "structural", "eta": 0.02}, 2e-2),  # the same at resonances only: η beside ηΩ/ω
    ],
    ids=["modal", "rayleigh", "structural"],
)
def test_frequency_responses_are_those_of_the_model(damping, close):
    """Linear: the state space of the reduced system against the model's own synthesis."""
    model = cantilever(**damping)
    inputs, outputs = [place(model, "n10.y")], [place(model, "n10.y"), place(model, "n6.y")]
    law = nl.cubic(0.0)
    system = reduced_system(model, law, column(model, "n10.y"), inputs, outputs, 300.0)
    f = np.linspace(5.0, 300.0, 40)
    wanted = responses(model, 2j * np.pi * f, np.array(outputs), np.array(inputs), "displacement")
    _, into, out = system.parts()
    got = []
    for w in 2.0 * np.pi * f:
        Z = np.diag(system.omega**2 - w**2) + 1j * w * system.damping
        got.append(out.T @ np.linalg.solve(Z, into))
    assert np.linalg.norm(np.array(got) - wanted) < close * np.linalg.norm(wanted)
    assert system.modes < model.size


def test_static_answer_at_an_element_is_exact():
    """Local flexibility: what the modes leave out is in the corrections."""
    model = cantilever()
    B = column(model, "n7.y") - column(model, "n4.y")
    system = reduced_system(model, nl.cubic(0.0), B, [], [], 200.0)
    phi, _, _ = system.parts()
    exact = B.T @ np.linalg.solve(model.matrices().K.toarray(), B)
    got = phi.T @ (phi / system.omega[:, None] ** 2)
    np.testing.assert_allclose(got, exact, rtol=1e-9)


def test_the_nonlinear_answer_does_not_hang_on_the_band():
    """Contact at the tip and a slider in the middle: a wide basis against a narrow one."""
    model = cantilever(kind="rayleigh", alpha=8.0, beta=2e-5)
    B = np.hstack([column(model, "n10.y"), column(model, "n5.y")])
    rate = 1000.0
    t = np.arange(0, 0.4, 1.0 / rate)
    p = (30.0 * np.sin(2 * np.pi * 11.0 * t) * np.minimum(1.0, 8 * t))[:, None]
    places = [place(model, "n8.y")], [place(model, "n10.y")]
    free = reduced_system(model, nl.linear([0.0, 0.0]), B, *places, 100.0)
    reach = np.abs(simulate(free, p, rate).x).max(axis=0)
    laws = nl.join([nl.clearance(3e4, 0.3 * reach[0]), nl.jenkins(3e3 / reach[1], 4.0)])
    small, large = (
        simulate(reduced_system(model, laws, B, *places, top), p, rate) for top in (150.0, 1000.0)
    )
    assert np.any(large.force[:, 0] > 0.0) and np.ptp(large.force[:, 1]) > 4.0
    scale = np.linalg.norm(large.displacement)
    assert np.linalg.norm(small.displacement - large.displacement) < 0.02 * scale


def test_a_free_structure_flies():
    """Rigid-body motion: a force on a free beam moves its centre by F t²/2m."""
    points = np.column_stack([SPANS, 0.0 * SPANS, 0.0 * SPANS])
    model = elements.build(
        elements.lines("beam2d", points, elements.chain(9), ["x", "y", "rz"], "bar")
    )
    at = [place(model, "n3.x")]
    system = reduced_system(model, nl.cubic(0.0), column(model, "n8.y"), at, at, 200.0)
    run = simulate(system, np.full((101, 1), 2.0), 1000.0)
    assert run.displacement[-1, 0] == pytest.approx(0.5 * 2.0 / model.total_mass() * 0.01, rel=1e-2)


def test_held_places_and_bad_bands():
    model = cantilever()
    system = reduced_system(model, nl.cubic(1.0), column(model, "n9.y"), [-1], [-1], 200.0)
    run = simulate(system, np.ones((10, 1)), 1000.0)
    assert not np.any(run.displacement)
    with pytest.raises(ModelError, match="above 0 Hz"):
        reduced_system(model, nl.cubic(1.0), column(model, "n9.y"), [], [], 0.0)
