"""Effects that a problem may ask for."""

from __future__ import annotations

from cvxupdate.errors import Fault, ProblemFileError
from cvxupdate.physics import effect_names
from cvxupdate.physics.effect import MOTION
from cvxupdate.spec import Spec


def refuse_unknown(spec: Spec) -> None:
    """Refuse effects that the grammar names and is not implemented: nothing would be tried
    for them, and "nothing explains it" would be no answer.

    Raises
    ------
    ProblemFileError
        With a fault for each.
    """
    known = (*effect_names(), *effect_names(MOTION))
    faults = [
        Fault(
            str(spec.path),
            f"diagnose.physics[{i}]",
            f"'{word}' is not implemented yet, so nothing would be tried for it.",
            f"Take it out. Implemented: {', '.join(sorted(known))}.",
        )
        for i, word in enumerate(spec.diagnose.physics or ())
        if word not in known
    ]
    if faults:
        raise ProblemFileError(faults)
