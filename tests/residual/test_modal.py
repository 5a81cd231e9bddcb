"""The modal comparison: rows, weights and derivatives, along the iteration and at repeated
eigenvalues."""

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.errors import InputError, ModelError
from cvxupdate.fe.modes import model_modes
from cvxupdate.residual.modal import ModalResidual, modal_residual
from cvxupdate.residual.repeated import aligned, clusters, turned
from cvxupdate.residual.shape_rows import channel_rows, visible
from tests.cases.structures import (
    PORTAL,
    TRUTH,
    crossing,
    free_chain,
    measured,
    portal,
    square,
    structure,
)

CHANNELS = ("n2.x", "n3.x", "n4.y", "n5.y", "n6.x", "n6.y")


def residual(shapes: bool = True) -> ModalResidual:
    model = structure(portal(), PORTAL)[1]
    table = measured(model, TRUTH, [1, 2, 3, 4, 5], channels=CHANNELS, noise=2, shape_std=0.03)
    holes = table.shapes.copy()
    holes[1, 2] = np.nan  # an entry that was not measured
    return modal_residual(model, [replace(table, shapes=holes)], [], shapes)


def test_rows_are_differences_in_deviations() -> None:
    """Eigenvalue rows: (λ − λₓ)/(2 λₓ σ_f/f) ≈ (f − fₓ)/σ_f for a small difference; a shape equal
    to the measured one up to scale has zero rows."""
    r = residual()
    point = r.evaluate(TRUTH)
    values, weights, labels = point.differences
    table = r.fit[0]
    expected = (point.frequencies(0) - table.frequency) / table.frequency_std
    assert np.allclose((weights * values)[:5], expected, rtol=5e-3)
    assert labels[0].endswith("Hz") and "shape of" in labels[5] and len(labels) == 5 + 5 * 6 - 1
    assert np.all(np.abs((weights * values)[5:]) < 5.0)
    exact = measured(r.model, TRUTH, [1, 2, 3], channels=CHANNELS)
    same = modal_residual(r.model, [replace(exact, shapes=-3.0 * exact.shapes)], [], True).evaluate(
        TRUTH
    )
    assert np.abs(same.differences[0][3:]).max() < 1e-9


@pytest.mark.parametrize("shapes", [False, True])
def test_the_system_is_the_derivative_of_the_differences(shapes: bool) -> None:
    r = residual(shapes)
    p = np.array([0.05, -0.03, 0.02, 0.04, 0.1, -0.05, 0.0])
    point = r.evaluate(p)
    system = point.system()
    assert np.allclose(system.residual(p), point.differences[0] * point.differences[1], atol=1e-9)
    h = 1e-4
    for j in range(len(p)):
        d = np.zeros(len(p))
        d[j] = h
        ends = [r.evaluate(p + s * d, point).differences for s in (1, -1, 2, -2)]
        v = [e[0] for e in ends]
        central = (8 * (v[0] - v[1]) - (v[2] - v[3])) / (12 * h)
        error = system.weights * (system.A[:, j] - central)
        assert np.abs(error).max() <= 1e-5 * np.abs(system.weights[:, None] * system.A).max()
    assert not np.any(system.A[:, 6])  # a dashpot moves no undamped mode


def test_crossing_modes_keep_their_measured_partner() -> None:
    model = structure(crossing(), [{"group": "bar", "of": "Iy"}])[1]
    r = modal_residual(model, [measured(model, [0.4], [1, 2], pairs=[2, 1])], [], False)
    point = r.evaluate(model.zero())
    for value in (0.1, 0.25, 0.4):
        point = r.evaluate(np.array([value]), point)
    assert point.places[0].tolist() == [0, 1]
    assert np.allclose(point.frequencies(0), r.fit[0].frequency, rtol=1e-12)
    assert r.evaluate(np.array([0.4])).places[0].tolist() == [0, 1]  # in one step too


def test_support_spring_from_zero_keeps_the_flexible_partners() -> None:
    model = structure(
        free_chain(), [{"group": "support", "of": "k", "scale": 1e5}, {"group": "k2", "of": "k"}]
    )[1]
    truth = np.array([0.3, 0.1])
    table = measured(
        model, truth, [2, 3, 4, 5], pairs=[1, 2, 3, 4]
    )  # the suspended chain's mode 1 was rigid
    r = modal_residual(model, [table], [], False)
    point = r.evaluate(truth, r.evaluate(np.array([0.1, 0.0]), r.evaluate(model.zero())))
    assert np.allclose(point.frequencies(0), table.frequency, rtol=1e-12)


def test_scored_tables_are_followed_and_change_no_row() -> None:
    model = structure(portal(), PORTAL)[1]
    fit, other = measured(model, TRUTH, [1, 2, 3]), measured(model, TRUTH, [4, 5], use="hold-out")
    alone, both = (
        modal_residual(model, [fit], [], False),
        modal_residual(model, [fit], [other], False),
    )
    p = 0.5 * TRUTH
    a, b = alone.evaluate(p), both.evaluate(p)
    assert (
        np.allclose(a.differences[0], b.differences[0], rtol=1e-9)
        and a.differences[2] == b.differences[2]
    )
    assert b.places[1].tolist() == [3, 4]


