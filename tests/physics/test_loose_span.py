"""A part of an edge that is loose: where it is sought, and that one number says what it does."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from cvxupdate.diagnose.nominal.refinement import Mesh
from cvxupdate.diagnose.nominal.supports import held_dofs, regrown, release_from
from cvxupdate.diagnose.output.export import problem_file
from cvxupdate.diagnose.results import Updated
from cvxupdate.fe.analysis import analysis_of
from cvxupdate.fe.modes import model_modes
from cvxupdate.physics.context import SearchContext
from cvxupdate.physics.loose_span import LooseSpan, rows, spans
from cvxupdate.spec import check_problem, load_problem
from tests.fe.analysis.test_solid import read, sheet

NX, NY = 4, 5


def clamped(nx: int, ny: int, gone: range = range(0)) -> str:
    nodes = [1 + j * (nx + 1) for j in range(ny + 1) if j not in gone]
    nodes += [nx + 1 + j * (nx + 1) for j in range(ny + 1)]
    return f'[[model.supports]]\nnodes = {nodes}\ndofs = ["z", "rx", "ry"]\n'


@pytest.fixture
def context(tmp_path):
    spec, file = read(tmp_path, sheet(NX, NY, clamped(NX, NY)))
    release = release_from(spec, Mesh(analysis_of(spec, file, 8)))
    base = release(0, "z")
    m = base.matrices(base.zero())
    place = cache(lambda n, k: regrown(release(n, k), base))
    held = held_dofs(spec, file)
    return SearchContext(base, m.K, m.M, 900.0, 20.0, ("n8.z",), held, place, 0.01)


def test_every_edge_has_its_row_and_its_spans(context):
    found = dict(rows(context))
    assert found == {
        (1, 6, 11, 16, 21, 26): ("z", "rx", "ry"),
        (5, 10, 15, 20, 25, 30): ("z", "rx", "ry"),
    }
    parts = list(spans((1, 6, 11, 16, 21, 26)))
    assert (6, 11) in parts and (1,) in parts and (1, 6, 11, 16) in parts
    assert all(len(p) < 6 for p in parts), "all of them are an edge, and no part of it"


def test_one_number_says_what_a_loose_span_does(context, tmp_path):
    """Beside a fine mesh held nowhere between the supports beside it, where the screws are loose;
    no other span does as well."""
    times = 4
    free = range(times + times // 2, 3 * times - times // 2 + 1)  # of nodes 11 and 6, half way
    other, fine = (
        read(tmp_path, sheet(times * NX, times * NY, clamped(times * NX, times * NY, gone)))[1]
        for gone in (free, range(0))
    )
    true, whole = (model_modes(m, 7).frequencies for m in (other, fine))
    rigid = model_modes(context.model, 7).frequencies
    assert np.abs(true / whole - 1.0).max() > 0.008

    def left(effect) -> float:
        model, out = effect.change.model, []
        for size in np.geomspace(0.1, 1000.0, 9):
            p = model.zero()
            p[-1] = size
            own = model_modes(model, 7, p).frequencies
            out.append(np.sqrt(np.mean((own / rigid - true / whole) ** 2)))
        return min(out)

    found = {e.place.nodes: e for e in LooseSpan().candidates(context)}
    near = found[11,]
    at_rest = model_modes(near.change.model, 7).frequencies
    np.testing.assert_allclose(at_rest, rigid, rtol=1e-4)
    errors = {n: left(found[n]) for n in ((11,), (6, 11), (6,), (21, 26), (15,))}
    assert errors[11,] < 3e-3
    assert errors[15,] == pytest.approx(errors[11,], rel=1e-3), (
        "frequencies do not tell mirror images"
    )
    assert all(errors[n] > 2.0 * errors[11,] for n in ((6, 11), (6,), (21, 26)))
    says = found[6, 11].type.says(found[6, 11], {"k": 4e3, "kr": 12.0})
    assert "between nodes 1 and 16, 0.120 m of the edge" in says and "every direction" in says


def test_it_is_written_as_springs_in_every_direction(context, tmp_path):
    found = {e.place.nodes: e for e in LooseSpan().candidates(context)}
    effect = found[6, 11]
    model = effect.change.model
    p = model.zero()
    p[-1] = 3.0
    own = model.parameters[-1]
    k, kr = (q.value(model, own, 3.0, 0.1)[0] for q in effect.figures)
    spec = load_problem(tmp_path / "problem.toml")
    found = Updated(model, p, zeta=np.zeros(1), refine=8, solid=False)
    path = tmp_path / "again.toml"
    path.write_text(problem_file(spec, found).text, encoding="utf-8")
    assert check_problem(path) == ()
    springs = {
        (r.nodes[0], r.dof): r.k
        for b in load_problem(path).model.elements
        if b.type == "spring"
        for r in b.rows
    }
    wanted = {(n, d): k if d == "z" else kr for n in (6, 11) for d in ("z", "rx", "ry")}
    assert springs == pytest.approx(wanted, rel=1e-4)
