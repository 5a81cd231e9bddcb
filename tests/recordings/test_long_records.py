"""Long records: in blocks they say what they say as a whole, in little memory, with a bar on a
terminal."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tracemalloc
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from cvxupdate.recordings import survey as module
from cvxupdate.recordings.inspect import inspect_file
from cvxupdate.recordings.inspect.channels import survey_whole
from cvxupdate.recordings.read import read_file
from cvxupdate.recordings.read.contents import Options
from cvxupdate.recordings.read.time_axis import rate_of_times, rises
from cvxupdate.recordings.survey import survey

RATE = 2048.0


def signals() -> dict[str, NDArray[np.float64]]:
    rng = np.random.default_rng(8)
    t = np.arange(300_000) / RATE
    tone = (
        3.0 * np.sin(2 * np.pi * 61.3 * t)
        + np.sin(2 * np.pi * 220.0 * t)
        + 0.2 * rng.normal(size=t.size)
        + 7.0
    )
    coarse = np.round(tone / 0.05) * 0.05
    dropped = tone.copy()
    for at, length in (
        (4090, 12),
        (8192, 40),
        (16_300, 300),
        (40_950, 5000),
        (299_900, 60),
    ):  # blocks of 4096 end amid four of them
        dropped[at : at + length] = dropped[at]
    holes = tone.copy()
    holes[[5, 4096, 70_000]] = np.nan, np.inf, np.nan
    frozen = tone.copy()
    frozen[50_000:200_000] = frozen[50_000]
    return {
        "tone": tone,
        "converter": coarse,
        "clipped": np.clip(tone, 3.5, 10.2),
        "clipped converter": np.clip(coarse, 3.5, 10.0),
        "drop-outs": dropped,
        "holes": holes,
        "frozen": frozen,
        "dead": np.full(t.size, 2.0),
        "switched": np.where(rng.random(t.size) > 0.5, 1.0, 0.0),
        "nothing": np.full(t.size, np.nan),
    }


@pytest.mark.parametrize("name", list(signals()))
def test_blocks_say_what_the_whole_record_says(name: str, monkeypatch: pytest.MonkeyPatch) -> None:
    x = signals()[name]
    want = survey_whole(x, RATE)
    monkeypatch.setattr(module, "LONG", 4096)
    (seen,) = survey([x], RATE)
    assert (seen.missing, seen.clipped) == (want.missing, want.clipped)
    assert [seen.mean, seen.rms, seen.least, seen.largest] == pytest.approx(
        [want.mean, want.rms, want.least, want.largest], rel=1e-12, abs=1e-12, nan_ok=True
    )
    assert [line.frequency for line in seen.lines] == pytest.approx(
        [line.frequency for line in want.lines], rel=1e-9
    )
    assert [line.amplitude for line in seen.lines] == pytest.approx(
        [line.amplitude for line in want.lines], rel=1e-9
    )
    # a value that stays for more samples than memory should hold is noted in parts that share a
    # sample
    assert (
        seen.dropped == want.dropped
        if name != "frozen"
        else abs(seen.dropped - want.dropped) <= want.dropped // 16_000
    )
    assert (want.dropped > 0) == (name in ("drop-outs", "frozen")) and (
        want.clipped > 0
    ) == name.startswith("clipped")


def test_the_bar_moves_to_its_end(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(module, "LONG", 1000)
    heard: list[tuple[str, int, int]] = []
    survey([np.arange(4500.0), np.ones(4500)], RATE, lambda *said: heard.append(said), "looking")
    assert heard == [("looking", done, 4500) for done in (1000, 2000, 3000, 4000, 4500)]


def test_times_are_checked_in_blocks(monkeypatch: pytest.MonkeyPatch) -> None:

    from cvxupdate.recordings.read import time_axis

    monkeypatch.setattr(time_axis, "BLOCK", 100)
    t = np.arange(1000) / 50.0
    assert rises(t) and rate_of_times(t, "x") == pytest.approx(50.0)
    late = t.copy()
    late[700:] += 0.5
    with pytest.raises(time_axis.RecordingError, match="sample "):
        rate_of_times(late, "x")
    back = t.copy()
    back[500] = back[499]
    assert not rises(back) and not rises(np.where(t == t[300], np.nan, t))


@pytest.mark.parametrize(
    "form", ["npz", "compressed npz", "npy", "h5", "mat", "compressed mat", "csv"]
)
def test_a_large_file_is_held_on_disk_whatever_its_format(
    tmp_path: Path, form: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    """24 MB (6 MB of text), with everything above half a megabyte counted as large: memory stays
    far below the table's size."""
    from cvxupdate.recordings.read import disk_buffer

    for name in ("npz", "hdf5", "mat", "text", "disk_buffer"):
        monkeypatch.setattr(
            sys.modules[f"cvxupdate.recordings.read.{name}"],
            "PIECE",
            2**17 if name != "disk_buffer" else disk_buffer.PIECE,
        )
    monkeypatch.setattr(sys.modules["cvxupdate.recordings.read.text"], "_PIECE", 4096)
    data = np.random.default_rng(2).normal(size=(200_000, 4) if form == "csv" else (1_500_000, 2))
    path = tmp_path / f"a.{form.split()[-1]}"
    if form.endswith("npz"):
        (np.savez_compressed if form.startswith("compressed") else np.savez)(path, data=data)
    elif form == "npy":
        np.save(path, data)
    elif form == "h5":
        import h5py

        with h5py.File(path, "w") as file:
            file.create_dataset(
                "data", data=data, chunks=(1000, 2), compression="gzip", compression_opts=1
            )
    elif form.endswith("mat"):
        from scipy.io import savemat

        savemat(path, {"data": data}, do_compression=form.startswith("compressed"))
    else:
        np.savetxt(path, data, "%.6f", delimiter=",")
    heard: list[tuple[int, int]] = []
    read_file(path)  # libraries that load on use
    tracemalloc.start()
    contents = read_file(
        path, Options(progress=lambda what, done, total: heard.append((done, total)))
    )
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    np.testing.assert_allclose(contents.arrays["data"], data, atol=1e-6 if form == "csv" else 0.0)
    assert peak < 0.5 * data.nbytes
    if form not in ("npy", "mat"):  # nothing of these is read before it is used
        assert (
            heard
            and heard[-1][0] == heard[-1][1]
            and all(0 < done <= total for done, total in heard)
        )


