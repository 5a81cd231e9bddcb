"""The laboratory's structure under another boundary: the drawing and the bench change alike."""

from __future__ import annotations

from dataclasses import replace

import pytest

from cvxupdate.diagnose.apart import Apart, Measurement, MeasurementSet
from validation.boundary import left_of, under
from validation.generated.cases import draw
from validation.generated.laboratory import build, natural

GROUNDED = next(
    c for s in range(600, 700) if (c := draw(s)).design.family == "bar" and c.design.held
)


def lowest(case) -> float:
    return float(natural(build(case.design, {}, ()), 10.0 * case.top)[0][0])


@pytest.mark.parametrize(("kind", "sign"), [("mass", -1.0), ("spring", 1.0)])
def test_what_is_put_on_is_in_the_drawing(kind, sign):
    node = sorted(GROUNDED.design.nodes)[len(GROUNDED.design.nodes) // 2]
    held = {d for n, d in GROUNDED.design.held if n == node}
    dof = next(d for d in GROUNDED.design.dofs if d in ("x", "y", "z") and d not in held)
    change = Measurement(kind, "", (), node=node, mass=1.0, dof=dof, stiffness=1e5)
    there = under(GROUNDED, change)
    more = there.design.elements[-1]
    assert (more.kind, more.nodes, more.group) == (kind, (node,), "known")
    assert more.id not in {e.id for e in GROUNDED.design.elements}
    assert sign * (lowest(there) - lowest(GROUNDED)) > 0.0


def test_a_support_is_taken_away():
    node, dof = GROUNDED.design.held[0]
    there = under(GROUNDED, Measurement("support", "", (), node=node, dof=dof))
    assert set(GROUNDED.design.held) - set(there.design.held) == {(node, dof)}
    assert under(GROUNDED, Measurement("support", "", (), node=node, dof="none")) is None
    assert under(GROUNDED, Measurement("free", "", ())).design.held == ()


def test_a_plate_is_clamped_along_whole_edges():
    plate = replace(GROUNDED, design=replace(GROUNDED.design, family="plate"))
    node, dof = GROUNDED.design.held[0]
    assert under(plate, Measurement("support", "", (), node=node, dof=dof)) is None


def test_left_is_what_both_list():
    def finding(physics, *others):
        return {"physics": physics, "place": "n1", "equivalent": [named(o) for o in others]}

    def named(physics):
        return {"physics": physics, "place": "n1"}

    before = [finding("added_mass", "mass_change", "attached_resonator"), finding("clearance")]
    left = left_of(before, [finding("mass_change")])
    assert left == [[("mass_change", "n1")]]
    assert len(left_of(before, [finding("added_mass", "mass_change")])[0]) == 2
    assert len(left_of(before, [])[0]) == 3 and len(left_of(before, [finding("shear")])[0]) == 3


def test_the_set_is_proposed_unless_another_boundary_leaves_clearly_fewer():
    one = Measurement("mass", "a mass", (4.0,), left=1.0)
    several = MeasurementSet((Measurement("response", "", (1.0,)),), (5.0,), left=0.5)
    for left in (0.5, 0.95, 1.05):
        even = Apart((), (one,), together=replace(several, left=left))
        assert even.proposed == several.measurements and even.as_good(one) == (left > 0.9)
    single = replace(one, kind="response")
    assert Apart((), (single,), together=replace(several, left=0.95)).proposed == (single,)
    assert Apart((), (single,), together=several).proposed == several.measurements
    worse = Apart((), (one,), together=replace(several, left=1.2))
    assert worse.proposed == (one,)
    assert Apart((), (one,)).proposed == (one,) and Apart((), ()).proposed == ()
