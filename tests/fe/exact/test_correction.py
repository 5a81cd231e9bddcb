"""What exact members add, at one point and at many together."""

import numpy as np
import scipy.sparse.linalg as sla

from cvxupdate.fe.responses import matrices_with_damping
from cvxupdate.fe.synthesis import DirectLines
from tests.cases.elements import POINTS, SPACE, build, lines

SECTION = {"shape": "rectangle", "width": 0.02, "height": 0.012, "kappa": 0.85}


def test_many_points_are_each_what_they_are_alone() -> None:
    """Members of unlike lengths and directions: Z(s) solved afresh at every point, in any order."""
    text = lines("exact_beam", POINTS, [(1, 2), (2, 3), (3, 4)], SPACE, SECTION)
    model = build({**text, "damping": {"kind": "structural", "eta": 0.02}})
    m = matrices_with_damping(model)
    assert m.beyond is not None
    points = 2j * np.pi * np.array([900.0, 35.0, 410.0, 35.0, 4100.0])
    found = DirectLines(m, np.array([7])).at(points)
    for i, s in enumerate(points.tolist()):
        fresh = matrices_with_damping(model).beyond  # has nothing kept
        assert fresh is not None
        Z = m.K + 1j * m.D + s * m.C + s * s * m.M + fresh.at(s)
        unit = np.zeros(model.size, dtype=complex)
        unit[7] = 1.0
        np.testing.assert_allclose(
            found[:-1, i, 0], sla.spsolve(Z.tocsc(), unit), rtol=1e-6, atol=1e-16
        )