def long_file(path: Path, samples: int, channels: int) -> None:
    """Single precision, written block by block: noise and a line at 61.3 Hz."""
    table = np.lib.format.open_memmap(path, "w+", np.float32, (samples, channels))
    for at in range(0, samples, 2**20):
        size = min(2**20, samples - at)
        noise = np.random.default_rng(at).standard_normal((size, channels), dtype=np.float32)
        table[at : at + size] = (
            noise
            + 3.0
            * np.sin(2 * np.pi * 61.3 / RATE * np.arange(at, at + size, dtype=np.float64))[:, None]
        )
    table.flush()


def on_a_terminal(*arguments: str) -> tuple[str, str, int]:
    """What the command prints, what a terminal on its standard error shows, and its peak memory in
    bytes."""
    pty = pytest.importorskip("pty", reason="no pseudo-terminals on this system")
    code = """import pathlib, re, resource
from cvxupdate.cli import main
try:
    main()
finally:  # getrusage would count the process that started this one; VmHWM is of this one alone
    status = pathlib.Path("/proc/self/status")
    if status.exists():
        kib = int(re.search(r"VmHWM:\\s+(\\d+)", status.read_text())[1])
    else:
        kib = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    print("PEAK", kib * 1024)"""
    leader, follower = pty.openpty()
    with subprocess.Popen(
        [sys.executable, "-c", code, *arguments],
        stdout=subprocess.PIPE,
        stderr=follower,
        text=True,
        env={**os.environ, "TERM": "xterm", "COLUMNS": "100"},
    ) as process:
        os.close(follower)
        shown = b""
        while True:
            try:
                chunk = os.read(leader, 4096)
            except OSError:
                break
            if not chunk:
                break
            shown += chunk
        out, _ = process.communicate()
    os.close(leader)
    assert process.returncode == 0
    said, _, peak = out.rpartition("PEAK ")
    return said, shown.decode(), int(peak)


@pytest.mark.parametrize("option", [(), ("--json",)])
def test_inspect_shows_a_bar_on_a_terminal_and_never_with_json(
    tmp_path: Path, option: tuple[str, ...]
) -> None:
    long_file(tmp_path / "a.npy", 1_500_000, 1)
    said, shown, _ = on_a_terminal("inspect", str(tmp_path / "a.npy"), *option)
    assert "looking" not in said
    if option:
        assert shown == "" and json.loads(said)["length"] == 1_500_000
    else:
        assert "inspecting the channels" in shown and "100%" in shown and "1500000 samples" in said


@pytest.mark.slow
def test_a_long_file_is_inspected_in_less_than_twice_its_size_with_a_bar(tmp_path: Path) -> None:
    """128 MB of single precision, 8 channels x 4 million samples, beside what inspecting a short
    file of the kind takes; the table in double precision alone would be twice the file."""
    samples = 4_000_000
    long_file(tmp_path / "short.npy", 1000, 8)
    *_, least = on_a_terminal("inspect", str(tmp_path / "short.npy"))
    long_file(tmp_path / "a.npy", samples, 8)
    size = (tmp_path / "a.npy").stat().st_size
    assert size > 125e6
    said, shown, peak = on_a_terminal("inspect", str(tmp_path / "a.npy"))
    assert f"{samples} samples" in said and "inspecting the channels" in shown and "100%" in shown
    assert peak - least < 1.6 * size
    seen = inspect_file(tmp_path / "a.npy")
    assert [c.rms for c in seen.channels] == pytest.approx([np.sqrt(1.0 + 4.5)] * 8, rel=1e-3)
