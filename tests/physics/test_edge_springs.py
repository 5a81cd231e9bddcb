"""Supports along an edge that give way do so between their nodes, too: beside a plate on a fine
mesh with springs on its edge that were assembled by hand."""

from __future__ import annotations

from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import scipy.sparse as sp
from scipy.sparse.linalg import eigsh

from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.nominal.supports import held_dofs, regrown, release_from
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.errors import InputError
from cvxupdate.fe.analysis import analysis_of, as_stated
from cvxupdate.fe.build import build_model
from cvxupdate.fe.modes import model_modes
from cvxupdate.fe.refinement import refined
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.equal_supports import EqualSupports
from cvxupdate.physics.soft_support import SoftSupport
from cvxupdate.spec import check_problem, load_problem
from tests.fe.analysis.test_solid import B, H, read, sheet

RIGIDITY = 207e9 * H**3 / 12.0 / (1.0 - 0.3**2)
SHARED = {1: 50.0, 6: 100.0, 11: 100.0, 16: 50.0}  # N·m/rad
HELD = {"z": ("z",), "ry": ("z", "rx", "ry")}  # pinned edges that move, clamped ones that turn


def supports(nx: int, ny: int, near: tuple[str, ...], beyond: tuple[str, ...]) -> str:
    out = ""
    for i, dofs in ((0, near), (nx, beyond)):
        nodes = [1 + i + j * (nx + 1) for j in range(ny + 1)]
        if dofs:
            out += f"[[model.supports]]\nnodes = {nodes}\ndofs = {list(dofs)}\n".replace("'", '"')
    return out


def by_hand(tmp_path, nx: int, ny: int, dof: str, k: float) -> np.ndarray:
    """Frequencies (Hz) of a plate on nx × ny elements, whose near edge is on springs of k a metre:
    deflections are cubic between nodes, rotations about the edge linear."""
    near = tuple(d for d in HELD[dof] if d != dof)
    _, model = read(tmp_path, sheet(nx, ny, supports(nx, ny, near, HELD[dof])))
    m = model.matrices(model.zero())
    K, length = m.K.tolil(), B / ny
    points, weights = np.polynomial.legendre.leggauss(5)
    for j in range(ny):
        a, b = 1 + j * (nx + 1), 1 + (j + 1) * (nx + 1)
        for t, w in zip((1.0 + points) / 2.0, weights * length / 2.0, strict=True):
            N = {f"n{a}.ry": 1.0 - t, f"n{b}.ry": t}
            if dof == "z":
                N = {
                    f"n{a}.z": 1.0 - 3.0 * t**2 + 2.0 * t**3,
                    f"n{b}.z": 3.0 * t**2 - 2.0 * t**3,
                    f"n{a}.rx": (t - 2.0 * t**2 + t**3) * length,
                    f"n{b}.rx": (t**3 - t**2) * length,
                }
            for one, u in N.items():
                for other, v in N.items():
                    K[model.place[one], model.place[other]] += k * w * u * v
    found = eigsh(sp.csc_array(K), 6, sp.csc_array(m.M), sigma=-1.0)[0]
    return np.sqrt(np.sort(found)) / (2.0 * np.pi)


def grown(tmp_path, dof: str):
    spec, file = read(tmp_path, sheet(4, 3, supports(4, 3, HELD[dof], HELD[dof])))
    release = release_from(spec, Mesh(analysis_of(spec, file, 8)))
    base = release(0, dof)  # nothing is
    m = base.matrices(base.zero())
    place = cache(lambda n, k: regrown(release(n, k), base))
    held = held_dofs(spec, file)
    return SearchContext(base, m.K, m.M, 900.0, 20.0, ("n8.z",), held, place, 0.01)


