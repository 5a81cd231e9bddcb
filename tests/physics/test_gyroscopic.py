"""A spinning shaft: the effect's tangent, the response and its derivatives with a skew damping
matrix against dense algebra, and the spin found."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
import scipy.linalg
from numpy.typing import NDArray

from cvxupdate.diagnose.fit import fitted
from cvxupdate.diagnose.nominal.damping import undamped
from cvxupdate.diagnose.responses.point import ResponseSetting
from cvxupdate.diagnose.responses.setting import setting_for
from cvxupdate.diagnose.responses.signals import Signal
from cvxupdate.errors import ModelError
from cvxupdate.fe.elements import Gyroscopic
from cvxupdate.fe.model import Matrices, Model
from cvxupdate.fe.responses import condenser
from cvxupdate.fe.synthesis import receptance
from cvxupdate.physics import candidates_of
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.effect import Effect
from cvxupdate.physics.growth import Wanted, append_parameters
from cvxupdate.physics.gyroscopic import Spin
from cvxupdate.recordings.types import Channel, FrequencyResponse, Origin
from cvxupdate.update.trust_region import Options
from tests.cases.elements import build
from tests.cases.signals import signal_of

ALONG = (0.0, 0.13, 0.29, 0.4, 0.62)
TOP = 400.0


def rotor(
    section: dict[str, object] | None = None,
    spin: float | None = None,
    disc: tuple[float, float, float] = (0.02, 0.011, 0.011),
) -> Model:
    """A round shaft on unequal springs with a disc off the middle; one element points backwards."""
    rows = [
        {"id": i + 1, "nodes": [i + 1, i + 2] if i != 2 else [4, 3], "group": "shaft"}
        for i in range(4)
    ]
    elements = [
        {"type": "beam3d", "material": "steel", "section": "s", "rows": rows},
        {
            "type": "mass",
            "rows": [
                {
                    "id": 20,
                    "nodes": [3],
                    "m": 2.1,
                    "Ixx": disc[0],
                    "Iyy": disc[1],
                    "Izz": disc[2],
                    "group": "disc",
                }
            ],
        },
        {
            "type": "spring",
            "rows": [
                {"id": 30, "nodes": [1], "k": 8e5, "dofs": ["y", "z"]},
                {"id": 31, "nodes": [5], "k": 3e5, "dof": "y"},
                {"id": 32, "nodes": [5], "k": 4e5, "dof": "z"},
            ],
        },
        {"type": "dashpot", "dof": "y", "rows": [{"id": 40, "nodes": [5], "c": 12.0}]},
    ]
    if spin is not None:
        area = 7850.0 * np.pi * 0.02**4 / 32.0
        elements.append(
            {
                "type": "gyroscopic",
                "omega": spin,
                "rows": [
                    *({"id": 50 + i, "nodes": [i + 1, i + 2], "Ip": area} for i in range(4)),
                    {"id": 60, "nodes": [3], "Ip": disc[0], "axis": [1.0, 0.0, 0.0]},
                ],
            }
        )
    return undamped(
        build(
            {
                "dofs": ["y", "z", "ry", "rz"],
                "nodes": [{"id": i + 1, "x": x} for i, x in enumerate(ALONG)],
                "materials": {"steel": {"E": 207e9, "nu": 0.3, "rho": 7850.0}},
                "sections": {"s": section or {"shape": "circle", "diameter": 0.02}},
                "elements": elements,
            }
        )
    )


def context_of(model: Model) -> SearchContext:
    m = model.matrices()
    return SearchContext(model, m.K, m.M, TOP, 10.0, (), (), lambda node, kind: model, 0.005)


def found(model: Model) -> Effect:
    (candidate,) = Spin().candidates(context_of(model))
    assert candidate.change is not None
    return candidate


def at_spin(candidate: Effect, omega: float) -> tuple[Model, NDArray[np.float64]]:
    assert candidate.change is not None
    p = candidate.change.model.zero()
    p[-1] = omega / candidate.change.model.parameters[-1].unit_size
    return candidate.change.model, p


def test_the_word_is_the_element_of_the_problem_file() -> None:
    """Shaft and disc spin together about the beams' local x, whichever way an element points; the
    tangent is the whole of it."""
    candidate = found(rotor())
    assert (
        candidate.place.groups == ("shaft",)
        and candidate.place.elements == (1, 2, 3, 4)
        and candidate.sign == 0
    )
    model, p = at_spin(candidate, -310.0)
    wanted = rotor(spin=-310.0).matrices().C.toarray()
    np.testing.assert_allclose(
        model.matrices(p).C.toarray(), wanted, atol=1e-12 * np.abs(wanted).max()
    )
    slope = np.zeros((model.size + 1,) * 2)
    for b in candidate.change.tangent[0]:
        for dofs, small in zip(b.dofs, b.C, strict=True):
            slope[np.ix_(dofs, dofs)] += small
    dashpot = rotor().matrices().C.toarray()
    np.testing.assert_allclose(
        slope[:-1, :-1] * p[-1], wanted - dashpot, atol=1e-12 * np.abs(wanted).max()
    )


@pytest.mark.parametrize(
    "model",
    [
        rotor({"shape": "rectangle", "width": 0.02, "height": 0.025}, disc=(0.02, 0.011, 0.013)),
        rotor({"shape": "rectangle", "width": 0.02, "height": 0.025}, disc=(0.0, 0.0, 0.0)),
    ],
)
def test_what_is_not_round_cannot_spin(model: Model) -> None:
    """Its matrices would change as it turns."""
    assert Spin().candidates(context_of(model)) == []


def test_a_round_disc_on_a_flat_bar_can() -> None:
    (disc,) = Spin().candidates(
        context_of(rotor({"shape": "rectangle", "width": 0.02, "height": 0.025}))
    )
    assert disc.place.nodes == (3,) and disc.place.elements == ()


def measured(H: NDArray[np.complex128], epsilon: float) -> Signal:
    lines, sensors, inputs = LINES, SENSORS, INPUTS
    read, pushed = (
        tuple(Channel(int(label[1:].split(".")[0]), label.split(".")[1], of) for label in labels)
        for labels, of in ((sensors, "displacement"), (inputs, "force"))
    )
    frf = FrequencyResponse(
        Origin("lab", "test"),
        lines,
        H,
        "displacement",
        read,
        pushed,
        np.full(H.shape, (1e-4 * np.abs(H).max()) ** 2),
    )
    return signal_of(frf, epsilon)


SENSORS, INPUTS = ("n2.y", "n2.z", "n4.y", "n5.z"), ("n2.y", "n4.z")
LINES = np.arange(10.0, TOP, 0.5)


def laboratory(omega: float, zeta: float = 0.0) -> NDArray[np.complex128]:
    """The spinning rotor by dense inversion, with modal damping of the standing one."""
    m = rotor(spin=omega).matrices()
    K, M, C = (x.toarray() for x in (m.K, m.M, m.C))
    lam, phi = scipy.linalg.eigh(K, M)
    C = C + M @ phi @ np.diag(2 * zeta * np.sqrt(np.maximum(lam, 0.0))) @ phi.T @ M
    place = rotor().place
    s = 2j * np.pi * LINES[:, None, None]
    H = np.linalg.inv(s**2 * M + s * C + K)
    return np.asarray(H[:, [place[x] for x in SENSORS]][:, :, [place[x] for x in INPUTS]])


def setting(
    omega: float, zeta: float = 0.0, epsilon: float = 0.03, model: Model | None = None
) -> ResponseSetting:
    """Every mode among those that the skew matrix couples."""
    made = setting_for(
        at_spin(found(rotor()), omega)[0] if model is None else model,
        rotor(),
        (measured(laboratory(omega, zeta), epsilon),),
        1e4,
    )
    return replace(made, zeta=np.full(made.damped, zeta))


def test_the_response_with_a_skew_matrix_is_that_of_dense_algebra() -> None:
    chosen = setting(800.0)
    p = np.zeros(len(chosen.columns))
    p[len(chosen.model.parameters) - 1] = at_spin(found(rotor()), 800.0)[1][-1]
    point = chosen.evaluate(p)
    assert point.low >= point.modes.shapes.shape[1]
    wanted = laboratory(800.0)
    still = laboratory(0.0)
    size = np.abs(wanted).max()
    s = chosen.signals[0].s
    np.testing.assert_allclose(
        point.responses[0].raw,
        wanted[np.searchsorted(LINES, s.imag / 2 / np.pi - 1e-6)],
        atol=1e-8 * size,
    )
    assert np.abs(wanted - still).max() > 0.1 * size  # it is no trifle
    np.testing.assert_allclose(
        receptance(
            rotor(spin=800.0),
            LINES[::50],
            [chosen.model.place[x] for x in SENSORS],
            [chosen.model.place[x] for x in INPUTS],
        ),
        wanted[::50],
        atol=1e-9 * size,
    )


def test_reciprocity_is_lost_as_onsager_and_casimir_say() -> None:
    """H(Ω) = H(−Ω)ᵀ: turning the spin round exchanges force and sensor."""
    there, back = (
        receptance(rotor(spin=w), LINES[::20], np.arange(20), np.arange(20))
        for w in (800.0, -800.0)
    )
    np.testing.assert_allclose(there, np.swapaxes(back, 1, 2), atol=1e-10 * np.abs(there).max())
    assert np.abs(there - np.swapaxes(there, 1, 2)).max() > 0.05 * np.abs(there).max()


def test_derivatives_with_a_skew_matrix() -> None:
    """Spin, stiffness of the shaft, mass of the disc, dashpot, where it spins: against fourth-order
    differences."""
    wanted = [
        Wanted("shaft", "stiffness", (1, 2, 3, 4)),
        Wanted("disc", "mass", (20,)),
        Wanted("c", "c", (40,)),
    ]
    candidate = found(append_parameters(rotor(), wanted))
    model, p = at_spin(candidate, 800.0)
    chosen = setting(800.0, model=model)
    p = np.append(p, np.zeros(len(chosen.columns) - len(p)))
    point = chosen.evaluate(p)
    A = point.jacobian()
    for j in range(len(model.parameters)):
        rows = []
        for factor in (1, -1, 2, -2):
            step = np.zeros(len(p))
            step[j] = factor * 1e-5
            rows.append(chosen.evaluate(p + step, point).differences[0])
        central = (8 * (rows[0] - rows[1]) - (rows[2] - rows[3])) / 12e-5
        assert np.linalg.norm(A[:, j] - central) < 1e-6 * np.linalg.norm(central), chosen.columns[j]


@pytest.mark.parametrize("omega", [420.0, -420.0])
def test_the_spin_is_found_with_its_sign(omega: float) -> None:
    chosen = setting(omega, 0.01, 0.15)
    result = fitted(chosen, np.zeros(len(chosen.columns)), Options(1e-6, 40, 0.5))
    j = len(chosen.model.parameters) - 1
    assert chosen.model.parameters[j].physical(float(result.p[j])) == pytest.approx(omega, rel=1e-3)


def test_force_balance_refuses_what_spins() -> None:
    m: Matrices = rotor(spin=100.0).matrices()
    with pytest.raises(ModelError, match="gyroscopic"):
        condenser(m, np.array([0, 1]), np.array([0]))
    condenser(rotor().matrices(), np.array([0, 1]), np.array([0]))


def test_it_is_in_the_catalogue() -> None:
    (same,) = candidates_of(context_of(rotor()), ("gyroscopic",))
    assert same.key == found(rotor()).key
    assert Gyroscopic(1).dofs == ("rx", "ry", "rz")
