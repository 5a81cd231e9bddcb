"""Peaks that stand out are those of scipy.signal."""

import subprocess
import sys

import numpy as np
import pytest
from scipy.signal import find_peaks

from cvxupdate.recordings.peaks import prominent
from tests.cases.bad_beam import channels, good_text, write


@pytest.mark.parametrize("seed", range(40))
def test_the_same_peaks_as_scipy(seed):
    """Noise, steps with plateaus, ties, and slow waves under noise."""
    random = np.random.default_rng(seed)
    size = int(random.integers(1, 400))
    noise = random.standard_normal(size)
    waves = 3.0 * np.sin(np.linspace(0.0, 20.0, size)) + 0.3 * noise
    for level in (noise, np.round(noise), np.round(waves, 1), np.zeros(size)):
        for least in (0.0, 0.5, 2.0):
            places, facts = find_peaks(level, prominence=least)
            mine, above = prominent(level, least)
            assert np.array_equal(mine, places)
            assert np.allclose(above, facts["prominences"], atol=1e-15)


def test_a_check_loads_no_scipy_signal(tmp_path):
    """It takes half a second, of the two in which a file is to be answered."""
    path = write(tmp_path, channels(), good_text())
    code = (
        "import sys; from cvxupdate.study import check; check(sys.argv[1]); "
        "print('scipy.signal' in sys.modules, 'scipy.stats' in sys.modules)"
    )
    done = subprocess.run(
        [sys.executable, "-c", code, str(path)], capture_output=True, text=True, check=True
    )
    assert done.stdout.split() == ["False", "False"]
