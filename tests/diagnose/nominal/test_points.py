"""Sheets that are held at points give way there, if they are thick enough for it to be heard."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.modes.worth import mesh_for
from cvxupdate.diagnose.nominal.points import compliance, giving, on_points, points_of
from cvxupdate.diagnose.nominal.scatter import prior_scales, with_nuisance
from cvxupdate.diagnose.nominal.supports import elements_of, release_from
from cvxupdate.diagnose.nominal.theory import POINT, SIZES, theory_lines
from cvxupdate.diagnose.nominal.written import sayable
from cvxupdate.fe.modes import model_modes
from tests.fe.analysis.test_solid import CLAMPED, read, sheet

CORNERS = '[[model.supports]]\nnodes = [1, 5, 16, 20]\ndofs = ["z"]\n'
AT = ((1, "z"), (5, "z"), (16, "z"), (20, "z"))
G, THICK = 207e9 / 2.6, 0.015


def test_points_are_those_without_a_neighbour(tmp_path):
    assert points_of(read(tmp_path, sheet(4, 3, CORNERS))[1]) == AT
    assert points_of(read(tmp_path, sheet(4, 3, CLAMPED))[1]) == ()
    assert points_of(read(tmp_path, sheet(4, 3))[1]) == ()
    beam = (
        '[model.sections.leg]\nshape = "rectangle"\nwidth = 0.02\nheight = 0.02\n'
        '[[model.elements]]\ntype = "beam3d"\nmaterial = "steel"\nsection = "leg"\n'
        "rows = [{ id = 90, nodes = [1, 2] }]\n"
    )
    there = points_of(read(tmp_path, sheet(4, 3, beam + CORNERS))[1])
    assert there == AT[1:], "a leg stands at the other"


def test_rigid_until_they_give_way_by_what_theory_says(tmp_path):
    _, model = read(tmp_path, sheet(4, 3, CORNERS, h=THICK))
    unit = compliance(model, [0, 4])
    assert unit == pytest.approx(1.0 / (np.pi / 2.0 * 5.0 / 6.0 * G * THICK))
    free = on_points(model, AT)
    assert free.size == model.size + 4 and free.labels[-4:] == tuple(f"n{n}.z" for n, _ in AT)
    f, held, soft = (
        model_modes(m, 5).frequencies for m in (model, free, giving(free, SIZES[POINT][1]))
    )
    np.testing.assert_allclose(held, f, rtol=1e-3)
    assert np.all(soft < 0.999 * f)
    assert on_points(model, ()) is model


def test_where_it_is_heard_it_is_a_nuisance_parameter(tmp_path):
    spec, model = read(tmp_path, sheet(4, 3, CORNERS, h=THICK))
    mesh = mesh_for(spec, model, 1.2 * model_modes(model, 4).frequencies[3], True)
    assert mesh.points == AT and POINT in mesh.theory
    own = with_nuisance(mesh.on(model), theory=mesh.theory)
    (j,) = [j for j, q in enumerate(own.parameters) if q.of == POINT]
    q, (most, deviation) = own.parameters[j], SIZES[POINT]
    assert (q.lower, q.upper) == (0.0, most) and prior_scales(own)[j] == deviation
    p = own.zero()
    p[j] = 6.0
    np.testing.assert_allclose(
        model_modes(own, 5, p).frequencies,
        model_modes(giving(mesh.on(model), 6.0), 5).frequencies,
        rtol=1e-9,
    )
    (line,) = [x for x in theory_lines(own, SimpleNamespace(p=p, misfit=1.0)) if "point holds" in x]
    assert "(by 6.0 / θκGh)" in line and "no finding" in line
    assert sayable(own, p)[2] == [], "a file has springs for it"
    # neither scatters its stiffness with the groups, nor is an element that may be otherwise
    (springs,) = [b for b in own.blocks if b.kind.name == "compliance"]
    assert not any(set(springs.ids) & set(q.elements) for q in own.parameters if q.of != POINT)
    assert not elements_of(own) & set(springs.ids.tolist())
    freed = release_from(spec, mesh)(1, "z")
    assert "n5.z" in freed.place


def test_a_thin_sheet_is_held_rigidly(tmp_path):
    spec, model = read(tmp_path, sheet(4, 3, CORNERS, h=0.001))
    mesh = mesh_for(spec, model, 1.2 * model_modes(model, 4).frequencies[3], True)
    assert mesh.finer and mesh.points == () and POINT not in mesh.theory
