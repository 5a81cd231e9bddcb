"""What a model still misses of its reference state: a frequency for each mode, and what is left."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from scipy.linalg import eigh

from cvxupdate.diagnose.nominal.mesh import NONE
from cvxupdate.diagnose.nominal.refinement import PLAIN
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.common import Common, Missed, common_of
from cvxupdate.diagnose.responses.data import prepare
from cvxupdate.diagnose.responses.evidence import ResponseEvidence
from cvxupdate.diagnose.types import Errors
from cvxupdate.fe.modes import model_modes
from tests.cases.signals import signal_of


def evidence_of(model, *recordings):
    start = with_nuisance(model, scatter=0.1)
    return ResponseEvidence(
        model, start, prepare(recordings), PLAIN, (), (), lambda n, k: start, lambda text: None
    )


def test_frequencies_that_no_parameter_moves_are_told_mode_by_mode(chain, lab, measure):
    """A stiffer ground and a softer top move each mode by its own part; what is then left is the
    shapes' part, and less than what was there before."""
    _, model = chain
    real = lab(k=(1.12, 1, 1, 0.94))
    sharp = {"step": 0.1}
    recordings = measure(real, 4, seed=2, **sharp), measure(real, 1, "hold-out", seed=3, **sharp)
    evidence = evidence_of(model, *recordings)
    common = common_of(evidence, evidence.data.sharp, evidence.data.sharp_hold_out)
    wanted = np.sqrt(eigh(real.K, real.M)[0]) / (2 * np.pi)
    own = model_modes(model, 4).flexible().frequencies
    assert common.shift.frequencies == pytest.approx(own)
    assert (1 + common.shift.shift) * own == pytest.approx(wanted, rel=2e-3)
    before = evidence.errors(evidence.bases[-1])
    assert common.floor.fit < 0.5 * before.fit and common.floor.hold_out < before.hold_out


def test_what_is_left_is_stated_where_it_is(chain, lab, measure):
    """A channel that reads a tenth too much has a tenth left on every line, the others nothing."""
    _, model = chain
    m = model.matrices(model.zero())
    exact = replace(lab(), K=m.K.toarray(), M=m.M.toarray())
    sound = measure(exact, 4, noise=1e-5)
    evidence = evidence_of(model, replace(sound, H=sound.H * np.array([1, 1.1, 1, 1])[:, None]))
    common = common_of(evidence, evidence.data.sharp, ())
    weighed = common.weighed(signal_of(sound))
    assert weighed.missed.shape == weighed.Y.shape
    left = np.median(weighed.missed[:, :, 0], axis=0)
    assert left[1] == pytest.approx(0.1, abs=0.03) and np.all(left[[0, 2, 3]] < 0.03)
    assert np.all(weighed.scale() >= signal_of(sound).scale())


def test_channels_that_the_reference_lacks_have_what_all_have(chain, lab, measure):
    signal = signal_of(measure(lab(), 4))
    f = signal.s.imag / (2 * np.pi)
    other = Missed(f, ("n9.x",), ("n9.x",), 2, np.full((len(f), 1, 1), 0.2))
    common = Common(NONE, (other,), Errors(0.1, 0.1))
    assert common.weighed(signal).missed == pytest.approx(np.full(signal.Y.shape, 0.2))
