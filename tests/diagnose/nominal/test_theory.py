"""What Euler's beams on centre lines leave out: nuisance parameters where it is small and matters,
nothing where it does not, a finding where it is large."""

from __future__ import annotations

from types import SimpleNamespace

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.mesh import shearing
from cvxupdate.diagnose.nominal.refinement import Wanted, fine_enough, shift_between
from cvxupdate.diagnose.nominal.scatter import prior_scales, with_nuisance
from cvxupdate.diagnose.nominal.theory import (
    GROUP,
    SIZES,
    other,
    stocky,
    theory_lines,
    theory_of,
    with_theory,
)
from cvxupdate.errors import ModelError
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.positive_mass import check_mass
from tests.cases.elements import FLAT_Y, POINTS, SPACE, build, chain, lines
from tests.diagnose.nominal.test_refinement import STOCKY, load
from tests.fe.analysis.test_corners import portal


def mesh_of(spec, model, enough):
    top = 1.1 * model_modes(model, 5).flexible().frequencies[-1]
    return fine_enough(
        spec, model, Wanted(top, 1e-5, enough, lambda a, b: shift_between(a, b, top))
    )


@pytest.fixture
def frame(tmp_path):
    from cvxupdate.fe.build import build_model

    spec = portal(tmp_path, 0.0)
    return spec, build_model(spec)


def test_a_slender_frame_may_shear_and_be_stiff_at_its_corners(frame):
    spec, model = frame
    mesh = mesh_of(spec, model, 1e-4)
    assert mesh.theory == ("shear", "rotary", "corner") and not mesh.stocky
    own = with_nuisance(mesh.on(model), theory=mesh.theory)
    extra = {q.of: (j, q) for j, q in enumerate(own.parameters) if q.group == GROUP}
    for word in ("shear", "corner"):
        (j, q), (most, deviation) = extra[word], SIZES[word]
        assert (q.lower, q.upper) == (0.0, most) and prior_scales(own)[j] == deviation
    p = own.zero()
    p[extra["corner"][0]] = 1.0
    stiffer = model_modes(own, 5, p).frequencies
    np.testing.assert_allclose(
        stiffer, model_modes(with_theory(mesh.on(model), "corner"), 5).frequencies
    )
    assert np.all(stiffer > model_modes(own, 5).frequencies)
    line, turning = theory_lines(own, SimpleNamespace(p=p, misfit=1.0))
    bare, _ = theory_lines(own, SimpleNamespace(p=p, misfit=1e3))
    assert turning.startswith("Sections of beams may resist turning or not (1.0 of it)")
    assert bare.startswith("Beams may deform in shear and be stiffer within")
    assert "shear (none of" in line and "factor of 2" in line and "no finding" in line


def test_where_it_changes_nothing_that_is_heard_there_is_none(frame):
    spec, model = frame
    assert mesh_of(spec, model, 0.1).theory == ()
    assert theory_lines(with_nuisance(model), SimpleNamespace(p=[], misfit=1.0)) == []


def test_shear_that_shifts_frequencies_by_much_is_a_finding(tmp_path):
    """Of a bar eight depths long it is no matter of theory, turning is one; it has no corners."""
    spec, model = load(tmp_path, STOCKY)
    mesh = mesh_of(spec, model, 1e-4)
    assert mesh.theory == ("rotary",) and mesh.stocky
    own = shearing(model)
    assert not stocky(own, lambda a, b: 1.0, 0.01), "it has shear already"


def test_a_clamped_edge_may_hold_from_before_its_line_on(tmp_path):
    from tests.fe.analysis.test_solid import CLAMPED, read, sheet

    spec, model = read(tmp_path, sheet(4, 3, CLAMPED))
    mesh = mesh_of(spec, model, 1e-4)
    assert mesh.theory == ("lag", "turning", "clamp")
    own = with_nuisance(mesh.on(model), theory=mesh.theory)
    (j,) = [j for j, q in enumerate(own.parameters) if q.of == "clamp"]
    q, (most, deviation) = own.parameters[j], SIZES["clamp"]
    assert (q.name, q.lower, q.upper) == ("clamp of sheets", 0.0, most)
    assert prior_scales(own)[j] == deviation
    p = own.zero()
    p[j] = 0.25
    _, line = theory_lines(own, SimpleNamespace(p=p, misfit=1.0))
    assert "(0.25 of it)" in line and "no finding" in line


