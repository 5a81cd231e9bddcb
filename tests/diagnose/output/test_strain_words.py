"""Groups that were taken for scatter, though hardly."""

from __future__ import annotations

import numpy as np

from cvxupdate.diagnose.nominal.scatter import prior_scales, with_nuisance
from cvxupdate.diagnose.output.strain_words import strained_lines
from tests.cases.plain_evidence import CHAIN


def test_a_group_that_is_further_off_than_groups_scatter_is_named():
    model = with_nuisance(CHAIN)
    scales = np.array(prior_scales(model))
    own = [q for q in model.parameters if q.of == "stiffness"]
    k = model.parameters.index(own[0])
    p = np.zeros(len(scales))
    assert not strained_lines(model.parameters, p)
    p[k] = -2.9 * scales[k]
    assert not strained_lines(model.parameters, p), "as groups scatter"
    p[k] = -3.4 * scales[k]
    (line,) = strained_lines(model.parameters, p)
    assert f"group '{own[0].group}' is 6.8 % softer" in line and "3.4 times" in line
    mass = next(j for j, q in enumerate(model.parameters) if q.of == "mass")
    p[k], p[mass] = 0.0, 3.2 * scales[mass]
    (line,) = strained_lines(model.parameters, p)
    assert "heavier" in line
