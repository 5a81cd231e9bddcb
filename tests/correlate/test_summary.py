"""The whole comparison in one object."""

import json

import numpy as np
import pytest

from cvxupdate.correlate import correlation
from cvxupdate.errors import InputError
from cvxupdate.reduction import dynamic, partition, serep

SENSORS = np.array([7, 19, 22, 28, 37, 40, 43, 46, 48, 51])


def test_a_model_against_itself_is_perfect_by_every_measure(frame):
    order = np.array([2, 0, 1, 4])
    factor = np.array([2.0, -1j, 0.3, -4.0])
    a = frame.phi[SENSORS][:, :8]
    x = frame.phi[SENSORS][:, order] * factor
    out = correlation(
        frame.frequency[:8],
        a,
        frame.frequency[order],
        x,
        K=frame.K,
        M=frame.M,
        transformation=serep(frame.phi[:, :8], SENSORS),
        elements=frame.batches,
    )
    assert out.pairing.model.tolist() == order.tolist()
    assert out.frequency_error_percent_max == 0.0 and out.frequency_scatter == 0.0
    assert out.mac_min == pytest.approx(1.0) and out.mac_error == pytest.approx(0.0, abs=1e-9)
    assert np.allclose(out.scale_factor, factor) and np.allclose(out.comac, 1.0)
    assert np.allclose(out.shapes_measured, out.shapes_model) and np.allclose(
        np.abs(out.shapes_model).max(axis=0), 1.0
    )
    assert np.allclose(out.mass_orthogonality, np.eye(4), atol=1e-8)
    assert np.allclose(out.cross_orthogonality, np.eye(4), atol=1e-8)
    assert np.allclose(out.pseudo_orthogonality, np.eye(8)[:, order], atol=1e-8)
    assert np.allclose(out.energy.kinetic_difference, 0.0, atol=1e-9)
    assert (
        out.balance.max() < 1e-5
        and out.element_balance.imbalance < 1e-5
        and out.element_energy.max() < 1e-6
    )
    assert out.notes == () and out.complete == (0, 1, 2, 3)


def test_a_changed_element_gaps_and_a_foreign_mode(frame, frame_maker):
    truth = frame_maker(stiffness={9: -0.4})
    x = truth.phi[SENSORS][:, :5].astype(complex)
    x[4, 2] = np.nan
    foreign = np.linalg.svd(frame.phi[SENSORS][:, :9])[0][
        :, 9:
    ]  # a motion that none of nine model modes has
    x = np.column_stack([x, foreign])
    fx = np.append(truth.frequency[:5], 300.0)
    split = partition(frame.K, frame.M, SENSORS)
    each = [dynamic(split, f) for f in fx]
    labels = [f"s{i}" for i in range(10)]
    out = correlation(
        frame.frequency[:9],
        frame.phi[SENSORS][:, :9],
        fx,
        x,
        std=0.01 * fx,
        labels=labels,
        K=frame.K,
        M=frame.M,
        transformation=serep(frame.phi[:, :9], SENSORS),
        expansions=each,
        elements=frame.batches,
    )
    assert out.pairing.unpaired.tolist() == [5] and any("300 Hz" in n for n in out.notes)
    assert any("[3]" in n and "without a value" in n for n in out.notes) and out.complete == (
        0,
        1,
        3,
        4,
    )
    assert np.argmax(out.element_balance.stiffness) == 9
    assert out.mass_orthogonality.shape == (4, 4) and out.frequency_std.shape == (5,)
    assert 0 < out.frequency_error_percent_mean < 10 and 0.9 < out.mac_min < 1
    data = json.loads(json.dumps(out.to_json(), allow_nan=False))
    assert data["pairing"]["unpaired"] == [5] and data["labels"] == labels
    assert data["shapes_measured"][4][2] == [None, None]
    assert set(data) >= {
        "frequency_error_percent_mean",
        "frequency_error_percent_max",
        "mac_mean",
        "mac_min",
        "comac",
        "element_balance",
        "balance",
        "energy",
    }


def test_nothing_paired_is_said_and_not_raised(frame):
    foreign = np.linalg.svd(frame.phi[SENSORS][:, :4])[0][:, 8:]
    out = correlation(
        frame.frequency[:4],
        frame.phi[SENSORS][:, :4],
        np.array([10.0, 20.0]),
        foreign,
        K=frame.K,
        M=frame.M,
        transformation=serep(frame.phi[:, :4], SENSORS),
    )
    assert (
        len(out.pairing) == 0
        and out.mac_min is None
        and any("No mode could be paired" in n for n in out.notes)
    )
    json.dumps(out.to_json(), allow_nan=False)


def test_bad_input_is_named(frame):
    a = frame.phi[SENSORS][:, :4]
    with pytest.raises(InputError, match="labels"):
        correlation(frame.frequency[:4], a, frame.frequency[:4], a, labels=["one"])
    with pytest.raises(InputError, match="masters must be the sensors"):
        correlation(
            frame.frequency[:4],
            a,
            frame.frequency[:4],
            a,
            K=frame.K,
            M=frame.M,
            transformation=serep(frame.phi[:, :4], SENSORS[:8]),
        )