def test_a_free_sheet_goes_from_a_solid_to_kirchhoffs(tmp_path):
    """With nothing of its theory left it has the modes of the thin plate; it has no clamp."""
    from tests.fe.analysis.test_solid import read, sheet

    spec, model = read(tmp_path, sheet(4, 3))
    mesh = mesh_of(spec, model, 1e-4)
    assert mesh.theory == ("lag", "turning")
    own = with_nuisance(mesh.on(model), theory=mesh.theory)
    extra = {q.of: j for j, q in enumerate(own.parameters) if q.group == GROUP}
    assert [(own.parameters[j].lower, own.parameters[j].upper) for j in extra.values()] == [
        (-1.0, 0.0),
        (-1.0, 0.0),
    ]
    p = own.zero()
    p[list(extra.values())] = -1.0
    thin = analysis_of(spec, model, mesh.analysis.parts).only(frozenset(mesh.analysis.families))
    f = model_modes(own, 9, p).flexible().frequencies
    np.testing.assert_allclose(f, model_modes(thin.on(model), 9).flexible().frequencies, rtol=2e-5)
    assert np.all(f > 1.0005 * model_modes(own, 9).flexible().frequencies)
    p[extra["turning"]] = -0.25
    (line,) = theory_lines(own, SimpleNamespace(p=p, misfit=1.0))
    assert "in shear (none of it) and resist turning (0.75 of it)" in line and "no finding" in line


def test_of_a_thick_sheet_every_end_that_is_tried_is_a_structure(tmp_path):
    """Lagging behind in shear without turning is none: of a sheet 16 thicknesses wide its inertia
    is negative, and what was diagnosed then were the file's own thin elements."""
    from tests.fe.analysis.test_solid import B, read, sheet

    spec, model = read(tmp_path, sheet(4, 3, h=B / 16.0))
    found = analysis_of(spec, model, 8, solid=True)
    assert found is not None

    def differ(*models):
        for m in models:
            check_mass(m.matrices(m.zero()).M, m.size)
        return 1.0

    thick = found.on(model)
    told = theory_of(thick, differ, lambda a, b: 0.0, 0.5, 0.01)
    assert told[:2] == ("lag", "turning")
    with pytest.raises(ModelError, match="negative eigenvalue"):
        differ(other(thick, "turning"))


def test_a_sheet_whose_theory_is_not_heard_has_no_parameter_of_it(tmp_path):
    from tests.fe.analysis.test_solid import read, sheet

    spec, model = read(tmp_path, sheet(4, 3))
    assert mesh_of(spec, model, 0.1).theory == ()


def beam(kind="beam3d", **words):
    return build(lines(kind, POINTS, chain(3), SPACE, "bar", **words))


def words(model, shift):
    """Of a change that is heard and shifts frequencies by so much."""
    return theory_of(model, lambda a, b: 1.0, lambda a, b: shift, 0.5, 0.01)


@pytest.mark.parametrize("has", [True, False])
def test_sections_turn_from_what_the_file_says_to_the_other(has):
    """With the whole of the parameter a model has the modes of the file that says the other (in a
    plane: what turns about its own axis, the file alone says)."""

    def bending(has):
        dofs = ["x", "y", "rz"]
        return build(lines("beam2d", FLAT_Y, chain(3), dofs, "general", rotary_inertia=has))

    model, file = bending(has), bending(not has)
    own = with_nuisance(model, theory=("rotary",))
    (j,) = [j for j, q in enumerate(own.parameters) if q.of == "rotary"]
    q = own.parameters[j]
    assert (q.lower, q.upper) == ((-1.0, 0.0) if has else (0.0, 1.0))
    p = own.zero()
    p[j] = -1.0 if has else 1.0
    for there in (model_modes(own, 8, p), model_modes(other(model, "rotary"), 8)):
        np.testing.assert_allclose(there.eigenvalues, model_modes(file, 8).eigenvalues, rtol=1e-9)


def test_nothing_turns_in_lumped_mass_nor_in_an_exact_member():
    for model in (beam(mass="lumped"), beam("exact_beam")):
        assert words(model, 0.0) == ("shear",)
        own = with_nuisance(model, theory=("rotary",))
        assert not [q for q in own.parameters if q.group == GROUP]


def test_rotary_inertia_is_a_switch_however_much_it_shifts_frequencies():
    """No finding says it: a stocky bar without was told as softer and stiffer elements."""
    assert words(beam(), 0.005) == ("shear", "rotary")
    assert words(beam(), 0.02) == ("rotary",)
