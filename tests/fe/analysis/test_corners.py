"""Members that are stiff where they meet: against frames with short members that hardly bend."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.analysis.corners import corner_names, corner_nodes, corner_terms
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.spec import load_problem

DEPTH, LEG, SPAN = 0.02, 0.6, 0.9
HEAD = """
title = "Portal"
[model]
dofs = ["x", "z", "ry"]
[model.materials.steel]
E = 207e9
nu = 0.3
rho = 7850.0
[model.materials.firm]
E = 207e12
nu = 0.3
rho = 7850.0
[model.sections.bar]
shape = "rectangle"
width = 0.03
height = 0.02
[[model.supports]]
nodes = [1, 4]
dofs = ["x", "z", "ry"]
"""


def portal(folder, stub):
    """Two legs, one twice as long as the other, and a beam with a node in it; with members of the
    length ``stub`` (0: none) that hardly bend at both corners."""
    xz = {1: (0.0, 0.0), 2: (0.0, 2 * LEG), 3: (SPAN, LEG), 4: (SPAN, 0.0)}
    slope = np.subtract(xz[3], xz[2]) / np.linalg.norm(np.subtract(xz[3], xz[2]))
    xz[5] = tuple(np.add(xz[2], 0.4 * np.subtract(xz[3], xz[2])))
    soft, firm = [(1, 2), (2, 5), (5, 3), (4, 3)], []
    if stub:
        xz[6], xz[7] = (0.0, 2 * LEG - stub), (SPAN, LEG - stub)
        xz[8], xz[9] = np.add(xz[2], stub * slope), np.subtract(xz[3], stub * slope)
        soft, firm = [(1, 6), (8, 5), (5, 9), (4, 7)], [(6, 2), (2, 8), (9, 3), (7, 3)]
    nodes = ", ".join(f"{{ id = {n}, x = {x}, z = {z} }}" for n, (x, z) in xz.items())
    text = HEAD.replace("[model]\n", f"[model]\nnodes = [{nodes}]\n")
    for material, pairs, first in (("steel", soft, 1), ("firm", firm, 11)):
        rows = ", ".join(
            f"{{ id = {first + k}, nodes = [{a}, {b}] }}" for k, (a, b) in enumerate(pairs)
        )
        if rows:
            text += (
                f'[[model.elements]]\ntype = "beam2d"\nmaterial = "{material}"\n'
                f'section = "bar"\nrows = [{rows}]\n'
            )
    path = folder / f"problem{stub > 0}.toml"
    path.write_text(text, encoding="utf-8")
    return load_problem(path)


def with_corners(model, value):
    blocks = (
        replace(b, properties={**b.properties, "corner": np.full(len(b.ids), value)})
        for b in model.blocks
    )
    return replace(model, blocks=tuple(blocks))


def test_frequencies_rise_as_with_members_that_hardly_bend(tmp_path):
    """To first order in the length of what does not bend: of a fifth of half a depth, the next
    order is a tenth."""
    part = 0.2
    spec = portal(tmp_path, 0.0)
    model = build_model(spec)
    plain = analysis_of(spec, model, 8, solid=True).on(model)
    before = model_modes(plain, 3).frequencies
    rise = model_modes(with_corners(plain, part), 3).frequencies / before - 1.0
    firm = portal(tmp_path, part * DEPTH / 2.0)
    fine = refined(firm.model, lambda block, row: 16 if row.id < 11 else 1).model
    true = model_modes(build_model(replace(firm, model=fine, update=None)), 3).frequencies
    np.testing.assert_allclose(rise, true / before - 1.0, rtol=0.15)
    assert np.all(rise > 1e-3)


@pytest.mark.parametrize("ends", [(True, False), (False, True)])
def test_what_is_near_an_end_counts_twice(tmp_path, ends):
    """Against the integral of the cubics' curvature, as far as half a depth."""
    model = build_model(portal(tmp_path, 0.0))
    block = model.blocks[0]
    rows, dofs = np.array([1]), block.dofs[1]
    L = float(np.linalg.norm(np.subtract(*model.xyz[block.nodes[1]])))
    ((_, name),) = corner_names(block)
    (found,) = corner_terms(block, rows, dofs, ends, L)
    assert name == "cornery"
    xi, weight = np.polynomial.legendre.leggauss(3)
    reach = DEPTH / 2.0 / L
    xi, weight = (xi + 1.0) / 2.0 * reach, weight / 2.0 * reach
    xi = xi if ends[0] else 1.0 - xi
    curved = np.stack([-6 + 12 * xi, L * (-4 + 6 * xi), 6 - 12 * xi, L * (-2 + 6 * xi)])
    across = np.array([model.xyz[n] for n in block.nodes[1]])
    e = (across[1] - across[0]) / L
    # displacement across and slope of each end by (x, z, ry)
    one = np.array([[-e[2], e[0], 0.0], [0.0, 0.0, -1.0]])
    T = np.block([[one, np.zeros((2, 3))], [np.zeros((2, 3)), one]])
    energy = T.T @ ((curved * weight) @ curved.T / L**3) @ T
    place = np.argsort(np.argsort(dofs))
    np.testing.assert_allclose(found[np.ix_(place, place)], energy, rtol=1e-9, atol=1e-9 * L**-3)


def test_corners_are_where_members_meet_at_an_angle(tmp_path):
    model = build_model(portal(tmp_path, 0.0))
    assert {int(model.node_ids[n]) for n in corner_nodes(model)} == {2, 3}


def test_nothing_changes_unless_it_is_asked_for(tmp_path):
    """Nor where sheets and lines are taken as their theory has them."""
    spec = portal(tmp_path, 0.0)
    model = build_model(spec)
    plain, solid = (analysis_of(spec, model, 4, solid=s).on(model) for s in (False, True))
    np.testing.assert_allclose(
        model_modes(plain, 6).frequencies, model_modes(solid, 6).frequencies, rtol=1e-10
    )