@pytest.mark.parametrize("dof", ["z", "ry"])
def test_an_edge_on_springs_is_that_of_a_fine_mesh(tmp_path, dof):
    context = grown(tmp_path, dof)
    nodes = (1, 6, 11, 16)
    effect = next(
        e
        for e in EqualSupports().candidates(context)
        if e.place.nodes == nodes and e.place.dof == dof
    )
    model = effect.change.model
    unit, a0 = model.parameters[-1].unit_size, float(model.blocks[-1].properties["a0"][0])
    p = model.zero()
    rigid = model_modes(context.model, 6).frequencies
    np.testing.assert_allclose(model_modes(model, 6, p).frequencies, rigid, rtol=2e-4)
    for part in (0.01, 1.0, 100.0):
        k = part * RIGIDITY / (B**3 if dof == "z" else B)
        p[-1] = (len(nodes) / (k * B) - a0) / unit
        coarse, fine = (by_hand(tmp_path, 20 * n, 15 * n, dof, k) for n in (1, 2))
        own = model_modes(model, 6, p).frequencies
        np.testing.assert_allclose(own, (4.0 * fine - coarse) / 3.0, rtol=5e-4)


def test_one_support_gives_way_with_its_part_of_the_edge(tmp_path):
    """Rigid, it is as all are; soft, the edge moves there and is held beside it; its springs and
    those of its neighbours together are those of the edge."""
    context = grown(tmp_path, "z")
    effect = next(e for e in SoftSupport().candidates(context) if e.place.nodes == (6,))
    model = effect.change.model
    free = model.labels[context.model.size :]
    assert {x.split(" of ")[1].split()[0] for x in free[1:]} == {"1-6", "6-11"}
    rigid = model_modes(context.model, 5).frequencies
    np.testing.assert_allclose(model_modes(model, 5).frequencies, rigid, rtol=1e-4)
    p = model.zero()
    p[-1] = 1e3
    softer = model_modes(model, 5, p)
    assert np.all(softer.frequencies < rigid * (1.0 - 1e-4))
    across = np.array([x.endswith(".z") for x in model.labels])
    first = np.abs(softer.shapes[:, 0])
    assert first[model.place["n6.z"]] > 0.01 * first[across].max()


@pytest.mark.parametrize("dof", ["z", "ry"])
def test_it_is_written_as_springs_at_the_nodes(tmp_path, dof):
    """With the stiffness of the whole edge between them."""
    context = grown(tmp_path, dof)
    effect = next(
        e
        for e in EqualSupports().candidates(context)
        if e.place.nodes == (1, 6, 11, 16) and e.place.dof == dof
    )
    model = effect.change.model
    k = RIGIDITY / (B**3 if dof == "z" else B)
    a0, unit = float(model.blocks[-1].properties["a0"][0]), model.parameters[-1].unit_size
    p = model.zero()
    p[-1] = (4.0 / (k * B) - a0) / unit
    spec = load_problem(tmp_path / "problem.toml")
    found = Updated(model, p, zeta=np.zeros(1), refine=8, solid=False)
    path = tmp_path / "again.toml"
    path.write_text(problem_file(spec, found).text, encoding="utf-8")
    assert check_problem(path) == ()
    again = load_problem(path)
    springs = [r for b in again.model.elements if b.type == "spring" for r in b.rows]
    assert [r.nodes for r in springs] == [(1,), (6,), (11,), (16,)]
    parts = np.array([1.0, 2.0, 2.0, 1.0]) / 6.0
    np.testing.assert_allclose([r.k for r in springs], parts * k * B, rtol=1e-4)
    assert all(r.edge for r in springs)
    wanted = model_modes(model, 6, p).frequencies
    own = model_modes(as_stated(again, build_model(again)), 6).frequencies
    np.testing.assert_allclose(own, wanted, rtol=2e-3)
    fine = refined(again.model, lambda block, row: 4).model
    divided = model_modes(build_model(replace(again, model=fine, update=None)), 6).frequencies
    np.testing.assert_allclose(divided, wanted, rtol=5e-3)


