"""Tables of modes at two drive levels."""

from __future__ import annotations

import numpy as np
import pytest

from cvxupdate.diagnose.modes.levels import TYPICAL, level_change
from cvxupdate.diagnose.output.wording import nonlinear
from cvxupdate.recordings.types import ModeTable, Origin

F = np.array([10.0, 31.0, 70.0])


def table(level: float | None, f=F, zeta=0.01, std=2e-4, zeta_std=0.03) -> ModeTable:
    """Three modes with damping ratios, deviations relative."""
    f = np.asarray(f, dtype=float)
    damping = np.full(len(f), zeta)
    origin = Origin(f"at {level}", "table", "fit", level)
    return ModeTable(
        origin, f, std * f, damping, zeta_std * damping, (), None, None, np.zeros(len(f), int)
    )


def test_tables_of_one_level_say_nothing() -> None:
    assert level_change([table(1.0), table(1.0, 0.9 * F)]) is None
    assert level_change([table(None), table(None, 0.9 * F)]) is None
    assert level_change([table(1.0)]) is None


def test_a_linear_structure_changes_no_more_than_its_noise() -> None:
    rng = np.random.default_rng(4)
    loud = table(2.0, F * (1.0 + 2e-4 * rng.standard_normal(3)), 0.01)
    change = level_change([table(1.0), loud])
    assert change is not None and not nonlinear(change)
    assert change.change < 3.0 * change.noise


def test_a_frequency_that_falls_with_the_level_counts_in_half_power_bandwidths() -> None:
    """A shift by one bandwidth of the first of three modes; the others stay."""
    f = F.copy()
    f[0] *= 1.0 - 2.0 * 0.01
    change = level_change([table(1.0), table(2.0, f)])
    assert change is not None and nonlinear(change)
    assert change.change == pytest.approx(1.0 / np.sqrt(3.0), rel=0.02)


def test_damping_that_grows_with_the_level_is_told() -> None:
    change = level_change([table(1.0), table(4.0, zeta=0.024)])
    assert change is not None and nonlinear(change)
    assert change.change == pytest.approx(np.log(2.4))


def test_unknown_damping_leaves_the_frequencies() -> None:
    change = level_change([table(1.0, zeta=np.nan), table(2.0, F * 1.002, zeta=np.nan)])
    assert change is not None
    assert change.change == pytest.approx(0.002 / (2.0 * TYPICAL), rel=0.01)


def test_modes_that_only_one_table_has_are_left_out() -> None:
    more = table(2.0, [10.0, 31.0, 52.0, 70.0])
    change = level_change([table(1.0), more])
    assert change is not None and change.change == pytest.approx(0.0, abs=1e-12)
    assert level_change([table(1.0), table(2.0, [400.0])]) is None
