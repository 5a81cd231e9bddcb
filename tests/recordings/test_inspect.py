"""Inspection: what was put into a file is found in it, and the block it prints is a problem
file's."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.recordings.lines import decaying_sines, dominant_lines, frf_peaks, sine_fit
from cvxupdate.recordings.load import load_recordings
from cvxupdate.spec import load_problem

UNSTATED = "# rate ="
MODEL = """
[model]
dofs = ["z"]
nodes = [{ id = 1, x = 0.0 }]
[[model.elements]]
type = "spring"
dof = "z"
rows = [{ id = 1, nodes = [1], k = 1000.0 }]
[[model.elements]]
type = "mass"
rows = [{ id = 2, nodes = [1], m = 1.0 }]
"""


def record(rng: np.random.Generator) -> np.ndarray:
    t = np.arange(8192) / 1000.0
    force = rng.normal(size=t.size)
    tone = (
        3.0 * np.sin(2 * np.pi * 61.3 * t)
        + np.sin(2 * np.pi * 220.0 * t)
        + 0.1 * rng.normal(size=t.size)
    )
    return np.column_stack([t, force, tone])


def test_a_csv_is_seen_as_it_is_and_its_block_loads(tmp_path: Path) -> None:
    data = record(np.random.default_rng(1))
    data[:, 1] = np.clip(data[:, 1], -2.0, 2.0)
    data[500:560, 2] = data[500, 2]
    np.savetxt(
        tmp_path / "a.csv", data, delimiter=",", header="Time (s),Force (N),Acc (g)", comments=""
    )
    seen = inspect_file(tmp_path / "a.csv")
    force, tone = seen.channels
    assert seen.kind == "time" and seen.rate == pytest.approx(1000.0) and seen.length == 8192
    assert (force.quantity, tone.quantity, tone.unit) == ("force", "acceleration", "g")
    assert force.clipped == np.count_nonzero(np.abs(data[:, 1]) == 2.0) and force.dropped == 0
    assert tone.dropped == 60 and tone.clipped == 0
    assert tone.lines[0].frequency == pytest.approx(61.3, abs=0.02) and tone.lines[
        1
    ].frequency == pytest.approx(220.0, abs=0.02)
    assert tone.lines[0].amplitude == pytest.approx(3.0, rel=0.03)
    (tmp_path / "problem.toml").write_text(MODEL + seen.block)
    (history,) = load_recordings(load_problem(tmp_path / "problem.toml"))
    np.testing.assert_allclose(history.data[:, 1], data[:, 2] * 9.80665)  # type: ignore[union-attr]
    assert "in drop-outs" in seen.text() and "clipped" in seen.text()


@pytest.mark.parametrize("name", ["a.npz", "a.mat", "a.json", "frf.npz", "frf.csv"])
def test_blocks_of_other_forms_are_valid(tmp_path: Path, name: str) -> None:
    data = record(np.random.default_rng(2))[:600, 1:]
    f = np.arange(1.0, 201.0)
    H = 1.0 / (50.0**2 - f**2 + 2j * f)
    path = tmp_path / name
    if name == "a.npz":
        np.savez(path, data=data)
    elif name == "a.mat":
        from scipy.io import savemat

        savemat(path, {"V1": data[:, 0], "V2": data[:, 1]})
    elif name == "a.json":
        import json

        path.write_text(json.dumps({"data": data.tolist(), "dt": 0.001}))
    elif name == "frf.npz":
        np.savez(
            path,
            frequency=f,
            H=H[:, None, None],
            response_node=[1],
            response_dof=[3],
            reference_node=[1],
            reference_dof=[3],
        )
    else:
        path.write_text(
            "".join(
                f"{a!r};{b.real!r}{b.imag:+}j\n"
                for a, b in zip(f.tolist(), H.tolist(), strict=True)
            )
        )
    seen = inspect_file(path)
    block = seen.block
    if UNSTATED in block:  # the file does not say it, and any number would run
        (tmp_path / "problem.toml").write_text(MODEL + block)
        with pytest.raises(RecordingError, match="does not state its sampling rate"):
            load_recordings(load_problem(tmp_path / "problem.toml"))
        block = block.replace(UNSTATED, "rate = 1e3 #")
    assert (block != seen.block) == (name in ("a.npz", "a.mat"))
    (tmp_path / "problem.toml").write_text(MODEL + block)
    (recording,) = load_recordings(load_problem(tmp_path / "problem.toml"))
    if name.startswith("frf"):
        assert seen.kind == "frf" and recording.H.shape == (200, 1, 1)  # type: ignore[union-attr]
    else:
        assert seen.kind == "time" and recording.data.shape == data.shape  # type: ignore[union-attr]


def test_noise_has_no_dominant_lines_but_one_in_a_thousand() -> None:
    rng = np.random.default_rng(5)
    for samples in (1000, 40_000):
        alarms = sum(
            bool(dominant_lines(rng.normal(size=samples), 1.0, false_alarm=0.02))
            for _ in range(100)
        )
        assert alarms <= 9  # 2 expected, 1e-4 beyond


def test_sine_fit_recovers_frequency_amplitude_and_phase() -> None:
    t = np.arange(700) / 500.0
    x = np.column_stack(
        [2.0 * np.cos(2 * np.pi * 1.3 * t + 0.4) + 5.0, 0.5 * np.cos(2 * np.pi * 1.3 * t - 1.0)]
    )
    frequency, amplitude, left = sine_fit(x, 500.0, 1.1)
    assert frequency == pytest.approx(1.3, rel=1e-9)
    np.testing.assert_allclose(amplitude, [2.0 * np.exp(0.4j), 0.5 * np.exp(-1j)], rtol=1e-7)
    assert np.all(left < 1e-8)


def test_matrix_pencil_recovers_close_decays() -> None:
    t = np.arange(500) / 200.0
    x = sum(
        a * np.exp(-z * 2 * np.pi * f * t) * np.cos(2 * np.pi * f * np.sqrt(1 - z**2) * t + p)
        for a, f, z, p in ((1, 22.0, 0.02, 0), (0.5, 26.0, 0.03, 1))
    )
    np.testing.assert_allclose(decaying_sines(x, 200.0, 2), [(22.0, 0.02), (26.0, 0.03)], rtol=1e-6)


def test_peaks_of_an_frf_lie_within_a_fraction_of_a_line() -> None:
    f = np.arange(1.0, 400.0) * 0.5
    H = sum(1.0 / (a**2 - f**2 + 0.02j * a * f) for a in (33.3, 101.7))
    assert [p.frequency for p in frf_peaks(f, H[:, None], 5)] == pytest.approx(
        [33.3, 101.7], abs=0.15
    )


def test_peaks_of_huge_responses_are_those_of_small_ones() -> None:
    """A damaged file may hold 1e300, whose square is beyond what a number holds."""
    f = np.arange(1.0, 400.0) * 0.5
    H = sum(1.0 / (a**2 - f**2 + 0.02j * a * f) for a in (33.3, 101.7))[:, None]
    small, huge = (frf_peaks(f, k * H, 5) for k in (1.0, 1e300))
    assert [p.frequency for p in huge] == pytest.approx([p.frequency for p in small])
    assert [p.amplitude for p in huge] == pytest.approx([1e300 * p.amplitude for p in small])
    assert [p.ratio for p in huge] == pytest.approx([p.ratio for p in small])
    assert frf_peaks(f, 0.0 * H, 5) == ()
