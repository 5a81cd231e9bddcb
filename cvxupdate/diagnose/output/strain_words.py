"""Groups that nuisance parameters had to bring far: within usual scatter, but only just."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from cvxupdate.diagnose.nominal.scatter import scatter_of
from cvxupdate.diagnose.nominal.theory import GROUP
from cvxupdate.diagnose.settings import STRAINED
from cvxupdate.fe.parameters import Parameter
from cvxupdate.fe.terms import Real

SAYS = {"stiffness": ("stiffer", "softer"), "mass": ("heavier", "lighter")}


def strained_lines(parameters: Sequence[Parameter], values: Real) -> list[str]:
    """One line for each group whose nuisance parameter is `STRAINED` deviations or more from the
    drawing: ``parameters`` (n) of the model as it came; ``values`` of all unknowns of a fit, of
    which theirs are the first n."""
    out = []
    for q, value in zip(parameters, values, strict=False):
        if q.group in (None, GROUP) or q.of not in SAYS:
            continue
        scale = scatter_of(q)
        if abs(value) < STRAINED * scale:
            continue
        word = SAYS[q.of][int(np.sign(value) < 0)]
        out.append(
            f"Beside that group '{q.group}' is {abs(100 * value):.2g} % {word} than drawn, "
            f"{abs(value) / scale:.2g} times what groups usually scatter by: it was taken for "
            "scatter, and may be a second finding. If drawing and material are known better than "
            "that, set a smaller [diagnose] scatter."
        )
    return out
