"""Tell-tales in words: one line each, none where nothing shows."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.output.telltale_words import distorted, telltale_lines
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin, TimeHistory
from tests.cases.shaken import shaken
from tests.recordings.test_telltales import HARDENING, RUBBING, STOP, decaying


def said(*runs):
    return " ".join(telltale_lines(runs))


def test_a_linear_structure_gives_no_line():
    assert telltale_lines([shaken(seed=1), shaken(level=4.0, seed=2)]) == []
    assert telltale_lines([]) == []


@pytest.mark.slow
def test_what_the_level_does_is_said_with_what_it_may_be():
    hard = said(shaken(HARDENING, seed=3), shaken(HARDENING, 5.0, seed=4))
    assert "From level 1 to level 5 resonances move by" in hard and "up: it stiffens" in hard
    rubs = said(shaken(RUBBING, seed=5), shaken(RUBBING, 6.0, seed=6))
    assert "damping falls with the level, as with dry friction" in rubs
    stop = said(shaken(STOP, 3.0, seed=7))
    assert "lopsided" in stop and "where nothing was forced" in stop


def test_the_loudest_run_that_is_fitted_says_whether_motion_is_distorted():
    quiet, loud = shaken(seed=1), shaken(STOP, 3.0, seed=7)
    assert distorted([quiet, loud]) and not distorted([quiet]) and not distorted([])
    assert not distorted([quiet, replace(loud, origin=replace(loud.origin, use="hold-out"))])


def test_what_goes_with_time_is_not_said_of_the_level():
    first = shaken(seed=8, name="morning")
    later = shaken(seed=9, start=-0.3, end=-0.3, name="evening")
    text = said(first, later)
    assert "From morning to evening, at one level, resonances move down by" in text
    assert "From level" not in text
    within = said(shaken(seed=10, start=0.0, end=-0.3))
    assert "goes with time, not with the level" in within


def test_what_is_held_out_is_not_looked_at():
    later = shaken(seed=9, start=-0.3, end=-0.3)
    kept = replace(later, origin=replace(later.origin, use="hold-out"))
    assert telltale_lines([shaken(seed=8), kept]) == []


def test_a_ring_down_says_how_damping_goes():
    assert "its damping rises from" in said(decaying(0.4, 0.25))
    assert telltale_lines([decaying(1.5, 0.0)]) == []


def frf(level: float, seed: int, stiffer: float = 0.0, zeta: float = 0.01, step: float = 0.1):
    """Two masses between walls in FRFs, 0.5 % noise; ``stiffer`` N/m at the second."""
    f = np.arange(2.0, 60.0, step)
    K, M = np.array([[9e4, -4e4], [-4e4, 7e4 + stiffer]]), np.diag([2.0, 1.4])
    lam, phi = np.linalg.eig(np.linalg.solve(M, K))
    phi = phi / np.sqrt(np.diag(phi.T @ M @ phi))
    s = 2j * np.pi * f[:, None]
    H = ((phi[0] / (s**2 + 2 * zeta * np.sqrt(lam) * s + lam)) @ phi.T)[:, :, None]
    rng = np.random.default_rng(seed)
    noise = rng.standard_normal((2, *H.shape)) * 0.0035 * np.std(H)
    sensors = (Channel(1, "x", "displacement"), Channel(2, "x", "displacement"))
    origin = Origin(f"frf at {level}", "test", "fit", level=level)
    H = H + noise[0] + 1j * noise[1]
    return FrequencyResponse(
        origin, f, H, "displacement", sensors, (Channel(1, "x", "force"),), None, None
    )


def test_frequency_responses_at_two_levels_say_how_resonances_go():
    assert said(frf(1.0, 1), frf(4.0, 2)) == ""
    assert said(frf(1.0, 1), frf(4.0, 2, step=0.13)) == ""
    hard = said(frf(1.0, 1), frf(4.0, 2, stiffer=6e3))
    assert "From level 1 to level 4 resonances move by" in hard and "up: it stiffens" in hard
    rubs = said(frf(4.0, 2, zeta=0.006), frf(1.0, 1, zeta=0.012))
    assert "narrower: damping falls with the level" in rubs
    assert said(frf(2.0, 1), frf(2.0, 2, stiffer=6e3)) == "", "one level says nothing of levels"


def test_mains_hum_is_said() -> None:
    rng, n, rate = np.random.default_rng(5), 4096, 256.0
    data = rng.standard_normal((n, 2))
    data[:, 1] += np.sin(2.0 * np.pi * 50.0 * np.arange(n) / rate)
    channels = (Channel(1, "x", "force"), Channel(2, "x", "acceleration"))
    found = telltale_lines([TimeHistory(Origin("a run", "test", "fit"), rate, channels, data)])
    assert found[-1].startswith("Mains hum at 50 Hz was taken out of a run")
