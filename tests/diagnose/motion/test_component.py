"""Parts on a rig: laws made by an independent loop are found with their figures."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose.motion.component import Rig, laws_of, of_levels

K, FORCE, PLAY = 4e6, 5000.0, 0.003


def rig(use: str, frequency: float, play: float = PLAY, seed: int = 1) -> Rig:
    """Spring, slider and free play in series, as a loop over samples."""
    t = np.arange(2500) / 500.0
    x = 0.025 * np.sin(2.0 * np.pi * frequency * t)
    at, force = 0.0, np.zeros(len(x))
    for i, now in enumerate(x):
        bent = max(abs(now - at) - play / 2.0, 0.0)
        if K * bent > FORCE:
            at = now - np.sign(now - at) * (FORCE / K + play / 2.0)
            bent = FORCE / K
        force[i] = K * bent * np.sign(now - at)
    noise = 0.02 * FORCE * np.random.default_rng(seed).standard_normal(len(x))
    return Rig(use, use, "n1.x", x, np.gradient(x, t), force + 300.0 + noise)


def test_friction_with_free_play_is_found_with_its_figures() -> None:
    """An offset of the load cell changes nothing."""
    linear, *laws = laws_of([rig("fit", 0.5), rig("hold-out", 1.0, seed=2)])
    best = min(laws, key=lambda law: law.errors[0])
    assert best.name == "jenkins with play"
    assert best.size == pytest.approx(FORCE, rel=0.03)
    assert best.travel == pytest.approx(PLAY + 1.5 * FORCE / K, rel=0.1)
    assert best.errors[1] < 0.1 * linear.errors[1]


def test_without_free_play_a_slider_alone_does_as_well() -> None:
    laws = {law.name: law for law in laws_of([rig("fit", 0.5, play=0.0)])}
    assert laws["jenkins"].errors[0] < 1.1 * laws["jenkins with play"].errors[0]
    assert laws["jenkins"].errors[0] < 0.3 * laws["linear"].errors[0]


def test_a_friction_of_each_level_and_one_play_for_all() -> None:
    """The motion of all levels is the same, the friction grows with it; a level between, of which
    nothing was fitted, is foretold."""
    runs = [
        replace(rig(use, 0.5, seed=s), level=level)
        for s, (use, level) in enumerate((("fit", 1.0), ("hold-out", 1.5), ("fit", 2.0)))
    ]
    runs = [replace(r, x=r.level * r.x, force=r.level * r.force) for r in runs]
    same, own = of_levels([replace(r, x=r.x / r.level) for r in runs])
    assert own and min(law.errors[1] for law in same) < 0.1 * same[0].errors[1]
    best = min(same, key=lambda law: law.errors[0])
    assert [row[0] for row in best.own] == [1.0, 2.0]
    assert [row[3] for row in best.own] == pytest.approx([FORCE, 2.0 * FORCE], rel=0.03)
    assert best.at(1.5)[2] == pytest.approx(1.5 * FORCE, rel=0.03)


def test_levels_of_one_law_share_its_coefficients() -> None:
    runs = [replace(rig("fit", 0.5, seed=s), level=float(s)) for s in (1, 2)]
    laws, own = of_levels(runs)
    assert not own and all(len(law.own) == 1 for law in laws)