@pytest.mark.parametrize("dof", ["z", "ry"])
def test_springs_of_an_edge_hold_it_on_any_mesh(tmp_path, dof):
    """Springs of nodes alone let it turn between them the more the finer it is."""
    near = tuple(d for d in HELD[dof] if d != dof)
    text, k = sheet(4, 3, supports(4, 3, near, HELD[dof])), RIGIDITY / (B if dof == "ry" else B**3)
    share = {1: 0.5, 6: 1.0, 11: 1.0, 16: 0.5}

    def lowest(edge: bool, parts: int) -> float:
        rows = [
            f"{{ id = {100 + n}, nodes = [{n}], k = {300.0 * k * B * x}, edge = {edge} }}".lower()
            for n, x in share.items()
        ]
        own = f'[[model.elements]]\ntype = "spring"\ndof = "{dof}"\nrows = [{", ".join(rows)}]\n'
        spec, _ = read(tmp_path, text + own)
        fine = refined(spec.model, lambda block, row: parts).model
        return float(
            model_modes(build_model(replace(spec, model=fine, update=None)), 1).frequencies[0]
        )

    spread, lumps = ([lowest(edge, n) for n in (2, 8)] for edge in (True, False))
    assert spread[1] == pytest.approx(spread[0], rel=0.01)
    assert dof == "z" or lumps[1] < 0.98 * spread[1]


def test_stiffness_of_an_edge_is_shared_and_not_lost(tmp_path):
    """Of equal springs a metre, beside a support too, towards which they stiffen."""
    text = sheet(4, 3, supports(4, 3, ("z",), HELD["ry"]))
    rows = [f"{{ id = {100 + n}, nodes = [{n}], k = {k}, edge = true }}" for n, k in SHARED.items()]
    own = f'[[model.elements]]\ntype = "spring"\ndof = "ry"\nrows = [{", ".join(rows)}]\n'
    spec, _ = read(tmp_path, text + own)
    fine = refined(spec.model, lambda block, row: 5).model
    springs = [r for b in fine.elements if b.type == "spring" for r in b.rows]
    assert len(springs) == 4 + 3 * 4
    assert sum(r.k for r in springs) == pytest.approx(sum(SHARED.values()))
    assert {r.id for r in springs} == {101, 106, 111, 116}
    renumbered = refined(spec.model, lambda block, row: 5, renumber=True).model
    ids = [r.id for b in renumbered.elements for r in b.rows]
    assert len(set(ids)) == len(ids)


def test_two_springs_at_a_node_add_up(tmp_path):
    """On finer parts, those of the file and those of the analysis, as on the file's own."""
    text = sheet(4, 3, supports(4, 3, ("z",), HELD["ry"]))

    def first(times: int) -> tuple[float, float]:
        rows = [
            f"{{ id = {100 * i + n}, nodes = [{n}], k = {2e2 * k / times}, edge = true }}"
            for n, k in SHARED.items()
            for i in range(1, 1 + times)
        ]
        own = f'[[model.elements]]\ntype = "spring"\ndof = "ry"\nrows = [{", ".join(rows)}]\n'
        spec, model = read(tmp_path, text + own)
        fine = build_model(replace(spec, model=refined(spec.model, lambda b, r: 3).model))
        analysis = analysis_of(spec, model, 8)
        assert analysis is not None
        return tuple(float(model_modes(m, 1).frequencies[0]) for m in (fine, analysis.on(model)))

    np.testing.assert_allclose(first(2), first(1), rtol=1e-9)


def test_a_spring_between_two_nodes_holds_no_edge(tmp_path):
    text = sheet(4, 3, supports(4, 3, ("z",), HELD["ry"]))
    own = '[[model.elements]]\ntype = "spring"\nrows = [{ id = 99, nodes = [1, 6], dof = "ry", '
    with pytest.raises(InputError, match="edge: is for springs to ground; element 99 joins two"):
        read(tmp_path, text + own + "k = 1.0, edge = true }]\n")