def test_repeated_shapes_are_turned_to_the_measured_ones() -> None:
    """Any turn of the pair's shapes is the model's: the measured ones, a little off the square's,
    choose it, and pairing by MAC finds them."""
    model = structure(square(), [{"elements": "all", "of": "Dx"}, {"elements": "all", "of": "Dy"}])[
        1
    ]
    channels = ("n1.z", "n3.z", "n8.z", "n25.z", "n12.z", "n17.z")
    table = measured(model, [0.02, -0.01], [4, 5, 6, 7], channels=channels)
    r = modal_residual(model, [table], [], True, "mac")
    assert sorted(r.start.places[0].tolist()) == [6, 7, 8, 9]
    point = r.evaluate(model.zero())
    at = [model.place[c] for c in channels]
    for i, place in enumerate(point.places[0].tolist()):
        a, b = point.modes.shapes[at, place], table.shapes[i]
        assert (a @ b) ** 2 / (a @ a) / (b @ b) > 0.999


def test_repeated_eigenvalues_leave_shapes_out_and_keep_frequencies() -> None:
    """A square plate: rows of the pair's frequencies stay, with a derivative that is right along
    the split; its shapes are muted."""
    model = structure(square(), [{"elements": "all", "of": "Dx"}, {"elements": "all", "of": "Dy"}])[
        1
    ]
    truth = np.array([0.1, -0.04])
    table = measured(model, truth, [1, 2, 3, 4, 5], channels=("n1.z", "n3.z", "n8.z", "n25.z"))
    r = modal_residual(model, [table], [], True, "frequency")
    point = r.evaluate(model.zero())
    assert len(point.differences[2]) == 5 + 3 * 4 and {i for _, i in r.muted} == {3, 4}
    A = point.system().A
    h = 1e-5
    for j in range(2):
        d = np.zeros(2)
        d[j] = h
        moved = r.evaluate(d, point).differences[0][3:5] - point.differences[0][3:5]
        assert np.allclose(moved / h, A[3:5, j], rtol=1e-3, atol=1e-3 * np.abs(A[3:5]).max())


def test_pair_met_on_the_way_keeps_its_rows() -> None:
    """From an oblong-stiff plate through the square one: shapes at the repeated eigenvalue continue
    those before, so rows stay comparable."""
    model = structure(square(), [{"elements": "all", "of": "Dx"}, {"elements": "all", "of": "Dy"}])[
        1
    ]
    start = np.array([0.05, 0.0])
    table = measured(model, start, [4, 5], channels=("n1.z", "n3.z", "n8.z", "n25.z"), pairs=[4, 5])
    r = modal_residual(model, [table], [], True)
    loud = replace(r, muted=frozenset())
    before = loud.evaluate(np.array([1e-3, 0.0]), loud.evaluate(start))
    there = loud.evaluate(model.zero(), before)
    assert clusters(there.modes)
    assert len(there.differences[2]) == len(before.differences[2])
    assert np.allclose(there.differences[0][2:], before.differences[0][2:], atol=0.02)
    assert np.all(np.isfinite(there.system().A))


def test_alignment_undoes_any_turn_of_a_pair() -> None:
    model = structure(square(), [{"elements": "all", "of": "Dx"}])[1]
    m, modes = model.matrices(), model_modes(model, 8, model.zero())
    (first, *_rest) = clusters(modes)
    c, s = np.cos(0.7), np.sin(0.7)
    back = aligned(turned(modes, first, np.array([[c, -s], [s, c]])), m, modes.shapes[:, first])
    assert np.allclose(back.shapes, modes.shapes, atol=1e-10)


def test_no_structure_is_a_model_error_and_no_flexible_mode_an_input_error() -> None:
    model = structure(portal(), [{"group": "column", "of": "mass"}, {"group": "lump", "of": "m"}])[
        1
    ]
    r = modal_residual(model, [measured(model, model.zero(), [1, 2])], [], False)
    with pytest.raises(ModelError):
        r.evaluate(np.array([-3.0, -30.0]))
    lump = {
        "dofs": ["x"],
        "nodes": [{"id": i, "x": float(i), "y": 0.0, "z": 0.0} for i in (1, 2)],
        "elements": [
            {"type": "mass", "rows": [{"id": 1, "nodes": [1], "m": 1.0}]},
            {"type": "spring", "dof": "x", "rows": [{"id": 2, "nodes": [1, 2], "k": 1e5}]},
        ],
    }
    free = structure(lump, [{"elements": [1], "of": "m"}])[1]
    with pytest.raises(InputError, match="rigid-body modes only"):
        modal_residual(free, [measured(model, model.zero(), [1])], [], False)


def test_a_shape_that_the_sensors_cannot_see_is_no_shape() -> None:
    """A mode in y beside sensors in z: only its frequency is compared, whatever noise was written
    down as its shape."""
    model = structure(crossing(), [{"group": "bar", "of": "Iy"}])[1]
    sensors = ("n3.z", "n4.z")
    table = measured(model, model.zero(), [1, 2, 3], channels=sensors, pairs=[1, 2, 3])
    blind = int(
        np.argmin(
            [
                np.abs(
                    model_modes(model, 3, model.zero()).shapes[[model.place[c] for c in sensors], i]
                ).max()
                for i in range(3)
            ]
        )
    )
    shapes = table.shapes.copy()
    shapes[blind] = [1.0, -0.6]
    r = modal_residual(model, [replace(table, shapes=shapes)], [], True)
    assert r.unseen == {(0, blind)}
    assert not visible(r.start.modes.shapes[:, [blind]], channel_rows(table, model))[0]
    values, _, labels = r.evaluate(model.zero()).differences
    assert len(values) == 3 + 2 * 2 and not any(
        "shape of" in label and f"{table.frequency[blind]:.5g}" in label for label in labels
    )
    assert np.abs(values[3:]).max() < 1e-9
