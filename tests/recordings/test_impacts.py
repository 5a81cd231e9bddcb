"""Records of a hammer: told by their force, cut into blows; poles known in closed form."""

import numpy as np
import pytest
from scipy.signal import StateSpace, dlsim

from cvxupdate.commands.identify import identify
from cvxupdate.commands.identify_frf import of_frf
from cvxupdate.commands.identify_options import Options
from cvxupdate.errors import RecordingError
from cvxupdate.recordings.impacts import frf_from_blows, struck
from cvxupdate.recordings.types import Channel, Origin, TimeHistory

RATE = 1024.0
K = np.array([[9.0, -4.0, 0.0], [-4.0, 7.0, -3.0], [0.0, -3.0, 5.0]]) * 1e4
M = np.diag([1.0, 1.4, 0.7])
C = np.diag([3.0, 0.5, 1.0]) + 6e-5 * K

CHANNELS = [
    (0, "force", 1),
    (1, "displacement", 1),
    (2, "displacement", 2),
    (3, "displacement", 3),
]


def system():
    inverse = np.linalg.inv(M)
    A = np.block([[np.zeros((3, 3)), np.eye(3)], [-inverse @ K, -inverse @ C]])
    B = np.vstack([np.zeros((3, 1)), inverse[:, :1]])
    return A, B, np.hstack([np.eye(3), np.zeros((3, 3))])


def truth():
    values = np.linalg.eigvals(system()[0])
    values = values[values.imag > 0]
    values = values[np.argsort(np.abs(values))]
    return np.abs(values) / (2 * np.pi), -values.real / np.abs(values)


def record(times, seconds, noise=0.0, offset=0.0):
    """Force and displacements of a chain struck at ``times`` (s) by pulses of 4 ms, integrated
    ten times as finely as it is sampled."""
    fine = 10
    t = np.arange(int(seconds * RATE) * fine) / (RATE * fine)
    force = np.zeros(len(t))
    for size, begin in zip([60.0, 45.0, 70.0, 20.0], times, strict=False):
        inside = (t > begin) & (t < begin + 4e-3)
        force[inside] += size * np.sin(np.pi * (t[inside] - begin) / 4e-3)
    A, B, out = system()
    discrete = StateSpace(A, B, out, np.zeros((3, 1))).to_discrete(t[1], method="foh")
    y = dlsim(discrete, force)[1]
    data = np.column_stack([force, y])[::fine]
    rng = np.random.default_rng(8)
    size = np.max(np.abs(data), axis=0)
    data += noise * size * rng.standard_normal(data.shape) + offset * size
    channels = (
        Channel(1, "x", "force"),
        *(Channel(n, "x", "displacement") for n in (1, 2, 3)),
    )
    return TimeHistory(Origin("hammer", "x"), RATE, channels, data)


@pytest.mark.parametrize(
    ("times", "seconds", "blocks"),
    [
        pytest.param([0.02], 2.0, 1, id="one blow"),
        pytest.param([0.3, 2.4, 4.7], 7.2, 3, id="three"),
        pytest.param([0.3, 2.4, 4.7, 6.9], 7.2, 3, id="three and one cut short"),
    ],
)
def test_modes_of_a_struck_chain(times, seconds, blocks):
    history = record(times, seconds, noise=1e-4, offset=0.003)
    assert struck(history)
    frf, blows, top = frf_from_blows(history)
    assert len(blows.starts) == blocks and (frf.variance is None) == (blocks == 1)
    assert 60.0 < top <= 0.45 * RATE
    found = of_frf(frf, "time", Options(order=30, band=(3.0, 100.0), decay=blows.decay), ())
    f, zeta = truth()
    assert np.allclose(found.frequency, f, rtol=2e-3)
    assert np.allclose([m.damping for m in found.modes], zeta, rtol=0.05)


def test_a_rebound_is_within_the_blow():
    """The true modes are found; so may others be, where the two pulses cancel."""
    history = record([0.02, 0.055], 2.0, noise=1e-4, offset=0.003)
    frf, blows, _ = frf_from_blows(history)
    assert len(blows.starts) == 1 and blows.rebounds == 1
    found = of_frf(frf, "time", Options(order=30, band=(3.0, 100.0), decay=blows.decay), ())
    nearest = [found.frequency[np.argmin(np.abs(found.frequency - f))] for f in truth()[0]]
    assert np.allclose(nearest, truth()[0], rtol=1e-3)


def test_the_command_says_how_the_record_was_read(tmp_path):
    history = record([0.02, 0.055], 2.0, noise=1e-4)
    np.savetxt(tmp_path / "hit.csv", history.data, delimiter=",")
    rows = [f"{{ column = {c}, quantity = '{q}', node = {n}, dof = 'x' }}" for c, q, n in CHANNELS]
    (tmp_path / "hit.toml").write_text(
        "[[recordings]]\nkind = 'time'\nfile = 'hit.csv'\n"
        f"rate = {RATE}\nchannels = [{', '.join(rows)}]\n"
    )
    (found,) = identify(tmp_path / "hit.toml", Options(order=20, band=(3.0, 50.0))).sets
    said = " ".join(found.notes)
    assert "a record of 1 blow" in said and "hit again" in said and "reaches" in said


def test_the_window_is_what_a_short_block_needs():
    """A block at whose end the structure still moves: without the window the poles are biased."""
    history = record([0.01], 0.4, noise=1e-4)
    frf, blows, _ = frf_from_blows(history)
    assert blows.decay > 1.0
    taken_out = of_frf(frf, "time", Options(order=20, band=(3.0, 90.0), decay=blows.decay), ())
    f, zeta = truth()
    assert np.allclose(taken_out.frequency, f, rtol=5e-3)
    assert np.allclose([m.damping for m in taken_out.modes], zeta, rtol=0.1)


@pytest.mark.parametrize("kind", ["random", "sine", "none"])
def test_other_forces_are_no_blows(kind):
    history = record([0.02], 2.0)
    n = len(history.data)
    force = {
        "random": np.random.default_rng(0).standard_normal(n),
        "sine": np.sin(0.1 * np.arange(n)),
        "none": np.zeros(n),
    }[kind]
    data = np.column_stack([force, history.data[:, 1:]])
    assert not struck(TimeHistory(history.origin, RATE, history.channels, data))


def test_damaged_samples_are_refused():
    history = record([0.02], 1.0)
    history.data[40, 2] = np.nan
    with pytest.raises(RecordingError, match="repair them or cut the record"):
        frf_from_blows(history)
