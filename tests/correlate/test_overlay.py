"""Frequency responses before and after an update, for its page."""

from pathlib import Path

import numpy as np
import pytest

from cvxupdate.correlate import overlay
from cvxupdate.correlate.overlay import frf_overlays
from cvxupdate.correlate.response_error import modelled
from cvxupdate.recordings.measured import measured_responses
from cvxupdate.study import open_problem

BEAM = Path(__file__).resolve().parents[2] / "problems" / "generic" / "beam_a" / "problem.toml"


@pytest.fixture(scope="module")
def opened():
    _, model, recordings = open_problem(BEAM)
    p = 0.05 * np.random.default_rng(2).normal(size=len(model.parameters))
    return model, recordings, p


def test_curves_are_those_of_the_recordings_and_of_both_models(opened):
    """At the force, and where the updated model is furthest off; lines only where some were
    fitted."""
    model, recordings, p = opened
    found = frf_overlays(model, recordings, p, (500.0, 690.0))
    assert [(o.use, o.reference) for o in found] == [("fit", "n1.y")] * 2 + [
        ("hold-out", "n4.y")
    ] * 2
    for o, recording in zip(found[::2], recordings, strict=True):
        (m,) = measured_responses(recording)
        i = [c.label for c in m.responses].index(o.reference)
        assert o.response == o.reference
        before, after = (modelled(model, m, at) for at in (None, p))
        np.testing.assert_allclose(o.frequency, m.s.imag / (2.0 * np.pi))
        for curve, Y in ((o.measured, m.Y), (o.before, before), (o.after, after)):
            np.testing.assert_allclose(curve, np.abs(Y[:, i, 0]), rtol=1e-9)
        off = np.linalg.norm(after - m.Y, axis=0) / np.linalg.norm(m.Y, axis=0)
        assert o.error_after == pytest.approx(float(off[i, 0]), rel=1e-9)
        worst = found[found.index(o) + 1]
        others = [e for k, e in enumerate(off[:, 0].tolist()) if k != i]
        assert worst.error_after == pytest.approx(max(others), rel=1e-9)
    assert [o.fitted for o in found] == [(500.0, 690.0)] * 2 + [()] * 2


def test_long_recordings_are_thinned(opened, monkeypatch):
    model, recordings, p = opened
    monkeypatch.setattr(overlay, "LINES", 40)
    found = frf_overlays(model, recordings, p)
    assert all(20 < len(o.frequency) <= 40 for o in found)
