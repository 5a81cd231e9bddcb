"""A member of a family is read as the physical element that it is, and says how far it is from
any."""

import numpy as np
import pytest

from cvxupdate.fe.generic.reading import Reading, reading
from cvxupdate.fe.model import Model
from tests.cases.elements import SECTIONS, STEEL, chain, held, lines
from tests.cases.structures import structure

SPAN = [(0.0, 0.0, 0.0), (0.3, 0.4, 0.0)]
DOFS = ["x", "y", "z", "rx", "ry", "rz"]


def one(kind: str = "beam3d", **extra: object) -> Model:
    tables = held(lines(kind, SPAN, chain(1), DOFS, **extra), ([1], DOFS))
    return structure(tables, [{"elements": "all", "of": "generic"}])[1]


def read(model: Model, matrix: str, P: np.ndarray | None = None) -> Reading:
    use = next(u for u in model.families if u.matrix == matrix)
    family = use.families[0]
    if P is None:
        return reading(use, np.zeros(len(use.columns)))
    return reading(use, family.parameters(P))


def nominal(model: Model, matrix: str) -> np.ndarray:
    family = next(u for u in model.families if u.matrix == matrix).families[0]
    return family.member(np.diag(family.values))


def value(found: Reading, name: str) -> tuple[float | None, float | None]:
    q = next(q for q in found.quantities if q.name == name)
    return q.before, q.after


def test_a_beam_is_read_as_its_section() -> None:
    """EA, GJ and both EI of the section, whatever its place; no shear."""
    model = one()
    found = read(model, "K")
    c = model.blocks[0].kind.coefficients(model.blocks[0].properties)
    for name, coefficient in (
        ("EA", "EA"),
        ("GJ", "GJ"),
        ("EI, softer plane", "EIy.0"),
        ("EI, stiffer plane", "EIz.0"),
    ):
        size = float(np.asarray(c[coefficient])[0])
        assert value(found, name) == pytest.approx((size, size), rel=1e-9)
    assert value(found, "κGA, softer plane") == (None, None)
    assert found.says == "all.K: as it was." and found.distance < 1e-9


def test_a_beam_that_shears_is_found_in_the_family_of_one_that_does_not() -> None:
    """The Timoshenko element of the same section is a member: read with its own κGA, at no
    distance."""
    model, sheared = one(), one(section={**SECTIONS["bar"], "kappa": 0.85})
    found = read(model, "K", nominal(sheared, "K"))
    G = STEEL["E"] / 2.0 / (1.0 + STEEL["nu"])
    for name in ("κGA, softer plane", "κGA, stiffer plane"):
        before, after = value(found, name)
        assert before is None
        assert after == pytest.approx(0.85 * G * 0.1 * 0.012, rel=1e-6)
    assert found.distance < 1e-9 and "κGA" in found.says


def test_a_beam_stiffer_across_than_any_is_far_from_all() -> None:
    """The shear stiffness of a beam that does not shear is the largest there is."""
    model = one()
    use = next(u for u in model.families if u.matrix == "K")
    E = next(e for e in range(len(use.columns)) if _across(use.families[0].vectors[:, e]))
    p = np.zeros(len(use.columns))
    p[E] = 0.5
    found = reading(use, p)
    assert found.distance > 0.05 and found.unread > 0.3 and found.most == pytest.approx(1.5)


def _across(mode: np.ndarray) -> bool:
    """Whether the ends of a mode turn alike, which no constant curvature does."""
    first, second = mode[3:6], mode[9:12]
    return bool(np.linalg.norm(first + second) > 1.5 * np.linalg.norm(first))


def test_lumps_are_read_from_a_mass() -> None:
    """30 g and a rotary inertia on each node, and 5 % more of its own."""
    model = one()
    M = nominal(model, "M")
    lump = np.diag([0.03] * 3 + [2e-5] * 3 + [0.03] * 3 + [2e-5] * 3)
    found = read(model, "M", 1.05 * M + lump)
    own = STEEL["rho"] * 0.1 * 0.012 * 0.5
    assert value(found, "mass") == pytest.approx((own, 1.05 * own + 0.06), rel=1e-9)
    assert value(found, "factor")[1] == pytest.approx(1.05, rel=1e-6)
    assert value(found, "lump on each node")[1] == pytest.approx(0.03, rel=1e-6)
    assert value(found, "rotary lump on each node")[1] == pytest.approx(2e-5, rel=1e-5)
    assert value(found, "offset of its centre")[1] == pytest.approx(0.0, abs=1e-9)
    assert found.distance < 1e-9


def test_what_is_unlike_any_says_so() -> None:
    model = one()
    family = next(u for u in model.families if u.matrix == "M").families[0]
    rng = np.random.default_rng(4)
    p = np.array([rng.normal() * 0.1 for _ in family.entries])
    found = reading(next(u for u in model.families if u.matrix == "M"), p)
    assert found.distance > 0.02 and 0.2 < found.unread <= 1.0
    assert found.least < 1.0 < found.most
    np.testing.assert_allclose(
        found.X, family.relative(p) * np.outer(family.sizes, family.sizes), rtol=1e-12
    )


def test_a_beam_beside_its_nodes_is_read_with_its_offset() -> None:
    """Axis and shear centre 8 mm off in one plane, 3 mm in the other (classes "none": mirrors
    forbid both): EI and GJ are those of the section, at no distance."""
    tables = held(lines("beam3d", SPAN, chain(1), DOFS), ([1], DOFS))
    model = structure(
        tables, [{"elements": "all", "of": "generic", "family": {"classes": "none"}}]
    )[1]
    use = next(u for u in model.families if u.matrix == "K")
    shape = use.shapes[0]
    assert shape is not None
    _, y, z = next(shape.frames(nominal(model, "K")))
    away = 0.008 * y + 0.003 * z
    T = np.eye(12)
    for node in (0, 6):  # u of the axis = u + θ × away
        for k in range(3):
            T[node : node + 3, node + 3 + k] = np.cross(np.eye(3)[k], away)
    found = read(model, "K", T.T @ nominal(model, "K") @ T)
    assert value(found, "offset of its axis, softer plane")[1] == pytest.approx(0.008, rel=1e-6)
    assert value(found, "offset of its axis, stiffer plane")[1] == pytest.approx(0.003, rel=1e-6)
    for plane, size in (("softer", 0.008), ("stiffer", 0.003)):
        name = f"offset of its shear centre, {plane} plane"
        assert found.distance < 1e-9
        assert value(found, name) == (0.0, pytest.approx(size, rel=1e-6))
    for name in ("EA", "GJ", "EI, softer plane", "EI, stiffer plane"):
        before, after = value(found, name)
        assert after == pytest.approx(before, rel=1e-6)


def test_what_a_mass_lost_is_no_negative_lump() -> None:
    """Nine tenths of a mass whose centre line was made lighter than that: no part of the nearest
    physical element is less than nothing, and the sentence says how much of the change it has."""
    model = one()
    M = nominal(model, "M")
    lump = np.diag([0.01] * 3 + [1e-6] * 3 + [0.01] * 3 + [1e-6] * 3)
    found = read(model, "M", 0.9 * M - lump * 0.1)
    assert all(q.after is not None and q.after >= 0.0 for q in found.quantities)
    assert value(found, "lump on each node") == (0.0, 0.0)
    factor = value(found, "factor")[1]
    assert factor is not None and 0.7 < factor < 0.9
    assert "all of it as a physical element" in read(model, "M", 0.9 * M).says
    assert " % of that change; " in found.says or "all of it" in found.says
