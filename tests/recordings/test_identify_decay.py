"""The law of damping over the modes: thesis Table 9.1, and laws planted on purpose."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from cvxupdate.errors import RecordingError
from cvxupdate.recordings.identify.decay import decay_rates
from cvxupdate.recordings.types import ModeTable, Origin

# thesis Table 9.1, structure A: natural frequency (Hz), damping (%); the text calls it structural
# damping: a loss factor
TABLE_9_1 = np.array(
    [
        [29.6, 3.1],
        [32.5, 3.1],
        [66.6, 1.1],
        [67.7, 1.3],
        [84.5, 0.78],
        [93.9, 0.95],
        [124.7, 0.78],
        [140.4, 0.67],
        [175.2, 0.43],
        [182.6, 0.41],
        [202.9, 0.39],
        [209.5, 0.38],
        [210.9, 0.38],
        [259.1, 0.31],
        [287.8, 0.27],
        [301.7, 0.30],
        [319.9, 0.27],
        [339.7, 0.45],
        [360.4, 0.27],
        [376.9, 0.35],
    ]
)


def table(frequency: NDArray, damping: NDArray, std: NDArray | None = None) -> ModeTable:
    unknown = np.full(frequency.size, np.nan)
    return ModeTable(
        Origin("modes", "test"),
        frequency,
        unknown,
        damping,
        unknown if std is None else std,
        (),
        None,
        None,
        np.zeros(frequency.size, dtype=np.int64),
    )


def test_table_9_1_has_one_decay_rate() -> None:
    found = decay_rates(table(TABLE_9_1[:, 0], 0.5e-2 * TABLE_9_1[:, 1]))
    assert found.verdict == "constant decay rate"
    # loss factor x frequency is 0.86 Hz in the median: decay rate pi times that
    assert found.rate == pytest.approx(np.pi * 0.86, rel=0.05)
    assert 0.0 < found.rate_std < 0.1 * found.rate
    assert found.alpha == pytest.approx(2.0 * found.rate)
    assert found.exponent == pytest.approx(-1.0, abs=0.15)
    # 339.7 Hz with 0.45 % does not obey
    assert 17 in found.outliers
    for words in ("one decay rate", "mass-proportional", "exponential window", "mode 18"):
        assert words in found.says


@given(
    st.sampled_from(
        [(-1.0, "constant decay rate"), (0.0, "constant ratio"), (1.0, "stiffness proportional")]
    ),
    st.integers(0, 1000),
    st.integers(8, 25),
)
@settings(max_examples=60, deadline=None)
def test_planted_laws_are_named(law: tuple[float, str], seed: int, modes: int) -> None:
    rng = np.random.default_rng(seed)
    f = np.geomspace(20.0, 400.0, modes) * (1 + 0.02 * rng.standard_normal(modes))
    zeta = 0.01 * (f / 80.0) ** law[0] * np.exp(0.05 * rng.standard_normal(modes))
    found = decay_rates(table(f, zeta, 0.05 * zeta))
    assert found.verdict == law[1]
    assert abs(found.exponent - law[0]) < 6.0 * found.exponent_std + 1e-3


def test_no_law_is_forced() -> None:
    rng = np.random.default_rng(4)
    f = np.geomspace(20.0, 400.0, 14)
    found = decay_rates(table(f, 0.01 * np.exp(0.9 * rng.standard_normal(14))))
    assert found.verdict == "none" and "no single law" in found.says
    with pytest.raises(RecordingError, match="at least 3 are needed"):
        decay_rates(table(f[:2], np.array([0.01, 0.02])))
    # modes without a known damping do not count, but keep their place
    zeta = 2.0 / (2 * np.pi * f)
    zeta[3] = np.nan
    assert decay_rates(table(f, zeta)).rate == pytest.approx(2.0)
