"""Which kind of loss a structure has is told by its responses beside the resonances; what is found
is the same whichever the file supposes."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.diagnose import diagnose_problem
from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.nominal.scatter import with_nuisance
from cvxupdate.diagnose.responses.errors import channel_errors
from cvxupdate.diagnose.responses.setting import EFFORTS, setting_for
from tests.cases.chain import CHAIN, load
from tests.cases.signals import signal_of

ETA, ZETA = 0.06, 0.03  # heavy enough that the wrong kind leaves more than noise
SUPPOSED = {"viscous": f"zeta = {ZETA}", "structural": f"eta = {ETA}"}
KINDS = {"viscous": "modal", "structural": "structural"}


class Lossy:
    """The laboratory's chain with a heavy loss of one kind."""

    def __init__(self, lab, kind):
        self.lab = replace(lab, eta=ETA if kind == "structural" else 0.0)

    def receptance(self, frequency):
        return self.lab.receptance(frequency, ZETA)


def supposed(folder, kind):
    """The chain of the file with damping of a kind."""
    text = CHAIN.replace('kind = "modal"', f'kind = "{KINDS[kind]}"')
    return load(folder, text.replace("zeta = 0.005", SUPPOSED[kind]))


@pytest.mark.parametrize(("kind", "share"), [("viscous", 0.0), ("structural", 1.0)])
def test_the_kind_of_loss_is_told(chain, lab, measure, kind, share):
    _, model = chain
    signal = signal_of(measure(Lossy(lab(), kind), 4, noise=1e-3))
    setting = setting_for(with_nuisance(undamped(model)), model, (signal,), 75.0)
    left = {}
    for mixed in (False, True):
        own = replace(setting, mixed=mixed)
        found = fitted(own, np.zeros(len(own.columns)), EFFORTS["sharp"])
        left[mixed] = channel_errors(found.point, (signal,))
    assert found.point.loss.hysteretic == pytest.approx(share, abs=0.05)
    assert left[True] < 7e-3  # floors of one group scatter by themselves
    assert (left[False] > 2.0 * left[True]) == (kind == "structural")


@pytest.mark.parametrize(("true", "file"), [("structural", "viscous"), ("viscous", "structural")])
def test_a_soft_spring_is_found_whichever_kind_of_loss_is_supposed(
    tmp_path, lab, measure, true, file
):
    real = Lossy(lab(k=(1, 0.85, 1, 1)), true)
    spec, model = supposed(tmp_path, file)
    fit, held = measure(real, 4, seed=11), measure(real, 1, "hold-out", seed=12)
    found = diagnose_problem(spec, model, (fit, held))
    (first,) = found.findings
    assert first.physics == "stiffness_change" and first.place.groups == ("spring 2",)
    assert first.parameters["factor"] == pytest.approx(0.85, abs=0.02)
    assert first.confidence >= 0.5 and found.fit["hold_out"]["after"] < 0.01
    share = found.updated.text.partition("hysteretic = ")[2].partition("\n")[0]
    assert float(share or 0.0) == pytest.approx(1.0 if true == "structural" else 0.0, abs=0.1)


@pytest.mark.parametrize(("true", "file"), [("structural", "viscous"), ("viscous", "structural")])
def test_another_kind_of_loss_than_supposed_is_no_finding(tmp_path, lab, measure, true, file):
    real = Lossy(lab(), true)
    spec, model = supposed(tmp_path, file)
    fit, held = measure(real, 4, seed=21), measure(real, 1, "hold-out", seed=22)
    found = diagnose_problem(spec, model, (fit, held))
    assert found.verdict == "consistent" and found.findings == ()
