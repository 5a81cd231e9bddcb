"""Quality checks: silent on clean recordings (but for the stated rate), and right about spoilt
ones."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from scipy import linalg, signal, stats

from cvxupdate.recordings.quality import ALPHA, check, compare, compare_series, samples
from cvxupdate.recordings.read.variance import variance_of_frf
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, Real, TimeHistory

HAVE = bool(os.environ.get("CVXUPDATE_DATA")) and Path(os.environ["CVXUPDATE_DATA"]).is_dir()
RATE = 200.0
K = (
    np.array([[3.0, -1.4, 0, 0], [-1.4, 2.6, -1.2, 0], [0, -1.2, 2.9, -1.7], [0, 0, -1.7, 1.7]])
    * 2e4
)
M = np.diag([1.0, 2.0, 1.5, 0.8])
C = 2e-4 * K + 0.8 * M
CUBIC = 1e5  # N/m³: changes the FRF by about a fifth at level 64, and nothing at level 1


def chain(
    seed: int,
    force: int = 0,
    samples_: int = 8192,
    level: float = 1.0,
    cubic: float = 0.0,
    bits: int = 0,
    push: Real | None = None,
) -> TimeHistory:
    """Four masses under white force, or ``push``, on one of them: accelerations with 1 % noise,
    optionally a hardening spring and a converter."""
    rng = np.random.default_rng(seed)
    u = level * (rng.normal(size=samples_) if push is None else push)
    B = np.zeros(4)
    B[force] = 1.0
    dt, inv = 1.0 / RATE, np.linalg.inv(M)
    A = np.block([[np.zeros((4, 4)), np.eye(4)], [-inv @ K, -inv @ C]])
    Ad = linalg.expm(A * dt)
    Bd = np.linalg.solve(A, (Ad - np.eye(8)) @ np.concatenate([np.zeros(4), inv @ B]))
    Nd = np.linalg.solve(
        A, (Ad - np.eye(8)) @ np.concatenate([np.zeros(4), inv @ np.array([0, 0, 0, 1.0])])
    )
    x, inner, driven = np.zeros((samples_ + 1, 8)), np.zeros(samples_), np.outer(u, Bd)
    for k in range(samples_):
        x[k + 1] = Ad @ x[k] + driven[k]
        if cubic:
            inner[k] = -cubic * min(max(float(x[k, 3]), -1.0), 1.0) ** 3
            x[k + 1] += Nd * inner[k]
    x, last = x[:-1], np.array([0.0, 0.0, 0.0, 1.0])
    out = (np.outer(u, B) + np.outer(inner, last) - x[:, :4] @ K.T - x[:, 4:] @ C.T) @ inv.T
    data = np.column_stack([u, out])
    data += 0.01 * data.std(axis=0) * rng.normal(size=data.shape)
    if bits:
        step = 4.0 * data.std(axis=0) / 2 ** (bits - 1)
        data = np.round(data / step) * step
    channels = (
        Channel(force + 1, "x", "force"),
        *(Channel(n, "x", "acceleration") for n in (1, 2, 3, 4)),
    )
    return TimeHistory(Origin(f"run {seed}", "test", level=level), RATE, channels, data)


def frf(
    seed: int, noise: float = 0.01, averages: int = 40, references: tuple[int, ...] = (0, 2)
) -> FrequencyResponse:
    """Accelerance of the chain by H1 over independent lines, with coherence."""
    rng = np.random.default_rng(seed)
    f = np.linspace(1.0, 60.0, 1200)
    w = 2 * np.pi * f
    H = (
        -(w**2)[:, None, None]
        * np.linalg.inv(K + 1j * w[:, None, None] * C - (w**2)[:, None, None] * M)[
            :, :, list(references)
        ]
    )
    x = rng.normal(size=(averages, 1200)) + 1j * rng.normal(size=(averages, 1200))
    floor = noise * np.sqrt(np.mean(np.abs(H) ** 2, axis=0))
    Sxx = np.sum(np.abs(x) ** 2, axis=0)
    n = rng.normal(size=(averages, *H.shape)) + 1j * rng.normal(size=(averages, *H.shape))
    y = H[None] * x[:, :, None, None] + floor * n
    estimate = np.sum(y * np.conj(x)[:, :, None, None], axis=0) / Sxx[:, None, None]
    coherence = np.abs(estimate) ** 2 * Sxx[:, None, None] / np.sum(np.abs(y) ** 2, axis=0)
    variance, _ = variance_of_frf(estimate, coherence)
    return FrequencyResponse(
        Origin(f"frf {seed}", "test"),
        f,
        estimate,
        "acceleration",
        tuple(Channel(k, "x", "acceleration") for k in (1, 2, 3, 4)),
        tuple(Channel(r + 1, "x", "force") for r in references),
        variance,
        coherence.min(axis=2),
    )


def most(trials: int, rate: float) -> int:
    """Alarms that a rate would exceed once in 10⁴ series."""
    return int(stats.binom.isf(1e-4, trials, rate))


def changed(
    history: TimeHistory, column: int, change: Callable[[np.ndarray], np.ndarray]
) -> TimeHistory:
    data = history.data.copy()
    data[:, column] = change(data[:, column])
    return replace(history, data=data)


@pytest.mark.parametrize("test", [samples.clipping, samples.dropouts, samples.drift])
@pytest.mark.parametrize(
    "kind", ["white", "12 bit", "vibration", "sine", "hammer", "blows", "repeated"]
)
def test_clean_channels_raise_no_more_alarms_than_stated(
    test: Callable[..., samples.Test], kind: str
) -> None:
    rng = np.random.default_rng(7)
    alarms, trials = 0, 400
    for _ in range(trials):
        x = rng.normal(size=4096)
        t = np.arange(4096) / 1000.0
        if kind == "12 bit":
            x = np.round(x / 0.004) * 0.004
        elif kind == "vibration":
            x = (
                np.round(
                    signal.lfilter([1.0], [1.0, -1.9 * np.cos(rng.uniform(0.1, 2.5)), 0.9], x)
                    / 0.01
                )
                * 0.01
            )
        elif kind == "sine":
            x = (
                np.round(
                    (np.sin(2 * np.pi * rng.uniform(2.0, 80.0) * t + rng.uniform(0, 6)) + 1e-3 * x)
                    / 5e-4
                )
                * 5e-4
            )
        elif kind == "hammer":
            x = np.round((50.0 * np.exp(-(((t - 0.1) / 0.002) ** 2)) + 0.01 * x) / 0.01) * 0.01
        elif kind == "blows":  # of a coarse converter: nought between them
            blows = np.sort(rng.uniform(0.2, 3.9, 12))
            force = sum(50.0 * np.exp(-(((t - at) / 0.003) ** 2)) for at in blows)
            x = np.round((force + 0.002 * x) / 0.05) * 0.05
        elif kind == "repeated":
            x = np.tile(x[:1024], 4)
        alarms += test(x).fault
    assert alarms <= most(trials, ALPHA)


def test_clean_recordings_pass_every_check() -> None:
    alarms = [
        finding
        for seed in range(12)
        for finding in check(chain(seed, seed % 4, 4096, bits=12 if seed % 2 else 0))
    ]
    assert [a.says for a in alarms] == [] or len(alarms) <= most(12 * 5 * 7, ALPHA)


def test_clean_frfs_pass_every_check() -> None:
    alarms = [finding for seed in range(40) for finding in check(frf(seed))]
    # reciprocity and delay on 1 pair, drive points and passivity 2, coherence 4, causality 2
    assert len(alarms) <= most(40 * 12, ALPHA), [a.says for a in alarms]


@pytest.mark.parametrize(
    ("name", "spoil"),
    [
        ("clipping", lambda x: np.clip(x, -2.2 * x.std(), 2.2 * x.std())),
        (
            "clipping",
            lambda x: np.minimum(np.round(x / (x.std() / 200)) * (x.std() / 200), 2.2 * x.std()),
        ),
        (
            "drop-out",
            lambda x: np.where((np.arange(x.size) > 3000) & (np.arange(x.size) < 3060), 0.0, x),
        ),
        (
            "drop-out",
            lambda x: np.where((np.arange(x.size) > 3000) & (np.arange(x.size) < 3030), x[3000], x),
        ),
        ("drift", lambda x: x + np.linspace(0.0, 0.5 * x.std(), x.size)),
        ("drift", lambda x: x + 0.5 * x.std() * np.exp(-np.arange(x.size) / (0.4 * x.size))),
        ("missing values", lambda x: np.where(np.arange(x.size) == 77, np.nan, x)),
        ("dead channel", lambda x: np.full_like(x, 0.3)),
        ("dead channel", lambda x: np.round(1e-3 * np.sign(x), 3)),
        ("unrelated channel", lambda x: np.random.default_rng(99).normal(size=x.size)),
    ],
)
def test_a_spoilt_channel_is_named(name: str, spoil: Callable[[np.ndarray], np.ndarray]) -> None:
    findings = check(changed(chain(3), 2, spoil))
    assert {f.check for f in findings} == {name}
    assert all(
        "channel 2 (acceleration at n2.x)" in f.says and f.says.endswith(".") for f in findings
    )


def test_a_duplicated_channel_is_named() -> None:
    history = chain(4)
    data = history.data.copy()
    data[:, 3] = -2.0 * data[:, 1]
    (finding,) = check(replace(history, data=data))
    assert (
        finding.check == "duplicated channel"
        and finding.value == pytest.approx(-2.0)
        and "channel 1" in finding.says
        and "channel 3" in finding.says
    )


def spoilt(which: str, seed: int = 1) -> FrequencyResponse:
    """An FRF with one fault."""
    clean = frf(seed)
    H, f = clean.H.copy(), clean.frequency
    coherence = clean.coherence
    if which == "gain":
        H[:, 2, 0] *= 1.3
    elif which == "sign":
        H[:, 0, :] *= -1.0
    elif which == "delay":
        H[:, 2, :] *= np.exp(-2j * np.pi * f * 1.5e-3)[:, None]
    elif which == "conjugate":
        H = np.conj(H)
    elif which == "coherence":
        coherence = coherence.copy()  # type: ignore[union-attr]
        peak = int(np.argmax(np.abs(H[:, 3, 0]) * np.abs(H[:, 3, 1])))
        coherence[peak - 4 : peak + 5, 3] = 0.5
    return replace(clean, H=H, coherence=coherence)


@pytest.mark.parametrize(
    ("which", "name", "words"),
    [
        ("gain", "reciprocity", "a gain is wrong"),
        ("sign", "polarity", "wrong sign"),
        ("sign", "reciprocity", "sign differs"),
        ("delay", "delay", "n3.x/n1.x lags"),
        ("delay", "passivity", "gives power back at"),
        ("conjugate", "causality", "opposite sign"),
        ("coherence", "low coherence", "n4.x"),
    ],
)
def test_a_spoilt_frf_is_named(which: str, name: str, words: str) -> None:
    for seed in range(5):
        found = [f for f in check(spoilt(which, seed)) if f.check == name]
        assert found and any(words in f.says for f in found), [
            f.says for f in check(spoilt(which, seed))
        ]
    if name == "delay":
        assert found[0].value == pytest.approx(1.5e-3, rel=0.15)
    if which == "gain":
        assert found[0].value in (pytest.approx(1.3, rel=0.02), pytest.approx(1 / 1.3, rel=0.02))


def test_low_coherence_at_an_antiresonance_is_no_fault() -> None:
    clean = frf(2, noise=0.05)
    assert clean.coherence is not None and clean.coherence.min() < 0.3
    assert [f for f in check(clean) if f.check == "low coherence"] == []


def test_a_level_that_changes_the_frf_is_reported_and_a_linear_one_is_not() -> None:
    quiet, loud = (
        chain(1, 3, 16384, level=1.0, cubic=CUBIC),
        chain(2, 3, 16384, level=64.0, cubic=CUBIC),
    )
    findings = compare([quiet, loud])
    assert findings and {f.check for f in findings} == {"level dependence"}
    assert all("level 64 to 1" in f.says or "level 1 to 64" in f.says for f in findings)
    for seed in range(10, 16):
        assert compare([chain(seed, 3, 16384), chain(seed + 100, 3, 16384, level=64.0)]) == ()


def test_a_fast_sweep_up_and_one_down_are_of_one_structure() -> None:
    """Each passes a peak within a block of averages, which took them for two structures; one
    spring that hardens is told from them."""
    t = np.arange(2048) / RATE
    push = np.where(t < 8.0, signal.chirp(np.minimum(t, 8.0), 1.0, 8.0, 60.0), 0.0)
    back = np.where(t < 8.0, signal.chirp(np.minimum(t, 8.0), 60.0, 8.0, 1.0), 0.0)
    for force in range(4):
        up, down = (chain(k, force, 2048, push=x) for k, x in ((1, push), (2, back)))
        assert compare([up, down]) == ()
    loud = chain(3, 3, 2048, level=64.0, cubic=CUBIC, push=push)
    assert {f.check for f in compare([up, loud])} == {"level dependence"}


@pytest.mark.parametrize("periods", [4, 8])
@pytest.mark.parametrize("noise", [0.0, 1e-3])
def test_forces_that_repeat_themselves_are_compared_at_their_lines(
    periods: int, noise: float
) -> None:
    """Eight periods have power on every eighth line, which tells no local model; nor do four where
    nothing at all lies between."""
    t, lines = np.arange(512) / RATE, np.arange(2, 150)
    runs = []
    for seed in (1, 2):
        rng = np.random.default_rng(seed)
        phase = 2 * np.pi * (lines[:, None] * t * RATE / 512 + rng.random((lines.size, 1)))
        push = np.tile(np.sum(np.cos(phase), axis=0), periods + 2)
        push = push + noise * push.std() * rng.normal(size=push.size)
        run = chain(seed, 3, push.size, push=push)
        runs.append(replace(run, data=run.data[1024:]))
    assert compare(runs) == ()
    doubled = compare([runs[0], changed(runs[1], 0, lambda x: 2.0 * x)])
    assert [f.check for f in doubled] == ["gain"] * 4


def test_a_force_channel_out_of_line_is_reported_with_its_factor() -> None:
    clean, other = chain(1, 1, 16384), chain(2, 1, 16384)
    wrong = changed(other, 0, lambda x: 3.3 * x)
    assert compare([clean, other]) == ()
    findings = [f for f in compare([clean, wrong, chain(3, 1, 16384)]) if f.check == "gain"]
    assert len(findings) == 4 and all(
        f.value == pytest.approx(3.3, rel=0.05) and "run 2" in f.says for f in findings
    )


def test_reciprocity_across_recordings_names_the_gain() -> None:
    first, second = frf(1, references=(0,)), frf(2, references=(2,))
    assert [f for f in compare([first, second]) if f.check == "reciprocity"] == []
    findings = [
        f for f in compare([first, replace(second, H=1.5 * second.H)]) if f.check == "reciprocity"
    ]
    assert findings and findings[0].value in (
        pytest.approx(1.5, rel=0.05),
        pytest.approx(1 / 1.5, rel=0.05),
    )


@pytest.mark.skipif(
    not HAVE, reason="CVXUPDATE_DATA does not name a folder with the real recordings"
)
def test_the_shaker_s_force_channel_of_the_cantilever_is_reported() -> None:
    from cvxupdate.recordings.load import load_recordings
    from cvxupdate.spec import load_problem

    folder = Path(__file__).parents[2] / "problems" / "real" / "unb-cantilever-tip-mass"
    series = [
        load_recordings(load_problem(folder / name))
        for name in ("problem_massa1.toml", "problem.toml", "problem_massa4.toml")
    ]
    factors = []
    for recordings in series:
        sines = [
            f for f in compare(recordings) if f.check == "gain" and "sine tests (shaker" in f.says
        ]
        assert len(sines) == 1
        factors.append(sines[0].value)
    assert factors[0] == pytest.approx(
        3.2, rel=0.1
    )  # massa1, the cleanest one degree of freedom; the README says 3.2 to 3.4
    assert min(factors) > 1.5
    (pooled,) = compare_series(series)
    assert 2.0 < pooled.value < 3.5
    # the hammer's accelerometer points against the blow: without the sign of the problem file the
    # drive point gives power back
    (analyser,) = [r for r in series[0] if isinstance(r, FrequencyResponse)]
    assert [f for f in check(analyser) if f.check == "polarity"] == []
    assert [f.check for f in check(replace(analyser, H=-analyser.H)) if f.check == "polarity"] == [
        "polarity"
    ]


@pytest.mark.skipif(
    not HAVE, reason="CVXUPDATE_DATA does not name a folder with the real recordings"
)
def test_the_three_frame_files_are_three_columns_of_one_reciprocal_matrix() -> None:
    """Published as three repeats; with the force on floor 1, 2, 3 they are reciprocal, with it on
    floor 1 throughout they contradict one another."""
    from cvxupdate.recordings.load import load_recordings
    from cvxupdate.spec import load_problem

    recordings = load_recordings(
        load_problem(
            Path(__file__).parents[2]
            / "problems"
            / "real"
            / "cristallo-3storey-frame"
            / "problem.toml"
        )
    )
    assert compare(recordings) == ()
    as_published = [replace(r, references=recordings[0].references) for r in recordings]  # type: ignore[type-var, union-attr]
    assert len(compare(as_published)) >= 3


@pytest.mark.parametrize("loss", [0.0, 1e-6, 1e-4])
@pytest.mark.parametrize("silent", ["none", "response", "reference", "both"])
@pytest.mark.filterwarnings("error::RuntimeWarning")
def test_simulated_frfs_without_damping_or_with_silent_channels_are_not_blamed_on_time(
    loss: float, silent: str
) -> None:
    """An undamped structure has no direction of time, a silent channel no phase: neither is a fault
    of causality, and neither divides by zero."""
    f = np.linspace(1.0, 100.0, 400)
    shapes = np.array([[1.0, 0.8, 0.5], [0.6, -0.7, 0.9], [0.3, -0.9, 0.6]])
    d = 1.0 / (
        (2 * np.pi * np.array([20.0, 45.0, 80.0])) ** 2 * (1 + 1j * loss)
        - (2 * np.pi * f[:, None]) ** 2
    )
    H = np.einsum("fr,ro,ri->foi", d, shapes, shapes[:, :2])
    if silent in ("response", "both"):
        H[:, 1] = 0.0
    if silent in ("reference", "both"):
        H[:, :, 1] = 0.0
    channels = (
        [Channel(k, "x", "displacement") for k in (1, 2, 3)],
        [Channel(k, "x", "force") for k in (1, 2)],
    )
    for variance in (None, np.zeros(H.shape), variance_of_frf(H, None)[0]):
        said = check(
            FrequencyResponse(
                Origin("undamped", "test"),
                f,
                H,
                "displacement",
                *map(tuple, channels),
                variance,
                np.ones((400, 3)),
            )
        )
        assert {x.check for x in said} <= (
            {"reciprocity"} if silent in ("response", "reference") else set()
        )
    reversed_phase = FrequencyResponse(
        Origin("damped", "test"),
        f,
        np.conj(H_damped(f, shapes)),
        "displacement",
        *map(tuple, channels),
    )
    assert "causality" in {x.check for x in check(reversed_phase)}


def H_damped(f: np.ndarray, shapes: np.ndarray) -> np.ndarray:
    d = 1.0 / (
        (2 * np.pi * np.array([20.0, 45.0, 80.0])) ** 2 * (1 + 0.02j)
        - (2 * np.pi * f[:, None]) ** 2
    )
    return np.einsum("fr,ro,ri->foi", d, shapes, shapes[:, :2])
